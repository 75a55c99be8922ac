"""The search for free paths: random polygons near the targets, improved side by side, the best of them to the end.

First with their joint travel rounded off generously, then the best of them with hardly any rounding. They are solved
with few integration steps; what those miss of the true net rotation is added to the target, and they are solved again,
until the true one is on it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from reojax._internal.progress import label
from reojax.optimisation.optimise import optimise
from reojax.planning import quaternions
from reojax.planning.clear_paths import Clear
from reojax.planning.free_polygons import ALONE, COARSE, Aim, Polygons
from reojax.planning.freedom import Freedom
from reojax.planning.polygon_table import PolygonTable

_ROWS, _LEAST_ROWS = 32, 4
"""Polygons solved side by side, at most and at least: few shapes, few programs."""
_ROUNDS = 6
"""How often starts are tried for targets that are not reached."""
_FIRST_STEPS = 40
"""Steps of those with a clearance before the best are chosen; contact bends the ways there, and they end late."""
_FINALISTS = 2
"""Polygons of each target that are improved to the end."""
_ROUND, _SHARP = 0.1, 0.01
"""Rounding of the joint travel on each edge [rad], at first and at the end, where joints may go a radian or more."""
_SLOPE = 3e-3
"""Slope, as in `optimise`, at which the search for less joint travel stops."""
_MISS = 1e-10
"""Miss [rad] that the solver goes for, in one run."""
_REACHED, _NEAR = 1e3, 1e7
"""How many times that much counts as on the target for the time being, and how many as near to it."""
_LAST = 4
"""How often, at most, the target is shifted to bring the true rotation onto it."""
_IDLE = 1e-3
"""Joints that move less than this anywhere on a path [rad], where they may go a radian or more, are held at the end."""
_OFF = 1e6
"""Joint travel [rad] that is worse than any."""
_SPARE = 0.06
"""Share of the clearance that is asked for on top of it at first, for what lies between samples."""
_EASED = 0.5
"""Share of that at each further shift of the target."""
_MOST_TURN = 3.0
"""Largest turn of one loop that is looked for [rad]; the logarithm has no derivative at a half turn."""

_FARTHER = 20.0
"""How many times the turn of the best random polygon is looked for at most; it is also the unit of that turn."""


class Search:
    """What all solutions of one call share."""

    def __init__(
        self,
        polygons: Polygons,
        table: PolygonTable,
        freedom: Freedom,
        starts: int,
        max_steps: int,
        tolerance: float,
        clear: Clear | None = None,
    ):
        self.polygons, self.table, self.freedom = polygons, table, freedom
        self.clear, self.spare = clear, 0.0 if clear is None else _SPARE * clear.margin
        self.starts, self.max_steps, self.tolerance = starts, max_steps, tolerance
        self.rounds = _ROUNDS
        corners = polygons.corners
        self._low = np.append(np.tile(freedom.low, corners), 0.0)
        self._high = np.append(np.tile(freedom.high, corners), 0.0)
        width = (freedom.high - freedom.low).mean() if len(freedom.low) else 1.0
        self._fine = min(1.0, width / 2)  # joints that go little have their travel rounded off less
        self._bar: Any = None

    @contextmanager
    def bar(self, show: bool | str) -> Iterator[None]:
        """Count polygons on stderr."""
        from tqdm import tqdm

        with tqdm(total=0, disable=not show, unit=" polygons", desc=label(show) or "free paths") as self._bar:
            yield

    def shortest(self, targets: np.ndarray, runs: np.ndarray, hints: np.ndarray | None = None) -> np.ndarray:
        """Polygons (m, n) of little travel on the targets (m, 3, 3) of one run, or as near as can be found.

        What one run misses counts `runs` (m,) times. `hints` (m, h, n) are tried first.
        """
        exact = np.maximum(np.minimum(_MISS, 0.05 * self.tolerance / runs), 1e-14)
        return self._improve(self._first(targets, exact, hints), targets, exact, self.tolerance / runs)

    def onto(self, x: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """Polygons (m, n) brought onto targets (m, 3, 3) from where they are, or as near as can be."""
        tolerance = np.full(len(x), self.tolerance)
        return self._improve(x[:, None], targets, np.clip(0.05 * tolerance, 1e-14, _MISS), tolerance)

    def farthest(self, axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Polygons (m, h, n) that turn the base about axes (m, 3) as far as can be found, and how far (m,)."""
        x = np.array([self.table.farthest(axis, self.starts) for axis in axes])
        x[:, :, -1] = np.minimum(x[:, :, -1], _MOST_TURN)
        owner, shape = np.repeat(np.arange(len(axes)), x.shape[1]), x.shape
        still = np.broadcast_to(np.eye(3), (len(owner), 3, 3))
        found, miss, _ = self._solve(x.reshape(len(owner), -1), still, _MISS, _ROUND, 1e-3, axes[owner])
        turn = np.where(miss < _REACHED * _MISS, found[:, -1], 0.0).reshape(shape[:2])
        found = found.reshape(shape)
        found[:, :, -1] = 0.0
        return np.take_along_axis(found, turn.argsort(1)[:, ::-1, None], 1), turn.max(1)

    def _solve(
        self,
        x: np.ndarray,
        targets: np.ndarray,
        exact: float,
        rounding: float | None,
        slope: float = _SLOPE,
        axes: np.ndarray | None = None,
        held: np.ndarray | None = None,
        most_steps: int | None = None,
        spare: float | None = None,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Improve polygons (m, n) for targets (m, 3, 3), or for turning far about `axes`: polygons, misses, travel.

        Without a `rounding` of the travel only the target counts; variables `held` (m, n) stay as they are.
        """
        spare = self.spare if spare is None else spare
        rows = 1 if len(self.freedom.start) > ALONE else min(_ROWS, max(_LEAST_ROWS, 1 << (len(x) - 1).bit_length()))
        ends = np.stack([self.freedom.start, self.freedom.end])
        turning = axes is not None
        upper = self._high.copy()
        upper[-1] = min(_MOST_TURN, _FARTHER * x[:, -1].max()) if turning else 0.0
        low, high = (np.repeat(box[None], len(x), 0) for box in (self._low, upper))
        if held is not None:
            low, high = np.where(held, x, low), np.where(held, x, high)
        parts = [(x[:0], np.zeros(0), np.zeros(0))]
        self._bar.total += len(x)
        for first in range(0, len(x), rows):
            size = min(rows, len(x) - first)
            take = np.minimum(np.arange(first, first + rows), len(x) - 1)
            wanted = targets[take].copy()
            wanted[size:] = np.nan  # what fills the program's shape ends at once
            found = optimise(
                self.polygons.travel,
                x[take],
                lower=low[take],
                upper=high[take],
                equality=self.polygons.miss,
                inequality=None if self.clear is None else self.polygons.too_near,
                data=Aim(
                    target=wanted,
                    axis=axes[take] if turning else np.zeros((rows, 3)),
                    ends=np.repeat(ends[None], rows, 0),
                    rounding=np.full(rows, (rounding or 1.0) * self._fine),
                    short=np.full(rows, float(rounding is not None and not turning)),
                    far=np.full(rows, float(turning)),
                    margin=np.tile(np.zeros(0) if self.clear is None else self.clear.with_spare(spare), (rows, 1)),
                ),
                tolerance=exact,
                slope_tolerance=slope,
                max_steps=min(most_steps or self.max_steps, self.max_steps),
            )
            parts.append((found.value[:size], found.residual[:size], found.cost[:size]))
            self._bar.update(size)
        value, miss, cost = map(np.concatenate, zip(*parts, strict=True))
        return value, miss, cost

    def _first(self, targets: np.ndarray, exact: np.ndarray, hints: np.ndarray | None) -> np.ndarray:
        """Polygons (m, f, n) for each target: of those from some starts the ones of least travel, or the closest."""
        tried = np.array([self.table.near(target, self.rounds * self.starts) for target in targets])
        if hints is not None:
            tried = np.concatenate([hints, tried], axis=1)[:, : tried.shape[1]]
        worth = np.full(tried.shape[:2], np.inf)
        steps, close = (None, _REACHED) if self.clear is None else (_FIRST_STEPS, _NEAR)
        for first in range(0, tried.shape[1], self.starts):
            waiting = np.flatnonzero(worth.min(1) >= _OFF)
            if not len(waiting):
                break
            x = tried[waiting, first : first + self.starts]
            owner, shape = np.repeat(waiting, x.shape[1]), x.shape
            x, aim = x.reshape(len(owner), -1), targets[owner]
            x, miss, travel = self._solve(x, aim, exact[waiting].min(), _ROUND, most_steps=steps)
            tried[waiting, first : first + self.starts] = x.reshape(shape)
            if self.clear is not None:  # what touches between the samples is no answer
                miss = np.where(self.clear.keeps(self.polygons.paths(x, self.freedom)), miss, 10.0 + miss)
            value = _worth(miss, travel, close * exact[owner])
            worth[waiting, first : first + self.starts] = value.reshape(shape[:2])
        return np.take_along_axis(tried, worth.argsort(1)[:, :_FINALISTS, None], 1)

    def _improve(self, found: np.ndarray, targets: np.ndarray, exact: np.ndarray, tolerance: np.ndarray) -> np.ndarray:
        """The best polygon (m, n) of some for each target, once they are improved to the end."""
        polygons, shape = self.polygons, found.shape[:2]
        wanted = np.repeat(targets, shape[1], axis=0)
        exact, tolerance = (np.repeat(array, shape[1]) for array in (exact, tolerance))
        x = found.reshape(len(wanted), -1)
        turned, coarse = self._rotations(x)
        error = apart(turned, wanted)
        for k in range(_LAST + 1):
            near = error < _NEAR * exact
            going = np.flatnonzero(near & (error > 0.5 * tolerance)) if k else np.arange(len(x))
            if not len(going):
                break
            # what the coarse steps have to show for the true rotation to be the one wanted
            shifted = wanted[going] @ turned[going].swapaxes(1, 2) @ coarse[going]
            aim = np.where(near[going, None, None], shifted, wanted[going])
            start = x[going]
            eased = self.spare * _EASED**k  # the last way is short: what is asked for in hand may be used up
            options = {"held": self._idle(start), "spare": eased}
            moved, _, _ = self._solve(start, aim, exact[going].min(), None if k else _SHARP, **options)
            true, few = self._rotations(moved)
            off = apart(true, wanted[going])
            better = off < (error[going] if k else np.maximum(error, _NEAR * exact)[going])
            for old, change in ((x, moved), (turned, true), (coarse, few), (error, off)):
                old[going[better]] = change[better]
        paths = polygons.paths(x, self.freedom)
        if self.clear is not None:
            error = np.where(self.clear.keeps(paths), error, 10.0 + error)  # worse than any miss
        worth = _worth(error, np.abs(np.diff(paths, axis=1)).sum((1, 2)), tolerance).reshape(shape)
        return np.take_along_axis(x.reshape(*shape, -1), worth.argmin(1)[:, None, None], 1)[:, 0]

    def _idle(self, x: np.ndarray) -> np.ndarray:
        """Which variables (m, n) belong to joints that hardly move; a polygon needs three joints that do."""
        count, place = len(self.freedom.low), list(self.freedom.joints)
        ends = np.stack([self.freedom.start[place], self.freedom.end[place]])
        corners = x[:, :-1].reshape(len(x), self.polygons.corners, count)
        farthest = np.maximum(np.abs(corners - ends[0]).max(1), np.abs(ends[1] - ends[0]))
        idle = farthest < np.minimum(_IDLE * self._fine, np.sort(farthest, axis=1)[:, -3:].min(1)[:, None])
        return np.pad(np.tile(idle, self.polygons.corners), ((0, 0), (0, 1)))

    def _rotations(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Net rotations (m, 3, 3) of polygons (m, n), true ones and those by the steps of the search."""
        paths = self.polygons.paths(x, self.freedom)
        return self.polygons.rotations(paths), self.polygons.rotations(paths, COARSE)


def _worth(miss: np.ndarray, travel: np.ndarray, tolerance: np.ndarray) -> np.ndarray:
    """What is made least: the travel of polygons that reach their targets, before the miss of those that do not."""
    return np.where(miss <= tolerance, travel, _OFF * (1 + miss))


def apart(turned: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Angles (m,) between rotations [rad]."""
    p, q = (quaternions.from_matrices(r) for r in (turned, wanted))
    return quaternions.angles(quaternions.product(quaternions.inverse(p), q))

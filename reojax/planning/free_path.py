"""Free closed paths: one closed polygon within the joint limits that ends on the target, with little joint travel.

For each target, random polygons which end near it are improved side by side by `design.optimise`: first with their
joint travel rounded off generously, then the best of them once more with hardly any rounding. They are solved with
few integration steps; what those miss of the true net rotation is added to the target, and they are solved again,
until the true one is on it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax.manoeuvres import Layout
from reojax.optimisation.optimise import optimise
from reojax.planning import quaternions
from reojax.planning.checks import robot_and_layout
from reojax.planning.free_polygons import Polygons, PolygonTable, family_of
from reojax.planning.words import box_of
from reojax.robot import Robot

_ROWS = 32
"""Polygons solved side by side: one shape, one program."""
_ROUNDS = 3
"""How often starts are tried for targets that are not reached."""
_FINALISTS = 2
"""Polygons of each target that are improved to the end."""
_ROUND, _SHARP = 0.1, 0.01
"""Rounding of the joint travel on each edge [rad], at first and at the end."""
_SLOPE = 3e-3
"""Slope, as in `design.Solution`, at which the search for less joint travel stops."""
_EXACT = {8: 1e-10, 4: 1e-5}
"""Miss [rad] that the solver goes for, by the bytes of a number."""
_REACHED, _NEAR = 1e3, 1e7
"""How many times that much counts as on the target for the time being, and how many as near to it."""
_LAST = 4
"""How often, at most, the target is shifted to bring the true rotation onto it."""
_ANY = 1e6
"""Slope that stops the solver as soon as the target is met."""
_OFF = 1e6
"""Joint travel [rad] that is worse than any."""


class FreePaths(NamedTuple):
    """Closed polygons, one for each target; of `free_path` one, without the leading axis."""

    waypoints: Float[np.ndarray, "*m v j"]
    """Corners of the joint paths [rad], both ends at zero, for `polygon`."""
    rotation: Float[np.ndarray, "*m 3 3"]
    """Net rotation of the base after each."""
    error: Float[np.ndarray, "*m"]
    """Angle left to the target [rad]."""
    travel: Float[np.ndarray, "*m"]
    """Sum over all joints of the angle each one moves through [rad]."""
    converged: Bool[np.ndarray, "*m"]
    """Whether `error` is within the tolerance; the travel is then the least found, not proven to be the least."""


def free_path(robot: Robot, target: ArrayLike, **options: Any) -> FreePaths:
    """Find a closed polygon of little joint travel after which the base has turned by `target` (3, 3).

    Options and errors as for `free_paths`.
    """
    many = free_paths(robot, checks.rotations("target", target, (3, 3))[None], **options)
    return FreePaths(*(field[0] for field in many))


def free_paths(
    robot: Robot,
    targets: Float[Array, "m 3 3"] | ArrayLike,
    *,
    twist_limit: float,
    bend_limit: float,
    corners: int = 8,
    starts: int = 8,
    layout: Layout | None = None,
    tolerance: float = 1e-9,
    max_steps: int = 100,
    seed: int = 0,
    progress: bool = False,
) -> FreePaths:
    """Find closed polygons of little joint travel after which the base has turned by the targets.

    Local: more `starts` find less travel. Runs on the host, many polygons side by side.

    Args:
        robot: the robot. Joints that neither twist, bend nor fold stay at zero.
        targets: (m, 3, 3) rotations of the base, final base components to initial ones.
        twist_limit: largest angle of the distal joints, either way [rad]. The robot's own joint limits hold too.
        bend_limit: largest angle of the centre joint, either way [rad].
        corners: number of free corners, at least 2; more find less travel and take longer.
        starts: polygons to start from for each target; up to three times as many if it is not reached.
        layout: which joints twist, bend and fold; default by the robot's number of joints.
        tolerance: angle to the target that counts as reached [rad].
        max_steps: most steps of the solver.
        seed: of the random polygons.
        progress: whether to show a bar on stderr.

    Returns:
        The paths. Where a target is not reached, the closest path found, with `converged` False. The identity gives
        the path that stays at zero.

    Raises:
        ValueError: naming the entry, if a target is no rotation or an option makes no sense.
    """
    layout = robot_and_layout(robot, layout)
    given = checks.rotations("targets", targets, (-1, 3, 3))
    twist_limit, bend_limit = checks.positive("twist_limit", twist_limit), checks.positive("bend_limit", bend_limit)
    corners, starts = checks.whole("corners", corners, 2), checks.whole("starts", starts)
    tolerance, max_steps = checks.positive("tolerance", tolerance), checks.whole("max_steps", max_steps)
    box = box_of(robot, layout, "R", twist_limit, bend_limit)
    polygons, pool = family_of(robot, layout, box, corners, checks.whole("seed", seed, 0))
    wanted = quaternions.to_matrices(quaternions.from_matrices(given))
    exact = _EXACT[jax.dtypes.canonicalize_dtype(float).itemsize]
    with _bar(progress) as bar:
        solver = _Solver(polygons, pool, min(_ROWS, len(wanted) * starts), exact, bar)
        x = _shortest(solver, _first(solver, wanted, starts, max_steps), wanted, max_steps, tolerance)
    paths, rotation = polygons.paths(x), polygons.rotations(x)
    still = _apart(np.eye(3), wanted) <= tolerance
    paths[still], rotation[still] = 0.0, np.eye(3)
    error = _apart(rotation, wanted)
    return FreePaths(paths, rotation, error, np.abs(np.diff(paths, axis=1)).sum((1, 2)), error <= tolerance)


class _Solver(NamedTuple):
    """What all solutions of one call share."""

    polygons: Polygons
    pool: PolygonTable
    rows: int
    exact: float
    bar: Any

    def __call__(
        self, x: np.ndarray, targets: np.ndarray, rounding: float, steps: int, slope: float = _SLOPE
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Improve polygons (m, n) for targets (m, 3, 3): the polygons, their misses and their travel (m,)."""
        parts = [(x[:0], np.zeros(0), np.zeros(0))]
        self.bar.total += len(x)
        for first in range(0, len(x), self.rows):
            take = np.minimum(np.arange(first, first + self.rows), len(x) - 1)
            found = optimise(
                self.polygons.travel,
                x[take],
                lower=self.pool.low,
                upper=self.pool.high,
                equality=self.polygons.miss,
                data=(targets[take], np.full(self.rows, rounding)),
                tolerance=self.exact,
                slope_tolerance=slope,
                max_steps=steps,
            )
            size = min(self.rows, len(x) - first)
            parts.append((found.value[:size], found.residual[:size], found.cost[:size]))
            self.bar.update(size)
        value, miss, cost = map(np.concatenate, zip(*parts, strict=True))
        return value, miss, cost


def _first(solver: _Solver, targets: np.ndarray, starts: int, max_steps: int) -> np.ndarray:
    """Polygons (m, f, n) for each target: of those from so many starts the ones of least travel, or the closest."""
    tried = np.array([solver.pool.near(target, _ROUNDS * starts) for target in targets])
    worth = np.full(tried.shape[:2], np.inf)
    for first in range(0, tried.shape[1], starts):
        waiting = np.flatnonzero(worth.min(1) >= _OFF)
        if not len(waiting):
            break
        x = tried[waiting, first : first + starts]
        owner, shape = np.repeat(waiting, x.shape[1]), x.shape
        x, miss, travel = solver(x.reshape(len(owner), -1), targets[owner], _ROUND, max_steps)
        tried[waiting, first : first + starts] = x.reshape(shape)
        worth[waiting, first : first + starts] = _worth(miss, travel, _REACHED * solver.exact).reshape(shape[:2])
    return np.take_along_axis(tried, worth.argsort(1)[:, :_FINALISTS, None], 1)


def _shortest(solver: _Solver, found: np.ndarray, targets: np.ndarray, max_steps: int, tolerance: float) -> np.ndarray:
    """The best polygon (m, n) of some for each target, once they are improved to the end."""
    polygons, shape = solver.polygons, found.shape[:2]
    wanted = np.repeat(targets, shape[1], axis=0)
    x, aim = found.reshape(len(wanted), -1), wanted.copy()
    turned = polygons.rotations(x)
    error = _apart(turned, wanted)
    for k in range(_LAST + 1):
        near = error < _NEAR * solver.exact
        going = np.flatnonzero(near & (error > 0.5 * tolerance)) if k else np.arange(len(x))
        shift = wanted[going] @ turned[going].swapaxes(1, 2)
        new = np.where(near[going, None, None], shift @ aim[going], wanted[going])
        moved, _, _ = solver(x[going], new, _SHARP, max_steps, _ANY if k else _SLOPE)
        now = polygons.rotations(moved)
        off = _apart(now, wanted[going])
        better = off < np.maximum(error[going], 0.0 if k else _REACHED * solver.exact)
        for old, change in ((x, moved), (aim, new), (turned, now), (error, off)):
            old[going[better]] = change[better]
    paths = polygons.paths(x)
    worth = _worth(error, np.abs(np.diff(paths, axis=1)).sum((1, 2)), tolerance).reshape(shape)
    return np.take_along_axis(x.reshape(*shape, -1), worth.argmin(1)[:, None, None], 1)[:, 0]


def _worth(miss: np.ndarray, travel: np.ndarray, tolerance: float) -> np.ndarray:
    """What is made least: the travel of polygons that reach their targets, before the miss of those that do not."""
    return np.where(miss <= tolerance, travel, _OFF * (1 + miss))


def _apart(turned: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Angles (m,) between rotations [rad]."""
    p, q = (quaternions.from_matrices(np.broadcast_to(r, wanted.shape)) for r in (turned, wanted))
    return quaternions.angles(quaternions.product(quaternions.inverse(p), q))


def _bar(show: bool) -> Any:
    from tqdm import tqdm

    return tqdm(total=0, disable=not show, unit=" polygons", desc="free paths")

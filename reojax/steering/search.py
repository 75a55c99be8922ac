"""The search for motions: from ever further starts until each release has its own, and for the least durations.

Motors make a step of the search several times as dear. So it goes without them first, and again with them from what
that finds, where they are not strong enough for it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax.mechanics.momentum import momentum_matrices
from reojax.optimisation.status import Status
from reojax.steering.clear_motion import proven_clearance
from reojax.steering.end import basis
from reojax.steering.limits import FEASIBLE, RightingTask
from reojax.steering.newton import EXACT_STEPS, Judged, judge, solve
from reojax.steering.result import Righting, trajectory_through
from reojax.steering.starts import CHUNK, RobotKey, Starts, ends_of, starts_of

LANES = 32
"""Motions that are searched for side by side, at most."""
_LONGER, _TRIES, _HALVINGS = 1.6, 4, 5
"""How a duration that is too short grows, how often, and how often the gap to one that does is halved."""


class Search(NamedTuple):
    """What all searches of one call share."""

    task: RightingTask
    pieces: int
    starts: int
    tolerance: float
    max_steps: int
    seed: int
    lanes: int
    """Motions side by side: one size, one program."""

    def __call__(self, goals, momenta, durations, guesses: Float[np.ndarray, "m p+1 j"] | None = None) -> Righting:
        """The motions of m releases, from `guesses` first where there are any."""
        return _answer(self, goals, momenta, durations, _best(self, goals, momenta, durations, guesses))


class _Rows(NamedTuple):
    """Releases that are searched for side by side."""

    goals: np.ndarray
    momenta: np.ndarray
    durations: np.ndarray

    def of(self, i: Any) -> _Rows:
        return _Rows(*(field[i] for field in self))


def _best(look: Search, goals, momenta, durations, guesses) -> Judged:
    """The best motion of each release: the least effort of those that converged first, else the nearest."""
    table = starts_of(
        RobotKey(look.task.robot), look.pieces, look.seed, look.task.start.tobytes(), look.task.end.tobytes()
    )
    inertia = np.asarray(momentum_matrices(look.task.robot, look.task.start).A)
    rows, m = _Rows(np.asarray(goals), np.asarray(momenta), np.asarray(durations)), len(goals)
    order: list[np.ndarray | None] = [None] * m
    best: dict[int, tuple] = {}
    tried = np.zeros(m, int)
    per_round = 2 if look.lanes == 2 else 1
    if guesses is not None:
        _take(look, best, rows, np.arange(m), guesses)
    while waiting := [i for i in range(m) if tried[i] < look.starts and not (i in best and best[i][0])]:
        picked, points = [], []
        for i in waiting:
            if order[i] is None or tried[i] == per_round:
                order[i] = _order(look, table, inertia, rows.of(i), order[i], tried[i])
            own = order[i][tried[i] : tried[i] + per_round]  # pyright: ignore[reportOptionalSubscript]
            picked += [i] * len(own)
            points.append(table.points[own])
            tried[i] += per_round
        _take(look, best, rows, np.array(picked), np.concatenate(points))
    return Judged(*(np.stack(leaf) for leaf in zip(*(best[i][2] for i in range(m)), strict=True)))


def _order(
    look: Search, table: Starts, inertia: np.ndarray, row: _Rows, before: np.ndarray | None, tried: int
) -> np.ndarray:
    """Starts, the nearest to the target first: by their ends after a drift, and if these failed by their true ends."""
    if before is None:
        drift = np.asarray(so3.exp(jnp.asarray(np.linalg.solve(inertia, row.momenta) * row.durations)))
        return np.argsort(-_cosine(look, drift @ table.ends, row.goals))[: max(look.starts, CHUNK)]
    rest = before[tried:]
    ends = ends_of(look.task.robot, table.points[rest], row.momenta, float(row.durations))
    return np.concatenate([before[:tried], rest[np.argsort(-_cosine(look, ends, row.goals))]])


def _cosine(look: Search, ends: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """The larger, the nearer are ends to the nearest that will do (`limits.nearest`): 1 + 2 cos of the angle."""
    about = np.asarray(look.task.about)
    between = np.asarray(ends) @ goal.T
    trace = np.trace(between, axis1=1, axis2=2)
    if not about.any():
        return trace
    n = goal @ about
    along = np.einsum("a,kab,b->k", n, between, n)
    across = np.einsum("ab,kba->k", np.asarray(so3.hat(jnp.asarray(n))), between)
    return along + np.hypot(trace - along, across)


def _take(look: Search, best: dict[int, tuple], rows: _Rows, picked: np.ndarray, points: np.ndarray) -> None:
    """Search from `points` for the releases `picked`, and keep what is better than what there was."""
    out = _found(look, points, rows.of(picked))
    for lane, i in enumerate(picked):
        one = Judged(*(leaf[lane] for leaf in out))
        good = bool(one.reached(look.tolerance))
        rank = (not good, float(one.effort) if good else float(one.error + one.beyond))
        if i not in best or rank < best[i][1]:
            best[i] = (good, rank, one)


def _found(look: Search, points: np.ndarray, rows: _Rows) -> Judged:
    """What the search comes to from each start: without motors, then with them where they matter."""
    free = look.task._replace(motors=None)

    def by(task: RightingTask, points: np.ndarray, rows: _Rows) -> Judged:
        return in_lanes(
            look.lanes,
            lambda p, g, h, t: solve(task, look.pieces, look.max_steps, p, g, h, t, look.tolerance),
            (points, *rows),
        )

    out = by(free, points, rows)
    if look.task.motors is None:
        return out
    driven = in_lanes(
        look.lanes, lambda p, g, h, t, n: judge(look.task, look.pieces, p, g, h, t, n), (out.points, *rows, out.steps)
    )
    over = np.flatnonzero(np.asarray(out.reached(look.tolerance) & (driven.beyond > FEASIBLE)))
    if len(over):
        again = by(look.task, np.asarray(out.points)[over], rows.of(over))
        for mine, theirs in zip(driven, again, strict=True):
            mine[over] = theirs
    return driven


def in_lanes(lanes: int, function: Any, arguments: tuple[Any, ...]) -> Judged:
    """A function of arrays with one leading axis, so many rows at a time; the last ones are filled up."""
    size, parts = len(arguments[0]), []
    for first in range(0, size, lanes):
        take = np.minimum(np.arange(first, first + lanes), size - 1)
        parts.append(jax.tree.map(np.asarray, function(*(jnp.asarray(x[take]) for x in arguments))))
    return Judged(*(np.concatenate(leaf)[:size] for leaf in zip(*parts, strict=True)))


def _answer(look: Search, goals, momenta, durations, best: Judged) -> Righting:
    """What is told of the motions that were found."""
    task, m = look.task, len(goals)
    points, error, beyond, effort, rotation, omega, margin, steps = (np.asarray(leaf) for leaf in best)
    good = np.asarray(best.reached(look.tolerance))
    nothing = np.full(m, np.nan)
    clear = nothing.copy()
    if task.clearance is not None:
        for i in range(m):
            clear[i] = proven_clearance(task.robot, trajectory_through(points[i], float(durations[i])))
        beyond = np.maximum(beyond, float(task.clearance) - clear)
        good &= beyond <= FEASIBLE
    status = np.where(good, Status.CONVERGED, np.where(error > look.tolerance, Status.NOT_FOUND, Status.INFEASIBLE))
    fine = basis(look.pieces, EXACT_STEPS).nodes[:, 0] @ points
    travel = np.abs(np.diff(fine, axis=1)).sum((1, 2))
    margin = nothing if task.motors is None else margin
    return Righting(points, np.asarray(durations), momenta, rotation, omega, error, beyond, margin, effort, travel,
                    good, status, steps, nothing, clear)  # fmt: skip


def least_durations(look: Callable[..., Righting], found: Righting, goals, momenta, *, keep: bool) -> Righting:
    """Lengthen the durations that are too short, then halve the gaps, of all releases side by side.

    `keep` the answers for the durations that were asked for; a duration is tried from the motion of the next longer.
    """
    m = len(goals)
    fields = [np.array(field) for field in found]
    best = Righting(*(np.array(field) for field in found))
    asked = np.flatnonzero(~found.converged) if keep else np.arange(m)
    low, high = np.zeros(m), np.array(found.duration, float)
    able = np.array(found.converged)

    def shorter(rows: np.ndarray, durations: np.ndarray) -> np.ndarray:
        """Try durations; which of the rows can do with them."""
        trial = look(goals[rows], momenta[rows], durations, best.points[rows])
        well = np.asarray(trial.converged)
        for field, value in zip(best, trial, strict=True):
            field[rows[well]] = value[well]
        able[rows[well]] = True
        return well

    for _ in range(_TRIES):
        rows = asked[~able[asked]]
        if not len(rows):
            break
        low[rows], high[rows] = high[rows], _LONGER * high[rows]
        shorter(rows, high[rows])
    rows = asked[able[asked]]
    for _ in range(_HALVINGS if len(rows) else 0):
        middle = np.where(low[rows] > 0, 0.5 * (low[rows] + high[rows]), 0.7 * high[rows])
        well = shorter(rows, middle)
        high[rows] = np.where(well, middle, high[rows])
        low[rows] = np.where(well, low[rows], middle)
    answer = Righting(*fields) if keep else best
    least = np.array(found.least_duration)
    least[rows] = high[rows]
    return answer._replace(least_duration=least)

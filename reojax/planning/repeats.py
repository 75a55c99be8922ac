"""One loop run many times: a loop whose N-th power is the target, and the least N for which one is found."""

from __future__ import annotations

import numpy as np

from reojax.planning import quaternions
from reojax.planning.free_search import Search, apart

MOST_REPEATS = 1_000_000
"""Most runs of one loop: the error of one run, 1e-15 rad at best, counts as often."""
_ROOTS = (0, -1, 1)
"""Whole turns added to the target's angle before it is divided by the number of runs; after the first, where that
one's loop is not found."""
_TRIES = 12
"""Numbers of runs tried, each a twentieth more than the one before, or one."""


def polygons_by_runs(
    search: Search, targets: np.ndarray, runs: np.ndarray, hints: np.ndarray | None = None
) -> np.ndarray:
    """Polygons (m, n) whose `runs`-th powers are the targets (m, 3, 3), or as near as can be found."""
    x, error = search.table.x[:1].repeat(len(targets), 0), np.full(len(targets), np.inf)
    # of each root in turn, for what the ones before have not reached
    for turns in _ROOTS:
        root = roots(targets, runs, turns)
        able = (runs > 1) & (np.abs(_angle(targets) + 2 * np.pi * turns) < np.pi * runs) if turns else runs > 0
        waiting = np.flatnonzero((error > search.tolerance) & able)
        if not len(waiting):
            break
        found = search.shortest(root[waiting], runs[waiting], None if hints is None else hints[waiting])
        off = _error(search, found, targets[waiting], runs[waiting])
        better = off < error[waiting]
        x[waiting[better]], error[waiting[better]] = found[better], off[better]
        hints = None
    return x


def least_repeats(search: Search, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Polygons (m, n) and the least numbers of runs (m,) with which they are found to reach the targets (m, 3, 3).

    How far one loop within the limits can turn the base about the target's axis is found first; it says how many
    runs are needed at the least. Powers of a loop keep its axis, so no other loop will do (a half turn apart).
    """
    # as many runs as the farthest turn about the axis takes, then more
    angle = _angle(targets)
    axis = quaternions.from_matrices(targets)[1:].T
    axis = axis / np.maximum(np.sqrt((axis**2).sum(1, keepdims=True)), np.finfo(float).tiny)
    hints, most = search.farthest(axis)
    ratio = np.where(most > 0, angle / np.where(most > 0, most, 1.0), 1.0)
    runs = np.clip(np.ceil(ratio - 1e-9), 1, MOST_REPEATS).astype(int)
    x, best, error = hints[:, 0].copy(), runs.copy(), np.full(len(targets), np.inf)
    for _ in range(_TRIES):
        waiting = np.flatnonzero(error > search.tolerance)
        if not len(waiting):
            break
        found = polygons_by_runs(search, targets[waiting], runs[waiting], hints[waiting])
        off = _error(search, found, targets[waiting], runs[waiting])
        better = waiting[off < error[waiting]]
        x[better], best[better], error[better] = (part[off < error[waiting]] for part in (found, runs[waiting], off))
        runs[waiting] = np.minimum(np.maximum(runs[waiting] + 1, 21 * runs[waiting] // 20), MOST_REPEATS)
    return x, best


def roots(targets: np.ndarray, runs: np.ndarray, turns: int = 0) -> np.ndarray:
    """Rotations (m, 3, 3) about the targets' axes whose `runs`-th powers they are: `(angle + 2 pi turns) / runs`."""
    # (cos f, sin f e) to (cos f', sin f' e), f' = (f + pi turns) / runs
    q = quaternions.from_matrices(targets)
    sine = np.sqrt((q[1:] ** 2).sum(0))
    half = (np.arctan2(sine, q[0]) + np.pi * turns) / runs
    axis = q[1:] / np.maximum(sine, np.finfo(float).tiny)
    return quaternions.to_matrices(np.concatenate([np.cos(half)[None], np.sin(half) * axis]))


def _angle(targets: np.ndarray) -> np.ndarray:
    return quaternions.angles(quaternions.from_matrices(targets))


def _error(search: Search, x: np.ndarray, targets: np.ndarray, runs: np.ndarray) -> np.ndarray:
    """Angles (m,) that all runs leave to the targets [rad]."""
    one = quaternions.from_matrices(search.polygons.rotations(search.polygons.paths(x, search.freedom)))
    return apart(quaternions.to_matrices(quaternions.power(one, runs)), targets)

"""The search for motions: from ever further starts until each release has its own, and for the least durations."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from reojax import so3
from reojax.mechanics.momentum import momentum_matrices
from reojax.optimisation.status import Status
from reojax.steering.clear_motion import proven_clearance
from reojax.steering.end import basis
from reojax.steering.limits import FEASIBLE, RightingTask
from reojax.steering.newton import EXACT_STEPS, solve
from reojax.steering.result import Righting, trajectory_through
from reojax.steering.starts import RobotKey, random_motions

LANES = 32
"""Motions that are searched for side by side, at most."""


_LEAST = Righting._fields.index("least_duration")


def search(task: RightingTask, goals, momenta, durations, *, pieces, starts, tolerance, max_steps, seed) -> Righting:
    """From ever further starts, until each release has its motion; lanes of one size, one program."""
    table, ends = random_motions(RobotKey(task.robot), pieces, seed, task.start.tobytes(), task.end.tobytes())
    m = len(goals)
    lanes = 2 if m == 1 else min(LANES, m)
    inertia = np.asarray(momentum_matrices(task.robot, task.start).A)
    best: dict[int, tuple] = {}
    order = []
    for goal, h, seconds in zip(goals, momenta, durations, strict=True):
        drift = np.asarray(so3.exp(jnp.asarray(np.linalg.solve(inertia, h) * seconds)))
        cosine = np.einsum("ab,kbc,ac->k", drift, ends, goal)
        order.append(np.argsort(-cosine)[:starts])
    tried = np.zeros(m, int)
    per_round = 2 if m == 1 else 1
    while True:
        waiting = [i for i in range(m) if tried[i] < len(order[i]) and not (i in best and best[i][0])]
        if not waiting:
            break
        queue = [(i, order[i][tried[i] + r]) for i in waiting for r in range(per_round) if tried[i] + r < len(order[i])]
        tried[waiting] += per_round
        for first in range(0, len(queue), lanes):
            part = queue[first : first + lanes]
            rows = np.array([part[min(k, len(part) - 1)] for k in range(lanes)])
            i, k = rows.T
            out = solve(task, pieces, max_steps, table[k], goals[i], momenta[i], durations[i], tolerance)
            out = jax.tree.map(np.asarray, out)
            for lane, (i, _) in enumerate(part):
                one = tuple(leaf[lane] for leaf in out)
                good = one[1] <= tolerance and one[2] <= FEASIBLE
                rank = (not good, float(one[3]) if good else float(one[1] + one[2]))
                if i not in best or rank < best[i][1]:
                    best[i] = (good, rank, one)
    rows = [best[i][2] for i in range(m)]
    points, error, beyond, effort, rotation, omega, margin, steps = (np.stack(x) for x in zip(*rows, strict=True))
    good = np.array([best[i][0] for i in range(m)])
    nothing = np.full(m, np.nan)
    clear = nothing.copy()
    if task.clearance is not None:
        for i in range(m):
            clear[i] = proven_clearance(task.robot, trajectory_through(points[i], float(durations[i])))
        beyond = np.maximum(beyond, float(task.clearance) - clear)
        good &= beyond <= FEASIBLE
    status = np.where(good, Status.CONVERGED, np.where(error > tolerance, Status.NOT_FOUND, Status.INFEASIBLE))
    fine = basis(pieces, EXACT_STEPS).nodes[:, 0] @ points
    travel = np.abs(np.diff(fine, axis=1)).sum((1, 2))
    margin = nothing if task.motors is None else margin
    return Righting(points, durations, momenta, rotation, omega, error, beyond, margin, effort, travel, good, status,
                    steps, nothing, clear)  # fmt: skip


def least_durations(search, found: Righting, goals, momenta, *, keep: bool) -> Righting:
    """Double the durations that are too short, then halve the gap; `keep` the answers for the durations asked for."""
    fields = [np.array(field) for field in found]
    for i in range(len(goals)):
        if keep and found.converged[i]:
            continue
        one = partial(search, goals[i : i + 1], momenta[i : i + 1])
        low, high, best = 0.0, float(found.duration[i]), None
        if found.converged[i]:
            best = Righting(*(field[i : i + 1] for field in found))
        for _ in range(4):
            if best is not None:
                break
            low, high = high, 1.6 * high
            trial = one(np.array([high]))
            best = trial if trial.converged[0] else None
        if best is None:
            continue
        for _ in range(5):
            middle = 0.5 * (low + high) if low else 0.7 * high
            trial = one(np.array([middle]))
            if trial.converged[0]:
                high, best = middle, trial
            else:
                low = middle
        if keep:
            fields[_LEAST][i] = high
        else:
            for field, value in zip(fields, best, strict=True):
                field[i] = value[0]
            fields[_LEAST][i] = high
    return Righting(*fields)

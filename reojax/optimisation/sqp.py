"""Sequential quadratic programming from many starts, on the host, in double precision.

Scaled so that variables range over about 1 and gradients are about 1 at the start. At a point x a step d solves

    minimise  g.d + d.B d / 2   with  c + J d = 0 (equalities),  c + J d <= 0 (inequalities),  within bounds

(`quadratic`), with exact first derivatives and B a damped BFGS estimate of the Lagrangian's Hessian (`bfgs`). The full
step is taken if it lowers the merit `cost + sum of penalty_i * violation_i` enough (S. P. Han, J. Optim. Theory Appl.
22, 297-309, 1977; penalties follow the multipliers as in M. J. D. Powell, Numerical Analysis, Dundee 1977, 144-157),
else a point of the line or of the second-order correction's arc (`line_search`). Where the linearised constraints have
no common point, steps restore feasibility instead: the merit is half the sum of squared violations until they do. A
start that ends where violations have a local least is moved aside and goes on, `RESTARTS` times at most; the moves are
the same for every start.

Each round differentiates the trial points of all running starts in one go; starts that have ended are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from reojax.optimisation.bfgs import update
from reojax.optimisation.functions import Derivatives, Values
from reojax.optimisation.iterates import (
    RUNNING,
    Iterates,
    ScaledProblem,
    all_finite,
    begin,
    lagrangian_gradient,
    stationarity_of,
    within_tolerances,
)
from reojax.optimisation.line_search import SUFFICIENT, search
from reojax.optimisation.merit import largest_violation, merit, predict
from reojax.optimisation.quadratic import QuadraticStep, solve_quadratic
from reojax.optimisation.status import Status

RESTARTS, ASIDE = 3, 0.3
"""How often a start may leave a local least of the violations, and by how much of the variables' ranges."""
_STILL, _PATIENCE = 1e-9, 12
"""Steps shorter than this, so many in a row, end a start."""
_MOST_DAMPING = 1e9
"""Curvature in all directions, after steps have failed so often, that ends a start."""
_ARRIVED = 1e-6
"""A start ends at a stationary point when its next step is shorter than this, fails, or ends at another one."""
_FLAT = 1e-9
"""Predicted reduction of half the squared violations, relative to them, that counts as none."""


def minimise(problem: ScaledProblem, x: Float[np.ndarray, "m n"], report: Callable[[int], Any]) -> Iterates:
    """Run all starts to their ends; `report` is told how many have got there."""
    ahead = problem.derivatives(x, np.arange(len(x)))
    run = begin(problem, x, *ahead)
    while (going := np.flatnonzero(run.status == RUNNING)).size:
        # values and derivatives at the trial points, scaled
        values, slopes = problem.derivatives(run.trial[going], going) if run.steps.any() else _rows_of(ahead, going)
        values = Values(values.cost / run.cost_scale[going], values.rows / run.row_scale[going])
        gradient = slopes.gradient / run.cost_scale[going, None]
        jacobian = slopes.jacobian / run.row_scale[going, :, None]
        # good enough: Armijo's condition for the merit
        finite = all_finite(values, gradient, jacobian)
        reached = merit(values.cost, values.rows, run.penalty[going], run.restoring[going], run.equalities)
        enough = run.here[going] + SUFFICIENT * run.reduction[going] + run.rounding[going]
        taken = finite & (run.chosen[going] | (reached <= enough))
        # go there, or look for a better point on the way
        _move(problem, run, going[taken], values, gradient, jacobian, taken)
        failed = _search(problem, run, going[~taken], values.rows[~taken])
        # new quadratic programs where something has changed
        ready = np.concatenate([going[taken], failed])
        ready = ready[run.status[ready] == RUNNING]
        out = run.steps[ready] >= problem.max_steps
        run.status[ready[out]] = Status.OUT_OF_STEPS
        _solve(problem, run, ready[~out])
        report(int((run.status != RUNNING).sum()))
    _return_to_nearest(run)
    return run


def _rows_of(ahead: tuple[Values, Derivatives], who: np.ndarray) -> tuple[Values, Derivatives]:
    values, slopes = ahead
    return Values(*(a[who] for a in values)), Derivatives(*(a[who] for a in slopes))


def _move(
    problem: ScaledProblem,
    run: Iterates,
    to: np.ndarray,
    values: Values,
    gradient: np.ndarray,
    jacobian: np.ndarray,
    taken: np.ndarray,
) -> None:
    """Go to the trial points, measure the curvature on the way, and see who has arrived."""
    before = lagrangian_gradient(run, to)
    change = run.trial[to] - run.x[to]
    run.x[to], run.f[to], run.c[to] = run.trial[to], values.cost[taken], values.rows[taken]
    run.gradient[to], run.jacobian[to] = gradient[taken], jacobian[taken]
    # curvature of the Lagrangian, with the multipliers of the program that led here
    begun = run.steps[to] > 0
    measured = begun & ~run.restoring[to]
    turn = lagrangian_gradient(run, to) - before
    who = to[measured]
    run.hessian[who], run.fresh[who] = update(run.hessian[who], run.fresh[who], change[measured], turn[measured])
    run.damping[to], run.chosen[to] = 1.0, False
    # steps that lead nowhere
    short = begun & (np.abs(change).max(1, initial=0.0) < _STILL)
    run.stalled_steps[to] = np.where(short, run.stalled_steps[to] + 1, 0)
    run.status[to[run.stalled_steps[to] >= _PATIENCE]] = Status.STALLED
    # both tolerances met, twice
    run.slope[to] = stationarity_of(problem, run, to)
    met = within_tolerances(problem, run, to)
    run.status[to[met & run.arrived[to]]] = Status.CONVERGED
    run.arrived[to] = met


def _search(problem: ScaledProblem, run: Iterates, who: np.ndarray, ahead: np.ndarray) -> Int[np.ndarray, " f"]:
    """Look for a better point between x and trial points that were not good enough; return those without one.

    These begin again with a multiple of the identity as B, ten times larger at every failure in a row.
    """
    lost = run.chosen[who]  # a chosen point where the derivatives are not finite
    look = who[~lost]
    trial, found = search(problem, run, look, ahead[~lost])
    run.trial[look[found]] = trial[found]
    run.chosen[look[found]] = True
    failed = np.concatenate([who[lost], look[~found]])
    run.status[failed[within_tolerances(problem, run, failed)]] = Status.CONVERGED
    failed = failed[run.status[failed] == RUNNING]
    # B anew
    run.damping[failed] = np.where(run.fresh[failed], 10 * run.damping[failed], 1.0)
    run.hessian[failed] = run.damping[failed, None, None] * np.eye(run.x.shape[1])
    run.fresh[failed], run.chosen[failed] = True, False
    run.status[failed[run.damping[failed] > _MOST_DAMPING]] = Status.STALLED
    return failed


def _solve(problem: ScaledProblem, run: Iterates, who: np.ndarray) -> None:
    """Solve the quadratic programs at x, see who has arrived, and propose the full steps."""
    low, high = problem.lower[who] - run.x[who], problem.upper[who] - run.x[who]
    for i, below, above in zip(who, low, high, strict=True):
        answer = _program(run, i, below, above)
        if not answer.solved:  # B is of no use
            run.hessian[i], run.fresh[i] = np.eye(len(below)), True
            answer = _program(run, i, below, above)
        if not answer.solved:
            run.status[i] = Status.STALLED
            continue
        run.step[i], run.restoring[i] = np.clip(answer.d, below, above), not answer.feasible
        if answer.feasible:
            run.multipliers[i] = answer.multipliers
            run.multipliers[i, run.equalities :] = np.maximum(answer.multipliers[run.equalities :], 0.0)
    run.steps[who] += 1
    # penalties no less than the multipliers, and slow to fall (Powell)
    size = np.abs(run.multipliers[who])
    run.penalty[who] = np.maximum(size, 0.5 * (run.penalty[who] + size))
    run.slope[who] = np.minimum(run.slope[who], stationarity_of(problem, run, who))
    # a step that short, at a point that meets the tolerances, is the end
    near = np.abs(run.step[who]).max(1, initial=0.0) <= _ARRIVED
    run.status[who[near & ~run.restoring[who] & within_tolerances(problem, run, who)]] = Status.CONVERGED
    # what the merit is, what is promised of it, and what of it is rounding
    run.reduction[who] = predict(run, who)
    run.here[who] = merit(run.f[who], run.c[who], run.penalty[who], run.restoring[who], run.equalities)
    size = np.where(run.restoring[who], 0.0, np.abs(run.f[who]) + run.penalty[who].sum(1) + 1)
    run.rounding[who] = 50 * problem.precision * size
    run.trial[who] = np.clip(run.x[who] + run.step[who], problem.lower[who], problem.upper[who])
    # a least of the violations that is none of the problem
    flat = run.restoring[who] & (-run.reduction[who] <= _FLAT * run.here[who]) & (run.status[who] == RUNNING)
    for i in who[flat]:
        _move_aside(problem, run, i)


def _program(run: Iterates, i: int, below: np.ndarray, above: np.ndarray) -> QuadraticStep:
    return solve_quadratic(run.hessian[i], run.gradient[i], run.jacobian[i], run.c[i], run.equalities, below, above)


def _move_aside(problem: ScaledProblem, run: Iterates, i: int) -> None:
    """Leave a local least of the violations, unless that has been done too often."""
    found = float(largest_violation(run.c[i] * run.row_scale[i], run.equalities))
    nearest = run.nearest[i]
    if nearest is None or found < nearest[0]:
        run.nearest[i] = found, run.x[i].copy(), float(run.f[i]), run.c[i].copy()
    # the nearest so far is kept; too often is the end
    if run.restarts[i] >= RESTARTS:
        run.status[i] = Status.INFEASIBLE
        return
    # a random point around, and all that was learnt forgotten
    free = problem.upper[i] > problem.lower[i]
    reach = np.where(free, np.minimum(problem.upper[i] - problem.lower[i], 1.0), 0.0)
    aside = np.random.default_rng(run.restarts[i]).uniform(-1, 1, reach.shape)
    run.trial[i] = np.clip(run.x[i] + ASIDE * reach * aside, problem.lower[i], problem.upper[i])
    run.hessian[i], run.fresh[i] = np.eye(len(reach)), True
    run.multipliers[i] = run.penalty[i] = 0.0
    run.chosen[i] = True
    run.restarts[i] += 1


def _return_to_nearest(run: Iterates) -> None:
    """Starts that were moved aside and found nothing better end where violations were least."""
    for i, nearest in enumerate(run.nearest):
        if nearest is not None and run.status[i] != Status.CONVERGED and nearest[0] < run.violation[i]:
            _, run.x[i], run.f[i], run.c[i] = nearest

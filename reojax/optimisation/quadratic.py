"""The quadratic programs of a sequential method, by DAQP.

    minimise  g.d + d.B d / 2   within  A_e d + b_e = 0,  A_i d + b_i <= 0,  low <= d <= high

DAQP is a dual active-set method in C (D. Arnström, A. Bemporad, D. Axehill, IEEE Trans. Autom. Control 67, 4362-4369,
2022): exact to rounding, certain about infeasibility, and some 70 us for 40 variables and 40 rows. Where the rows
cannot all hold within the box, their violations are made small instead: each costs its square over twice `SOFTNESS`.
That is a Gauss-Newton step of feasibility restoration, with B as its damping.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

SOFTNESS = 1e-6
"""Small against the curvatures, which are scaled to about 1: a violation then comes before any cost."""
_NONE = 1e30
"""What DAQP takes for no bound."""
_FREE, _EQUALITY, _SOFT = 0, 5, 8
"""DAQP's marks of a row: an inequality; an equality; one that may be violated."""
_SOLVED, _SOLVED_SOFT = 1, 2
_EXACT = 1e-10
"""Largest violation of a row that an answer may have."""


class QuadraticStep(NamedTuple):
    """Answer of one quadratic program."""

    d: Float[np.ndarray, " n"]
    multipliers: Float[np.ndarray, " m"]
    """Of the rows; those of inequalities are not negative."""
    feasible: bool
    """Whether all rows hold; if not, their violations are as small as they can be."""
    solved: bool
    """False where B was not positive definite to rounding; then the rest is of no use."""


def solve_quadratic(
    hessian: Float[np.ndarray, "n n"],
    gradient: Float[np.ndarray, " n"],
    rows: Float[np.ndarray, "m n"],
    offset: Float[np.ndarray, " m"],
    equalities: int,
    low: Float[np.ndarray, " n"],
    high: Float[np.ndarray, " n"],
) -> QuadraticStep:
    """Solve the program above; the first `equalities` rows must be zero, the others not positive.

    Variables with `low == high` are held; `low` and `high` may be infinite.
    """
    free = high > low
    if free.all() or not free.any():
        return _solve(hessian, gradient, rows, offset, equalities, low, high)
    d = np.where(free, 0.0, low)  # a program of fewer variables is quicker
    part = _solve(
        hessian[np.ix_(free, free)],
        gradient[free] + hessian[free] @ d,
        rows[:, free],
        offset + rows @ d,
        equalities,
        low[free],
        high[free],
    )
    d[free] = part.d
    return part._replace(d=d)


def _solve(
    hessian: np.ndarray,
    gradient: np.ndarray,
    rows: np.ndarray,
    offset: np.ndarray,
    equalities: int,
    low: np.ndarray,
    high: np.ndarray,
) -> QuadraticStep:
    import daqp  # not needed before something is optimised

    n, last = len(gradient), len(gradient) + equalities
    # bounds of the variables first, then of the rows
    above = np.concatenate([np.minimum(high, _NONE), -offset])
    below = np.concatenate([np.maximum(low, -_NONE), -offset])
    below[last:] = -_NONE
    sense = np.full(len(above), _FREE, np.int32)
    sense[:n][high <= low] = _EQUALITY
    sense[n:last] = _EQUALITY
    d, _, flag, info = daqp.solve(hessian, gradient, rows, above, below, sense, primal_tol=_EXACT)
    if flag == _SOLVED:
        return QuadraticStep(d, info["lam"][n:], True, True)
    sense[n:] = _SOFT
    d, _, flag, info = daqp.solve(
        hessian, gradient, rows, above, below, sense, primal_tol=_EXACT, rho_soft=SOFTNESS, w_soft=0.0
    )
    return QuadraticStep(d, info["lam"][n:], False, flag in (_SOLVED, _SOLVED_SOFT) and bool(np.isfinite(d).all()))

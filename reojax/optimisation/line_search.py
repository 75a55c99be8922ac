"""Points between where a start is and where its program wants it to go.

    x + a d        the line, and
    x + a d + a^2 e  the arc, whose second-order correction e takes back what the constraints' curvature has added

(D. Q. Mayne, E. Polak, Math. Programming Study 16, 45-61, 1982). Without the arc, steps along strongly curved
constraints (the net rotation of a loop is one) become short. All points are evaluated at once; of those that lower the
merit enough the lowest is taken.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from reojax.optimisation.merit import merit

SUFFICIENT = 1e-4
"""Share of the predicted reduction that a point must bring (Armijo)."""
_ARC = np.array([1.0, 0.5, 0.25, 0.1, 0.03, 0.004])
_LINE = np.array([0.5, 0.25, 0.1, 0.03, 0.004, 0.001])
_LENGTHS = np.concatenate([_ARC, _LINE])
_BENDS = np.concatenate([_ARC**2, 0 * _LINE])
_ACTIVE, _INSIDE = 1e-6, 1e-9
"""How near to zero a linearised inequality counts as active, and how far from its bound a variable may be corrected."""
_REGULARISATION = 1e-9


def search(
    problem: Any, run: Any, who: np.ndarray, ahead: Float[np.ndarray, "r q"]
) -> tuple[Float[np.ndarray, "r n"], Bool[np.ndarray, " r"]]:
    """Return a better point for each start, and whether there is one.

    Args:
        problem: values of the functions, and bounds.
        run: the iterates.
        who: which of them.
        ahead: their constraints at the end of the full step.
    """
    count, x, d = len(_LENGTHS), run.x[who], run.step[who]
    if not who.size:
        return x, np.zeros(0, bool)
    e = _second_order_correction(problem, run, who, ahead)
    points = x[:, None] + _LENGTHS[None, :, None] * d[:, None] + _BENDS[None, :, None] * e[:, None]
    points = np.clip(points, problem.lower[who][:, None], problem.upper[who][:, None])
    values = problem.values(points.reshape(-1, x.shape[1]), np.repeat(who, count))
    reached = merit(
        values.cost.reshape(-1, count) / run.cost_scale[who, None],
        values.rows.reshape(len(who), count, -1) / run.row_scale[who, None],
        run.penalty[who, None],
        run.restoring[who, None],
        run.equalities,
    )
    enough = run.here[who, None] + SUFFICIENT * _LENGTHS * run.reduction[who, None] + run.rounding[who, None]
    reached = np.where(reached <= enough, reached, np.inf)  # what is not finite is not lower either
    return points[np.arange(len(who)), reached.argmin(1)], np.asarray(np.isfinite(reached).any(1))


def _second_order_correction(problem: Any, run: Any, who: np.ndarray, ahead: np.ndarray) -> Float[np.ndarray, "r n"]:
    """Shortest change that takes back, to first order, what the active constraints gained beyond their linear model.

    Variables that the step has put onto a bound stay there.
    """
    x, d, jacobian = run.x[who], run.step[who], run.jacobian[who]
    linear = (jacobian @ d[:, :, None])[:, :, 0] + run.c[who]
    equality = np.arange(linear.shape[1]) < run.equalities
    active = equality[None] | (linear > -_ACTIVE)
    known = np.asarray(np.isfinite(ahead).all(1))
    excess = np.where(active & known[:, None], ahead - linear, 0.0)
    inside = (x + d > problem.lower[who] + _INSIDE) & (x + d < problem.upper[who] - _INSIDE)
    rows = np.where(active[:, :, None] & inside[:, None], jacobian, 0.0)
    # J^T (J J^T + small)^-1: rows may be dependent
    gram = rows @ rows.swapaxes(1, 2)
    small = _REGULARISATION * (np.trace(gram, axis1=1, axis2=2) + _REGULARISATION)
    gram = gram + small[:, None, None] * np.eye(gram.shape[1])
    return -(rows.swapaxes(1, 2) @ np.linalg.solve(gram, excess[:, :, None]))[:, :, 0]

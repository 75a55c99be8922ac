"""What tells better points from worse: violations, the two merits, their predicted reduction, and stationarity."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Bool, Float


def violations(rows: Float[np.ndarray, "*r q"], equalities: int) -> Float[np.ndarray, "*r q"]:
    """How far each row is from what it should be: zero in the first ones, not positive in the others."""
    return np.concatenate([np.abs(rows[..., :equalities]), np.maximum(rows[..., equalities:], 0.0)], axis=-1)


def largest_violation(rows: Float[np.ndarray, "*r q"], equalities: int) -> Float[np.ndarray, "*r"]:
    """The largest of them."""
    return violations(rows, equalities).max(-1, initial=0.0)


def merit(
    cost: Float[np.ndarray, "*#r"],
    rows: Float[np.ndarray, "*#r q"],
    penalty: Float[np.ndarray, "*#r q"],
    restoring: Bool[np.ndarray, "*#r"],
    equalities: int,
) -> Float[np.ndarray, "*r"]:
    """Cost and penalised violations; half the sum of their squares where feasibility is being restored."""
    v = violations(rows, equalities)
    return np.where(restoring, 0.5 * (v * v).sum(-1), cost + (penalty * v).sum(-1))


def predict(run: Any, who: np.ndarray) -> Float[np.ndarray, " r"]:
    """Change of the merits by the steps, with cost and constraints linear in the step."""
    step = run.step[who]
    linear = (run.jacobian[who] @ step[:, :, None])[:, :, 0] + run.c[who]
    zero = np.zeros(len(who))
    now, after = (
        merit(zero, rows, run.penalty[who], run.restoring[who], run.equalities) for rows in (run.c[who], linear)
    )
    slope = np.where(run.restoring[who], 0.0, (run.gradient[who] * step).sum(1))
    return np.minimum(slope + after - now, 0.0)


def stationarity(
    x: Float[np.ndarray, "r n"],
    gradient: Float[np.ndarray, "r n"],
    multipliers: Float[np.ndarray, "r i"],
    slack: Float[np.ndarray, "r i"],
    lower: Float[np.ndarray, "r n"],
    upper: Float[np.ndarray, "r n"],
) -> Float[np.ndarray, " r"]:
    """Largest component of the Lagrangian's gradient that does not press against a bound, and of complementarity."""
    pressed = np.abs(x - np.clip(x - gradient, lower, upper)).max(1, initial=0.0)
    return np.maximum(pressed, np.minimum(multipliers, slack).max(1, initial=0.0))

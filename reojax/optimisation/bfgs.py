"""Damped BFGS estimates of the Lagrangian's Hessian (M. J. D. Powell, Numerical Analysis, Dundee 1977, 144-157)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

_SHORTEST = 1e-15
"""Steps shorter than this measure nothing."""
_FIRST = 1e-3, 1e3
"""Range of the first curvature."""
_DAMPING = 0.2
"""Share of the old curvature along a step that is kept at least, so that the estimate stays positive definite."""


def update(
    hessian: Float[np.ndarray, "r n n"],
    fresh: Bool[np.ndarray, " r"],
    step: Float[np.ndarray, "r n"],
    change: Float[np.ndarray, "r n"],
) -> tuple[Float[np.ndarray, "r n n"], Bool[np.ndarray, " r"]]:
    """Return the estimates after steps along which the gradients changed, and which are still `fresh`.

    The first update of an estimate also sets its size: curvature along the step in all directions.
    """
    square, sy = (step * step).sum(1), (step * change).sum(1)
    useful = np.isfinite(change).all(1) & (square > _SHORTEST**2)
    size = np.clip(np.abs(sy) / np.where(useful, square, 1.0), *_FIRST)
    first = size[:, None, None] * np.eye(step.shape[1])
    B = np.where((fresh & useful)[:, None, None], first, hessian)

    Bs = (B @ step[:, :, None])[:, :, 0]
    sBs = (step * Bs).sum(1)
    # Powell's damping: y moves towards B s until s.y is a fifth of s.B s
    short = sy < _DAMPING * sBs
    share = np.where(short, (1 - _DAMPING) * sBs / np.where(short, sBs - sy, 1.0), 1.0)[:, None]
    y = share * change + (1 - share) * Bs
    sy = (step * y).sum(1)

    useful &= (sy > 0) & (sBs > 0)
    sy, sBs = np.where(useful, sy, 1.0)[:, None, None], np.where(useful, sBs, 1.0)[:, None, None]
    change_of_B = y[:, :, None] * y[:, None] / sy - Bs[:, :, None] * Bs[:, None] / sBs
    return np.where(useful[:, None, None], B + change_of_B, B), fresh & ~useful

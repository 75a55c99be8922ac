"""The door of the optimisers: starts, bounds, scales and data, in shape and in order."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from reojax._internal import checks
from reojax._internal.arrays import as_numbers, common_float


class Box(NamedTuple):
    """What the variables of every start may be, and how much is much."""

    lower: Float[np.ndarray, "m n"]
    upper: Float[np.ndarray, "m n"]
    scale: Float[np.ndarray, " n"]


def check_starts(starts: Any, lower: Any, upper: Any, scale: Any, data: Any) -> tuple[Float[np.ndarray, "m n"], Box]:
    """Return starts and their box.

    Raises:
        ValueError: naming the argument, its value and the rule.
    """
    x = np.asarray(as_numbers("starts", starts))
    x = x[None] if x.ndim == 1 else x
    if x.ndim != 2 or not x.size:
        raise ValueError(f"`starts` has shape {x.shape}; it must be (n,) or (m, n), with at least one of each.")
    dtype = common_float(x)
    x = np.asarray(x, dtype)
    n = x.shape[1]

    def bound(entry: str, value: Any) -> np.ndarray:
        array = np.asarray(as_numbers(entry, value), dtype)
        if array.shape not in ((), (n,), x.shape):
            raise ValueError(f"`{entry}` has shape {array.shape}; it must be one number, ({n},) or {x.shape}.")
        return np.broadcast_to(array, x.shape)

    low, high = bound("lower", lower), bound("upper", upper)
    for i, k in np.argwhere(~(low <= high))[:1]:
        raise ValueError(f"lower[{k}] is {low[i, k]:g} and upper[{k}] is {high[i, k]:g}; bounds must be in order.")
    for i, k in np.argwhere(~((low <= x) & (x <= high) & np.isfinite(x)))[:1]:
        raise ValueError(
            f"starts[{i}, {k}] is {x[i, k]:g}; it must be from {low[i, k]:g} to {high[i, k]:g}, and finite."
        )
    size = _widths(low, high) if scale is None else np.asarray(as_numbers("scale", scale), float)
    if size.shape not in ((), (n,)):
        raise ValueError(f"`scale` has shape {size.shape}; it must be one number or ({n},).")
    size = np.broadcast_to(size, (n,))
    for k in np.flatnonzero(~((size > 0) & np.isfinite(size)))[:1]:
        raise ValueError(f"scale[{k}] is {size[k]:g}; it must be positive and finite.")
    for leaf in jax.tree.leaves(data):
        if np.shape(leaf)[:1] != (len(x),):
            raise ValueError(
                f"`data` has an array of shape {np.shape(leaf)}; with {len(x)} starts, {len(x)} come first."
            )
    return x, Box(low, high, size)


def _widths(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Largest range that a variable has in any start; 1 where it is infinite, or none."""
    with np.errstate(invalid="ignore"):
        width = np.asarray(high, float) - np.asarray(low, float)
    width = np.where(np.isfinite(width), width, 0.0).max(0)
    return np.where(width > 0, width, 1.0)


def check_tolerances(**tolerances: Any) -> None:
    """Refuse what is not one positive finite number."""
    for entry, number in tolerances.items():
        checks.positive(entry, number, unit="")

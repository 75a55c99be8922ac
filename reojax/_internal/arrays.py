"""The array types of every signature, and the one rule for the dtype of a result."""

import datetime
from collections.abc import Callable
from typing import Any, TypeVar

import jax
import jax.core
import jax.numpy as jnp
import numpy as np

Array = jax.Array | np.ndarray
Tree = TypeVar("Tree")
_RULE = "reojax computes in float32 or float64: convert them, as in `np.asarray(x, np.float64)`"


def common_float(*trees: Any) -> np.dtype:
    """Return the lowest floating precision found in `trees`: any float32 in makes float32 out.

    Integers and empty trees do not vote; with nothing to vote the answer is JAX's default float.
    Robots and angles from Python numbers are float64, so asking for float32 anywhere is asking for
    float32 altogether. Without `jax_enable_x64` everything is float32, as always in JAX.
    """
    dtypes = {jnp.result_type(leaf) for leaf in jax.tree.leaves(trees)}
    floats = [jax.dtypes.canonicalize_dtype(d) for d in dtypes if jnp.issubdtype(d, jnp.floating)]
    for dtype in floats:
        if dtype not in (np.float32, np.float64):
            raise ValueError(f"there are numbers of type {dtype}; {_RULE}.")
    return min(floats, key=lambda d: d.itemsize, default=jax.dtypes.canonicalize_dtype(float))


def cast(tree: Tree, dtype: Any) -> Tree:
    """The same with JAX arrays of that dtype; may be traced."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), tree)


def kind_of_arrays(*trees: Any) -> tuple[Any, Callable[[Any], Any]]:
    """Module and cast for a changed copy of `trees`: NumPy's unless JAX's arrays are about, in their lowest float."""
    leaves = [leaf for leaf in jax.tree.leaves(trees) if hasattr(leaf, "dtype")]
    xp = jnp if any(isinstance(leaf, jax.Array) for leaf in leaves) else np
    floats = [leaf.dtype for leaf in leaves if jnp.issubdtype(leaf.dtype, jnp.floating)]
    dtype = min(floats, key=lambda d: d.itemsize)
    return xp, lambda array: xp.asarray(array, dtype)


def is_concrete(value: Any) -> bool:
    """Tell whether the numbers of `value` can be read now (False while JAX is tracing it)."""
    return not any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(value))


def refuse_lookalikes(entry: str, value: Any) -> None:
    """Refuse what NumPy would take for a number without a word: truth values, times, masked entries, other units.

    Raises:
        ValueError: naming `entry`.
    """
    if hasattr(value, "units") and hasattr(value, "magnitude"):
        raise ValueError(f"`{entry}` is {_short(value)}, with units of its own; give its number in SI units.")
    for leaf in jax.tree.leaves(value):
        if isinstance(leaf, np.ma.MaskedArray) and np.ma.getmaskarray(leaf).any():
            raise ValueError(f"`{entry}` has masked entries, which would count; leave them out, or fill them.")
        kind = getattr(getattr(leaf, "dtype", None), "kind", "")
        if isinstance(leaf, bool) or kind == "b":
            raise ValueError(f"`{entry}` is {_short(value)}, with truth values in it; only real numbers will do.")
        if kind in ("m", "M") or isinstance(leaf, datetime.timedelta | datetime.date):
            raise ValueError(f"`{entry}` is {_short(value)}, a time of its own kind; give a number of seconds.")


def as_numbers(entry: str, value: Any) -> Array:
    """Return `value` as an array of real numbers (integers become floats), traced or not.

    Raises:
        ValueError: naming `entry`, if it is anything else: truth values, times, numbers with units, masked entries, or
            floats that are neither float32 nor float64.
    """
    refuse_lookalikes(entry, value)
    leaves = jax.tree.leaves(value)
    on_device = any(isinstance(leaf, jax.Array) for leaf in leaves)
    try:
        array = jnp.asarray(value) if on_device else np.asarray(value)
    except Exception as error:  # a ragged list, no numbers, or an object that does not turn into an array
        raise ValueError(f"`{entry}` is {_short(value)}; only real numbers will do.") from error
    if array.dtype.kind in "iu":
        return array.astype(float)
    if not jnp.issubdtype(array.dtype, jnp.floating):
        raise ValueError(f"`{entry}` is {_short(value)}; only real numbers will do.")
    if array.dtype not in (np.float32, np.float64):
        raise ValueError(f"`{entry}` is of type {array.dtype}; {_RULE}.")
    return array


def _short(value: Any) -> str:
    """`repr`, cut where it is long."""
    if isinstance(value, str | bytes):
        value = value[:200]
    try:
        text = repr(value)
    except Exception:
        text = f"a {type(value).__name__}"
    return text if len(text) <= 200 else f"{text[:150]} ... {text[-40:]}"

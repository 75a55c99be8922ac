"""The array types of every signature, and the one rule for the dtype of a result."""

from typing import Any

import jax
import jax.core
import jax.numpy as jnp
import numpy as np

Array = jax.Array | np.ndarray


def common_float(*trees: Any) -> np.dtype:
    """Return the lowest floating precision found in `trees`: any float32 in makes float32 out.

    Integers and empty trees do not vote; with nothing to vote the answer is JAX's default float.
    Robots and angles from Python numbers are float64, so asking for float32 anywhere is asking for
    float32 altogether. Without `jax_enable_x64` everything is float32, as always in JAX.
    """
    dtypes = {jnp.result_type(leaf) for leaf in jax.tree.leaves(trees)}
    floats = [jax.dtypes.canonicalize_dtype(d) for d in dtypes if jnp.issubdtype(d, jnp.floating)]
    return min(floats, key=lambda d: d.itemsize, default=jax.dtypes.canonicalize_dtype(float))


def is_concrete(value: Any) -> bool:
    """Tell whether the numbers of `value` can be read now (False while JAX is tracing it)."""
    return not any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(value))


def as_numbers(entry: str, value: Any) -> Array:
    """Return `value` as an array of real numbers (integers become floats), traced or not.

    Raises:
        ValueError: naming `entry`, if it is anything else.
    """
    on_device = any(isinstance(leaf, jax.Array) for leaf in jax.tree.leaves(value))
    try:
        array = jnp.asarray(value) if on_device else np.asarray(value)
    except (TypeError, ValueError) as error:  # a ragged list, or no numbers
        raise ValueError(f"`{entry}` is {value!r}; only real numbers will do.") from error
    if jnp.issubdtype(array.dtype, jnp.integer):
        array = array.astype(float)
    if not jnp.issubdtype(array.dtype, jnp.floating):
        raise ValueError(f"`{entry}` is {value!r}; only real numbers will do.")
    return array

"""Values at the nodes that are computed once and kept, however many read them.

XLA on CPU makes one loop for every array it writes, and computes what several loops share again in each, however
long that takes. Only an expensive operation is never repeated, and a division is one: what is divided by a one
that the compiler cannot see through is written out once. (Matrix products stop it too, at three times the cost.)
In the derivative, where everything has many readers, this saves half of the work.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

Keep = Callable[[Any], Any]


def keeper(like: jax.Array) -> Keep:
    """Return a function that keeps the scalars of a vector, where they are arrays of the shape of `like`."""
    like = jax.lax.stop_gradient(like)
    one = jnp.where(like == like, 1.0, like)  # a NaN of `like` has spoilt everything already

    def keep(vector: Any) -> Any:
        return tuple(c if isinstance(c, int | float) or c.shape != one.shape else _kept(c, one) for c in vector)

    return keep


@jax.custom_jvp
def _kept(values: jax.Array, one: jax.Array) -> jax.Array:
    return values / one


@_kept.defjvp
def _kept_jvp(primals, tangents):
    """Keep the derivatives too, so that reverse mode keeps what flows back."""
    values, one = primals
    return _kept(values, one), _kept(tangents[0], one)

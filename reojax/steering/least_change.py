"""The least change of the rest of a motion that takes back what its end would miss."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax._internal.linalg import solve_symmetric3

_LONGEST = 0.1
"""Largest change of the steering at one reading [rad]."""


class Effort(NamedTuple):
    """What a change of the joints costs."""

    spread: Float[Array, "j j"]
    """`W^-1`, with coupled joints carried along."""
    price: Float[Array, ""]
    """Square of an error that is worth a change of one radian [rad^2]."""


def steer_to(
    miss: Float[Array, "3"],
    slope: Float[Array, "3 n j"],
    steer: Float[Array, "n j"],
    effort: Effort,
    worth: Array,
    largest: Array,
) -> Float[Array, "n j"]:
    """The steering after a reading that is `worth` a share of `-W^-1 slope^T (slope W^-1 slope^T + price)^-1 miss`.

    A Gauss-Newton step about the motion that is told now, in all bumps and joints: repeated at each reading, it goes
    to motions from which the end can be turned where it could not from the planned one. `largest` is the change of a
    joint up to which the prediction lets it go; the steering stays within twice that.
    """
    lever = slope @ effort.spread
    matrix = jnp.einsum("anj,bnj->ab", slope, lever) + effort.price * jnp.eye(3, dtype=miss.dtype)
    force = solve_symmetric3(matrix, miss[:, None])[:, 0]
    move = -worth * jnp.einsum("anj,a->nj", lever, force)
    move = move * jnp.minimum(1, _LONGEST / jnp.maximum(jnp.abs(move).max(), 1e-12))
    return jnp.clip(steer + move, -2 * largest, 2 * largest)

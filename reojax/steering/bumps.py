"""Smooth changes of a motion in time: cubic B-splines at equal distances, each of which begins and ends at rest.

The told motion is `theta(t) - bumps(t) c` with `c` (n, j), a number for each of n bumps and each joint. All bumps
vanish with their first two derivatives at both ends of the motion.
"""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Float

from reojax._internal.arrays import Array


def bumps(time: Float[Array, ""], duration: Array, count: int) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """Values of all bumps at one time, each 1 at its highest, and their rates [1/s].

    With `u` the distance from a bump's middle in widths, `((2 - |u|)_+^3 - 4 (1 - |u|)_+^3) / 4`: the cubic B-spline
    (C. de Boor, A Practical Guide to Splines, 1978). `time` and `duration` in seconds.
    """
    width = duration / (count + 3)
    u = time / width - jnp.arange(2, count + 2, dtype=duration.dtype)
    outer, inner = jnp.maximum(2 - jnp.abs(u), 0), jnp.maximum(1 - jnp.abs(u), 0)
    return (outer**3 - 4 * inner**3) / 4, jnp.sign(u) * (12 * inner**2 - 3 * outer**2) / (4 * width)

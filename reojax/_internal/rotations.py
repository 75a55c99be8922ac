"""What rotations are computed with: functions of an angle from its square, a matrix's quaternion, scaled lengths.

Each is exact to rounding with its derivatives, at zero and at half turns too; `so3` says how.
"""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from reojax._internal.quaternions import outer_rows


def stumpff(order: int, square: jax.Array) -> jax.Array:
    """Sum of `(-square)^i / (2 i + order)!`: cos t, sin t / t, (1 - cos t) / t^2, (t - sin t) / t^3.

    Here `square` is t^2. Below t = 1 eleven terms reach rounding, two derivatives included, in any dtype.
    """
    near = square < 1
    inside = jnp.where(near, square, 0.0)
    series = jnp.zeros_like(inside)
    for i in reversed(range(11)):
        series = 1 / math.factorial(2 * i + order) - inside * series
    t = jnp.sqrt(jnp.where(near, 1.0, square))
    closed = (
        lambda: jnp.cos(t),
        lambda: jnp.sin(t) / t,
        lambda: (1 - jnp.cos(t)) / (t * t),
        lambda: (t - jnp.sin(t)) / (t * t * t),
    )[order]
    return jnp.where(near, series, closed())


def hat(u: jax.Array) -> jax.Array:
    """Matrix of the cross product with `u` (3,)."""
    x, y, z = u
    zero = jnp.zeros_like(x)
    return jnp.stack([zero, -z, y, z, zero, -x, -y, x, zero]).reshape(3, 3)


def hat_squared(u: jax.Array) -> jax.Array:
    """Its square, `u u^T - |u|^2`."""
    return u[:, None] * u[None, :] - jnp.sum(u * u) * jnp.eye(3, dtype=u.dtype)


def matrix_of_quaternion(w: jax.Array, u: jax.Array, square: jax.Array | float = 1.0) -> jax.Array:
    """Rotation of the quaternion (w, u) whose squared length is `square`."""
    return jnp.eye(3, dtype=u.dtype) + (2 / square) * (w * hat(u) + hat_squared(u))


def unit_quaternion(r: jax.Array) -> jax.Array:
    """Of the rows of `4 q q^T`, linear in the matrix, normalise that of the largest component (Shepperd)."""
    rows = outer_rows(r)
    largest = lax.argmax(jnp.stack([rows[i][i] for i in range(4)]), 0, np.int32)
    row = lax.select_n(largest, *(jnp.stack(row) for row in rows))
    q = row / jnp.sqrt(jnp.sum(row * row))
    return jnp.where(q[0] < 0, -q, q)


def scale_to_one(vector: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Return `vector / scale` and `scale`: its largest component, or 1 at zero; a constant to autodiff."""
    scale = lax.stop_gradient(jnp.max(jnp.abs(vector)))
    scale = jnp.where(scale >= jnp.finfo(vector.dtype).tiny, scale, 1.0)
    return vector / scale, scale


def length(vector: jax.Array) -> jax.Array:
    """Length of a vector, with derivative 0 at zero."""
    unit, scale = scale_to_one(vector)
    square = jnp.sum(unit * unit)
    zero = square == 0
    return jnp.where(zero, 0.0, scale * jnp.sqrt(jnp.where(zero, 1.0, square)))


def polar(x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Length and direction of (x, y); the direction of (0, 0) is 0, and both have derivative 0 there."""
    size = length(jnp.stack([x, y]))
    x, y = scale_to_one(jnp.stack([x, y]))[0]
    return size, jnp.arctan2(jnp.where(size == 0, 0.0, y), jnp.where(size == 0, 1.0, x))


def wrap(turn: jax.Array) -> jax.Array:
    """Angle in (-3 pi, 3 pi) brought to (-pi, pi]."""
    turn = jnp.where(turn > math.pi, turn - 2 * math.pi, turn)
    return jnp.where(turn <= -math.pi, turn + 2 * math.pi, turn)

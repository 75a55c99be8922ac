"""Quaternions (w, x, y, z) of arrays, and ordered products of many along the first axis."""

import jax
import jax.numpy as jnp

from reojax.mechanics._fast.materialize import materialize
from reojax.mechanics._fast.scalar import cross, dot, mul, plus, scaled, sub

Quaternion = tuple[jax.Array, ...]
"""w, x, y, z."""
Triple = tuple[jax.Array, ...]
"""x, y, z."""


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the quaternion of the rotation `a b`: in the frame that `a` made, do `b`."""
    s, u, t, v = a[0], a[1:], b[0], b[1:]
    return sub(mul(s, t), dot(u, v)), *plus(plus(scaled(s, v), scaled(t, u)), cross(u, v))


def rotate(q: Quaternion, v: Triple) -> Triple:
    """Return the vector `v` turned by the unit quaternion `q`."""
    u = q[1:]
    twice = scaled(2, cross(u, v))
    return plus(plus(v, scaled(q[0], twice)), cross(u, twice))


def inverse(q: Quaternion) -> Quaternion:
    """Return the quaternion of the inverse rotation."""
    w, x, y, z = q
    return w, -x, -y, -z


def to_matrix(q: Quaternion) -> jax.Array:
    """Return the 3x3 matrix of one unit quaternion, four scalars."""
    w, x, y, z = q
    columns = (
        [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    )
    return jnp.stack([jnp.stack(column) for column in columns], axis=1)


def product(factors: Quaternion) -> Quaternion:
    """Return `factors[0] factors[1] ... factors[m - 1]` of arrays (m,), m >= 1, as four scalars.

    Products of pairs, of pairs of pairs, and so on.
    """
    while factors[0].shape[0] > 1:
        w, *xyz = factors
        odd = (0, w.shape[0] % 2)
        pairs = [c.reshape(-1, 2) for c in (jnp.pad(w, odd, constant_values=1), *(jnp.pad(c, odd) for c in xyz))]
        factors = materialize(multiply(*(tuple(c[:, side] for c in pairs) for side in (0, 1))))
    return tuple(c[0] for c in factors)


def products_up_to(factors: Quaternion) -> Quaternion:
    """Return for each i the product `factors[0] ... factors[i]`, four arrays (m,).

    Products of the last 2, 4, 8, ... factors up to each.
    """
    length = 1
    while length < factors[0].shape[0]:
        factors = materialize(multiply(shift(factors, length), factors))
        length *= 2
    return factors


def shift(factors: Quaternion, by: int) -> Quaternion:
    """Return the quaternions `by` places later, identities before them, without the last ones."""
    w, *xyz = (c[:-by] for c in factors)
    padding = (by, 0)
    return jnp.pad(w, padding, constant_values=1), *(jnp.pad(c, padding) for c in xyz)

"""Quaternions (w, x, y, z) of arrays, and ordered products of many along the first axis."""

import jax
import jax.numpy as jnp

from reojax._internal.quaternions import matrix_rows, product
from reojax.mechanics._fast.materialize import materialize
from reojax.mechanics._fast.scalar import cross, plus, scale

Quaternion = tuple[jax.Array, ...]
"""w, x, y, z."""
Triple = tuple[jax.Array, ...]
"""x, y, z."""


def rotate(q: Quaternion, v: Triple) -> Triple:
    """Return the vector `v` turned by the unit quaternion `q`."""
    u = q[1:]
    twice = scale(2, cross(u, v))
    return plus(plus(v, scale(q[0], twice)), cross(u, twice))


def to_matrix(q: Quaternion) -> jax.Array:
    """Return the 3x3 matrix of one unit quaternion, four scalars."""
    return jnp.stack([jnp.stack(row) for row in matrix_rows(q)])


def ordered_product(factors: Quaternion) -> Quaternion:
    """Return `factors[0] factors[1] ... factors[m - 1]` of arrays (m,), m >= 1, as four scalars.

    Products of pairs, of pairs of pairs, and so on.
    """
    while factors[0].shape[0] > 1:
        w, *xyz = factors
        odd = (0, w.shape[0] % 2)
        pairs = [c.reshape(-1, 2) for c in (jnp.pad(w, odd, constant_values=1), *(jnp.pad(c, odd) for c in xyz))]
        factors = materialize(product(*(tuple(c[:, side] for c in pairs) for side in (0, 1))))
    return tuple(c[0] for c in factors)


def products_up_to(factors: Quaternion) -> Quaternion:
    """Return for each i the product `factors[0] ... factors[i]`, four arrays (m,).

    Products of the last 2, 4, 8, ... factors up to each.
    """
    length = 1
    while length < factors[0].shape[0]:
        factors = materialize(product(shift(factors, length), factors))
        length *= 2
    return factors


def shift(factors: Quaternion, by: int) -> Quaternion:
    """Return the quaternions `by` places later, identities before them, without the last ones."""
    w, *xyz = (c[:-by] for c in factors)
    padding = (by, 0)
    return jnp.pad(w, padding, constant_values=1), *(jnp.pad(c, padding) for c in xyz)

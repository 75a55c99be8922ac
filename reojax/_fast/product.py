"""Quaternions (w, x, y, z) of arrays, and ordered products of many along the first axis."""

import math

import jax
import jax.numpy as jnp

Quaternion = tuple[jax.Array, ...]
"""w, x, y, z."""
Triple = tuple[jax.Array, ...]
"""x, y, z."""


def times(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the quaternion of the rotation `a b`: in the frame that `a` made, do `b`."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


def rotate(q: Quaternion, v: Triple) -> Triple:
    """Return the vector `v` turned by the unit quaternion `q`."""
    w, x, y, z = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return (
        v[0] + w * tx + y * tz - z * ty,
        v[1] + w * ty + z * tx - x * tz,
        v[2] + w * tz + x * ty - y * tx,
    )


def to_matrix(q: Quaternion) -> jax.Array:
    """Return the 3x3 matrix of one unit quaternion, four scalars."""
    w, x, y, z = q
    columns = (
        [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    )
    return jnp.stack([jnp.stack(column) for column in columns], axis=1)


def identity(like: jax.Array) -> Quaternion:
    """Return identity quaternions in the shape and dtype of `like`."""
    return jnp.ones_like(like), jnp.zeros_like(like), jnp.zeros_like(like), jnp.zeros_like(like)


def ordered_products(factors: Quaternion) -> tuple[Quaternion, Quaternion]:
    """Return the product of all factors and the products of those before each one.

    A tree of two levels: `m` factors (arrays (m,), m >= 1) in about `sqrt(m)` runs, all runs multiplied
    side by side, then the runs' products. `lax.scan` keeps the program small for any `m`, and keeps XLA on
    CPU from computing a factor again for each of the four components that read it.

    Returns:
        `factors[0] ... factors[m - 1]` as four scalars, and for each i `factors[0] ... factors[i - 1]` as
        four arrays (m,), the first of them the identity.
    """
    m = factors[0].shape[0]
    length = math.isqrt(m - 1) + 1
    runs = -(-m // length)
    padding = identity(jnp.zeros((runs * length - m,), factors[0].dtype))
    grid = tuple(jnp.concatenate([f, p]).reshape(runs, length).T for f, p in zip(factors, padding, strict=True))
    run, before_in_run = _chain(grid)
    total, before_run = _chain(run)
    before = times(tuple(q[None, :] for q in before_run), before_in_run)
    return total, tuple(q.T.reshape(-1)[:m] for q in before)


def _chain(factors: Quaternion) -> tuple[Quaternion, Quaternion]:
    start = identity(factors[0][0])
    return jax.lax.scan(lambda done, factor: (times(done, factor), done), start, factors)

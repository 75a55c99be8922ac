"""Quaternions (w, x, y, z) of arrays, and their ordered product along the first axis."""

import math

import jax
import jax.numpy as jnp

Quaternion = tuple[jax.Array, jax.Array, jax.Array, jax.Array]


def times(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the quaternion of the rotation `a b`: in the frame that `a` made, do `b`."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


def identity(like: jax.Array) -> Quaternion:
    """Return identity quaternions in the shape and dtype of `like`."""
    return jnp.ones_like(like), jnp.zeros_like(like), jnp.zeros_like(like), jnp.zeros_like(like)


def ordered_product(factors: Quaternion) -> Quaternion:
    """Return `factors[0] factors[1] ...` of four arrays (m,), m >= 1, as four scalars.

    A tree of two levels: `m` factors in about `sqrt(m)` runs, all runs multiplied side by side, then the
    runs' products. `lax.scan` keeps the program small for any `m`, and keeps XLA on CPU from
    computing a factor again for each of the four components that read it.
    """
    m = factors[0].shape[0]
    length = math.isqrt(m - 1) + 1
    runs = -(-m // length)
    padding = identity(jnp.zeros((runs * length - m,), factors[0].dtype))
    padded = (jnp.concatenate([f, p]).reshape(runs, length).T for f, p in zip(factors, padding, strict=True))
    return _chain(_chain(tuple(padded)))


def _chain(factors: Quaternion) -> Quaternion:
    start = identity(factors[0][0])
    return jax.lax.scan(lambda done, factor: (times(done, factor), None), start, factors)[0]


def cumulative_product(factors: Quaternion) -> Quaternion:
    """Return all leading products `factors[0] ... factors[i]`, four arrays (m,), by a parallel scan."""
    return jax.lax.associative_scan(times, factors)

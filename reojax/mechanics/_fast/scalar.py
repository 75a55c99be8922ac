"""Arithmetic on scalars that may be known beforehand, and vectors and symmetric matrices made of them.

A scalar is a Python number (known while tracing) or an array. Products with a known 0 and +-1 and sums
with a known 0 cost nothing, which XLA itself may not do: in floating point 0 * x is not always 0.
"""

from typing import Any, TypeAlias

import jax
import numpy as np

Scalar: TypeAlias = jax.Array | float | int
Vector: TypeAlias = tuple[Scalar, ...]
"""x, y, z."""
Symmetric: TypeAlias = tuple[Scalar, ...]
"""xx, yy, zz, xy, xz, yz."""
Matrix: TypeAlias = tuple[Vector, ...]
"""Three rows."""

ZERO: Vector = (0, 0, 0)


def _known(a: Scalar) -> bool:
    return isinstance(a, int | float)


def mul(a: Scalar, b: Scalar) -> Any:
    """Return `a * b`."""
    if _known(b) and not _known(a):
        a, b = b, a
    if _known(a):
        if a == 0:
            return 0
        if a == 1:
            return b
        if a == -1:
            return -b if _known(b) else jax.lax.neg(b)
        if _known(b):
            return a * b
    return jax.lax.mul(*_alike(a, b))


def add(a: Scalar, b: Scalar) -> Any:
    """Return `a + b`."""
    if _known(a) and a == 0:
        return b
    if _known(b) and b == 0:
        return a
    if _known(a) and _known(b):
        return a + b
    return jax.lax.add(*_alike(a, b))


def _alike(a: Any, b: Any) -> tuple[jax.Array, jax.Array]:
    """Both as arrays of one shape. (The operators of `jax.numpy` do it too, but take most of the time of tracing.)"""
    if _known(a):
        a = np.asarray(a, b.dtype)
    elif _known(b):
        b = np.asarray(b, a.dtype)
    if a.shape != b.shape:
        shape = a.shape or b.shape
        a, b = (x if x.shape == shape else jax.lax.broadcast_in_dim(x, shape, ()) for x in (a, b))
    return a, b


def sub(a: Scalar, b: Scalar) -> Any:
    """Return `a - b`."""
    if _known(a) or _known(b):
        return add(a, mul(-1, b))
    return jax.lax.sub(*_alike(a, b))


def dot(a: Vector, b: Vector) -> Any:
    """Return the scalar product of two triples."""
    return add(add(mul(a[0], b[0]), mul(a[1], b[1])), mul(a[2], b[2]))


def cross(a: Vector, b: Vector) -> tuple[Any, ...]:
    """Return the vector product."""
    return (
        sub(mul(a[1], b[2]), mul(a[2], b[1])),
        sub(mul(a[2], b[0]), mul(a[0], b[2])),
        sub(mul(a[0], b[1]), mul(a[1], b[0])),
    )


def plus(a: tuple[Scalar, ...], b: tuple[Scalar, ...]) -> tuple[Any, ...]:
    """Return the sum of two vectors, or of two symmetric matrices."""
    return tuple(add(x, y) for x, y in zip(a, b, strict=True))


def scale(s: Scalar, a: tuple[Scalar, ...]) -> tuple[Any, ...]:
    """Return a vector or a symmetric matrix scaled by `s`."""
    return tuple(mul(s, x) for x in a)


def apply(matrix: Matrix, a: Vector) -> Vector:
    """Return `matrix @ a`."""
    return (dot(matrix[0], a), dot(matrix[1], a), dot(matrix[2], a))


def full(s: Symmetric) -> Matrix:
    """Return the rows of a symmetric matrix."""
    xx, yy, zz, xy, xz, yz = s
    return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))


def turned_inertia(rotation: Matrix, s: Symmetric) -> Symmetric:
    """Return `rotation @ s @ rotation.T`."""
    rows = [apply(full(s), row) for row in rotation]  # the rows of rotation @ s
    x, y, z = rotation
    return (dot(rows[0], x), dot(rows[1], y), dot(rows[2], z), dot(rows[0], y), dot(rows[0], z), dot(rows[1], z))


def point_inertia(mass: Scalar, d: Vector) -> Symmetric:
    """Return the inertia `mass (|d|^2 - d d^T)` of a point mass at `d`."""
    x, y, z = d
    xx, yy, zz = mul(x, x), mul(y, y), mul(z, z)
    products = (mul(x, y), mul(x, z), mul(y, z))
    return scale(mass, (add(yy, zz), add(xx, zz), add(xx, yy), *scale(-1, products)))


def transpose(matrix: Matrix) -> Matrix:
    """Return the transposed matrix."""
    x, y, z = zip(*matrix, strict=True)
    return (x, y, z)

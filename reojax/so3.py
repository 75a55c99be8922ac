"""Rotations in space: 3x3 matrices, rotation vectors, unit quaternions and ZXZ Euler angles.

A rotation is a matrix `R` that takes body components to outer components. Functions take one rotation
(`jax.vmap` for more), accept arrays or nested lists, and keep the dtype; integers become JAX's default float.

Values and derivatives are exact to rounding wherever they exist, at the identity and at half turns too.
Three devices do it. Analytic functions of an angle are written in its square, as power series near zero
and in closed form elsewhere, so that no derivative divides by zero or cancels. A matrix is read through its
quaternion, from the largest component (S. W. Shepperd, J. Guidance and Control 1, 223-224, 1978), which loses
no digits near a half turn. Lengths and plane angles are taken of vectors scaled to size one, so that tiny
ones do not underflow when squared. Products are written out: a float32 matrix product may be rounded to
fewer digits on an accelerator.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import rotations
from reojax._internal.arrays import Array, is_concrete, refuse_lookalikes
from reojax._internal.checks import key as check_key, shorten


def hat(vector: ArrayLike) -> Float[Array, "3 3"]:
    """Matrix of the cross product: `hat(a) @ b = a x b`.

    Args:
        vector: (3,).

    Raises:
        ValueError: if `vector` is not of shape (3,).
    """
    return rotations.hat(_floats(vector, "vector", (3,)))


def vee(matrix: ArrayLike) -> Float[Array, "3"]:
    """Vector of a skew-symmetric matrix, `vee(hat(a)) = a`; of any other matrix, that of its skew part.

    Args:
        matrix: (3, 3).

    Raises:
        ValueError: if `matrix` is not of shape (3, 3).
    """
    m = _floats(matrix, "matrix", (3, 3))
    return 0.5 * jnp.stack([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])


def exp(vector: ArrayLike) -> Float[Array, "3 3"]:
    """Rotation by the angle `|vector|` about the direction of `vector`: the matrix exponential of its `hat`.

    Args:
        vector: (3,) rotation vector [rad], of any length.

    Raises:
        ValueError: if `vector` is not of shape (3,).
    """
    half = 0.5 * _floats(vector, "vector", (3,))
    square = jnp.sum(half * half)
    return rotations.matrix_of_quaternion(rotations.stumpff(0, square), rotations.stumpff(1, square) * half)


def log(rotation: ArrayLike) -> Float[Array, "3"]:
    """Rotation vector [rad] of a rotation, the shortest: `exp(log(R)) = R`, `|log(R)| <= pi`.

    A half turn has two, `v` and `-v`; the one whose largest component is positive is returned. The
    derivative there is that of the branch on which the value lies.

    Args:
        rotation: (3, 3).

    Raises:
        ValueError: if `rotation` is not of shape (3, 3).
    """
    q = rotations.unit_quaternion(_floats(rotation, "rotation", (3, 3)))
    w, u = q[0], q[1:]
    square = jnp.sum(u * u)
    near = 64 * square < w * w  # tan(angle / 2) < 1/8, where 12 terms of the arctangent reach rounding
    cosine = jnp.where(near, w, 1.0)
    sine = jnp.sqrt(jnp.where(near, 1.0, square))
    ratio = jnp.where(near, square, 0.0) / (cosine * cosine)
    series = jnp.zeros_like(ratio)
    for i in reversed(range(12)):
        series = 1 / (2 * i + 1) - ratio * series
    return 2 * jnp.where(near, series / cosine, jnp.arctan2(sine, w) / sine) * u


def angle(rotation: ArrayLike) -> Float[Array, ""]:
    """Angle of a rotation [rad], in [0, pi]; `angle(P.T @ Q)` is the distance between two rotations.

    It has a kink at the identity, where its derivative is given as 0, and at half turns, where it is
    that of one side.

    Args:
        rotation: (3, 3).

    Raises:
        ValueError: if `rotation` is not of shape (3, 3).
    """
    q = rotations.unit_quaternion(_floats(rotation, "rotation", (3, 3)))
    return 2 * jnp.arctan2(rotations.length(q[1:]), q[0])


def left_jacobian(vector: ArrayLike) -> Float[Array, "3 3"]:
    """Matrix `J` of the derivative of `exp`: `exp(v + dv) = exp(J dv) exp(v)` to first order in `dv`.

    `J(v) = I + (1 - cos t) / t^2 hat(v) + (t - sin t) / t^3 hat(v)^2` with `t = |v|`. Its transpose
    `J(-v)` is the right Jacobian: body angular velocity per rate of `v`.

    Args:
        vector: (3,) rotation vector [rad].

    Raises:
        ValueError: if `vector` is not of shape (3,).
    """
    v = _floats(vector, "vector", (3,))
    square = jnp.sum(v * v)
    return (
        jnp.eye(3, dtype=v.dtype)
        + rotations.stumpff(2, square) * rotations.hat(v)
        + rotations.stumpff(3, square) * rotations.hat_squared(v)
    )


def to_quaternion(rotation: ArrayLike) -> Float[Array, "4"]:
    """Unit quaternion (w, x, y, z) of a rotation, with w >= 0.

    For a half turn (w = 0) the largest of x, y, z is positive.

    Args:
        rotation: (3, 3).

    Raises:
        ValueError: if `rotation` is not of shape (3, 3).
    """
    return rotations.unit_quaternion(_floats(rotation, "rotation", (3, 3)))


def from_quaternion(quaternion: ArrayLike) -> Float[Array, "3 3"]:
    """Rotation of a quaternion (w, x, y, z), which is normalised first; all zeros give NaN.

    Args:
        quaternion: (4,), of any length but zero; `q` and `-q` are the same rotation.

    Raises:
        ValueError: if `quaternion` is not of shape (4,).
    """
    q, _ = rotations.scale_to_one(_floats(quaternion, "quaternion", (4,)))
    return rotations.matrix_of_quaternion(q[0], q[1:], jnp.sum(q * q))


def to_euler_zxz(rotation: ArrayLike) -> Float[Array, "3"]:
    """Angles (a, b, c) [rad] of `R = Rz(a) Rx(b) Rz(c)`; a and c in (-pi, pi], b in [0, pi].

    Where b is 0 or pi only a + c or a - c is defined; then c = 0. The angles jump there, so the
    derivative is only finite: the one along rotations about z, on which they are smooth.

    Args:
        rotation: (3, 3).

    Raises:
        ValueError: if `rotation` is not of shape (3, 3).
    """
    w, x, y, z = rotations.unit_quaternion(_floats(rotation, "rotation", (3, 3)))
    # (w, z) = cos(b/2) (cos, sin)((a + c)/2)  and  (x, y) = sin(b/2) (cos, sin)((a - c)/2)
    cosine, half_sum = rotations.polar(w, z)
    sine, half_difference = rotations.polar(x, y)
    half_difference = jnp.where(sine == 0, half_sum, half_difference)
    half_sum = jnp.where(cosine == 0, half_difference, half_sum)
    a, c = rotations.wrap(half_sum + half_difference), rotations.wrap(half_sum - half_difference)
    return jnp.stack([a, 2 * jnp.arctan2(sine, cosine), c])


def from_euler_zxz(angles: ArrayLike) -> Float[Array, "3 3"]:
    """Rotation `Rz(a) Rx(b) Rz(c)`: about z, then about the new x, then about the newest z.

    Args:
        angles: (3,) the angles (a, b, c) [rad], of any size.

    Raises:
        ValueError: if `angles` is not of shape (3,).
    """
    angles = _floats(angles, "angles", (3,))
    (ca, cb, cc), (sa, sb, sc) = jnp.cos(angles), jnp.sin(angles)
    rows = (
        [ca * cc - sa * cb * sc, -ca * sc - sa * cb * cc, sa * sb],
        [sa * cc + ca * cb * sc, -sa * sc + ca * cb * cc, -ca * sb],
        [sb * sc, sb * cc, cb],
    )
    return jnp.stack([*rows[0], *rows[1], *rows[2]]).reshape(3, 3)


def interpolate(start: ArrayLike, end: ArrayLike, fraction: ArrayLike | float | int) -> Float[Array, "3 3"]:
    """Rotation a `fraction` of the way along the shortest turn: `start exp(fraction log(start^T end))`.

    Args:
        start: (3, 3), reached at fraction 0; it decides the dtype.
        end: (3, 3), reached at fraction 1.
        fraction: scalar; outside [0, 1] the turn is continued.

    Raises:
        ValueError: if an argument has the wrong shape.
    """
    start = _floats(start, "start", (3, 3))
    end = _floats(end, "end", (3, 3)).astype(start.dtype)
    part = _floats(fraction, "fraction", ()).astype(start.dtype)
    turn = jnp.matmul(start.T, end, precision="highest")
    return jnp.matmul(start, exp(part * log(turn)), precision="highest")


def random(key: jax.Array, dtype: type | np.dtype = float) -> Float[Array, "3 3"]:
    """Rotation drawn from the uniform (Haar) distribution.

    Args:
        key: a key of `jax.random`.
        dtype: of the result; JAX's default float if not given.

    Raises:
        ValueError: if it is no key.
    """
    check_key("key", key)
    return from_quaternion(jax.random.normal(key, (4,), dtype))


def _floats(value: ArrayLike | float | int, name: str, shape: tuple[int, ...]) -> jax.Array:
    """Return `value` as a floating array, or raise a ValueError that names it."""
    refuse_lookalikes(name, value)
    try:
        array = jnp.asarray(value)
    except (TypeError, ValueError, ArithmeticError) as error:
        raise ValueError(f"`{name}` must be an array of numbers of shape {shape}; got {shorten(value)}.") from error
    if array.shape != shape:
        raise ValueError(f"`{name}` has shape {array.shape}; it must be {shape}.")
    if jnp.issubdtype(array.dtype, jnp.complexfloating):
        raise ValueError(f"`{name}` has dtype {array.dtype}; it must be real.")
    if is_concrete(array) and np.isnan(np.asarray(array)).any():
        raise ValueError(f"`{name}` has an entry that is not a number: {shorten(np.asarray(array).tolist())}.")
    return array if jnp.issubdtype(array.dtype, jnp.floating) else array.astype(float)

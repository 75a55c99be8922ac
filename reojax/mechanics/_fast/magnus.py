"""From omega at the nodes of a step to the rotation over the step: `R' = R hat(omega)`, by eight Gauss nodes a step.

The equation is linear, so all nodes of all steps are evaluated beforehand, at once. With Gauss nodes s_i in
a step and time scaled to it, three changes of frame make what is left to integrate smaller and smaller:

1. Mean: with `wbar` the mean of omega over the step, `R = exp(wbar / 2) Q exp((s - 1/2) wbar)` leaves
   `Q' = Q hat(u)`,   `u = exp((s - 1/2) wbar) (omega - wbar)`.
2. Fer (F. Fer, Bull. Acad. Roy. Belg. 44, 818-829, 1958): with `U(s)` the integral of u from 0 to s,
   `Q = P exp(U(s))` leaves `P' = P hat(v)`, `v = (exp(U) - J(U)) u` with J the left Jacobian of exp: the
   commutator `U x u / 2` and beyond, of second order in u.
3. Magnus: `P(1) = exp(m_0 + (m_0 x m_1 + m_1 x m_2 + ...) / 2)`, with m_n the integral of v times the n-th
   Legendre polynomial: the second term of the Magnus series, half the integral of `V x v`.

The rotation over the step is `exp(wbar / 2) P(1) exp(U(1)) exp(wbar / 2)`. Integrals are products with
constant 8x8 matrices; on CPU a matrix product is also what makes XLA store its operand once instead of
computing it again for every reader.
"""

from collections.abc import Callable
from itertools import pairwise
from math import factorial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from reojax._internal.quaternions import product
from reojax.mechanics._fast.materialize import materialize
from reojax.mechanics._fast.nodes import LEGENDRE, NODES, WEIGHTS, per_step
from reojax.mechanics._fast.quaternions import Quaternion, Triple
from reojax.mechanics._fast.scalar import cross, dot, mul, plus, scale
from reojax.mechanics._fast.sincos import horner, sincos

_MOMENTS = WEIGHTS[:, None] * LEGENDRE
"""values (steps, 8) @ _MOMENTS = integrals of the values times the Legendre polynomials."""
_USED = 6
"""Moments that the Magnus series uses; a product with all eight is faster than with six."""
_SHARES = WEIGHTS[None, :]
"""values (steps, 1) @ _SHARES = their part at each node of a mean over the step."""
_MEAN_AT_NODES = np.repeat(WEIGHTS[:, None], len(NODES), axis=1)


def _running_integral() -> np.ndarray:
    legendre = np.polynomial.legendre
    antiderivatives = [legendre.legval(2 * NODES - 1, legendre.legint(row, lbnd=-1)) for row in np.eye(len(NODES))]
    return 0.5 * np.linalg.solve(LEGENDRE.T, np.array(antiderivatives))


_INTEGRAL = _running_integral()
"""values (steps, 8) @ _INTEGRAL = integrals of the values from the step's start to each node."""

_COS0 = tuple((-1) ** k / factorial(2 * k) for k in range(8))
_SIN1 = tuple((-1) ** k / factorial(2 * k + 1) for k in range(8))  # sin t / t in t^2
_COS2 = tuple((-1) ** k / factorial(2 * k + 2) for k in range(8))  # (1 - cos t) / t^2
_SIN3 = tuple((-1) ** k / factorial(2 * k + 3) for k in range(8))  # (t - sin t) / t^3
_FER_1 = tuple(a - b for a, b in zip(_SIN1, _COS2, strict=True))
_FER_2 = tuple(a - b for a, b in zip(_COS2, _SIN3, strict=True))
_SERIES_END = 10.0
"""Angles within a step stay below this root (180 degrees) or the step is too long for eight nodes anyway."""


def _spread(values: Triple, matrix: np.ndarray) -> Triple:
    x, y, z = (per_step(v, matrix).reshape(-1) for v in values)
    return x, y, z


def _moments(values: Triple, count: int) -> list[Triple]:
    """Integrals over each step of three arrays of nodes, times the first Legendre polynomials."""
    x, y, z = (per_step(v, _MOMENTS[:, :1] if count == 1 else _MOMENTS) for v in values)
    return [tuple(jax.lax.index_in_dim(v, n, axis=1, keepdims=False) for v in (x, y, z)) for n in range(count)]


class Step(NamedTuple):
    """Rotations over steps and inside them; `R(s) = half @ inside(s)` from a step's start, all unit quaternions."""

    rotation: Quaternion
    """Over the whole step, four arrays (steps,)."""
    half: Quaternion
    """`exp(wbar / 2)`, four arrays (steps,)."""
    inside: Callable[[Triple], Triple]
    """Turns vectors at the nodes by `P(s) exp(U(s)) exp((s - 1/2) wbar)`, keeping what is in between."""
    back: Callable[[Triple], Triple]
    """Transpose of the mean over each step of `inside`: vectors (steps,) to vectors at the nodes."""


def step_rotations(omega: Triple) -> Step:
    """Solve `R' = R hat(omega)` over each step.

    Args:
        omega: angular velocity times the step's duration at the nodes of all steps, three arrays (steps * 8,).
    """
    s = jnp.asarray(np.tile(NODES - 0.5, omega[0].shape[0] // len(NODES)), omega[0].dtype)
    # 1. Mean: u = exp((s - 1/2) wbar) (omega - wbar)
    mean = _spread(omega, _MEAN_AT_NODES)
    u = materialize(_rotate(scale(s, mean), plus(omega, scale(-1, mean))))
    # 2. Fer: U, the running integral of u, and v = (exp(U) - J(U)) u
    turned = _spread(u, _INTEGRAL)
    v = materialize(_fer(u, turned))
    # 3. Magnus: m_0 + (m_0 x m_1 + m_1 x m_2 + ...) / 2
    m = _moments(v, _USED)
    first = m[0]
    for a, b in pairwise(m):
        first = plus(first, scale(0.5, cross(a, b)))
    # all together: exp(wbar / 2) P(1) exp(U(1)) exp(wbar / 2)
    half = materialize(_exp(scale(0.5, _moments(omega, 1)[0])))
    inner = materialize(product(_exp_small(first), _exp_small(_moments(u, 1)[0])))
    rotation = materialize(product(product(half, inner), half))

    def turns() -> tuple[Triple, ...]:
        # exp((s - 1/2) wbar), then exp(U), then P to first order
        return scale(s, mean), turned, _spread(v, _INTEGRAL)

    def inside(vectors: Triple) -> Triple:
        for turn in turns():
            vectors = materialize(_rotate(turn, vectors))
        return vectors

    def back(vectors: Triple) -> Triple:
        vectors = materialize(_spread(vectors, _SHARES))  # of a mean over the step
        for turn in reversed(turns()):
            vectors = _rotate(scale(-1, turn), vectors)
        return materialize(vectors)

    return Step(rotation, half, inside, back)


def mean_over_step(values: Triple) -> Triple:
    """Mean over each step, arrays (steps,), of three arrays of nodes."""
    return _moments(values, 1)[0]


def _rotate(by: Triple, vectors: Triple) -> Triple:
    """Turn vectors by rotation vectors below a half turn: `v + sinc b x v + cosc b x (b x v)`, by power series."""
    square = jnp.minimum(dot(by, by), _SERIES_END)
    p = cross(by, vectors)
    return plus(vectors, plus(scale(horner(_SIN1, square), p), scale(horner(_COS2, square), cross(by, p))))


def _fer(u: Triple, turned: Triple) -> Triple:
    """`(exp(U) - J(U)) u`: the power series of both, less each other, in `U x u` and `U x (U x u)`."""
    square = jnp.minimum(dot(turned, turned), _SERIES_END)
    p = cross(turned, u)
    return plus(scale(horner(_FER_1, square), p), scale(horner(_FER_2, square), cross(turned, p)))


def _exp_small(vector: Triple) -> Quaternion:
    """Quaternion of a rotation vector below a turn, by power series."""
    square = jnp.minimum(0.25 * dot(vector, vector), _SERIES_END)
    return horner(_COS0, square), *scale(mul(0.5, horner(_SIN1, square)), vector)


def _exp(vector: Triple) -> Quaternion:
    """Quaternion of a rotation vector of any length."""
    square = 0.25 * dot(vector, vector)  # of half the angle
    small = square < 1e-4
    # closed form, its argument safe where it is not read
    angle = jnp.sqrt(jnp.where(small, 1.0, square))
    s, c = sincos(angle)
    # power series near zero
    near = jnp.where(small, square, 0.0)
    k = 0.5 * jnp.where(small, horner(_SIN1[:4], near), s / angle)
    return jnp.where(small, horner(_COS0[:4], near), c), *scale(k, vector)

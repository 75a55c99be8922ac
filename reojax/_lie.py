"""Orientation by time, on the rotation group: `R' = R hat(a(t) + M(t) R^T H)` with a constant vector `H`.

That is a free-floating robot whose joints are driven: `M = A^-1` and `a = A^-1 B theta_dot`. A Runge-Kutta
method of sixth order in seven stages (J. C. Butcher, J. Austral. Math. Soc. 4, 1964) on the rotation vector
of each step (H. Munthe-Kaas, Appl. Numer. Math. 29, 1999), so that R stays a rotation to rounding.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._arrays import Array

NODES = (0.0, 1 / 3, 1 / 2, 2 / 3, 1.0)
"""Shares of a step at which `a` and `M` are needed."""
_NODE = (0, 1, 3, 1, 2, 2, 4)
"""Node of each stage."""
_STAGES = (
    (),
    (1 / 3,),
    (0.0, 2 / 3),
    (1 / 12, 1 / 3, -1 / 12),
    (-1 / 16, 9 / 8, -3 / 16, -3 / 8),
    (0.0, 9 / 8, -3 / 8, -3 / 4, 1 / 2),
    (9 / 44, -9 / 11, 63 / 44, 18 / 11, 0.0, -16 / 11),
)
_WEIGHTS = (11 / 120, 0.0, 27 / 40, 27 / 40, -4 / 15, -4 / 15, 11 / 120)
_SERIES = (1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160)
"""Of `(1 - x/2 cot(x/2)) / x^2` in powers of `x^2`."""


def orientations(
    length: Float[Array, " s"],
    own: Float[Array, "s 5 3"],
    mobility: Float[Array, "s 5 3 3"],
    momentum: Float[Array, "3"],
) -> Float[Array, "s+1 3 3"]:
    """Rotations from the identity on, at the ends of all steps.

    Args:
        length: (s,) durations of the steps [s].
        own: (s, 5, 3) `a` at the nodes of each step.
        mobility: (s, 5, 3, 3) `M` at the nodes of each step.
        momentum: (3,) `H`.
    """

    def step(rotation: Array, inputs: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        h, a, m = inputs
        body = _apply(rotation.T, momentum)
        slopes: list[Array] = []
        for node, row in zip(_NODE, _STAGES, strict=True):
            u = h * _mixed(row, slopes)
            omega = a[node] + _apply(m[node], _apply(so3.exp(-u), body))
            slopes.append(_untwisted(u, omega))
        turn = so3.exp(h * _mixed(_WEIGHTS, slopes))
        rotation = jnp.matmul(rotation, turn, precision="highest")
        return rotation, rotation

    first = jnp.eye(3, dtype=own.dtype)
    _, rest = jax.lax.scan(step, first, (length, own, mobility))
    return jnp.concatenate([first[None], rest])


def _untwisted(u: Array, omega: Array) -> Array:
    """Rate of the rotation vector `u` of `exp(hat(u))` that turns at `omega`, in the turned frame."""
    square = u @ u
    factor = jnp.polyval(jnp.asarray(_SERIES[::-1], u.dtype), square)
    once = jnp.cross(u, omega)
    return omega + 0.5 * once + factor * jnp.cross(u, once)


def _mixed(weights: tuple[float, ...], slopes: list[Array]) -> Array:
    total = jnp.zeros(3, slopes[0].dtype if slopes else None)
    for weight, slope in zip(weights, slopes, strict=True):
        total = total + weight * slope
    return total


def _apply(matrix: Array, vector: Array) -> Array:
    return jnp.matmul(matrix, vector, precision="highest")


def step_nodes(samples: int) -> np.ndarray:
    """(samples, 5) shares of a piece at the nodes of its equal steps."""
    return (np.arange(samples)[:, None] + np.array(NODES)) / samples

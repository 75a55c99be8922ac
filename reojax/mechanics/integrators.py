"""Orientation by time, on the rotation group: `R' = R hat(a(t) + M(t) R^T H)` with a constant vector `H`.

That is a free-floating robot whose joints are driven: `M = A^-1` and `a = A^-1 B theta_dot`. A Runge-Kutta
method of sixth order in seven stages (J. C. Butcher, J. Austral. Math. Soc. 4, 1964) on the rotation vector
of each step (H. Munthe-Kaas, Appl. Numer. Math. 29, 1999), so that R stays a rotation to rounding.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array

NODES = (0.0, 1 / 3, 1 / 2, 2 / 3, 1.0)
"""Shares of a step at which `a` and `M` are needed."""
_NODE = np.array([0, 1, 3, 1, 2, 2, 4])
"""Node of each stage."""
_STAGES = np.array(
    [
        [0, 0, 0, 0, 0, 0, 0],
        [1 / 3, 0, 0, 0, 0, 0, 0],
        [0, 2 / 3, 0, 0, 0, 0, 0],
        [1 / 12, 1 / 3, -1 / 12, 0, 0, 0, 0],
        [-1 / 16, 9 / 8, -3 / 16, -3 / 8, 0, 0, 0],
        [0, 9 / 8, -3 / 8, -3 / 4, 1 / 2, 0, 0],
        [9 / 44, -9 / 11, 63 / 44, 18 / 11, 0, -16 / 11, 0],
    ]
)
_WEIGHTS = np.array([11 / 120, 0, 27 / 40, 27 / 40, -4 / 15, -4 / 15, 11 / 120])
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

    stages, weights = jnp.asarray(_STAGES, own.dtype), jnp.asarray(_WEIGHTS, own.dtype)

    def step(rotation: Array, inputs: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        h, a, m = inputs
        body = _apply(rotation.T, momentum)

        def stage(slopes: jax.Array, inputs: Any) -> tuple[jax.Array, None]:
            index, row, a, m = inputs
            u = h * (row @ slopes)
            omega = a + _apply(m, _apply(so3.exp(-u), body))
            return slopes.at[index].set(_untwist(u, omega)), None

        every = (jnp.arange(len(_NODE)), stages, a[_NODE], m[_NODE])
        slopes, _ = jax.lax.scan(stage, jnp.zeros((len(_NODE), 3), own.dtype), every)
        turn = so3.exp(h * (weights @ slopes))
        rotation = jnp.matmul(rotation, turn, precision="highest")
        return rotation, rotation

    first = jnp.eye(3, dtype=own.dtype)
    _, rest = jax.lax.scan(step, first, (length, own, mobility))
    return jnp.concatenate([first[None], rest])


def _untwist(u: Array, omega: Array) -> Array:
    """Rate of the rotation vector `u` of `exp(hat(u))` that turns at `omega`, in the turned frame."""
    square = u @ u
    factor = jnp.polyval(jnp.asarray(_SERIES[::-1], u.dtype), square)
    once = jnp.cross(u, omega)
    return omega + 0.5 * once + factor * jnp.cross(u, once)


def _apply(matrix: Array, vector: Array) -> Array:
    return jnp.matmul(matrix, vector, precision="highest")


def step_nodes(samples: int) -> np.ndarray:
    """(samples, 5) shares of a piece at the nodes of its equal steps."""
    return (np.arange(samples)[:, None] + np.array(NODES)) / samples


GAUSS = (0.5 - 15**0.5 / 10, 0.5, 0.5 + 15**0.5 / 10)
"""Shares of a step at which `end_rotation` needs the angular velocity."""


def end_rotation(length: Float[Array, " s"], omega: Float[Array, "s 3 3"]) -> Float[Array, "3 3"]:
    """Rotation from the identity to the end of all steps, of an angular velocity that does not depend on it.

    All steps at once: Magnus's expansion to sixth order (S. Blanes et al., BIT 40, 2000), then their product in pairs.

    Args:
        length: (s,) durations of the steps [s].
        omega: (s, 3, 3) angular velocity at the nodes `GAUSS` of each step, one in each row [rad/s].
    """
    first, middle, last = (length[:, None] * omega[:, i] for i in range(3))
    a1, a2, a3 = middle, 15**0.5 / 3 * (last - first), 10 / 3 * (last - 2 * middle + first)
    c1 = jnp.cross(a2, a1)
    c2 = -jnp.cross(2 * a3 + c1, a1) / 60
    vector = a1 + a3 / 12 + jnp.cross(a2 + c2, -20 * a1 - a3 + c1) / 240
    turn = jax.vmap(so3.exp)(vector)
    while turn.shape[0] > 1:
        if turn.shape[0] % 2:
            turn = jnp.concatenate([turn, jnp.eye(3, dtype=turn.dtype)[None]])
        turn = jnp.matmul(turn[::2], turn[1::2], precision="highest")
    return turn[0]

"""Runge-Kutta methods on the rotation group: `R' = R hat(omega(R, y))`, `y' = f(R, y)`.

An explicit method for the rotation vector of each step, whose rate is `dexp^-1` of omega, and for the further state y
beside it (H. Munthe-Kaas, Appl. Numer. Math. 29, 1999), so that R stays a rotation to rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array


class Tableau(NamedTuple):
    """An explicit Runge-Kutta method (J. C. Butcher)."""

    nodes: tuple[float, ...]
    """Shares of a step at which the right side is evaluated, each once."""
    node: tuple[int, ...]
    """(s,) which of the nodes each stage is at."""
    stages: np.ndarray
    """(s, s) what each stage takes of the slopes before it."""
    weights: np.ndarray
    """(s,) of the slopes in the step."""


RK4 = Tableau(
    nodes=(0.0, 1 / 2, 1.0),
    node=(0, 1, 1, 2),
    stages=np.diag([0.5, 0.5, 1.0], -1),
    weights=np.array([1, 2, 2, 1]) / 6,
)
"""The classical method of fourth order."""

RK6 = Tableau(
    nodes=(0.0, 1 / 3, 1 / 2, 2 / 3, 1.0),
    node=(0, 1, 3, 1, 2, 2, 4),
    stages=np.array(
        [
            [0, 0, 0, 0, 0, 0, 0],
            [1 / 3, 0, 0, 0, 0, 0, 0],
            [0, 2 / 3, 0, 0, 0, 0, 0],
            [1 / 12, 1 / 3, -1 / 12, 0, 0, 0, 0],
            [-1 / 16, 9 / 8, -3 / 16, -3 / 8, 0, 0, 0],
            [0, 9 / 8, -3 / 8, -3 / 4, 1 / 2, 0, 0],
            [9 / 44, -9 / 11, 63 / 44, 18 / 11, 0, -16 / 11, 0],
        ]
    ),
    weights=np.array([11 / 120, 0, 27 / 40, 27 / 40, -4 / 15, -4 / 15, 11 / 120]),
)
"""Sixth order in seven stages (J. C. Butcher, J. Austral. Math. Soc. 4, 1964)."""

_SERIES = (1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160)
"""Of `(1 - x/2 cot(x/2)) / x^2` in powers of `x^2`."""

Rates = Callable[[Array, Any, Any], tuple[Array, Any]]
"""From rotation, state and what belongs to the node to the angular velocity (body frame) and the state's rate."""


def runge_kutta_step(
    method: Tableau, rates: Rates, h: Array, rotation: Float[Array, "3 3"], state: Any, at_nodes: Any = None
) -> tuple[jax.Array, Any]:
    """Rotation and state after a step of duration `h`.

    Args:
        method: the tableau.
        rates: the right side.
        h: the step [s].
        rotation: (3, 3) at the start.
        state: a tree of arrays at the start.
        at_nodes: a tree of arrays whose first axis is that of `method.nodes`; `rates` gets the entry of its node.
    """
    count, dtype = len(method.node), rotation.dtype
    start = (jnp.zeros(3, dtype), jax.tree.map(jnp.asarray, state))  # rotation vector from the start, and y

    def advance(part: jax.Array, slopes: Any) -> Any:
        return jax.tree.map(lambda y, k: y + h * jnp.tensordot(part, k, 1, precision="highest"), start, slopes)

    def turn(u: jax.Array) -> jax.Array:
        return jnp.matmul(rotation, so3.exp(u), precision="highest")

    def stage(slopes: Any, inputs: Any) -> tuple[Any, None]:
        index, part, node = inputs
        u, y = advance(part, slopes)  # where this stage looks: what the earlier slopes make of the start
        omega, slope = rates(turn(u), y, node)
        return jax.tree.map(lambda all_, k: all_.at[index].set(k), slopes, (_dexp_inverse(u, omega), slope)), None

    none_yet = jax.tree.map(lambda y: jnp.zeros((count, *y.shape), y.dtype), start)
    chosen = jax.tree.map(lambda leaf: leaf[np.array(method.node)], at_nodes)
    every = (jnp.arange(count), jnp.asarray(method.stages, dtype), chosen)
    slopes, _ = jax.lax.scan(stage, none_yet, every)  # a loop: one stage to compile
    # the step: R exp(u), so that R stays a rotation
    u, y = advance(jnp.asarray(method.weights, dtype), slopes)
    return turn(u), y


def _dexp_inverse(u: Array, omega: Array) -> Array:
    """Rate of the rotation vector `u` of `exp(hat(u))` that turns at `omega`, in the turned frame."""
    factor = jnp.polyval(jnp.asarray(_SERIES[::-1], u.dtype), u @ u)
    once = jnp.cross(u, omega)
    return omega + 0.5 * once + factor * jnp.cross(u, once)


def orientations(
    length: Float[Array, " s"],
    own: Float[Array, "s 5 3"],
    mobility: Float[Array, "s 5 3 3"],
    momentum: Float[Array, "3"],
) -> Float[Array, "s+1 3 3"]:
    """Rotations from the identity on, at the ends of all steps, of `R' = R hat(a + M R^T H)`, by `RK6`.

    That is a free-floating robot whose joints are driven: `M = A^-1`, `a = A^-1 B theta_dot`, `H` its angular momentum.

    Args:
        length: (s,) durations of the steps [s].
        own: (s, 5, 3) `a` at the nodes of each step, `step_nodes`.
        mobility: (s, 5, 3, 3) `M` likewise.
        momentum: (3,) `H`.
    """

    def rates(rotation: Array, _: Any, node: tuple[Array, Array]) -> tuple[Array, tuple[()]]:
        a, m = node
        return a + _apply(m, _apply(rotation.T, momentum)), ()

    def step(rotation: Array, inputs: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        h, *nodes = inputs
        rotation, _ = runge_kutta_step(RK6, rates, h, rotation, (), tuple(nodes))
        return rotation, rotation

    first = jnp.eye(3, dtype=own.dtype)
    _, rest = jax.lax.scan(step, first, (length, own, mobility))
    return jnp.concatenate([first[None], rest])


def _apply(matrix: Array, vector: Array) -> Array:
    return jnp.matmul(matrix, vector, precision="highest")


def step_nodes(samples: int) -> np.ndarray:
    """(samples, 5) shares of a piece at the nodes of its equal steps of `RK6`."""
    return (np.arange(samples)[:, None] + np.array(RK6.nodes)) / samples

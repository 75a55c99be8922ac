"""Where a smooth joint motion with angular momentum ends, and how the end turns with its shape.

A motion is a spline of least jerk, at rest at both ends, through points at equal times: linear in these points. Its end
comes from `R' = R hat(A^-1 (B theta' + R^T H))` (`reojax.mechanics.integrators`), the derivative from the first
variation (`reojax.mechanics.variation`): one sum over the nodes, however many points there are.
"""

from __future__ import annotations

from functools import cache, partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array
from reojax._internal.linalg import solve_symmetric3
from reojax.mechanics.integrators import orientations, step_nodes
from reojax.mechanics.momentum import momentum_matrices
from reojax.mechanics.variation import Instant, instant, turn_of_instant
from reojax.robot import Robot


class Basis(NamedTuple):
    """Splines of p pieces by their p + 1 points, over a duration of 1."""

    coefficients: np.ndarray
    """(p, 6, p + 1) of the powers of the time since each piece began."""
    stages: np.ndarray
    """(s, 5, 2, p + 1) value and rate at the stages of each step of the integration."""
    nodes: np.ndarray
    """(2 s + 1, 3, p + 1) value, rate and acceleration at both ends and the middle of each step."""
    weights: np.ndarray
    """(2 s + 1,) of Simpson's rule."""


@cache
def basis(pieces: int, steps: int) -> Basis:
    """The splines, and the places where an integration of `steps` steps a piece reads them. NumPy alone.

    Of all curves through the points, at rest at both ends, that of least integrated squared jerk: a quintic spline.
    """
    coefficients = _least_jerk(pieces)
    width = 1 / pieces
    shares = step_nodes(steps) * width  # (steps, 5)
    rows = [_powers(shares.ravel(), order) for order in (0, 1)]
    stages = np.einsum("okp,qpn->qkon", np.stack(rows), coefficients)
    stages = stages.reshape(pieces * steps, 5, 2, pieces + 1)
    inner = np.arange(2 * steps) / (2 * steps) * width
    powers = np.stack([_powers(inner, order) for order in range(3)])
    nodes = np.einsum("okp,qpn->qkon", powers, coefficients).reshape(-1, 3, pieces + 1)
    last = np.stack([_powers(np.array([width]), order)[0] for order in range(3)]) @ coefficients[-1]
    simpson = np.tile([2.0, 4.0], pieces * steps)
    simpson[0] = 1
    return Basis(
        coefficients, stages, np.concatenate([nodes, last[None]]), np.append(simpson, 1) / 6 / (pieces * steps)
    )


def _powers(t: np.ndarray, order: int) -> np.ndarray:
    k = np.arange(6)
    factor = np.ones(6)
    for i in range(order):
        factor = factor * (k - i)
    return factor * t[:, None] ** np.maximum(k - order, 0)


def _least_jerk(pieces: int) -> np.ndarray:
    """Of all curves through the points, at rest at both ends, that of least integrated squared jerk."""
    width = 1 / pieces
    ends = [np.concatenate([_powers(np.array([t]), order) for order in range(3)]) for t in (0.0, width)]
    hermite = np.linalg.inv(np.concatenate(ends))  # coefficients of a piece from values, rates, accelerations
    k = np.arange(3, 6)
    third = k * (k - 1) * (k - 2)
    jerk = np.zeros((6, 6))
    jerk[3:, 3:] = third[:, None] * third[None] * width ** (k[:, None] + k[None] - 5) / (k[:, None] + k[None] - 5)
    form = hermite.T @ jerk @ hermite
    total = np.zeros((3 * pieces + 3, 3 * pieces + 3))
    for q in range(pieces):
        total[3 * q : 3 * q + 6, 3 * q : 3 * q + 6] += form
    free = [3 * q + order for q in range(1, pieces) for order in (1, 2)]
    states = np.zeros((3 * pieces + 3, pieces + 1))
    states[::3] = np.eye(pieces + 1)
    if free:
        size = np.sqrt(np.diag(total)[free])
        even = total[np.ix_(free, free)] / (size[:, None] * size)
        states[free] = np.linalg.solve(even, -(total[free][:, ::3] / size[:, None])) / size[:, None]
    return np.stack([hermite @ states[3 * q : 3 * q + 6] for q in range(pieces)])


def end_of(robot: Robot, points: Float[Array, "p+1 j"], duration: Array, momentum: Array, steps: int) -> Array:
    """Orientation at the ends of all steps (s + 1, 3, 3), base to inertial frame, from the identity.

    `R' = R hat(A^-1 (B theta' + R^T H))` by Runge and Kutta of sixth order (`reojax.mechanics.integrators`). All of
    one dtype, nothing is checked.

    Args:
        robot: the robot.
        points: (p + 1, j) of the spline [rad].
        duration: of the motion [s].
        momentum: (3,) inertial frame [kg m^2/s].
        steps: of each piece, static.
    """
    own = basis(points.shape[0] - 1, steps)
    dtype = points.dtype
    theta = jnp.asarray(own.stages[:, :, 0], dtype) @ points
    rate = jnp.asarray(own.stages[:, :, 1], dtype) @ points / duration

    def rate_terms(theta: Array, rate: Array) -> tuple[Array, Array]:
        A, B = momentum_matrices(robot, theta)
        both = solve_symmetric3(A, jnp.concatenate([(B @ rate)[:, None], jnp.eye(3, dtype=dtype)], axis=1))
        return both[:, 0], both[:, 1:]

    count, joints = own.stages.shape[0], points.shape[1]
    a, m = jax.vmap(rate_terms)(theta.reshape(-1, joints), rate.reshape(-1, joints))
    length = jnp.full(count, 1 / count, dtype) * duration
    return orientations(length, a.reshape(count, 5, 3), m.reshape(count, 5, 3, 3), momentum)


def end_and_slope(
    robot: Robot, points: Float[Array, "p+1 j"], duration: Array, momentum: Array, steps: int
) -> tuple[Float[Array, "s+1 3 3"], Float[Array, "3 p+1 j"]]:
    """Orientations at the ends of all steps, and how the last one turns with the points, inertial frame.

    The slope is that of points that leave both ends of the motion as they are; of the first and last point it means
    nothing.
    """
    own = basis(points.shape[0] - 1, steps)
    dtype = points.dtype
    theta = jnp.asarray(own.nodes[:, 0], dtype) @ points
    rate = jnp.asarray(own.nodes[:, 1], dtype) @ points / duration
    known = jax.vmap(partial(instant, robot))(theta, rate)
    rotation = _by_nodes(known, rate, duration / (own.nodes.shape[0] // 2), momentum)
    half = jax.vmap(lambda a, b: a @ so3.exp(0.5 * so3.log(a.T @ b)))(rotation[:-1], rotation[1:])
    pairs = jnp.concatenate([half, rotation[1:]], axis=1).reshape(-1, 3, 3)
    both = jnp.concatenate([rotation[:1], pairs])
    g, growth = jax.vmap(partial(turn_of_instant, robot), (0, 0, 0, None))(known, rate, both, momentum)
    to_end = _transitions(growth, duration)
    weight = jnp.asarray(own.weights, dtype)[:, None, None] * duration
    slope = jnp.einsum("nai,np->api", weight * (to_end @ g), jnp.asarray(own.nodes[:, 0], dtype))
    return rotation, slope


def _by_nodes(known: Instant, rate: Float[Array, "n j"], length: Array, momentum: Array) -> Float[Array, "s+1 3 3"]:
    """Orientation at the ends of all steps, Runge-Kutta of fourth order on the nodes where the slope is known too."""
    eye = jnp.eye(3, dtype=rate.dtype)

    def rate_terms(A: Array, B: Array, rate: Array) -> Array:
        return solve_symmetric3(A, jnp.concatenate([(B @ rate)[:, None], eye], axis=1))

    both = jax.vmap(rate_terms)(known.A, known.B, rate)
    nodes = jnp.stack([both[:-1:2], both[1::2], both[2::2]], axis=1)

    def step(r: Array, node: Array) -> tuple[Array, Array]:
        def omega(k: int, r: Array) -> Array:
            return node[k, :, 0] + node[k, :, 1:] @ (r.T @ momentum)

        first = omega(0, r)
        second = omega(1, r @ so3.exp(length / 2 * first))
        third = omega(1, r @ so3.exp(length / 2 * second))
        last = omega(2, r @ so3.exp(length * third))
        turn = length / 6 * (first + 2 * second + 2 * third + last) + length**2 / 12 * jnp.cross(first, last)
        after = r @ so3.exp(turn)
        return after, after

    _, found = jax.lax.scan(step, eye, nodes)
    return jnp.concatenate([eye[None], found])


def _transitions(growth: Float[Array, "m 3 3"], duration: Array) -> Float[Array, "m 3 3"]:
    """`Phi(end, s)` at nodes a half step apart: the trapezoid rule, backward from the identity."""
    h = duration / (growth.shape[0] - 1)

    def back(after: Array, pair: tuple[Array, Array]) -> tuple[Array, Array]:
        slope = after @ pair[1]
        before = after + h / 2 * (slope + (after + h * slope) @ pair[0])
        return before, before

    eye = jnp.eye(3, dtype=growth.dtype)
    _, found = jax.lax.scan(back, eye, (growth[:-1], growth[1:]), reverse=True)
    return jnp.concatenate([found, eye[None]])

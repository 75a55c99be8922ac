"""The estimator of `Steering`: an extended Kalman filter on the rotation group (F. L. Markley, JGCD 26, 2003).

It holds the orientation, the angular momentum, a wire's drag and chosen parameters of the robot, and goes along the
joint angles that are read: `R' = R hat(A^-1 (B theta' + R^T H))`, `H' = -drag R omega`.
"""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool

from reojax import so3
from reojax._internal.arrays import Array
from reojax._internal.linalg import solve_symmetric3
from reojax.captures.parameters import Parameter
from reojax.mechanics.momentum import momentum_matrices
from reojax.motion.trajectory import Trajectory
from reojax.robot import Robot
from reojax.steering.readings import SteeringState

_LONGEST = 4e-3
"""Longest step of the integration from one reading to the next [s]."""


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["robot", "trajectory", "noise", "wander"],
    meta_fields=["parameters"],
)
@dataclasses.dataclass(frozen=True, eq=False)
class Model:
    """What the estimator goes by."""

    robot: Robot
    trajectory: Trajectory
    noise: Array
    """Of the read orientation, about each axis [rad]."""
    wander: Array
    """Of the orientation beyond all else [rad/s^(1/2)]."""
    parameters: tuple[Parameter, ...]


def omega_and_slopes(
    robot: Robot, chosen: tuple[Parameter, ...], values: Array, theta: Array, rate: Array, rotation: Array, h: Array
) -> tuple[Array, Array]:
    """Angular velocity of the base `A^-1 (B theta' + R^T H)` [rad/s], and its slopes (3, 4 + q).

    Both in the base frame; slopes by the momentum in the base frame `A^-1 R^T` (3), by the drag (none, 0), and by each
    parameter. Angles and rates (j,) in rad and rad/s, `rotation` (3, 3), `h` (3,) in the inertial frame [kg m^2/s].
    """

    def omega(values: Array) -> tuple[Array, Array]:
        A, B = momentum_matrices(robot_with(robot, chosen, values), theta)
        both = solve_symmetric3(A, jnp.concatenate([(B @ rate + rotation.T @ h)[:, None], rotation.T], axis=1))
        return both[:, 0], both

    if chosen:
        slopes, both = jax.jacfwd(omega, has_aux=True)(values)
    else:
        both = omega(values)[1]
        slopes = jnp.zeros((3, 0), values.dtype)
    return both[:, 0], jnp.concatenate([both[:, 1:], jnp.zeros((3, 1), values.dtype), slopes], axis=1)


def robot_with(robot: Robot, chosen: tuple[Parameter, ...], values: Array) -> Robot:
    """The robot with other values (q,) of the chosen parameters, in their own units."""
    for k, entry in enumerate(chosen):
        robot = entry.put(robot, values[k])
    return robot


def off(model: Model, values: Array) -> Array:
    """How far the parameters (q,) are from what the motion was planned with."""
    return values - jnp.asarray([p.start for p in model.parameters], values.dtype)


class Estimate(NamedTuple):
    """What is believed at one time; the rest is in the state."""

    rotation: Array
    momentum: Array
    covariance: Array


def along(
    model: Model,
    robot: Robot,
    state: SteeringState,
    at: Estimate,
    begin: Array,
    end: Array,
    times: Array,
    offsets: Array,
    spread: bool,
) -> Estimate:
    """The estimate at `end`, along the joints as they were read, with its covariance if `spread`.

    `R' = R hat(omega)` and `H' = -drag R omega` in steps of 4 ms at most, fourth order in the turn; the covariance
    of a left error `exp(e) R` by `P <- F P F^T + Q`, with `e' = R d omega` to first order (Markley 2003).

    Args:
        model: what the estimator goes by.
        robot: with the parameters as they are estimated.
        state: drag and parameters.
        at: the estimate at `begin`.
        begin: time [s].
        end: time, not before `begin` [s].
        times: (n,) when the joints were read [s].
        offsets: (n, j) how far they were from the motion [rad]; between two times by straight lines.
        spread: whether the covariance is carried along, static.
    """
    count = jnp.maximum(jnp.ceil((end - begin) / _LONGEST - 1e-6), 1)
    h = (end - begin) / count
    size = 7 + len(model.parameters)

    def joints(t: Array) -> Array:
        return model.trajectory.at(t).theta + jax.vmap(lambda column: jnp.interp(t, times, column))(offsets.T)

    def step(k: Array, at: Estimate) -> Estimate:
        t = begin + k * h
        first, middle, last = (joints(t + share * h) for share in (0.0, 0.5, 1.0))
        safe = jnp.where(h > 0, h, 1)
        rates = [
            (-3 * first + 4 * middle - last) / safe,
            (last - first) / safe,
            (first - 4 * middle + 3 * last) / safe,
        ]
        start = _rate(robot, first, rates[0], at.rotation, at.momentum)
        turned = at.rotation @ so3.exp(h / 2 * start)
        half, by = omega_and_slopes(model.robot, model.parameters, state.values, middle, rates[1], turned, at.momentum)
        stop = _rate(robot, last, rates[2], at.rotation @ so3.exp(h * half), at.momentum)
        turn = h / 6 * (start + 4 * half + stop) + h * h / 12 * jnp.cross(start, stop)
        spin = turned @ half
        momentum = at.momentum - h * state.drag * spin
        covariance = at.covariance
        if spread:
            onward = jnp.eye(size, dtype=h.dtype)
            seen_momentum = turned @ by[:, :3]  # R A^-1 R^T
            onward = onward.at[:3, :3].add(h * seen_momentum @ so3.hat(at.momentum))
            onward = onward.at[:3, 3:].add(h * turned @ by)
            onward = onward.at[3:6, 6].add(-h * spin)
            covariance = onward @ covariance @ onward.T
            covariance = covariance.at[np.arange(3), np.arange(3)].add(h * model.wander**2)
        return Estimate(at.rotation @ so3.exp(turn), momentum, covariance)

    return jax.lax.fori_loop(0, count.astype(int), step, at)


def _rate(robot: Robot, theta: Array, rate: Array, rotation: Array, momentum: Array) -> Array:
    A, B = momentum_matrices(robot, theta)
    return solve_symmetric3(A, (B @ rate + rotation.T @ momentum)[:, None])[:, 0]


def kalman_update(
    model: Model, state: SteeringState, at: Estimate, seen: Array, fresh: Bool[Array, ""]
) -> tuple[Estimate, Array, Array]:
    """Kalman's correction by one orientation, with drag and parameters; no change where it is not fresh.

    The innovation is `log(seen R^T)`, inertial frame [rad], of covariance `P_ee + noise^2 I`.
    """
    p = at.covariance
    miss = so3.log(seen @ at.rotation.T)
    total = p[:3, :3] + model.noise**2 * jnp.eye(3, dtype=p.dtype)
    gain = jnp.where(fresh, solve_symmetric3(total, p[:3]).T, 0)
    change = gain @ miss
    keep = jnp.eye(p.shape[0], dtype=p.dtype).at[:, :3].add(-gain)
    # Joseph's form: symmetric, positive
    covariance = keep @ p @ keep.T + model.noise**2 * gain @ gain.T
    rotation = so3.exp(change[:3]) @ at.rotation
    found = Estimate(rotation, at.momentum + change[3:6], covariance)
    return found, state.drag + change[6], state.values + change[7:]

"""A motion by time: joints, orientation, torques and what the motors do (thesis 2.4, 1.8).

The joints go as a trajectory says. The base turns as the angular momentum says: its orientation comes from
`omega = A^-1 (B theta_dot + R^T H)` with the momentum `H` constant in inertial space, so nothing can drift.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array, as_numbers, common_float, is_concrete
from reojax._internal.linalg import solve_symmetric3
from reojax.mechanics.dynamics import Load, base_velocity, joint_load
from reojax.mechanics.integrators import GAUSS, end_rotation, orientations, step_nodes
from reojax.mechanics.momentum import momentum_matrices
from reojax.motion.motor import Motor, check_motors, drive, per_joint
from reojax.motion.time_laws import Law
from reojax.motion.trajectory import State, Trajectory, along, polynomial
from reojax.path import Path
from reojax.robot import Robot

DEFAULT_SAMPLES = 128
"""Samples per piece of the trajectory: enough for a share of 1e-10 of the momentum on edges of 270 degrees."""


class Motion(NamedTuple):
    """A motion at `m` samples of time; of the motors only where they were given, else None."""

    time: Float[Array, " m"]
    """Time [s], from 0."""
    theta: Float[Array, "m j"]
    """Joint angles [rad]."""
    theta_dot: Float[Array, "m j"]
    """Joint rates [rad/s]."""
    theta_ddot: Float[Array, "m j"]
    """Joint accelerations [rad/s^2]; where they jump, those that follow."""
    rotation: Float[Array, "m 3 3"]
    """Rotation of the base, base frame to inertial; starts at the identity."""
    omega: Float[Array, "m 3"]
    """Angular velocity of the base, base frame [rad/s]."""
    torque: Float[Array, "m j"]
    """Joint torques at the output side, rotors included, before friction [N m]."""
    motor_speed: Float[Array, "m j"]
    """Speed of each rotor relative to its stator [rad/s]."""
    motor_torque: Float[Array, "m j"] | None = None
    """Torque that each motor's current makes [N m]."""
    current: Float[Array, "m j"] | None = None
    """Current of each motor [A]."""
    voltage: Float[Array, "m j"] | None = None
    """Voltage at each motor [V]."""
    margin: Float[Array, "m j"] | None = None
    """`1 - |voltage| / supply`: distance to the torque-speed line, in stall torques; negative beyond it."""


def simulate(
    robot: Robot,
    path: Path | Trajectory,
    law: Law | str = "quintic",
    *,
    durations: ArrayLike | None = None,
    motors: Motor | Sequence[Motor] | None = None,
    momentum: ArrayLike | None = None,
    samples: int = DEFAULT_SAMPLES,
) -> Motion:
    """Run a path with a time law, or a trajectory, in free fall.

    At zero momentum the rotation along a path is the same by any law (thesis 2.4): it is
    `net_rotation(robot, path)` at the end. With a momentum it is not: a slow motion turns further.

    Args:
        robot: the robot; its rotor inertias and gear ratios hold.
        path: the path in shape space; or a trajectory, which has its own law and durations.
        law: the time law of every edge, or its name.
        durations: (edges,) durations of the edges [s], or one for all.
        motors: motors of the joints, one for all or one for each, for `motor_torque` to `margin`.
        momentum: (3,) total angular momentum about the centre of mass, inertial frame [kg m^2/s]; the base
            frame is aligned with it at the start. Default zero.
        samples: steps of each piece of the trajectory, static: a quintic edge is one piece, a trapezoid's three.
            Sixth order in the step.

    Raises:
        ValueError: if anything does not fit the robot or the path, durations are missing or not positive,
            or `samples` is not a positive integer.
    """
    trajectory = _trajectory(robot, path, law, durations)
    start = as_numbers("momentum", np.zeros(3) if momentum is None else momentum)
    if start.shape != (3,) or (is_concrete(start) and not np.isfinite(start).all()):
        raise ValueError(f"`momentum` is {momentum}; it must be 3 finite numbers.")
    checks.whole("samples", samples)
    motors = None if motors is None else check_motors(motors, robot)
    return _simulate(robot, trajectory, start, motors, int(samples))


def _trajectory(robot: Robot, path: Path | Trajectory, law: Law | str, durations: ArrayLike | None) -> Trajectory:
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    if isinstance(path, Trajectory):
        if durations is not None:
            raise ValueError("`durations` go with a path; a trajectory has its own.")
        trajectory = path
    elif durations is None:
        raise ValueError("`durations` is missing; give seconds for each edge of the path, or one number for all.")
    else:
        trajectory = along(path, law, durations)
    if trajectory.joints != robot.joints:
        raise ValueError(f"`path` moves {trajectory.joints} joints; {robot.name!r} has {robot.joints} joints.")
    return trajectory


@partial(jax.jit, static_argnums=4)
def _simulate(robot: Robot, trajectory: Trajectory, momentum: Array, motors: Motor | None, samples: int) -> Motion:
    dtype = common_float(robot, trajectory, momentum)
    robot, trajectory, momentum = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), (robot, trajectory, momentum))
    rotation, time, state = orientation_along(robot, trajectory, momentum, samples)

    def load_at(theta: Array, theta_dot: Array, theta_ddot: Array, turned: Array) -> Load:
        return joint_load(robot, theta, theta_dot, theta_ddot, momentum=turned.T @ momentum)

    load = jax.vmap(load_at)(*state, rotation)
    motion = Motion(
        time=time,
        theta=state.theta,
        theta_dot=state.theta_dot,
        theta_ddot=state.theta_ddot,
        rotation=rotation,
        omega=load.omega,
        torque=load.torque,
        motor_speed=robot.gear_ratio[None] * state.theta_dot,
    )
    if motors is None:
        return motion
    asked = jax.vmap(partial(drive, robot, per_joint(motors, dtype)))(state.theta_dot, load)
    return motion._replace(motor_torque=asked.torque, current=asked.current, voltage=asked.voltage, margin=asked.margin)


def orientation_along(
    robot: Robot, trajectory: Trajectory, momentum: Float[Array, "3"], samples: int
) -> tuple[Float[Array, "m 3 3"], Float[Array, " m"], State]:
    """Rotations, times and joint states at `samples` equal steps of each piece, and at the end.

    All arrays are of one dtype, and nothing is checked.
    """
    dtype = momentum.dtype
    length = jnp.diff(trajectory.breaks)
    within = jnp.asarray(step_nodes(samples), dtype)[None] * length[:, None, None]
    at_nodes = jax.vmap(jax.vmap(jax.vmap(polynomial, (None, 0)), (None, 0)))
    state = at_nodes(trajectory.coefficients, within)

    def turning(theta: Array, theta_dot: Array) -> tuple[Array, Array]:
        A, B = momentum_matrices(robot, theta)
        both = solve_symmetric3(A, jnp.concatenate([(B @ theta_dot)[:, None], jnp.eye(3, dtype=dtype)], axis=1))
        return both[:, 0], both[:, 1:]

    flat = jax.tree.map(lambda leaf: leaf.reshape(within.size, robot.joints), state)
    own, mobility = jax.vmap(turning)(flat.theta, flat.theta_dot)
    steps = trajectory.pieces * samples
    step = jnp.repeat(length / samples, samples)
    rotation = orientations(step, own.reshape(steps, -1, 3), mobility.reshape(steps, -1, 3, 3), momentum)
    time = jnp.append((trajectory.breaks[:-1, None] + within[:, :, 0]).ravel(), trajectory.breaks[-1])
    sampled = jax.tree.map(lambda leaf: _samples(leaf.reshape(steps, within.shape[2], robot.joints)), state)
    return rotation, time, sampled


def _samples(nodes: Array) -> Array:
    return jnp.concatenate([nodes[:, 0], nodes[-1:, -1]])


def net_rotation_of(robot: Robot, trajectory: Trajectory, samples: int) -> Float[Array, "3 3"]:
    """Net rotation of a trajectory at zero momentum, by `samples` steps of each piece, all at once."""
    length = jnp.diff(trajectory.breaks)
    shares = jnp.asarray((np.arange(samples)[:, None] + np.array(GAUSS)) / samples, length.dtype)
    within = shares[None] * length[:, None, None]
    state = jax.vmap(jax.vmap(jax.vmap(polynomial, (None, 0)), (None, 0)))(trajectory.coefficients, within)
    theta, rate = (leaf.reshape(within.size, robot.joints) for leaf in state[:2])
    omega = jax.vmap(lambda theta, rate: base_velocity(robot, theta, rate))(theta, rate)
    return end_rotation(jnp.repeat(length / samples, samples), omega.reshape(-1, 3, 3))

"""A motion by time: joints, orientation, torques and what the motors do (thesis 2.4, 1.8).

The joints go as a trajectory says. The base turns as the angular momentum says: its orientation comes from
`omega = A^-1 (B theta_dot + R^T H)` with the momentum `H` constant in inertial space. So the momentum cannot drift,
which says nothing of the orientation: how far that can be wrong is `Motion.error`, and steps are chosen by it.
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
from reojax._internal.arrays import Array, as_numbers, cast, common_float, is_concrete
from reojax.mechanics.dynamics import Load, base_velocity, joint_load
from reojax.mechanics.integrators import GAUSS, end_rotation, orientations, step_nodes
from reojax.mechanics.kinematics import kinematics
from reojax.mechanics.momentum import velocity_by_momentum
from reojax.mechanics.own_units import without_names
from reojax.motion._resolution import (
    Resolution,
    error_by_halving,
    fill_up_half,
    orientations_found,
    over_nodes,
    quietly,
    refine,
    spin_bounds,
    start_count,
    status_by_resolution,
    target_error,
    told_by_resolution,
)
from reojax.motion.motor import Motor, check_motors, drive, per_joint
from reojax.motion.time_laws import Law
from reojax.motion.trajectory import State, Trajectory, along, polynomial
from reojax.optimisation.status import converged_by_status, message_of_status
from reojax.path import Path
from reojax.robot import Robot

DEFAULT_SAMPLES = 128
"""Samples per piece of the trajectory: enough for a share of 1e-10 of the momentum on edges of 270 degrees."""
_LEAST = 64
"""Fewest steps of a piece, where they are chosen."""
_ORDER = 6
"""Of the integration."""


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
    error: Float[Array, ""] | None = None
    """Estimate of how far any `rotation` may be wrong by the steps taken, not by the robot's numbers [rad]."""

    value = orientations_found
    """The orientations, under the name that all solvers' results have."""
    status = status_by_resolution
    """Converged where `error` is what steps that are chosen aim at; else out of steps, or not finite."""
    converged = converged_by_status
    """Whether `error` is below 1e-8 rad (1e-4 in float32)."""
    message = message_of_status
    """How it ended, in words."""
    __str__ = told_by_resolution


def simulate(
    robot: Robot,
    path: Path | Trajectory,
    law: Law | str = "quintic",
    *,
    durations: ArrayLike | None = None,
    motors: Motor | Sequence[Motor] | None = None,
    momentum: ArrayLike | None = None,
    samples: int = DEFAULT_SAMPLES,
    substeps: int | None = None,
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
        samples: samples of each piece of the trajectory, static: a quintic edge is one piece, a trapezoid's three.
        substeps: integration steps from one sample to the next, static, of sixth order. Default as many as bring
            `Motion.error` below 1e-8 rad (1e-4 in float32), by how far the robot turns in a step; where numbers are
            traced, as many as make 64 steps of a piece.

    Raises:
        ValueError: if anything does not fit the robot or the path, durations are missing or not positive, `samples` or
            `substeps` is not a positive integer, or the robot spins too fast for any number to come out.

    Warns:
        UserWarning: if the orientation is uncertain by more than 1e-3 rad with all the steps that are taken unasked.
    """
    trajectory = _trajectory(robot, path, law, durations)
    start = as_numbers("momentum", np.zeros(3) if momentum is None else momentum)
    if start.shape != (3,) or (is_concrete(start) and not np.isfinite(start).all()):
        raise ValueError(f"`momentum` is {checks.shorten(momentum)}; it must be 3 finite numbers.")
    samples = checks.whole("samples", samples)
    motors = None if motors is None else check_motors(motors, robot)

    plain = without_names(robot)

    def run(count: int) -> tuple[Motion, Resolution]:
        return _simulate(plain, trajectory, start, motors, samples, count)

    if substeps is not None:
        return quietly(run, checks.whole("substeps", substeps))[0]
    if not is_concrete((robot, trajectory, start, motors)):
        return run(start_count(_LEAST, samples, 0.0))[0]
    longest = float(np.diff(np.asarray(trajectory.breaks, float)).max())
    least, most = spin_bounds(robot, start, longest / samples)
    return refine(
        run,
        first=start_count(_LEAST, samples, most),
        hopeless=least,
        steps=trajectory.pieces * samples,
        order=_ORDER,
        target=target_error(common_float(robot, trajectory, start)),
        what=f"{robot.name!r}",
    )


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


@partial(jax.jit, static_argnums=(4, 5))
def _simulate(
    robot: Robot, trajectory: Trajectory, momentum: Array, motors: Motor | None, samples: int, substeps: int
) -> tuple[Motion, Resolution]:
    dtype = common_float(robot, trajectory, momentum)
    robot, trajectory, momentum = cast((robot, trajectory, momentum), dtype)
    rotation, time, state, resolution = orientation_along(robot, trajectory, momentum, samples, substeps)

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
        error=resolution.error,
    )
    if motors is None:
        return motion, resolution
    asked = jax.vmap(partial(drive, robot, per_joint(motors, dtype)))(state.theta_dot, load)
    driven = {"motor_torque": asked.torque, "current": asked.current, "voltage": asked.voltage, "margin": asked.margin}
    return motion._replace(**driven), resolution


def orientation_along(
    robot: Robot, trajectory: Trajectory, momentum: Float[Array, "3"], samples: int, substeps: int = 1
) -> tuple[Float[Array, "m 3 3"], Float[Array, " m"], State, Resolution]:
    """Rotations, times and joint states at `samples` equal parts of each piece, and at the end; how well resolved.

    All arrays are of one dtype, and nothing is checked.
    """
    dtype = momentum.dtype
    if samples * substeps % 2:  # the error is found by half the steps
        substeps *= 2
    count = samples * substeps
    length = jnp.diff(trajectory.breaks)
    within = jnp.asarray(step_nodes(count), dtype)[None] * length[:, None, None]
    at_nodes = jax.vmap(jax.vmap(jax.vmap(polynomial, (None, 0)), (None, 0)))
    state = at_nodes(trajectory.coefficients, within)

    # omega = A^-1 B theta_dot + A^-1 R^T H at every node: its own part, and what multiplies R^T H
    def turning(theta: Array, theta_dot: Array) -> tuple[Array, Array]:
        return velocity_by_momentum(robot, kinematics(robot, theta), theta_dot)

    flat = jax.tree.map(lambda leaf: leaf.reshape(within.size, robot.joints), state)
    own, mobility = over_nodes(turning, flat.theta, flat.theta_dot)
    steps = trajectory.pieces * count
    step = jnp.repeat(length / count, count)
    own, mobility = own.reshape(steps, -1, 3), mobility.reshape(steps, -1, 3, 3)
    # the same motion by all steps and by half of them, side by side: their distance is the error
    lengths = jnp.stack([step, fill_up_half(2 * step[::2])])
    both_own, both_mobility = (jnp.stack([x, fill_up_half(_coarse(x))]) for x in (own, mobility))
    integrate = jax.vmap(orientations, (0, 0, 0, None))  # one loop, compiled once
    fine, coarse = integrate(lengths, both_own, both_mobility, momentum)
    # bound of the turn in a step, |A^-1 B theta_dot| + |A^-1| |H|
    rate = jnp.sqrt((own**2).sum(-1)) + jnp.sqrt((mobility**2).sum((-1, -2)) * (momentum**2).sum())
    error = error_by_halving(fine, coarse[: steps // 2 + 1], _ORDER)
    resolution = Resolution(error, jax.lax.stop_gradient((step[:, None] * rate).max()))
    time = jnp.append((trajectory.breaks[:-1, None] + within[:, ::substeps, 0]).ravel(), trajectory.breaks[-1])
    shape = (steps, within.shape[2], robot.joints)
    sampled = jax.tree.map(lambda leaf: _samples(leaf.reshape(shape), substeps), state)
    return fine[::substeps], time, sampled, resolution


_COARSE = ((0, 0), (0, 3), (0, 4), (1, 1), (1, 4))
"""Of each node of a step of twice the length: which of the two steps has it, and as which node."""


def _coarse(nodes: Array) -> Array:
    """Nodes of steps of twice the length, (s / 2, 5, ...), out of those of all steps."""
    return jnp.stack([nodes[half::2, node] for half, node in _COARSE], axis=1)


def _samples(nodes: Array, substeps: int) -> Array:
    return jnp.concatenate([nodes[::substeps, 0], nodes[-1:, -1]])


def net_rotation_of(robot: Robot, trajectory: Trajectory, samples: int) -> Float[Array, "3 3"]:
    """Net rotation of a trajectory at zero momentum, by `samples` steps of each piece, all at once."""
    length = jnp.diff(trajectory.breaks)
    shares = jnp.asarray((np.arange(samples)[:, None] + np.array(GAUSS)) / samples, length.dtype)
    within = shares[None] * length[:, None, None]
    state = jax.vmap(jax.vmap(jax.vmap(polynomial, (None, 0)), (None, 0)))(trajectory.coefficients, within)
    theta, rate = (leaf.reshape(within.size, robot.joints) for leaf in state[:2])
    omega = jax.vmap(lambda theta, rate: base_velocity(robot, theta, rate))(theta, rate)
    return end_rotation(jnp.repeat(length / samples, samples), omega.reshape(-1, 3, 3))

"""Joints under control, in closed loop: PID, alone or on top of precomputed torques (thesis 1.8).

At every sample the controller reads the encoders, which count turns of the motors, and commands torques of the
motors, held until the next sample:

    M = (Kp e + Ki int e + Kd de/dt) / N  (+ the torque that the planned motion takes, precomputed).

Each motor gives what its supply allows at its speed `w`, `|resistance M / k + k w| <= supply`, loses drag and
friction, accelerates its own rotor and drives the joint through the gear, which takes its share. Between samples the
joints obey `forward_dynamics`; the orientation is only observed, it follows from `A omega = B theta_dot + R^T H`, so
that momentum is conserved by construction. Both are integrated by Runge-Kutta steps of order four, on the rotation
vector of each step.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array, as_numbers, cast, common_float, is_concrete
from reojax._internal.result_text import printed_as
from reojax.mechanics.dynamics import joint_load
from reojax.mechanics.integrators import RK4, runge_kutta_step
from reojax.mechanics.own_units import without_names
from reojax.motion.driven_joints import joint_acceleration, saturate
from reojax.motion.motor import Motor, check_motors, drive, per_joint
from reojax.motion.pid import Gains, check_gains
from reojax.motion.trajectory import Trajectory
from reojax.optimisation.status import Status, converged_by_status, message_of_status
from reojax.robot import Robot

COUNTS = 512.0
"""Counts of an encoder to a turn of its motor, before the gear (thesis 2.6)."""
_MOST_SAMPLES = 10**7
_State = tuple[Array, tuple[Array, Array]]
"""Orientation of the base; joint angles and rates."""


class Tracking(NamedTuple):
    """A motion under control, at every sample."""

    time: Float[Array, " m"]
    """Time [s], from 0."""
    planned: Float[Array, "m j"]
    """Joint angles as planned [rad]."""
    theta: Float[Array, "m j"]
    """Joint angles [rad]."""
    theta_dot: Float[Array, "m j"]
    """Joint rates [rad/s]."""
    rotation: Float[Array, "m 3 3"]
    """Orientation of the base; starts at the identity."""
    command: Float[Array, "m j"]
    """Torque that the controller asks of each motor from this sample on [N m]."""
    motor_torque: Float[Array, "m j"]
    """Torque that each motor gives at this sample [N m]."""
    saturated: Bool[Array, "m j"]
    """Whether that is less than is asked for."""

    @property
    def value(self) -> Float[Array, "m j"]:
        """The joint angles, under the name that all solvers' results have."""
        return self.theta

    @property
    def cost(self) -> Float[Array, ""]:
        """Root mean square of what the joints are off the plan [rad]."""
        return jnp.sqrt(((self.theta - self.planned) ** 2).mean())

    @property
    def error(self) -> Float[Array, ""]:
        """Farthest that a joint is off the plan at the end [rad]."""
        return jnp.abs(self.theta[-1] - self.planned[-1]).max()

    @property
    def violation(self) -> Float[Array, ""]:
        """Largest torque that was asked for and that a motor could not give [N m]."""
        return jnp.abs(self.command - self.motor_torque).max()

    @property
    def status(self) -> Int[Array, ""]:
        """Converged where the motors gave all that was asked for; else saturated, or not finite."""
        held = jnp.where(self.saturated.any(), Status.SATURATED, Status.CONVERGED)
        return jnp.where(jnp.isfinite(self.theta).all(), held, Status.NOT_FINITE)

    converged = converged_by_status
    """Whether the motors gave all that was asked for, and all numbers are finite."""
    message = message_of_status
    """How it ended, in words."""
    __str__ = printed_as(
        lambda run: (
            f"{len(run.time)} samples over {float(run.time[-1]):.6g} s, off the plan by "
            f"{float(run.cost):.3g} rad RMS and {float(run.error):.3g} rad at the end; {run.message}"
        ),
        "time",
    )


def track(
    robot: Robot,
    trajectory: Trajectory,
    motors: Motor,
    gains: Gains,
    *,
    feedforward: bool = False,
    sample_time: float = 1e-3,
    counts: float | None = COUNTS,
    settle: float = 0.0,
    momentum: ArrayLike | None = None,
    model: Robot | None = None,
    substeps: int = 4,
) -> Tracking:
    """Run a joint motion under control, in free fall.

    Differentiable in the robot, the trajectory's coefficients, motors, gains and momentum. The derivative of an
    encoder's count is taken as that of what it counts.

    Args:
        robot: the robot.
        trajectory: the planned motion of its joints; its duration must be known, not traced.
        motors: motors of the joints; the robot's rotor inertias and gear ratios hold.
        gains: of the PID controllers.
        feedforward: add the torques that the planned motion takes from the motors.
        sample_time: time between samples of the controller [s].
        counts: counts of the encoders to a turn of the motor; None for perfect ones.
        settle: time to go on after the planned motion's end [s].
        momentum: (3,) total angular momentum, inertial frame [kg m^2/s]; default zero.
        model: the robot that the controller believes in, for the precomputed torques; default the robot itself.
        substeps: Runge-Kutta steps to a sample, static.

    Raises:
        ValueError: if anything does not fit the robot, a time is not positive, or a gain is negative or not finite, or
            if the joints run away until no number comes out.
    """
    _check(robot, trajectory, sample_time=sample_time, counts=counts, settle=settle, substeps=substeps)
    believed = robot if model is None else model
    if not isinstance(believed, Robot) or believed.joints != robot.joints:
        raise ValueError(f"`model` is {checks.shorten(believed)}; it must be a Robot of {robot.joints} joints.")
    motors = check_motors(motors, robot)
    gains = check_gains(gains, robot)
    start = as_numbers("momentum", np.zeros(3) if momentum is None else momentum)
    if start.shape != (3,) or (is_concrete(start) and not np.isfinite(start).all()):
        raise ValueError(f"`momentum` is {checks.shorten(momentum)}; it must be 3 finite numbers.")
    turn = 0.0 if counts is None else 2 * np.pi / counts
    count = np.ceil((float(np.asarray(trajectory.breaks)[-1]) + settle) / sample_time - 1e-9)
    if not count <= _MOST_SAMPLES:
        raise ValueError(
            f"`sample_time` of {sample_time:g} s makes {count:.3g} samples; at most {_MOST_SAMPLES} are run."
        )
    given = (
        without_names(robot),
        without_names(believed),
        trajectory,
        motors,
        gains,
        start,
        sample_time,
        turn,
        feedforward,
    )
    if not is_concrete(given):
        return _track(*given, int(count), int(substeps))
    with jax.debug_nans(False):  # told below
        found = _track(*given, int(count), int(substeps))
    lost = ~np.isfinite(found.theta).all(axis=1) | ~np.isfinite(found.rotation).all(axis=(1, 2))
    if lost.any():
        raise ValueError(
            f"the joints run away under this control, and after {float(found.time[int(np.argmax(lost))]):.4g} s no "
            "number comes out: choose smaller gains, a shorter `sample_time`, or more `substeps`."
        )
    return found


def _check(robot: Robot, trajectory: Trajectory, **numbers: float | None) -> None:
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    if not isinstance(trajectory, Trajectory):
        raise ValueError(f"`trajectory` is a {type(trajectory).__name__}; it must be a Trajectory, as `along` makes.")
    if trajectory.joints != robot.joints:
        raise ValueError(f"`trajectory` moves {trajectory.joints} joints; {robot.name!r} has {robot.joints}.")
    if not is_concrete(trajectory.breaks):
        raise ValueError("`trajectory` has traced durations; the number of samples must be known.")
    for entry, value in numbers.items():
        if value is None and entry == "counts":  # perfect encoders
            continue
        if entry == "substeps":
            checks.whole(entry, value)
        elif entry == "settle":
            checks.number(entry, value, unit="s", least=0.0)
        else:
            checks.positive(entry, value, unit="s" if entry == "sample_time" else "")


@partial(jax.jit, static_argnums=(9, 10))
def _track(
    robot: Robot,
    model: Robot,
    trajectory: Trajectory,
    motors: Motor,
    gains: Gains,
    momentum: Array,
    sample_time: float,
    turn: float,
    feedforward: Array | bool,
    samples: int,
    substeps: int,
) -> Tracking:
    dtype = common_float(robot, trajectory, gains, momentum)
    robot, model, trajectory, gains, momentum = cast((robot, model, trajectory, gains, momentum), dtype)
    motors = per_joint(motors, dtype)
    period = jnp.asarray(sample_time, dtype)
    time = period * jnp.arange(samples + 1, dtype=dtype)
    plan = jax.vmap(trajectory.at)(time)
    forward = jnp.where(feedforward, _precompute(model, motors, trajectory, time, period), 0.0)
    ratio = robot.gear_ratio
    size = jnp.asarray(turn, dtype) / jnp.abs(ratio)

    def step(carry: tuple[Array, ...], inputs: tuple[Array, ...]) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        theta, theta_dot, rotation, integral, last = carry
        wanted, wanted_rate, given = inputs
        # what the encoders tell: the error, its rate by the last sample, its integral
        seen = _count(theta, size)
        error = wanted - seen
        rate = wanted_rate - (seen - last) / period
        summed = integral + period * error
        # M = (Kp e + Ki int e + Kd de/dt) / N, with the precomputed torque
        pid = gains.proportional * error + gains.integral * summed + gains.derivative * rate
        command = pid / ratio + given
        # what the motors can give of it
        torque = saturate(motors, command, ratio * theta_dot)
        saturated = torque != command
        kept = jnp.where(saturated, integral, summed)  # no wind-up

        turned, joints = _hold(robot, motors, command, momentum, (rotation, (theta, theta_dot)), period, substeps)
        return (*joints, turned, kept, seen), (theta, theta_dot, rotation, command, torque, saturated)

    start = plan.theta[0], plan.theta_dot[0], jnp.eye(3, dtype=dtype)
    before = start[0] - period * start[1]  # what was seen one sample earlier
    carry = (*start, jnp.zeros_like(start[0]), before)
    _, (theta, theta_dot, rotation, command, torque, saturated) = jax.lax.scan(
        step, carry, (plan.theta, plan.theta_dot, forward)
    )
    return Tracking(time, plan.theta, theta, theta_dot, rotation, command, torque, saturated)


def _precompute(model: Robot, motors: Motor, trajectory: Trajectory, time: Array, period: Array) -> Array:
    """Torques of the motors (m, j) that the planned motion takes by the model, each for the period from a sample on."""
    middle = time + period / 2  # the command is held for a period
    states = jax.vmap(trajectory.at)(middle)
    torque = jax.vmap(lambda state: drive(model, motors, state.theta_dot, joint_load(model, *state)).torque)(states)
    return jnp.where((middle < trajectory.duration)[:, None], torque, 0.0)


def _hold(
    robot: Robot, motors: Motor, command: Array, momentum: Array, state: _State, period: Array, substeps: int
) -> _State:
    """The base's orientation and the joints one period later, the command held."""

    def rates(rotation: Array, joints: tuple[Array, Array], _: None) -> tuple[Array, tuple[Array, Array]]:
        acceleration, omega = joint_acceleration(robot, motors, command, *joints, rotation.T @ momentum)
        return omega, (joints[1], acceleration)

    def substep(state: _State, _: None) -> tuple[_State, None]:
        return runge_kutta_step(RK4, rates, period / substeps, *state), None

    return jax.lax.scan(substep, state, length=substeps)[0]


def _count(theta: Array, size: Array) -> Array:
    """What encoders tell of joint angles, in counts of that `size`, all if 0; its derivative is that of the angles."""
    count = jnp.where(size > 0, size, 1)
    return theta + jax.lax.stop_gradient(jnp.where(size > 0, count * jnp.round(theta / count) - theta, 0))

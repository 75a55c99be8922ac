"""Least time: how fast the motors can run a motion (thesis 1.8, figure 3.2).

At zero momentum a motion run in `T` times the time takes `T^-2` of the torques at `T^-1` of the speeds. So the
voltage that a motor needs at one instant is `a / T^2 + b / T + c`, with inertia in `a`, drag and induced
voltage in `b`, and friction in `c`; the least `T` for which it stays within the supply, here and in all
slower runs, solves a quadratic equation. The least time of a motion is the largest over its instants.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from reojax._internal import checks
from reojax._internal.arrays import Array, cast, common_float, is_concrete
from reojax._internal.result_text import printed_as
from reojax.collision.refusal import require_clearance
from reojax.mechanics.dynamics import joint_load
from reojax.mechanics.own_units import without_names
from reojax.motion.motor import Motor, check_motors, demand, per_joint
from reojax.motion.time_laws import Law, check_law
from reojax.motion.trajectory import State, Trajectory, along, polynomial
from reojax.optimisation.status import Status, message_of_status
from reojax.path import Path
from reojax.robot import Robot

DEFAULT_SAMPLES = 256
"""Instants per piece of a law at which the motors are looked at."""


FALL = (2 * 2.0 / 9.80665) ** 0.5
"""Time that a fall of 2 m takes, the drop tower's (thesis 1.8) [s]."""
AVAILABLE = FALL - 0.02
"""What is left of it for a motion that starts 0.02 s after the release (thesis 1.8) [s]."""


class LeastTime(NamedTuple):
    """Least durations of a path's edges under a time law, and what sets them."""

    durations: Float[Array, " e"]
    """Least duration of each edge [s]; 0 for one that stays put."""
    duration: Float[Array, ""]
    """Their sum [s]."""
    joint: Int[Array, " e"]
    """The joint that sets it: its motor is at the torque-speed line."""
    place: Float[Array, " e"]
    """When in the edge, as a share of its duration."""
    needs: Float[Array, "e j"]
    """Least duration that each joint's motor alone would allow [s]."""
    clearance: Array | None = None
    """Least distance of the robot's parts along the path, proven [m]; None if it was not asked for."""

    @property
    def value(self) -> Float[Array, " e"]:
        """The durations, under the name that all solvers' results have."""
        return self.durations

    @property
    def cost(self) -> Float[Array, ""]:
        """Their sum [s]."""
        return self.duration

    @property
    def violation(self) -> Float[Array, ""]:
        """How far a motor is beyond its torque-speed line at the samples: 0, as the durations solve for it."""
        return jnp.zeros_like(self.duration)

    @property
    def error(self) -> Float[Array, ""]:
        """What is left of the equation that the durations solve at the samples: 0."""
        return jnp.zeros_like(self.duration)

    @property
    def status(self) -> Int[Array, ""]:
        """Converged; or unreachable, where no time is long enough, which is an error unless numbers are traced."""
        lost = jnp.where(jnp.isnan(self.duration), Status.NOT_FINITE, Status.UNREACHABLE)
        return jnp.where(jnp.isfinite(self.duration), Status.CONVERGED, lost)

    @property
    def converged(self) -> Bool[Array, ""]:
        """Whether the durations are finite."""
        return jnp.isfinite(self.duration)

    message = message_of_status
    """How it ended, in words."""
    __str__ = printed_as(
        lambda found: (
            f"{float(found.duration):.6g} s, of the edges "
            f"{', '.join(f'{float(each):.6g}' for each in found.durations)} s; {found.message}"
        ),
        "duration",
    )


def minimum_time(
    robot: Robot,
    path: Path,
    motors: Motor | Sequence[Motor],
    law: Law | str = "quintic",
    *,
    samples: int = DEFAULT_SAMPLES,
    clearance: float | None = None,
) -> LeastTime:
    """Shortest duration of each edge with every motor within its torque-speed curve at every instant.

    Exact at the samples, and differentiable with respect to robot, path, motors and law. Each edge starts and ends at
    rest, so that edges do not depend on one another. One that stays put takes no time: of a path that does, 0 s.

    Args:
        robot: the robot; its rotor inertias and gear ratios hold.
        path: the path in shape space, one edge or more.
        motors: motors of the joints, one for all or one for each.
        law: the time law of every edge, or its name.
        samples: instants per piece of the law, static.
        clearance: least distance between the robot's parts that the path must keep all along [m]; default not asked.

    Raises:
        ValueError: if anything does not fit the robot, or a supply cannot move its motor at all: it does not
            overcome the friction, so that no time is long enough;
            or the path does not keep the clearance, which is said with the pair and the place.
    """
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    motors = _able(motors, robot)
    proven = None if clearance is None else require_clearance(robot, path, clearance).distance
    law = check_law(law)
    trajectory = along(path, law, 1.0)
    _check_fit(robot, trajectory)
    times, place = _instants(without_names(robot), trajectory, motors, _count(samples))
    needs = times.reshape(path.edges, -1, robot.joints)
    # the slowest instant of each edge, and its joint
    flat = needs.reshape(path.edges, -1)
    worst = jnp.argmax(flat, axis=1)
    share = place.reshape(path.edges, -1) - jnp.arange(path.edges, dtype=place.dtype)[:, None]
    durations = flat.max(axis=1)
    return LeastTime(
        durations=durations,
        duration=durations.sum(),
        joint=worst % robot.joints,
        place=jnp.take_along_axis(share, (worst // robot.joints)[:, None], axis=1)[:, 0],
        needs=needs.max(axis=1),
        clearance=proven,
    )


def minimum_stretch(
    robot: Robot, trajectory: Trajectory, motors: Motor | Sequence[Motor], *, samples: int = DEFAULT_SAMPLES
) -> Float[Array, ""]:
    """Least factor, a scalar without a unit, by which a trajectory's time must be stretched for its motors.

    At zero momentum. Below 1 for one that can be run faster; 0 for one that stays put. Arguments and
    errors as for `minimum_time`.
    """
    motors = _able(motors, robot)
    _check_fit(robot, trajectory)
    return _instants(without_names(robot), trajectory, motors, _count(samples))[0].max()


@partial(jax.jit, static_argnums=3)
def _instants(robot: Robot, trajectory: Trajectory, motors: Motor, samples: int) -> tuple[Array, Array]:
    """Least stretch for each instant and motor, (pieces, samples + 1, j), and the instants' times."""
    dtype = common_float(robot, trajectory, motors)
    robot, trajectory = cast((robot, trajectory), dtype)
    motors = per_joint(motors, dtype)
    time, state = instants(trajectory, samples)

    def least(theta: Array, theta_dot: Array, theta_ddot: Array) -> Array:
        load = joint_load(robot, theta, theta_dot, theta_ddot)
        # a / T^2 + b / T + c is the voltage at T times the duration: both ends of the supply
        a, b, c = demand(robot, motors, theta_dot, load)
        up = _root(motors.supply - c, b.sum(0), a)
        down = _root(motors.supply + c, -b.sum(0), -a)
        return jnp.maximum(up, down)

    return jax.vmap(jax.vmap(least))(*state), time


def instants(trajectory: Trajectory, samples: int) -> tuple[Float[Array, "p m"], State]:
    """Times and joint states at `samples` equal steps of each piece, both ends of the piece included."""
    length = jnp.diff(trajectory.breaks)
    within = length[:, None] * jnp.linspace(0, 1, samples + 1, dtype=length.dtype)[None]
    state = jax.vmap(jax.vmap(polynomial, (None, 0)))(trajectory.coefficients, within)
    return trajectory.breaks[:-1, None] + within, state


def _root(supply: Array, b: Array, a: Array) -> Array:
    """Largest positive T with `supply T^2 = b T + a`, 0 without one; infinite if the supply is not positive."""
    # (b + sqrt(b^2 + 4 supply a)) / (2 supply), safe where there is none
    square = b * b + 4 * supply * a
    real = square > 0
    root = (b + jnp.sqrt(jnp.where(real, square, 1))) / (2 * jnp.where(supply > 0, supply, 1))
    return jnp.where(supply > 0, jnp.where(real & (root > 0), root, 0), jnp.inf)


def _able(motors: Motor | Sequence[Motor], robot: Robot) -> Motor:
    motors = check_motors(motors, robot)
    if is_concrete(motors):
        needed = np.asarray(motors.resistance * motors.friction / motors.torque_constant)
        weak = np.asarray(motors.supply) <= needed
        if weak.any():
            k = int(np.argmax(weak))
            raise ValueError(
                f"motors.supply is {np.asarray(motors.supply)[k]:g} V at joint {k}, too weak to do the move "
                f"in any time: the motor's friction alone takes {needed[k]:.3g} V."
            )
    return motors


def _check_fit(robot: Robot, trajectory: Trajectory) -> None:
    checks.instance("trajectory", trajectory, Trajectory, "`along` or `through` make")
    if trajectory.joints != robot.joints:
        raise ValueError(f"`path` moves {trajectory.joints} joints; {robot.name!r} has {robot.joints} joints.")


def _count(samples: int) -> int:
    checks.whole("samples", samples)
    return int(samples)

"""The optimiser behind the fastest motions: least duration, motors within their curves, joints within their limits."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from reojax import so3
from reojax._internal.arrays import Array
from reojax.collision.constraint import clearance_shortfall, with_spare
from reojax.mechanics.dynamics import joint_load
from reojax.mechanics.integrators import GAUSS, end_rotation
from reojax.motion._feasibility import (
    Conditions,
    beyond,
    beyond_limits,
    limits,
    restore_feasibility,
    with_jacobian,
)
from reojax.motion.least_time import minimum_stretch
from reojax.motion.motor import Motor, demand, no_load_speed, per_joint, stall_torque
from reojax.motion.simulation import net_rotation_of
from reojax.motion.trajectory import Trajectory, polynomial, stretch
from reojax.motion.trajectory_clearance import trajectory_clearance
from reojax.optimisation.optimise import Solution, optimise_together
from reojax.optimisation.status import Status
from reojax.robot import Robot

_SAMPLES = 6
"""Steps per piece while optimising, of three nodes each."""
_NODES = np.concatenate([[0], ((np.arange(_SAMPLES)[:, None] + np.array(GAUSS)) / _SAMPLES).ravel(), [1]])
_LOOKED = np.array([0, *range(2, 3 * _SAMPLES, 3), 3 * _SAMPLES + 1])
"""Nodes at which motors and joints are looked at: both ends of a piece, and the middle of each step."""
_FINE = 48
"""Steps per piece for the net rotation of the answer."""
_EXACT = 1e-8
"""Largest error of an answer's net rotation that counts as converged [rad]."""
_TOLERANCE, _SLOPE = 1e-7, 1e-5
"""Of the optimiser: largest violation (rad, and shares of the supply), and slope."""
_AGAIN = 2
"""How often a motion is solved again whose clearance turns out to be too little between the samples."""
_ROUNDING = 1e-12
"""What a joint may be beyond its limit by rounding [rad]."""


class Fastest(NamedTuple):
    """A motion of least duration, and how well it is what it should be."""

    trajectory: Trajectory
    """The motion, no motor beyond its torque-speed curve."""
    duration: Float[Array, ""]
    """How long it takes [s]."""
    error: Float[Array, ""]
    """Angle between its net rotation and the one wanted [rad]."""
    beyond: Float[Array, ""]
    """Farthest that a joint goes beyond its limits at any time [rad], 0 for none."""
    converged: Bool[Array, ""]
    """Whether the optimiser says that nothing near is faster, and `error` is below 1e-8 and `beyond` zero."""
    status: Int[Array, ""]
    """Why the optimiser ended, a `reojax.optimisation.status.Status`; `message` says it in words. `NOT_FOUND` where the
    motion does not keep the clearance asked for."""
    clearance: Float[Array, ""] | None = None
    """Least distance of the robot's parts at any time, proven [m]; None if it was not asked for."""

    @property
    def value(self) -> Trajectory:
        """The motion, under the name that all solvers' results have."""
        return self.trajectory

    @property
    def cost(self) -> Float[Array, ""]:
        """Its duration [s]."""
        return self.duration

    @property
    def violation(self) -> Float[Array, ""]:
        """Farthest that a joint goes beyond its limits [rad]."""
        return self.beyond

    @property
    def message(self) -> str:
        """Why the optimiser ended, in words."""
        return Status(int(self.status)).text


class Apart(NamedTuple):
    """A clearance that a motion must keep."""

    margin: float
    """Least distance of the robot's parts [m]."""
    have: Float[np.ndarray, " p"]
    """What each pair has at the postures that every motion passes [m]."""


class Task(NamedTuple):
    """What is to be fast: a motion made of unknowns."""

    robot: Robot
    motors: Motor
    goal: Array
    """(3, 3) the net rotation wanted."""
    kept: bool
    """Whether all unknowns have it."""
    build: Callable[[Array], Trajectory]
    """Makes the motion from the unknowns."""
    cost: Callable[[Array], Array]
    """Its duration."""
    order: Callable[[Array], Array]
    """Further numbers that must not be positive, linear in the unknowns."""
    apart: Apart | None
    """The clearance to keep, if any."""


class UnknownBox(NamedTuple):
    """Least and largest values of the unknowns, and their scales, each (n,)."""

    lower: np.ndarray
    upper: np.ndarray
    scale: np.ndarray


def least_duration(task: Task, starts: np.ndarray, box: UnknownBox, max_steps: int, progress: bool | str) -> Fastest:
    """Solve a task from several starts, (m, n); the best answer is polished, and run as fast as its motors allow."""
    robot = jax.tree.map(lambda leaf: jnp.asarray(leaf, float), task.robot)
    motors = per_joint(task.motors, np.dtype(float))
    soft = 0.02 * float(np.max(np.asarray(stall_torque(motors) * no_load_speed(motors))))
    limited = limits(robot)
    build = jax.jit(task.build)

    def node(theta: Array, theta_dot: Array, theta_ddot: Array) -> tuple[Array, Array]:
        """Share of the supply that each motor takes too much, and the base's angular velocity."""
        load = joint_load(robot, theta, theta_dot, theta_ddot)
        a, b, c = demand(robot, motors, theta_dot, load, soft=soft)
        return jnp.abs(a + b.sum(0) + c) / motors.supply - 1, load.omega

    def sample(x: Array) -> tuple[Array, Array, Array]:
        """At the samples: how far motors and joints are beyond their limits; the postures; and the net rotation."""
        trajectory = task.build(x)
        length = jnp.diff(trajectory.breaks)
        state = jax.vmap(jax.vmap(polynomial, (None, 0)))(trajectory.coefficients, length[:, None] * _NODES[None])
        taken, omega = jax.vmap(jax.vmap(node))(*state)
        past = [(sign * (state.theta[:, _LOOKED, k] - place)).ravel() for sign, k, place in limited]
        rows = jnp.concatenate([taken[:, _LOOKED].ravel(), *past])
        turned = end_rotation(jnp.repeat(length / _SAMPLES, _SAMPLES), omega[:, 1:-1].reshape(-1, 3, 3))
        return rows, state.theta[:, _LOOKED], turned

    def too_near(theta: Array, wanted: Array) -> Array:
        """What is missing to the clearance at postures (p, k, j), two conditions a piece."""
        if task.apart is None:
            return jnp.zeros(0)
        points = jnp.concatenate([theta[:, :-1].reshape(-1, robot.joints), theta[-1, -1:]])
        return clearance_shortfall(robot, points, 0.0, samples=1, groups=2 * len(theta), more=wanted)

    def order(x: Array) -> Array:
        return task.order(x) / box.scale[0]

    def rotation_error(turned: Array) -> Array:
        """Rotation vector (3,) from the goal, where not all unknowns have it."""
        return jnp.zeros(0) if task.kept else so3.log(task.goal.T @ turned)

    def sampled(x: Array, wanted: Array) -> tuple[Array, Array, Array]:
        """Cost, what must be zero, and what must not be positive, as the optimiser sees them."""
        rows, theta, turned = sample(x)
        return task.cost(x), rotation_error(turned), jnp.concatenate([rows, order(x), too_near(theta, wanted)])

    def exact(x: Array, share: Array, wanted: Array) -> Conditions:
        """The conditions where the joints are farthest, without motors."""
        _, theta, turned = sample(x)
        beyond_rows = [beyond_limits(robot, task.build(x), share), order(x), too_near(theta, wanted)]
        return Conditions(rotation_error(turned), jnp.concatenate(beyond_rows))

    fine = jax.jit(lambda trajectory: so3.log(task.goal.T @ net_rotation_of(robot, trajectory, _FINE)))
    linearised = with_jacobian(exact)

    def solve(starts: np.ndarray, wanted: np.ndarray) -> tuple[Solution, np.ndarray, Trajectory]:
        """The answers, the best of them polished, and its motion, run as fast as the motors allow."""
        found = optimise_together(
            sampled, starts, lower=box.lower, upper=box.upper, scale=box.scale, data=np.tile(wanted, (len(starts), 1)),
            tolerance=_TOLERANCE, slope_tolerance=_SLOPE, max_steps=max_steps, progress=progress,
        )  # fmt: skip
        best = np.asarray(found.value[found.best], float)
        if not task.kept or beyond(robot, build(best)) > _ROUNDING:
            conditions = lambda x, share: linearised(x, share, wanted)
            best = restore_feasibility(conditions, build, fine, best, (box.lower, box.upper, box.scale))
        trajectory = build(best)
        return found, best, stretch(trajectory, minimum_stretch(task.robot, trajectory, task.motors))

    if task.apart is None:
        (found, _, trajectory), proven, kept = solve(starts, np.zeros(0)), None, True
    else:
        margin, spare = task.apart.margin, 0.02 * task.apart.margin + 1e-4
        found, best, trajectory = solve(starts, with_spare(margin, spare, task.apart.have))
        proven = trajectory_clearance(task.robot, trajectory).distance
        for _ in range(_AGAIN):  # what came too near between the samples, with more asked for at them
            if proven >= margin:
                break
            spare = 2 * spare + margin - float(proven)
            found, best, trajectory = solve(best[None], with_spare(margin, spare, task.apart.have))
            proven = trajectory_clearance(task.robot, trajectory).distance
        kept = bool(proven >= margin)
    error, past = jnp.linalg.norm(fine(trajectory)), beyond(robot, trajectory)
    past = past if past > _ROUNDING else 0.0  # a corner of a path may lie on a limit
    good = bool(found.converged[found.best]) and past == 0 and float(error) < _EXACT and kept
    return Fastest(
        trajectory=trajectory,
        duration=trajectory.duration,
        error=error,
        beyond=jnp.asarray(past),
        converged=jnp.asarray(good),
        status=jnp.asarray(found.status[found.best] if kept else Status.NOT_FOUND),
        clearance=proven,
    )

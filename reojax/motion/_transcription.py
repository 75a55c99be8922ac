"""A fastest motion as a program of finite size (direct transcription): its conditions as functions of its unknowns.

Motors and joints are looked at in samples of each piece, which the optimiser sees, and joints also where they are
farthest, which feasibility restoration sees. Angular velocities at Gauss nodes give the net rotation.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array, cast
from reojax.collision.constraint import clearance_shortfall
from reojax.mechanics.dynamics import joint_load
from reojax.mechanics.integrators import GAUSS, end_rotation
from reojax.motion._feasibility import Conditions, beyond_limits, limits, with_jacobian
from reojax.motion.motor import Motor, demand, no_load_speed, per_joint, stall_torque
from reojax.motion.simulation import net_rotation_of
from reojax.motion.trajectory import Trajectory, polynomial
from reojax.robot import Robot

_SAMPLES = 6
"""Steps per piece while optimising, of three nodes each."""
_NODES = np.concatenate([[0], ((np.arange(_SAMPLES)[:, None] + np.array(GAUSS)) / _SAMPLES).ravel(), [1]])
_LOOKED = np.array([0, *range(2, 3 * _SAMPLES, 3), 3 * _SAMPLES + 1])
"""Nodes at which motors and joints are looked at: both ends of a piece, and the middle of each step."""
_FINE = 48
"""Steps per piece for the net rotation of the answer."""
_SOFT = 0.02
"""Share of a motor's largest power over which the sign of its power changes smoothly."""


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


class Transcription:
    """The conditions of a task as functions of its unknowns (n,)."""

    def __init__(self, task: Task, box: UnknownBox) -> None:
        """Compile nothing yet; the functions are traced when they are called."""
        self.task, self.box = task, box
        self.robot = cast(task.robot, float)
        self.motors = per_joint(task.motors, np.dtype(float))
        strongest = np.max(np.asarray(stall_torque(self.motors) * no_load_speed(self.motors)))
        self._soft = _SOFT * float(strongest)
        self._limits = limits(self.robot)
        self.build = jax.jit(task.build)
        self.linearise = with_jacobian(self._exact)
        self.rotation_left = jax.jit(self._rotation_left)

    def at_samples(self, x: Array, wanted: Array) -> tuple[Array, Array, Array]:
        """Cost, what must be zero, and what must not be positive, as the optimiser sees them.

        Args:
            x: the unknowns.
            wanted: (p,) clearance asked of each pair [m], or (0,).
        """
        rows, theta, turned = self._sample(x)
        inequality = jnp.concatenate([rows, self._order(x), self._too_near(theta, wanted)])
        return self.task.cost(x), self._rotation_error(turned), inequality

    def _exact(self, x: Array, share: Array, wanted: Array) -> Conditions:
        """The conditions where the joints are farthest, without motors."""
        _, theta, turned = self._sample(x)
        past = beyond_limits(self.robot, self.task.build(x), share)
        inequality = jnp.concatenate([past, self._order(x), self._too_near(theta, wanted)])
        return Conditions(self._rotation_error(turned), inequality)

    def _rotation_left(self, trajectory: Trajectory) -> Float[Array, "3"]:
        """Rotation vector from the goal to a motion's net rotation, finely integrated."""
        return so3.log(self.task.goal.T @ net_rotation_of(self.robot, trajectory, _FINE))

    def _sample(self, x: Array) -> tuple[Array, Array, Array]:
        """At the samples: how far motors and joints are beyond their limits; the postures; and the net rotation."""
        # joints at all nodes of all pieces
        trajectory = self.task.build(x)
        length = jnp.diff(trajectory.breaks)
        state = jax.vmap(jax.vmap(polynomial, (None, 0)))(trajectory.coefficients, length[:, None] * _NODES[None])
        # supplies exceeded, limits passed
        taken, omega = jax.vmap(jax.vmap(self._node))(*state)
        past = [(sign * (state.theta[:, _LOOKED, k] - place)).ravel() for sign, k, place in self._limits]
        rows = jnp.concatenate([taken[:, _LOOKED].ravel(), *past])
        # the net rotation, from the Gauss nodes alone
        turned = end_rotation(jnp.repeat(length / _SAMPLES, _SAMPLES), omega[:, 1:-1].reshape(-1, 3, 3))
        return rows, state.theta[:, _LOOKED], turned

    def _node(self, theta: Array, theta_dot: Array, theta_ddot: Array) -> tuple[Array, Array]:
        """Share of the supply that each motor takes too much, and the base's angular velocity."""
        load = joint_load(self.robot, theta, theta_dot, theta_ddot)
        a, b, c = demand(self.robot, self.motors, theta_dot, load, soft=self._soft)
        return jnp.abs(a + b.sum(0) + c) / self.motors.supply - 1, load.omega

    def _too_near(self, theta: Array, wanted: Array) -> Array:
        """What is missing to the clearance at postures (p, k, j), two conditions a piece."""
        if self.task.apart is None:
            return jnp.zeros(0)
        points = jnp.concatenate([theta[:, :-1].reshape(-1, self.robot.joints), theta[-1, -1:]])
        return clearance_shortfall(self.robot, points, 0.0, samples=1, groups=2 * len(theta), more=wanted)

    def _order(self, x: Array) -> Array:
        return self.task.order(x) / self.box.scale[0]

    def _rotation_error(self, turned: Array) -> Array:
        """Rotation vector (3,) from the goal, where not all unknowns have it."""
        return jnp.zeros(0) if self.task.kept else so3.log(self.task.goal.T @ turned)

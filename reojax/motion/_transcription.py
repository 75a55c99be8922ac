"""A fastest motion as a program of finite size (direct transcription): its conditions as functions of its unknowns.

Motors and joints are looked at in samples of each piece, which the optimiser sees, and joints also where they are
farthest, which feasibility restoration sees. Angular velocities at Gauss nodes give the net rotation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array, cast
from reojax.collision.constraint import clearance_shortfall
from reojax.mechanics.dynamics import joint_load
from reojax.mechanics.integrators import GAUSS, end_rotation
from reojax.mechanics.own_units import without_names
from reojax.motion._feasibility import Conditions, Ends, Linearised, beyond_limits, linearise, past_end
from reojax.motion._parametrisation import Parametrisation
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
    parametrisation: Parametrisation
    """What the unknowns are."""
    numbers: Any
    """What motions are made of beside them."""
    apart: Apart | None
    """The clearance to keep, if any."""


class UnknownBox(NamedTuple):
    """Least and largest values of the unknowns, and their scales, each (n,)."""

    lower: np.ndarray
    upper: np.ndarray
    scale: np.ndarray


class Numbers(NamedTuple):
    """The numbers of a task: arguments of all its programs, float64."""

    robot: Robot
    motors: Motor
    goal: Array
    soft: Array
    """Power over which the sign of a motor's power changes smoothly [W]."""
    unit: Array
    """Scale of times [s]."""
    motion: Any
    """What the parametrisation makes motions of."""


def numbers_of(task: Task, box: UnknownBox) -> Numbers:
    """The numbers of a task whose arrays can be read."""
    motors = per_joint(task.motors, np.dtype(float))
    strongest = np.max(np.asarray(stall_torque(motors) * no_load_speed(motors)))
    robot = without_names(task.robot, shapes=task.apart is not None)
    numbers = Numbers(robot, motors, task.goal, _SOFT * strongest, box.scale[0], task.numbers)
    return cast(numbers, float)


@dataclass(frozen=True)
class Transcription:
    """The conditions of a kind of task as functions of its unknowns (n,) and numbers; hashable, see `programs_of`."""

    parametrisation: Parametrisation
    ends: Ends
    """The limits that joints have."""
    apart: bool
    """Whether a clearance is asked for."""

    def __call__(self, x: Array, wanted: Array, numbers: Numbers) -> tuple[Array, Array, Array]:
        """Cost, what must be zero, and what must not be positive, as the optimiser sees them.

        Args:
            x: the unknowns.
            wanted: (p,) clearance asked of each pair [m], or (0,).
            numbers: of the task.
        """
        past, theta, turned = self._sample(x, numbers)
        inequality = jnp.concatenate([past, self._further(x, theta, wanted, numbers)])
        return self.parametrisation.duration(x), self._rotation_error(turned, numbers), inequality

    def build(self, x: Array, numbers: Numbers) -> Trajectory:
        """The motion."""
        return self.parametrisation.build(x, numbers.motion)

    def linearisation(self, x: Array, share: Array, wanted: Array, numbers: Numbers) -> Linearised:
        """The conditions where the joints are farthest, without motors, and their derivatives.

        Args:
            x: the unknowns.
            share: (2, p, j) where in each piece each joint is farthest, see `farthest`.
            wanted: (p,) clearance asked of each pair [m], or (0,).
            numbers: of the task.
        """

        def exact(x: Array) -> Conditions:
            _, theta, turned = self._sample(x, numbers)
            motion = self.parametrisation.build(x, numbers.motion)
            past = beyond_limits(numbers.robot, motion, share, self.ends)
            inequality = jnp.concatenate([past, self._further(x, theta, wanted, numbers)])
            return Conditions(self._rotation_error(turned, numbers), inequality)

        return linearise(exact, x)

    def rotation_left(self, trajectory: Trajectory, numbers: Numbers) -> Float[Array, "3"]:
        """Rotation vector from the goal to a motion's net rotation, finely integrated."""
        return so3.log(numbers.goal.T @ net_rotation_of(numbers.robot, trajectory, _FINE))

    def _sample(self, x: Array, numbers: Numbers) -> tuple[Array, Array, Array]:
        """At the samples: how far motors and joints are beyond their limits; the postures; and the net rotation."""
        # joints at all nodes of all pieces
        trajectory = self.parametrisation.build(x, numbers.motion)
        length = jnp.diff(trajectory.breaks)
        state = jax.vmap(jax.vmap(polynomial, (None, 0)))(trajectory.coefficients, length[:, None] * _NODES[None])
        # supplies exceeded, limits passed
        taken, omega = jax.vmap(jax.vmap(partial(_node, numbers)))(*state)
        looked = state.theta[:, _LOOKED]
        past = [past_end(numbers.robot, end, looked).ravel() for end in self.ends]
        rows = jnp.concatenate([taken[:, _LOOKED].ravel(), *past])
        # the net rotation, from the Gauss nodes alone
        turned = end_rotation(jnp.repeat(length / _SAMPLES, _SAMPLES), omega[:, 1:-1].reshape(-1, 3, 3))
        return rows, looked, turned

    def _further(self, x: Array, theta: Array, wanted: Array, numbers: Numbers) -> Array:
        """Conditions beside motors' and joints': the order of moves, and what is missing to the clearance."""
        order = self.parametrisation.order(x) / numbers.unit
        if not self.apart:
            return order
        # postures (p, k, j) of all pieces, the end of each being the start of the next; two conditions a piece
        points = jnp.concatenate([theta[:, :-1].reshape(-1, numbers.robot.joints), theta[-1, -1:]])
        short = clearance_shortfall(numbers.robot, points, 0.0, samples=1, groups=2 * len(theta), more=wanted)
        return jnp.concatenate([order, short])

    def _rotation_error(self, turned: Array, numbers: Numbers) -> Array:
        """Rotation vector (3,) from the goal, where not all unknowns have it."""
        return jnp.zeros(0) if self.parametrisation.keeps_rotation else so3.log(numbers.goal.T @ turned)


class Programs(NamedTuple):
    """Methods of a `Transcription`, compiled where they are first called."""

    build: Callable[..., Trajectory]
    linearisation: Callable[..., Linearised]
    rotation_left: Callable[..., Array]


@lru_cache(maxsize=64)
def programs_of(kind: Transcription) -> Programs:
    """The programs of a kind of task; of the last few kinds, for what has a kind as a static argument is never let go.

    The optimiser keeps those of as many.
    """
    return Programs(*(jax.jit(partial(method, kind)) for method in _COMPILED))


_COMPILED = Transcription.build, Transcription.linearisation, Transcription.rotation_left


def _node(numbers: Numbers, theta: Array, theta_dot: Array, theta_ddot: Array) -> tuple[Array, Array]:
    """Share of the supply that each motor takes too much, and the base's angular velocity."""
    load = joint_load(numbers.robot, theta, theta_dot, theta_ddot)
    a, b, c = demand(numbers.robot, numbers.motors, theta_dot, load, soft=numbers.soft)
    return jnp.abs(a + b.sum(0) + c) / numbers.motors.supply - 1, load.omega

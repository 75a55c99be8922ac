"""A path, a trajectory or a simulated motion, as samples with the middles between them."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax.mechanics.holonomy import rotation_history
from reojax.mechanics.momentum import momentum_matrices
from reojax.motion.simulation import Motion, orientation_along
from reojax.motion.trajectory import Trajectory
from reojax.path import Path
from reojax.robot import Robot


class Nodes(NamedTuple):
    """Both ends and the middle of m intervals; what belongs to a jump at the edge of two intervals is in both."""

    at: Float[Array, "m 3"]
    """Time [s], or path parameter."""
    theta: Float[Array, "m 3 j"]
    """Joint angles [rad]."""
    rate: Float[Array, "m 3 j"]
    """Their rates by `at`."""
    rotation: Float[Array, "m 3 3 3"]
    """Orientation of the base, one for each of the three nodes."""
    shape: Float[Array, "m 3"]
    """Weight that vanishes at every corner of a path, where the direction jumps; 1 along a motion in time."""
    momentum: Float[Array, "3"]
    """Angular momentum, inertial frame [kg m^2/s]."""


def nodes_of(robot: Robot, motion: Path | Trajectory | Motion, momentum: Array, samples: int) -> Nodes:
    """Nodes of anything that moves the joints, all arrays of one dtype.

    Args:
        robot: the robot.
        motion: a path has its edges as unit of the parameter; a simulated motion keeps its own samples and momentum.
        momentum: (3,) of a trajectory.
        samples: of each edge or piece.
    """
    if isinstance(motion, Path):
        return _of_path(robot, motion, samples)
    if isinstance(motion, Trajectory):
        return _of_trajectory(robot, motion, momentum, samples)
    return _of_motion(robot, motion)


def _of_path(robot: Robot, path: Path, samples: int) -> Nodes:
    dtype = path.waypoints.dtype
    edges, fine = path.edges, 2 * samples
    share = jnp.asarray(_triples(fine) / fine, dtype)
    at = jnp.arange(edges, dtype=dtype)[:, None, None] + share[None]
    step = jnp.diff(path.waypoints, axis=0)
    theta = path.waypoints[:-1, None, None] + share[None, :, :, None] * step[:, None, None]
    rotation = rotation_history(robot, path, samples=fine)
    index = np.arange(edges)[:, None, None] * fine + _triples(fine)[None]
    return Nodes(
        at=at.reshape(-1, 3),
        theta=theta.reshape(-1, 3, path.joints),
        rate=jnp.broadcast_to(step[:, None, None], theta.shape).reshape(-1, 3, path.joints),
        rotation=rotation[index.reshape(-1, 3)],
        shape=jnp.tile(30 * (share * (1 - share)) ** 2, (edges, 1)),
        momentum=jnp.zeros(3, dtype),
    )


def _of_trajectory(robot: Robot, trajectory: Trajectory, momentum: Array, samples: int) -> Nodes:
    rotation, time, state, _ = orientation_along(robot, trajectory, momentum, 2 * samples)
    index = _triples(2 * samples * trajectory.pieces)
    one = jnp.ones(index.shape, time.dtype)
    return Nodes(time[index], state.theta[index], state.theta_dot[index], rotation[index], one, momentum)


def _of_motion(robot: Robot, motion: Motion) -> Nodes:
    """The middles are means of the ends, which makes Simpson's rule the trapezoid rule."""
    A, B = momentum_matrices(robot, motion.theta[0])
    momentum = motion.rotation[0] @ (A @ motion.omega[0] - B @ motion.theta_dot[0])

    def three(values: Array) -> Array:
        return jnp.stack([values[:-1], (values[:-1] + values[1:]) / 2, values[1:]], axis=1)

    at = three(motion.time)
    both = three(motion.theta), three(motion.theta_dot), three(motion.rotation)
    return Nodes(at, *both, jnp.ones_like(at), momentum)


def _triples(fine: int) -> np.ndarray:
    """Numbers of both ends and the middle of each two of `fine` intervals."""
    return 2 * np.arange(fine // 2)[:, None] + np.arange(3)[None]

"""Where the links are and how they move with the joints: poses, Jacobians, the support mask."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from reojax._internal.arrays import Array
from reojax.mechanics.input_checks import check_motion
from reojax.robot import Robot
from reojax.so3 import hat


class LinkPoses(NamedTuple):
    """Frames of all links in the base frame."""

    rotation: Float[Array, "n 3 3"]
    """Orientation of each link: takes link components to base components."""
    position: Float[Array, "n 3"]
    """Origin of each link's frame, from the base frame's origin [m]."""


class Kinematics(NamedTuple):
    """Where the links are at a shape, and how they move with it, in the base frame."""

    rotation: Float[Array, "n 3 3"]
    """Orientation of each link."""
    origin: Float[Array, "n 3"]
    """Origin of each link's frame, from the base frame's origin [m]."""
    com: Float[Array, "n 3"]
    """Centre of mass of each link, from the centre of mass of the robot [m]."""
    angular_jacobian: Float[Array, "n 3 j"]
    """Angular velocity of each link relative to the base per joint rate."""
    linear_jacobian: Float[Array, "n 3 j"]
    """Velocity of each link's `com` per joint rate, while the base does not turn [m/rad]."""
    axis: Float[Array, "j 3"]
    """Joint axes, unit vectors."""


def link_poses(robot: Robot, theta: Float[Array, " j"]) -> LinkPoses:
    """Orientation and position of every link's frame in the base frame, at joint angles `theta` [rad].

    `rotation` (n, 3, 3) takes link components to base components, `position` (n, 3) is the frame's origin [m]; link 0,
    the base, has the identity and zero.

    Args:
        robot: the robot.
        theta: (j,) joint angles [rad].

    Raises:
        ValueError: if `theta` has the wrong shape or is not finite.
    """
    return forward_kinematics(*check_motion(robot, theta=theta))


def centre_of_mass(robot: Robot, theta: Float[Array, " j"]) -> Float[Array, "3"]:
    """Centre of mass of the whole robot, base frame, from the base frame's origin [m].

    Args:
        robot: the robot.
        theta: (j,) joint angles [rad].

    Raises:
        ValueError: if `theta` has the wrong shape or is not finite.
    """
    robot, theta = check_motion(robot, theta=theta)
    pose = forward_kinematics(robot, theta)
    return _mass_shares(robot) @ (pose.position + jnp.einsum("iab,ib->ia", pose.rotation, robot.com))


def joint_rotation(axis: Float[Array, "3"], angle: Float[Array, ""]) -> Float[Array, "3 3"]:
    """Rotation by `angle` [rad] about the unit vector `axis` (Rodrigues)."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    return c * jnp.eye(3, dtype=axis.dtype) + s * hat(axis) + (1 - c) * axis[:, None] * axis[None, :]


def forward_kinematics(robot: Robot, theta: Float[Array, " j"]) -> LinkPoses:
    """`link_poses` of arrays that are checked and of one dtype already."""
    # along the tree: R_child = R_parent exp(theta_k hat(e_k)), and a joint's place moves all links behind it
    turned = jax.vmap(joint_rotation)(unit_axes(robot), theta)
    rotation = [jnp.eye(3, dtype=theta.dtype)]
    for k, p in enumerate(robot.parent):
        rotation.append(jnp.matmul(rotation[p], turned[k], precision="highest") if p else turned[k])
    rotation = jnp.stack(rotation)
    arms = jnp.einsum("kab,kb->ka", rotation[np.array(robot.parent, int)], robot.anchor)
    return LinkPoses(rotation, jnp.matmul(support_mask(robot).astype(theta.dtype), arms, precision="highest"))


def kinematics(robot: Robot, theta: Float[Array, " j"]) -> Kinematics:
    """Poses and Jacobians of all links at `theta` [rad], base frame; arrays that are checked and of one dtype."""
    rotation, origin = forward_kinematics(robot, theta)
    moved = support_mask(robot).astype(theta.dtype)
    # joint axes in the base frame; a joint turns a link about its axis if it lies between the link and the base
    axis = jnp.einsum("kab,kb->ka", rotation[np.array(robot.parent, int)], unit_axes(robot))
    angular_jacobian = moved[:, None, :] * axis.T[None]
    # and moves its centre of mass by e_k x (c_i - o_k); less the mean by mass, which is how the robot's own moves
    com = origin + jnp.einsum("iab,ib->ia", rotation, robot.com)
    arm = com[:, None, :] - origin[None, 1:, :]
    linear_jacobian = moved[:, None, :] * jnp.cross(axis[None], arm).swapaxes(1, 2)
    share = _mass_shares(robot)
    return Kinematics(
        rotation=rotation,
        origin=origin,
        com=com - (share @ com)[None],
        angular_jacobian=angular_jacobian,
        linear_jacobian=linear_jacobian - jnp.einsum("i,iaj->aj", share, linear_jacobian)[None],
        axis=axis,
    )


def unit_axes(robot: Robot) -> Float[Array, "j 3"]:
    """Joint axes of unit length: only their direction counts."""
    size = jax.lax.stop_gradient(jnp.abs(robot.axis).max(1, keepdims=True))  # so that squares stay in range
    axis = robot.axis / size
    return axis / jnp.sqrt((axis * axis).sum(1, keepdims=True))


def _mass_shares(robot: Robot) -> Float[Array, " n"]:
    return robot.mass / robot.mass.sum()


def support_mask(robot: Robot) -> Bool[np.ndarray, "n j"]:
    """Tell which links each joint moves: `[i, k]` where joint k lies between the base and link i."""
    moved = np.zeros((robot.links, robot.joints), bool)
    for k, p in enumerate(robot.parent):
        moved[k + 1] = moved[p]
        moved[k + 1, k] = True
    return moved

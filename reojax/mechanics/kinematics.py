"""Where the links are and how they move with the joints: poses, Jacobians, the support mask."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from reojax._internal import checks
from reojax._internal.arrays import Array, as_numbers, common_float, is_concrete
from reojax.robot import Robot
from reojax.so3 import hat


class Kinematics(NamedTuple):
    """Where the links are at a shape, and how they move with it, in the base frame."""

    rotation: Float[Array, "n 3 3"]
    """Orientation of each link."""
    origin: Float[Array, "n 3"]
    """Origin of each link's frame, from the base frame's origin [m]."""
    centre: Float[Array, "n 3"]
    """Centre of mass of each link, from the centre of mass of the robot [m]."""
    turn: Float[Array, "n 3 j"]
    """Angular Jacobian: angular velocity of each link relative to the base per joint rate."""
    shift: Float[Array, "n 3 j"]
    """Linear Jacobian of `centre` [m/rad]."""
    axis: Float[Array, "j 3"]
    """Joint axes."""


def check_motion(robot: Robot, **motion: Any) -> Any:
    """Return the robot and the motion's vectors as arrays of one dtype, or raise a `ValueError`."""
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    for entry, value in motion.items():
        expected = (3,) if entry in ("omega", "momentum") else (robot.joints,)
        vector = motion[entry] = as_numbers(entry, value)
        if vector.shape != expected:
            robot_size = f"{robot.name!r} ({robot.joints} joints)"
            raise ValueError(f"`{entry}` has shape {vector.shape}; for {robot_size} it must be {expected}.")
        if is_concrete(vector) and not np.isfinite(vector).all():
            raise ValueError(f"`{entry}` is {np.asarray(vector).tolist()}; it must be finite.")
    everything = (robot, *motion.values())
    dtype = common_float(everything)
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), everything)


def joint_rotation(axis: Float[Array, "3"], angle: Float[Array, ""]) -> Float[Array, "3 3"]:
    """Rotation by `angle` [rad] about the unit vector `axis` (Rodrigues)."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    return c * jnp.eye(3, dtype=axis.dtype) + s * hat(axis) + (1 - c) * axis[:, None] * axis[None, :]


def kinematics(robot: Robot, theta: Float[Array, " j"]) -> Kinematics:
    """Poses and Jacobians of all links at joint angles `theta` [rad], in the base frame.

    Raises:
        ValueError: if `theta` has the wrong shape or is not finite.
    """
    robot, theta = check_motion(robot, theta=theta)
    unit = robot.axis / jnp.sqrt((robot.axis * robot.axis).sum(1, keepdims=True))
    rotation = [jnp.eye(3, dtype=theta.dtype)]
    for p, turned in zip(robot.parent, jax.vmap(joint_rotation)(unit, theta), strict=True):
        rotation.append(rotation[p] @ turned)
    rotation = jnp.stack(rotation)
    parent, moved = np.array(robot.parent, int), support_mask(robot).astype(theta.dtype)
    axis = jnp.einsum("kab,kb->ka", rotation[parent], unit)
    origin = moved @ jnp.einsum("kab,kb->ka", rotation[parent], robot.anchor)
    centre = origin + jnp.einsum("iab,ib->ia", rotation, robot.com)
    arm = centre[:, None, :] - origin[None, 1:, :]
    shift = moved[:, None, :] * jnp.cross(axis[None], arm).swapaxes(1, 2)
    share = robot.mass / robot.mass.sum()
    return Kinematics(
        rotation=rotation,
        origin=origin,
        centre=centre - (share @ centre)[None],
        turn=moved[:, None, :] * axis.T[None],
        shift=shift - jnp.einsum("i,iaj->aj", share, shift)[None],
        axis=axis,
    )


def support_mask(robot: Robot) -> Bool[np.ndarray, "n j"]:
    """Tell which links each joint moves: `[i, k]` where joint k lies between the base and link i."""
    moved = np.zeros((robot.links, robot.joints), bool)
    for k, p in enumerate(robot.parent):
        moved[k + 1] = moved[p]
        moved[k + 1, k] = True
    return moved

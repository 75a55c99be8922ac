"""Angular momentum of a free-floating robot: `A(theta) omega = B(theta) theta_dot` (thesis eq. 2.14).

With zero momentum, angular velocity `omega` of the base and joint rates `theta_dot` are tied by the
*local connection* `A^-1 B`, which depends on the shape `theta` alone. This module is the definition,
written to be read; `reojax._fast` evaluates the same equations quickly and is tested against it.

Notation (thesis 1.5, 2.5), all in the base frame: `rotation[i]`, `centre[i]` are link i's orientation
and its centre of mass measured from the centre of mass of the whole robot; `turn[i]` (3, j) and
`shift[i]` (3, j) are its angular and linear Jacobians, `w_i = omega + turn[i] theta_dot` and
`v_i = omega x centre[i] + shift[i] theta_dot`. The momentum about the centre of mass is

    h = sum_i I_i w_i + m_i centre_i x v_i + sum_k J_k (+-N_k theta_dot_k) e_k  =  A omega - B theta_dot,

the last sum over the motors' rotors, which spin about their joints' axes `e_k` relative to the
links that carry them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from reojax._arrays import Array, as_numbers, common_float, is_concrete
from reojax._smallmat import solve_symmetric3
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


class MomentumMatrices(NamedTuple):
    """`A` and `B` of `A omega = B theta_dot`, base frame, about the centre of mass [kg m^2]."""

    A: Float[Array, "3 3"]
    """Locked inertia of the robot; symmetric, positive definite."""
    B: Float[Array, "3 j"]
    """Minus the momentum that unit joint rates give while the base does not turn."""


def checked(robot: Robot, **motion: Any) -> Any:
    """Return the robot and the motion's vectors as arrays of one dtype, or raise a `ValueError`."""
    if not isinstance(robot, Robot):
        raise ValueError(f"`robot` is a {type(robot).__name__}; it must be a Robot, such as `make_robot` makes.")
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
    robot, theta = checked(robot, theta=theta)
    unit = robot.axis / jnp.sqrt((robot.axis * robot.axis).sum(1, keepdims=True))
    rotation = [jnp.eye(3, dtype=theta.dtype)]
    for p, turned in zip(robot.parent, jax.vmap(joint_rotation)(unit, theta), strict=True):
        rotation.append(rotation[p] @ turned)
    rotation = jnp.stack(rotation)
    parent, moved = np.array(robot.parent, int), carried(robot).astype(theta.dtype)
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


def carried(robot: Robot) -> Bool[np.ndarray, "n j"]:
    """Tell which links each joint moves: `[i, k]` where joint k lies between the base and link i."""
    moved = np.zeros((robot.links, robot.joints), bool)
    for k, p in enumerate(robot.parent):
        moved[k + 1] = moved[p]
        moved[k + 1, k] = True
    return moved


def momentum_matrices(robot: Robot, theta: Float[Array, " j"]) -> MomentumMatrices:
    """Matrices of `A omega = B theta_dot` at zero angular momentum (thesis eq. 2.14).

    Args:
        robot: the robot.
        theta: (j,) joint angles [rad].

    Returns:
        `A` (3, 3) and `B` (3, j) [kg m^2], in the base frame, about the centre of mass.

    Raises:
        ValueError: if `theta` has the wrong shape or is not finite.
    """
    robot, theta = checked(robot, theta=theta)
    return matrices_at(robot, kinematics(robot, theta))


def matrices_at(robot: Robot, pose: Kinematics) -> MomentumMatrices:
    """`momentum_matrices` where the poses and Jacobians are known already."""
    inertia = outer_inertia(robot, pose)
    lever = jax.vmap(hat)(pose.centre)
    A = (inertia - jnp.einsum("i,iab,ibc->iac", robot.mass, lever, lever)).sum(0)
    B = -jnp.einsum("iab,ibk->ak", inertia, pose.turn) - jnp.einsum("i,iab,ibk->ak", robot.mass, lever, pose.shift)
    return MomentumMatrices(A, B - pose.axis.T * (robot.rotor_inertia * rotor_spin(robot))[None])


def outer_inertia(robot: Robot, pose: Kinematics) -> Float[Array, "n 3 3"]:
    """Inertia of each link about its centre of mass, in the base frame [kg m^2]."""
    symmetric = 0.5 * (robot.inertia + robot.inertia.swapaxes(1, 2))
    return jnp.einsum("iab,ibc,idc->iad", pose.rotation, symmetric, pose.rotation)


def rotor_spin(robot: Robot) -> Float[Array, " j"]:
    """Turns of each rotor about its joint's axis, relative to the stator's link, per turn of the joint."""
    return robot.gear_ratio * np.array([1 if side == "parent" else -1 for side in robot.rotor_on], int)


def connection(robot: Robot, theta: Float[Array, " j"]) -> Float[Array, "3 j"]:
    """Local connection `A^-1 B`: column k is the base's turn per turn of joint k, base frame.

    `omega = connection(robot, theta) @ theta_dot` at zero angular momentum (thesis 2.5).

    Raises:
        ValueError: if `theta` has the wrong shape or is not finite.
    """
    A, B = momentum_matrices(robot, theta)
    return solve_symmetric3(A, B)


def angular_momentum(
    robot: Robot, theta: Float[Array, " j"], theta_dot: Float[Array, " j"], omega: Float[Array, "3"]
) -> Float[Array, "3"]:
    """Total angular momentum `A omega - B theta_dot` about the centre of mass, base frame [kg m^2/s].

    Args:
        robot: the robot.
        theta: (j,) joint angles [rad].
        theta_dot: (j,) joint rates [rad/s].
        omega: (3,) angular velocity of the base, base frame [rad/s].

    Raises:
        ValueError: if an argument has the wrong shape or is not finite.
    """
    robot, theta, theta_dot, omega = checked(robot, theta=theta, theta_dot=theta_dot, omega=omega)
    A, B = momentum_matrices(robot, theta)
    return A @ omega - B @ theta_dot

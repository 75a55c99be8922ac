"""Angular momentum of a free-floating robot: `A(theta) omega = B(theta) theta_dot` (thesis eq. 2.14).

With zero momentum, angular velocity `omega` of the base and joint rates `theta_dot` are tied by the
*local connection* `A^-1 B`, which depends on the shape `theta` alone. This module is the definition,
written to be read; `reojax.mechanics._fast` evaluates the same equations quickly and is tested against it.

Notation (thesis 1.5, 2.5), all in the base frame: `R_i`, `c_i` are link i's orientation and its centre of
mass measured from the centre of mass of the whole robot; `Ja_i` and `Jl_i` (3, j) are its angular and linear
Jacobians, `w_i = omega + Ja_i theta_dot` and `v_i = omega x c_i + Jl_i theta_dot`. The momentum about the
centre of mass is

    h = sum_i I_i w_i + m_i c_i x v_i + sum_k J_k (+-N_k theta_dot_k) e_k  =  A omega - B theta_dot,

the last sum over the motors' rotors, which spin about their joints' axes `e_k` relative to the
links that carry them.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax._internal.linalg import solve_symmetric3
from reojax.mechanics.input_checks import check_motion
from reojax.mechanics.kinematics import Kinematics, kinematics
from reojax.robot import Robot
from reojax.so3 import hat


class MomentumMatrices(NamedTuple):
    """`A` and `B` of `A omega = B theta_dot`, base frame, about the centre of mass [kg m^2]."""

    A: Float[Array, "3 3"]
    """Locked inertia of the robot; symmetric, positive definite."""
    B: Float[Array, "3 j"]
    """Minus the momentum that unit joint rates give while the base does not turn."""


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
    robot, theta = check_motion(robot, theta=theta)
    return momentum_matrices_of_pose(robot, kinematics(robot, theta))


def momentum_matrices_of_pose(robot: Robot, pose: Kinematics) -> MomentumMatrices:
    """`momentum_matrices` where the poses and Jacobians are known already."""
    inertia = inertia_in_base_frame(robot, pose)
    lever = jax.vmap(hat)(pose.com)
    # locked inertia: sum of I_i - m_i hat(c_i)^2
    A = (inertia - jnp.einsum("i,iab,ibc->iac", robot.mass, lever, lever)).sum(0)
    # momentum per joint rate while the base rests: sum of I_i Ja_i + m_i c_i x Jl_i ...
    turning = jnp.einsum("iab,ibk->ak", inertia, pose.angular_jacobian)
    moving = jnp.einsum("i,iab,ibk->ak", robot.mass, lever, pose.linear_jacobian)
    # ... and of each joint's rotor, J_k (+-N_k) e_k
    rotors = pose.axis.T * (robot.rotor_inertia * rotor_spin(robot))[None]
    return MomentumMatrices(A, -(turning + moving + rotors))


def inertia_in_base_frame(robot: Robot, pose: Kinematics) -> Float[Array, "n 3 3"]:
    """Inertia of each link about its centre of mass, in the base frame [kg m^2]."""
    symmetric = 0.5 * (robot.inertia + robot.inertia.swapaxes(1, 2))
    return jnp.einsum("iab,ibc,idc->iad", pose.rotation, symmetric, pose.rotation)


def rotor_spin(robot: Robot) -> Float[Array, " j"]:
    """Turns of each rotor about its joint's axis, relative to the stator's link, per turn of the joint."""
    return robot.gear_ratio * np.array([1 if side == "parent" else -1 for side in robot.rotor_on], int)


def connection(robot: Robot, theta: Float[Array, " j"]) -> Float[Array, "3 j"]:
    """Local connection `A^-1 B`: column k is the base's turn per turn of joint k, base frame.

    `omega = connection(robot, theta) @ theta_dot` at zero angular momentum (thesis 2.5).

    Args:
        robot: the robot.
        theta: (j,) joint angles [rad].

    Raises:
        ValueError: if `theta` has the wrong shape or is not finite.
    """
    robot, theta = check_motion(robot, theta=theta)
    return connection_of_pose(robot, kinematics(robot, theta))


def connection_of_pose(robot: Robot, pose: Kinematics) -> Float[Array, "3 j"]:
    """`connection` where the poses and Jacobians are known already."""
    A, B = momentum_matrices_of_pose(robot, pose)
    return solve_symmetric3(A, B)


def velocity_by_momentum(
    robot: Robot, pose: Kinematics, theta_dot: Float[Array, " j"]
) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
    """`A^-1 B theta_dot` and `A^-1`, base frame: `omega` is the first plus the second times the momentum.

    Nothing is checked: arrays are finite and of one dtype.
    """
    A, B = momentum_matrices_of_pose(robot, pose)
    columns = jnp.concatenate([(B @ theta_dot)[:, None], jnp.eye(3, dtype=theta_dot.dtype)], axis=1)
    both = solve_symmetric3(A, columns)
    return both[:, 0], both[:, 1:]


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
    robot, theta, theta_dot, omega = check_motion(robot, theta=theta, theta_dot=theta_dot, omega=omega)
    A, B = momentum_matrices_of_pose(robot, kinematics(robot, theta))
    return A @ omega - B @ theta_dot

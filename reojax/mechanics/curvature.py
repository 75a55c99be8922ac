"""Curvature of the local connection: how much a small loop in shape space turns the robot, and about which axis."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax.mechanics.input_checks import check_motion
from reojax.mechanics.kinematics import kinematics
from reojax.mechanics.momentum import connection_of_pose
from reojax.robot import Robot


def curvature(robot: Robot, theta: Float[Array, " j"]) -> Float[Array, "3 j j"]:
    """Curvature of the local connection `Gamma = A^-1 B` at a shape, an so(3)-valued two-form, base frame.

    `F[:, i, k] = d_i Gamma_k - d_k Gamma_i + Gamma_i x Gamma_k`, where `Gamma_i` is column i of `connection` and
    `d_i` the derivative by joint angle i. It is antisymmetric in i and k. With `R' = R hat(Gamma theta')` a small
    rectangle - joint i by `a`, joint k by `b`, joint i by `-a`, joint k by `-b` - turns the base by

        exp(a b F[:, i, k] + third order in a and b).

    A rotated base frame, `beta(theta)` for its axes in the old one, turns `F` into `beta^T F`: unlike that of the
    connection, the size of the curvature does not depend on the frame. It is zero on every plane of shape space
    only if no loop turns the robot at all. (J. E. Marsden, R. Montgomery and T. Ratiu, Mem. AMS 436, 1990; R. L. Hatton
    and H. Choset, Eur. Phys. J. Special Topics 224, 2015.)

    Args:
        robot: the robot.
        theta: (j,) joint angles [rad].

    Returns:
        (3, j, j) rotation vector per area of a loop in shape space [rad/rad^2].

    Raises:
        ValueError: if `theta` has the wrong shape or is not finite.
    """
    return curvature_terms(*check_motion(robot, theta=theta))[2]


def curvature_terms(
    robot: Robot, theta: Float[Array, " j"]
) -> tuple[Float[Array, "3 j"], Float[Array, "3 j j"], Float[Array, "3 j j"]]:
    """The connection, its slope `[:, k, i] = d_i Gamma_k`, and its curvature; arrays checked and of one dtype."""

    def gamma_of(theta: Array) -> Array:
        return connection_of_pose(robot, kinematics(robot, theta))

    gamma, slope = gamma_of(theta), jax.jacfwd(gamma_of)(theta)
    bracket = jnp.cross(gamma[:, :, None], gamma[:, None, :], axis=0)  # Gamma_i x Gamma_k
    return gamma, slope, jnp.swapaxes(slope, 1, 2) - slope + bracket

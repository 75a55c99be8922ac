"""First variation of the rotation of the base: how a small change of the joint motion turns the end.

Write the change of the attitude as a left perturbation, `R -> exp(e) R`, and take from `e` what the changed joints
`theta + p` turn the base by at the same instant, `R Gamma p`. What is left changes along the motion by

    e' = G p + N e,
    G p = R (F(p, theta') + d_p(A^-1) h + Gamma p x A^-1 h + A^-1 (h x Gamma p)),      N e = R A^-1 R^T (H x e),

with the connection `Gamma`, its curvature `F` (`curvature`), and the angular momentum `H`, in the base frame
`h = R^T H`. At zero momentum only the curvature counts, and the end turns by the integral of `R F(p, theta')`: a change
that vanishes at both ends does so by an area in shape space (J. E. Marsden, R. Montgomery and T. Ratiu, Mem. AMS 436,
1990). All of it is seen from the start, in inertial components.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax._internal.linalg import solve_symmetric3
from reojax.mechanics.kinematics import Kinematics, kinematics, support_mask
from reojax.mechanics.momentum import inertia_in_base_frame, momentum_matrices_of_pose, rotor_spin
from reojax.robot import Robot
from reojax.so3 import hat


class Instant(NamedTuple):
    """What the first variation needs of one posture and its rates, whatever the orientation."""

    pose: Kinematics
    inertia: Float[Array, "n 3 3"]
    """Of each link about its own centre of mass, base frame."""
    A: Float[Array, "3 3"]
    B: Float[Array, "3 j"]
    A_dot: Float[Array, "3 3"]
    """Its rate along the motion."""
    B_dot: Float[Array, "3 j"]


def instant(robot: Robot, theta: Float[Array, " j"], theta_dot: Float[Array, " j"]) -> Instant:
    """Posture, momentum matrices and their rates along the motion. Nothing is checked."""

    def matrices(theta: Array) -> tuple[tuple[Array, Array], tuple[Kinematics, Array]]:
        pose = kinematics(robot, theta)
        A, B = momentum_matrices_of_pose(robot, pose)
        return (A, B), (pose, inertia_in_base_frame(robot, pose))

    (A, B), (A_dot, B_dot), (pose, inertia) = jax.jvp(matrices, (theta,), (theta_dot,), has_aux=True)
    return Instant(pose, inertia, A, B, A_dot, B_dot)


def turn_of_instant(
    robot: Robot,
    now: Instant,
    theta_dot: Float[Array, " j"],
    rotation: Float[Array, "3 3"],
    momentum: Float[Array, "3"],
) -> tuple[Float[Array, "3 j"], Float[Array, "3 3"]]:
    """`G` and `N` of this module; `momentum` in the inertial frame.

    `omega = A^-1 (B theta' + h)` changes with joint i by `-A^-1 d_i (A omega - B theta')`, velocities held
    (`_momentum_slopes`), and the connection along the motion by `A^-1 (B_dot - A_dot Gamma)`.
    """
    # Gamma = A^-1 B, omega = A^-1 (B theta' + h)
    h = rotation.T @ momentum
    both = solve_symmetric3(now.A, jnp.concatenate([now.B, (now.B @ theta_dot + h)[:, None]], axis=1))
    gamma, omega = both[:, :-1], both[:, -1]
    # h x Gamma - d_i (A omega - B theta') - B_dot + A_dot Gamma, under A^-1
    slopes = _momentum_slopes(robot, now, theta_dot, omega)
    right = jnp.cross(h[:, None], gamma, axis=0) - slopes - now.B_dot + now.A_dot @ gamma
    # and A^-1 hat(h) R^T beside it, for N
    solved = solve_symmetric3(now.A, jnp.concatenate([right, hat(h) @ rotation.T], axis=1))
    count = robot.joints
    return rotation @ (solved[:, :count] + jnp.cross(gamma, omega[:, None], axis=0)), rotation @ solved[:, count:]


def _momentum_slopes(
    robot: Robot, now: Instant, theta_dot: Float[Array, " j"], omega: Float[Array, "3"]
) -> Float[Array, "3 j"]:
    """How the momentum `A omega - B theta'` changes with each joint while `omega` and `theta'` are held.

    Joint i turns all that lies beyond it about its axis `e` through `o`. Its momenta `h`, `p`, its first moment `s` and
    its inertia `I`, all about the centre of mass of the robot, turn along; what its parent's motion (`w`, `v` at o)
    carries does not: `e x h - (e x o) x p - I q + s x (q x o - e x v)` with `q = e x w`.
    """
    pose, parent = now.pose, np.array(robot.parent, int)
    beyond = jnp.asarray(support_mask(robot).T, omega.dtype)  # (j, n)
    lever = jax.vmap(hat)(pose.com)
    # motion of each link: w_i = omega + Ja_i theta', v_i = omega x c_i + Jl_i theta'
    spin = omega[None] + pose.angular_jacobian @ theta_dot
    speed = jnp.cross(omega[None], pose.com) + pose.linear_jacobian @ theta_dot
    # momenta of each link alone, its joint's rotor included: m v_i, and I_i w_i + c_i x m v_i
    linear = robot.mass[:, None] * speed
    own = jnp.einsum("iab,ib->ia", now.inertia, spin) + jnp.cross(pose.com, linear)
    own = own.at[1:].add((robot.rotor_inertia * rotor_spin(robot) * theta_dot)[:, None] * pose.axis)
    # inertia of each about the robot's centre of mass
    about = now.inertia - jnp.einsum("i,iab,ibc->iac", robot.mass, lever, lever)
    # summed over all that lies beyond each joint
    h, p = beyond @ own, beyond @ linear
    s = beyond @ (robot.mass[:, None] * pose.com)
    inertia = jnp.einsum("ji,iab->jab", beyond, about)
    # places of the joints, and the motion of their parents there
    centre = pose.origin[0] + pose.rotation[0] @ robot.com[0] - pose.com[0]
    e, o, w = pose.axis, pose.origin[1:] - centre[None], spin[parent]
    v = speed[parent] + jnp.cross(w, o - pose.com[parent])
    q = jnp.cross(e, w)
    # e x h - (e x o) x p - I q + s x (q x o - e x v)
    found = jnp.cross(e, h) - jnp.cross(jnp.cross(e, o), p) - jnp.einsum("jab,jb->ja", inertia, q)
    return (found + jnp.cross(s, jnp.cross(q, o) - jnp.cross(e, v))).T


def turn_per_change(
    robot: Robot,
    theta: Float[Array, " j"],
    theta_dot: Float[Array, " j"],
    rotation: Float[Array, "3 3"],
    momentum: Float[Array, "3"],
) -> tuple[Float[Array, "3 j"], Float[Array, "3 3"]]:
    """`G` and `N` of this module at one instant of a motion; `momentum` in the inertial frame. Nothing is checked."""
    return turn_of_instant(robot, instant(robot, theta, theta_dot), theta_dot, rotation, momentum)

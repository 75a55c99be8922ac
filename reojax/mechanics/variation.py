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

import jax
import jax.numpy as jnp
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax._internal.linalg import solve_symmetric3
from reojax.mechanics.momentum import momentum_matrices
from reojax.robot import Robot
from reojax.so3 import hat


def turn_per_change(
    robot: Robot,
    theta: Float[Array, " j"],
    theta_dot: Float[Array, " j"],
    rotation: Float[Array, "3 3"],
    momentum: Float[Array, "3"],
) -> tuple[Float[Array, "3 j"], Float[Array, "3 3"]]:
    """`G` and `N` of this module at one instant of a motion; `momentum` in the inertial frame. Nothing is checked."""
    h = rotation.T @ momentum

    def rates(theta: Array) -> tuple[Array, Array]:
        """Columns of the connection, and what the momentum turns the base by."""
        A, B = momentum_matrices(robot, theta)
        both = solve_symmetric3(A, jnp.concatenate([B, h[:, None]], axis=1))
        return both, both

    slope, both = jax.jacfwd(rates, has_aux=True)(theta)  # [:, k, i] = d_i of column k
    gamma, drift = both[:, :-1], both[:, -1]
    own = gamma @ theta_dot
    bent = jnp.einsum("aki,k->ai", slope[:, :-1], theta_dot) - jnp.einsum("aki,i->ak", slope[:, :-1], theta_dot)
    crossed = jnp.cross(gamma, (own + drift)[:, None], axis=0)  # of the curvature, and of what the momentum turns
    A, _ = momentum_matrices(robot, theta)
    pushed = solve_symmetric3(A, jnp.concatenate([jnp.cross(h[:, None], gamma, axis=0), hat(h) @ rotation.T], axis=1))
    count = robot.joints
    return rotation @ (bent + crossed + slope[:, -1] + pushed[:, :count]), rotation @ pushed[:, count:]

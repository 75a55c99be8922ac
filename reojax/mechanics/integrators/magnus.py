"""Magnus expansions: the rotation vector of a step of `R' = R hat(omega)`, omega known at Gauss nodes beforehand.

W. Magnus, Comm. Pure Appl. Math. 7, 1954; the quadratures are those of S. Blanes, F. Casas and J. Ros, BIT 40, 2000.
The signs of the commutators are those of a body frame, `R' = R hat(omega)` and not `R' = hat(omega) R`.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array

GAUSS_4 = (0.5 - 3**0.5 / 6, 0.5 + 3**0.5 / 6)
"""Shares of a step at which `magnus4` needs the angular velocity."""
GAUSS = (0.5 - 15**0.5 / 10, 0.5, 0.5 + 15**0.5 / 10)
"""Shares of a step at which `magnus6` and `end_rotation` need the angular velocity."""


def magnus4(first: Float[Array, "*s 3"], second: Float[Array, "*s 3"]) -> Array:
    """Rotation vector of a step, to fourth order; angular velocities at `GAUSS_4` times the step's duration."""
    return 0.5 * (first + second) + 3**0.5 / 12 * jnp.cross(first, second)


def magnus6(first: Float[Array, "*s 3"], middle: Float[Array, "*s 3"], last: Float[Array, "*s 3"]) -> Array:
    """Rotation vector of a step, to sixth order; angular velocities at `GAUSS` times the step's duration.

    Of NumPy arrays on the host, of others by JAX.
    """
    cross = np.cross if isinstance(first, np.ndarray) else jnp.cross
    # the first three moments of omega about the middle of the step
    a1, a2, a3 = middle, 15**0.5 / 3 * (last - first), 10 / 3 * (last - 2 * middle + first)
    # single and double commutators
    c1 = cross(a2, a1)
    c2 = -cross(2 * a3 + c1, a1) / 60
    return a1 + a3 / 12 + cross(a2 + c2, -20 * a1 - a3 + c1) / 240


def end_rotation(length: Float[Array, " s"], omega: Float[Array, "s 3 3"]) -> Float[Array, "3 3"]:
    """Rotation from the identity to the end of all steps, of an angular velocity that does not depend on it.

    All steps at once by `magnus6`, then their product in pairs.

    Args:
        length: (s,) durations of the steps [s].
        omega: (s, 3, 3) angular velocity at the nodes `GAUSS` of each step, one in each row [rad/s].
    """
    # rotation of every step, then products of pairs, of pairs of pairs, and so on
    turn = jax.vmap(so3.exp)(magnus6(*(length[:, None] * omega[:, i] for i in range(3))))
    while turn.shape[0] > 1:
        if turn.shape[0] % 2:
            turn = jnp.concatenate([turn, jnp.eye(3, dtype=turn.dtype)[None]])
        turn = jnp.matmul(turn[::2], turn[1::2], precision="highest")
    return turn[0]

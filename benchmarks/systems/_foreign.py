"""Momentum matrices of other people's models to angular velocity."""

import jax
import jax.numpy as jnp
import numpy as np


def omega_of(momentum: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Angular velocity of the base (m, 3) without momentum, of momentum matrices (m, 3, 6 + j) and rates (m, j).

    The matrices are about the centre of mass, in base axes; their columns are the base's linear velocity, its angular
    velocity and the joint rates.
    """
    h = np.einsum("mij,mj->mi", momentum[:, :, 6:], rate)
    return -np.linalg.solve(momentum[:, :, 3:6], h[:, :, None])[:, :, 0]


def omega_from_base_rows(inertia: jax.Array, push: jax.Array) -> jax.Array:
    """Angular velocity of the base (3,) without momentum, from rows of the mass matrix.

    Args:
        inertia: (6, 6) its block of the base, linear velocity first.
        push: (6,) its other columns times the joint rates.
    """
    mass, coupling = inertia[0, 0], inertia[:3, 3:]
    locked = inertia[3:, 3:] - coupling.T @ coupling / mass
    h = push[3:] - coupling.T @ push[:3] / mass
    x, y, z = locked
    columns = jnp.stack([jnp.cross(y, z), jnp.cross(z, x), jnp.cross(x, y)], axis=1)
    return -columns @ h / (x @ columns[:, 0])

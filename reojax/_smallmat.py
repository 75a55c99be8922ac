"""Closed-form 3x3 linear algebra. Batched LAPACK calls can deadlock on CPU, so nothing here uses any."""

import jax.numpy as jnp
from jaxtyping import Float

from reojax._arrays import Array


def solve_symmetric3(matrix: Float[Array, "3 3"], right: Float[Array, "3 k"]) -> Float[Array, "3 k"]:
    """Solve `matrix @ x = right` for a symmetric positive definite matrix by its adjugate (Cramer)."""
    x, y, z = matrix
    adjugate = jnp.stack([jnp.cross(y, z), jnp.cross(z, x), jnp.cross(x, y)])
    return adjugate @ right / jnp.dot(x, adjugate[0])

"""Linear algebra of small matrices. Batched LAPACK calls can deadlock on CPU, so nothing here uses any."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Float

from reojax._internal.arrays import Array


def solve_symmetric3(matrix: Float[Array, "3 3"], right: Float[Array, "3 k"]) -> Float[Array, "3 k"]:
    """Solve `matrix @ x = right` for a symmetric positive definite matrix by its adjugate (Cramer)."""
    size = jax.lax.stop_gradient(
        jnp.trace(matrix)
    )  # divided out, or else the determinant may leave the range of floats
    x, y, z = matrix / size
    adjugate = jnp.stack([jnp.cross(y, z), jnp.cross(z, x), jnp.cross(x, y)])
    return jnp.matmul(adjugate, right / size, precision="highest") / jnp.dot(x, adjugate[0], precision="highest")


def solve_positive(matrix: Float[Array, "n n"], right: Float[Array, "n ..."]) -> Float[Array, "n ..."]:
    """Solve `matrix @ x = right` for a symmetric positive definite matrix, by Cholesky; NaN for any other.

    Column by column, unrolled: meant for n up to some dozens. Its derivative solves with the same factor.

    Args:
        matrix: (n, n); only its lower triangle is read.
        right: (n,) or (n, k).
    """
    lower = cholesky(jax.lax.stop_gradient(matrix))
    symmetric = jnp.tril(matrix) + jnp.tril(matrix, -1).T

    def product(x: jax.Array) -> jax.Array:
        return jnp.matmul(symmetric, x, precision="highest")

    return jax.lax.custom_linear_solve(product, right, lambda _, b: cholesky_solve(lower, b), symmetric=True)


def cholesky(matrix: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """Lower triangular `L` of `L @ L.T = matrix`; NaN where the matrix is not positive definite."""
    n = matrix.shape[0]
    rest, columns = matrix, []
    for k in range(n):
        below = (jnp.arange(n) >= k).astype(matrix.dtype)
        column = below * rest[:, k] / jnp.sqrt(rest[k, k])
        columns.append(column)
        rest = rest - column[:, None] * column[None, :]
    return jnp.stack(columns, axis=1)


def cholesky_solve(lower: Float[Array, "n n"], right: Float[Array, "n ..."]) -> Float[Array, "n ..."]:
    """Solve `L @ L.T @ x = right` for a lower triangular `L`."""
    n = lower.shape[0]
    rest, forward = jnp.asarray(right), []
    for k in range(n):
        forward.append(rest[k] / lower[k, k])
        rest = rest - _outer(lower[:, k], forward[-1])
    rest, solution = jnp.stack(forward), []
    for k in reversed(range(n)):
        solution.append(rest[k] / lower[k, k])
        rest = rest - _outer(lower[k, :], solution[-1])
    return jnp.stack(solution[::-1])


def factor(matrix: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """Upper triangular `U` of `U.T @ U = matrix`, symmetric positive definite, for `solve_factored`.

    A loop, not unrolled: short to compile at any n. Where rounding has left nothing of a pivot, it becomes so large
    that this component of a solution is 0: the factor is always finite.
    """
    matrix = jnp.asarray(matrix)
    n = matrix.shape[0]
    least = 30 * jnp.finfo(matrix.dtype).eps * jnp.abs(jnp.diagonal(matrix))
    huge = jnp.sqrt(jnp.sqrt(jnp.finfo(matrix.dtype).max))

    def column(k: jax.Array, carry: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        rest, upper = carry
        row = jnp.where(jnp.arange(n) >= k, rest[k], 0.0)
        gone = row[k] <= least[k]
        row = jnp.where(gone, 0.0, row / jnp.sqrt(jnp.where(gone, 1.0, row[k])))
        return rest - row[:, None] * row[None, :], upper.at[k].set(row.at[k].max(jnp.where(gone, huge, 0.0)))

    return jax.lax.fori_loop(0, n, column, (matrix, jnp.zeros_like(matrix)))[1]


def solve_factored(upper: Float[Array, "n n"], right: Float[Array, " n"]) -> Float[Array, " n"]:
    """Solve `U.T @ U @ x = right` for an upper triangular `U`, in loops."""
    upper, right = jnp.asarray(upper), jnp.asarray(right)
    n = right.shape[0]

    def forward(k: jax.Array, rest: jax.Array) -> jax.Array:
        value = rest[k] / upper[k, k]
        return (rest - jnp.where(jnp.arange(n) > k, upper[k], 0.0) * value).at[k].set(value)

    def backward(i: jax.Array, rest: jax.Array) -> jax.Array:
        k = n - 1 - i
        behind = jnp.where(jnp.arange(n) > k, upper[k] * rest, 0.0).sum()
        return rest.at[k].set((rest[k] - behind) / upper[k, k])

    return jax.lax.fori_loop(0, n, backward, jax.lax.fori_loop(0, n, forward, right))


def _outer(column: Array, row: jax.Array) -> jax.Array:
    return jnp.multiply(column.reshape(-1, *(1,) * row.ndim), row[None])

"""Linear algebra of small matrices. Batched LAPACK calls can deadlock on CPU, so nothing here uses any."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

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


UNROLLED = 12
"""Largest matrix whose columns are written out one by one: a batch of 1000 is then solved three to four times faster
than by a loop over columns (4 x 4: 0.09 ms against 0.22 ms; 12 x 12: 1.1 ms against 3.2 ms). But the time to compile
grows with the size (12 x 12: 1.3 s; 24 x 24: 3.9 s, the loop 0.4 s), and one large system is solved no faster."""


def solve_positive(matrix: Float[Array, "n n"], right: Float[Array, "n ..."]) -> Float[Array, "n ..."]:
    """Solve `matrix @ x = right` for a symmetric positive definite matrix, by Cholesky; NaN for any other.

    Its derivative solves with the same factor.

    Args:
        matrix: (n, n); only its lower triangle is read.
        right: (n,) or (n, k).
    """
    lower = cholesky(jax.lax.stop_gradient(matrix))
    symmetric = jnp.tril(matrix) + jnp.tril(matrix, -1).T

    def product(x: jax.Array) -> jax.Array:
        return jnp.matmul(symmetric, x, precision="highest")

    return jax.lax.custom_linear_solve(product, right, lambda _, b: cholesky_solve(lower, b), symmetric=True)


def solve_without_exchange(matrix: Float[Array, "n n"], right: Float[Array, " n"]) -> Float[Array, " n"]:
    """Solve `matrix @ x = right` by elimination without exchange of rows (Gauss and Jordan).

    For matrices whose symmetric part is positive definite: there no pivot vanishes, and rounding stays small while the
    rest of the matrix is smaller than that part.
    """
    rows = jnp.arange(matrix.shape[0])

    def eliminate(rest: jax.Array, k: Any) -> tuple[jax.Array, None]:
        row = rest[k] / rest[k, k]
        return jnp.where((rows == k)[:, None], row[None], rest - rest[:, k][:, None] * row[None]), None

    both = jnp.concatenate([matrix, right[:, None]], axis=1)
    if len(rows) > UNROLLED:
        return jax.lax.scan(eliminate, both, rows)[0][:, -1]
    for k in range(len(rows)):
        both = eliminate(both, k)[0]
    return both[:, -1]


def cholesky(matrix: Float[Array, "n n"], *, drop: bool = False) -> Float[Array, "n n"]:
    """Lower triangular `L` of `L @ L.T = matrix`, symmetric positive definite; for `cholesky_solve`.

    Args:
        matrix: (n, n); only its lower triangle is read.
        drop: what becomes of a pivot of which rounding has left nothing. By default its column is NaN or infinite; if
            true, it is so large that this component of a solution is 0, and the factor is always finite.
    """
    matrix = jnp.asarray(matrix)
    rows = jnp.arange(matrix.shape[0])
    least = 30 * jnp.finfo(matrix.dtype).eps * jnp.abs(jnp.diagonal(matrix))
    huge = jnp.sqrt(jnp.sqrt(jnp.finfo(matrix.dtype).max))

    def column(rest: jax.Array, k: Any) -> tuple[jax.Array, jax.Array]:
        below = jnp.where(rows >= k, rest[:, k], 0.0)
        if drop:
            gone = below[k] <= least[k]
            below = jnp.where(gone, 0.0, below / jnp.sqrt(jnp.where(gone, 1.0, below[k])))
            found = jnp.where(gone & (rows == k), huge, below)
        else:
            found = below = below / jnp.sqrt(below[k])
        return rest - below[:, None] * below[None, :], found

    return _each(column, matrix, len(rows)).T


def cholesky_solve(lower: Float[Array, "n n"], right: Float[Array, "n ..."]) -> Float[Array, "n ..."]:
    """Solve `L @ L.T @ x = right` for a lower triangular `L`."""
    lower, right = jnp.asarray(lower), jnp.asarray(right)

    def forward(rest: jax.Array, k: Any) -> tuple[jax.Array, jax.Array]:  # L y = right
        value = rest[k] / lower[k, k]
        return rest - _outer(lower[:, k], value), value

    def backward(rest: jax.Array, k: Any) -> tuple[jax.Array, jax.Array]:  # L.T x = y
        value = rest[k] / lower[k, k]
        return rest - _outer(lower[k, :], value), value

    n = lower.shape[0]
    return _each(backward, _each(forward, right, n), n, reverse=True)


def _each(
    step: Callable[[Any, Any], tuple[jax.Array, jax.Array]], carry: jax.Array, n: int, reverse: bool = False
) -> jax.Array:
    """What `step` finds at each k from 0 to n - 1, or back, on what the ones before left; (n, ...) in order of k."""
    if n > UNROLLED:
        return jax.lax.scan(step, carry, jnp.arange(n), reverse=reverse)[1]
    found = {}
    for k in reversed(range(n)) if reverse else range(n):
        carry, found[k] = step(carry, k)
    return jnp.stack([found[k] for k in range(n)])


def _outer(column: Array, row: jax.Array) -> jax.Array:
    return jnp.multiply(column.reshape(-1, *(1,) * row.ndim), row[None])

"""Linear algebra without LAPACK, against NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from reojax._internal.linalg import cholesky, solve_positive, solve_symmetric3


def positive(n: int, seed: int = 0) -> np.ndarray:
    root = np.random.default_rng(seed).normal(size=(n, n))
    return root @ root.T + 0.1 * np.eye(n)


@pytest.mark.parametrize("n", [1, 3, 8])
@pytest.mark.parametrize("columns", [(), (2,)])
def test_solves(n, columns):
    matrix, right = positive(n), np.random.default_rng(1).normal(size=(n, *columns))
    np.testing.assert_allclose(solve_positive(matrix, right), np.linalg.solve(matrix, right), rtol=1e-11)


def test_closed_form_of_three():
    matrix, right = positive(3), np.eye(3)
    np.testing.assert_allclose(solve_symmetric3(matrix, right), np.linalg.inv(matrix), rtol=1e-11)


def test_factor():
    np.testing.assert_allclose(cholesky(positive(5)), np.linalg.cholesky(positive(5)), rtol=1e-12, atol=1e-14)


def test_gradient_in_both_modes():
    root, right = np.random.default_rng(2).normal(size=(2, 4, 4))
    f = lambda r: (solve_positive(r @ r.T + jnp.eye(4), right) ** 2).sum()
    step = 1e-6 * np.random.default_rng(3).normal(size=(4, 4))
    difference = (f(root + step) - f(root - step)) / 2
    np.testing.assert_allclose((jax.grad(f)(root) * step).sum(), difference, rtol=1e-6)
    np.testing.assert_allclose((jax.jacfwd(f)(root) * step).sum(), difference, rtol=1e-6)


def test_batches_call_no_lapack():
    f = jax.vmap(jax.grad(lambda m: solve_positive(m, jnp.ones(3)).sum()))
    assert "lapack_" not in jax.jit(f).lower(np.stack([positive(3)] * 2)).as_text()

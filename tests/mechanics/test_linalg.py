"""Linear algebra without LAPACK, against NumPy."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from reojax._internal import linalg
from reojax._internal.linalg import cholesky, cholesky_solve, solve_positive, solve_symmetric3

solve = jax.jit(solve_positive)
LARGE = linalg.UNROLLED + 3


def positive(n: int, seed: int = 0) -> np.ndarray:
    root = np.random.default_rng(seed).normal(size=(n, n))
    return root @ root.T + 0.1 * np.eye(n)


@pytest.mark.parametrize("n", [1, 3, 8, LARGE])
@pytest.mark.parametrize("columns", [(), (2,)])
def test_solves(n, columns):
    matrix, right = positive(n), np.random.default_rng(1).normal(size=(n, *columns))
    np.testing.assert_allclose(solve(matrix, right), np.linalg.solve(matrix, right), rtol=1e-10)


def test_closed_form_of_three():
    matrix, right = positive(3), np.eye(3)
    np.testing.assert_allclose(jax.jit(solve_symmetric3)(matrix, right), np.linalg.inv(matrix), rtol=1e-11)


@pytest.mark.parametrize("n", [5, LARGE])
def test_factor_reads_the_lower_triangle(n):
    lower = jax.jit(cholesky)(np.tril(positive(n)))
    np.testing.assert_allclose(lower, np.linalg.cholesky(positive(n)), rtol=1e-11, atol=1e-13)


def both(matrix, right, *, drop):
    """The factor and the solution by it."""
    lower = cholesky(matrix, drop=drop)
    return lower, cholesky_solve(lower, right)


@pytest.mark.parametrize("drop", [False, True])
def test_written_out_and_looped_are_the_same(drop, monkeypatch):
    matrix, right = positive(6), np.random.default_rng(1).normal(size=(6, 2))
    answers = []
    for largest in (6, 5):
        monkeypatch.setattr(linalg, "UNROLLED", largest)
        lowered = jax.jit(partial(both, drop=drop)).lower(matrix, right)
        answers.append(lowered.compile()(matrix, right))
        assert ("while" in lowered.as_text()) == (largest == 5)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-15), *answers)


@pytest.mark.parametrize("n", [4, LARGE])
def test_only_dropping_solves_a_singular_matrix(n):
    root = np.random.default_rng(4).normal(size=(n, n - 1))
    root[-1] = root[0]  # two components that the matrix cannot tell apart: the second one becomes 0
    matrix = root @ root.T
    right = matrix @ np.ones(n)
    found = jax.jit(partial(both, drop=True))(matrix, right)[1]
    np.testing.assert_allclose(matrix @ found, right, rtol=1e-8)
    assert abs(found[-1]) < 1e-60
    with jax.debug_nans(False):
        assert not np.isfinite(solve(-np.eye(n), np.ones(n))).any()


def test_gradient_in_both_modes():
    root, right = np.random.default_rng(2).normal(size=(2, 4, 4))
    f = jax.jit(lambda r: (solve_positive(r @ r.T + jnp.eye(4), right) ** 2).sum())
    step = 1e-6 * np.random.default_rng(3).normal(size=(4, 4))
    difference = (f(root + step) - f(root - step)) / 2
    np.testing.assert_allclose((jax.jit(jax.grad(f))(root) * step).sum(), difference, rtol=1e-6)
    np.testing.assert_allclose((jax.jit(jax.jacfwd(f))(root) * step).sum(), difference, rtol=1e-6)


@pytest.mark.parametrize("n", [3, LARGE])
def test_batches_call_no_lapack(n):
    f = jax.vmap(jax.grad(lambda m: solve_positive(m, jnp.ones(n)).sum()))
    assert "lapack_" not in jax.jit(f).lower(np.stack([positive(n)] * 2)).as_text()

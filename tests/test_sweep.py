"""Sweeps: every design at its place, whatever the sizes; bad designs told by their values."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax


def sums(x, y):
    """A cheap function with arrays of several shapes and types."""
    return {"sum": x + 10 * y, "both": (jnp.stack([x, y]), x > y)}


@pytest.mark.parametrize("chunk_size", [None, 1, 4, 100])
def test_every_design_at_its_place(chunk_size):
    """Grid shape in front of each array, whatever the chunks."""
    axes = {"x": np.arange(5.0), "y": np.array([2.0, 0.5, -1.0])}
    found = reojax.sweep(sums, axes, chunk_size=chunk_size, progress=False)
    x, y = np.meshgrid(*axes.values(), indexing="ij")
    np.testing.assert_array_equal(found.results["sum"], x + 10 * y)
    np.testing.assert_array_equal(found.results["both"][0], np.stack([x, y], -1))
    np.testing.assert_array_equal(found.results["both"][1], x > y)
    assert found.shape == (5, 3)
    assert found.bad == []


def test_a_list_of_designs():
    found = reojax.sweep(sums, reojax.zipped(x=[1, 2, 3], y=np.float32([0.5, 1, 2])), progress=False)
    assert found.shape == (3,)
    np.testing.assert_array_equal(found.results["sum"], [6, 12, 23])
    assert found.results["sum"].dtype == np.float32


def test_a_result_that_is_not_finite_is_told_by_its_design():
    found = reojax.sweep(lambda x, y: jnp.sqrt(x) / y, {"x": [4.0, -1.0], "y": [1.0, 2.0]}, progress=False)
    assert [(bad.position, bad.design) for bad in found.bad] == [
        ((1, 0), {"x": -1.0, "y": 1.0}),
        ((1, 1), {"x": -1.0, "y": 2.0}),
    ]
    assert "`result` is not finite" in found.bad[0].reason
    np.testing.assert_array_equal(found.results, [[2, 1], [np.nan, np.nan]])


def test_an_exception_in_one_design_loses_no_other():
    def host(x):
        if x == 2:
            raise RuntimeError("two is too much")
        return np.asarray(x)

    def function(x):
        return jax.pure_callback(host, jax.ShapeDtypeStruct((), float), x, vmap_method="sequential")

    found = reojax.sweep(function, {"x": np.arange(4.0)}, progress=False)
    np.testing.assert_array_equal(found.results, [0, 1, np.nan, 3])
    assert [bad.design for bad in found.bad] == [{"x": 2.0}]
    assert "two is too much" in found.bad[0].reason

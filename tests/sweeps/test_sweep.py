"""Sweeps: every design at its place, whatever the sizes; bad designs told by their values."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax.sweeps.chunks import chunking


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


def test_robots_in_the_closure_and_any_types():
    """Integers stay integers, float32 stays float32, and the function may close over anything."""
    table = np.array([3, 1, 4])
    found = reojax.sweep(lambda row: {"entry": jnp.asarray(table)[row]}, {"row": np.array([2, 0])}, progress=False)
    np.testing.assert_array_equal(found.results["entry"], [4, 3])
    assert found.results["entry"].dtype.kind == "i"
    single = reojax.sweep(lambda x: x * 2, {"x": np.float32([1, 2])}, progress=False)
    assert single.results.dtype == np.float32


def test_many_more_designs_than_a_block():
    """Chunks of several blocks, the last of them padded, in grid order."""
    axes = {"x": np.arange(300.0), "y": np.arange(70.0)}
    found = reojax.sweep(lambda x, y: 1000 * x + y, axes, progress=False)
    np.testing.assert_array_equal(found.results, np.add.outer(1000 * axes["x"], axes["y"]))
    found = reojax.sweep(lambda x, y: 1000 * x + y, axes, chunk_size=5001, progress=False)
    np.testing.assert_array_equal(found.results, np.add.outer(1000 * axes["x"], axes["y"]))


@pytest.mark.parametrize(
    ("total", "chunk_size", "expected"),
    [
        (1, None, (1, 1, 1)),
        (1000, None, (1000, 1000, 1)),
        (5341, None, (1024, 1024, 1)),
        (10**7, None, (65536, 1024, 64)),
        (10**10, None, (65536, 1024, 64)),
        (10**7, 1000, (1000, 1000, 1)),
        (10**7, 1500, (1500, 750, 2)),
        (10, 1000, (10, 10, 1)),
    ],
)
def test_chunks_hold_blocks(total, chunk_size, expected):
    sizes = chunking(total, chunk_size, 24, "cpu")
    assert sizes == (total, *expected)
    assert sizes.bounds(sizes.chunks - 1)[1] == total


def test_chunks_of_large_results_are_smaller():
    sizes = chunking(10**6, None, 36_000, "cpu")
    assert sizes.chunk * 36_000 <= 2**26


def test_xarray_is_labelled():
    xarray = pytest.importorskip("xarray")
    units = {"x": "rad", "sum": "m"}
    found = reojax.sweep(sums, {"x": [0.0, 1.0], "y": [2.0, 3.0, 4.0]}, units=units, progress=False)
    table = found.to_xarray()
    assert isinstance(table, xarray.Dataset)
    assert float(table["sum"].sel(x=1.0, y=3.0)) == 31
    assert table["sum"].attrs == {"units": "m"}
    assert table["x"].attrs == {"units": "rad"}
    assert table["both.0"].shape == (2, 3, 2)
    listed = reojax.sweep(sums, reojax.zipped(x=[0.0, 1.0], y=[2.0, 3.0]), units=units, progress=False).to_xarray()
    assert listed["sum"].dims == ("design",)
    assert listed["x"].dims == ("design",)


def test_an_archive_is_plain_numpy(tmp_path):
    found = reojax.sweep(sums, {"x": [0.0, 1.0], "y": [2.0]}, units={"x": "rad"}, progress=False)
    found.save(tmp_path / "s.npz")
    with np.load(tmp_path / "s.npz", allow_pickle=False) as file:
        assert set(file) == {"about", "axes/x", "axes/y", "results/sum", "results/both.0", "results/both.1"}
        np.testing.assert_array_equal(file["results/sum"], [[20], [21]])
    again = reojax.Sweep.load(tmp_path / "s.npz")
    assert again.units == {"x": "rad"}
    np.testing.assert_array_equal(again.results["both.1"], found.results["both"][1])
    (tmp_path / "t.npz").write_bytes((tmp_path / "s.npz").read_bytes()[:300])
    for path in ("t.npz", "none.npz"):
        with pytest.raises(ValueError, match="cannot read .* as a sweep"):
            reojax.Sweep.load(tmp_path / path)


def test_designs_that_fail_are_logged_with_their_values(caplog):
    reojax.sweep(lambda x: 1 / x, {"x": np.append(np.zeros(7), 0.5)}, progress=False)
    assert caplog.text.count("x=0: `result` is not finite") == 5
    assert "7 of 8 designs gave no finite result" in caplog.text


AXES = {"x": [1.0, 2.0], "y": [1.0]}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"axes": {}}, "`axes` is {}; it must map at least one name"),
        ({"axes": [1.0, 2.0]}, r"`axes` is \[1.0, 2.0\]; it must map"),
        ({"axes": {"x": [], "y": [1.0]}}, r"axis 'x' has shape \(0,\)"),
        ({"axes": {"x": 3.0, "y": [1.0]}}, r"axis 'x' has shape \(\)"),
        ({"axes": {"x": [[1.0]], "y": [1.0]}}, r"axis 'x' has shape \(1, 1\)"),
        ({"axes": {"x": [1.0, np.nan], "y": [1.0]}}, r"x\[1\] is nan; values of an axis must be finite"),
        ({"axes": {"x": ["a"], "y": [1.0]}}, "axis 'x' has entries of type"),
        ({"axes": {"x": [True], "y": [1.0]}}, "axis 'x' has entries of type bool"),
        ({"axes": {"x": [1j], "y": [1.0]}}, "axis 'x' has entries of type complex"),
        ({"axes": {"x": [[1.0], [1.0, 2.0]], "y": [1.0]}}, "axis 'x' is .*; it must be a list of real numbers"),
        ({"axes": {3: [1.0]}}, "an axis is named 3; names must be text"),
        ({"axes": {"x": [1.0]}}, "the axes are x: missing a required argument: 'y'"),
        ({"axes": {"x": [1.0], "y": [1.0], "z": [1.0]}}, "the axes are x, y, z: got an unexpected keyword"),
        ({"axes": reojax.zipped(x=[1.0, 2.0], y=[1.0])}, "zipped axes must be equally long; they have x 2, y 1 values"),
        ({"function": 3}, "`function` is 3; it must be a function"),
        ({"function": lambda x, y: None}, "`function` returns no array"),
        ({"function": lambda x, y: "text"}, "`function` must return arrays"),
        ({"function": lambda x, y: {"a": {"b": x}, "a.b": y}}, "several arrays of the same name"),
        ({"function": lambda x, y: jnp.bfloat16(x)}, "`result` has entries of type bfloat16"),
        ({"chunk_size": 0}, "`chunk_size` is 0; it must be a positive integer"),
        ({"chunk_size": 2.5}, "`chunk_size` is 2.5; it must be a positive integer"),
        ({"units": {"z": "m"}}, r"units\['z'\] is 'm'; .* of one of x, y, both.0, both.1, sum"),
        ({"units": {"x": 3}}, r"units\['x'\] is 3"),
        ({"shard": (0, 2)}, "a shard's results go into a `store`"),
        ({"shard": (2, 2), "store": "s"}, r"`shard` is \(2, 2\)"),
        ({"shard": 1, "store": "s"}, "`shard` is 1; it must be"),
    ],
)
def test_bad_input_is_named(tmp_path, monkeypatch, change, message):
    monkeypatch.chdir(tmp_path)
    arguments = {"function": sums, "axes": AXES, "progress": False} | change
    with pytest.raises(ValueError, match=message):
        reojax.sweep(**arguments)
    assert list(tmp_path.iterdir()) == []


def test_too_much_for_memory_is_refused_before_it_is_computed(monkeypatch):
    """On any machine, also where the system does not tell."""
    axes = {"x": np.arange(1e6), "y": np.arange(1e6)}
    monkeypatch.setattr("reojax.sweeps.memory.available", lambda: 2**34)
    with pytest.raises(ValueError, match=r"1e\+12 designs take .* GiB of memory, and .* are free; give a `store`"):
        reojax.sweep(lambda x, y: x * y, axes, progress=False)


def test_a_sweep_runs_outside_jit():
    with pytest.raises(ValueError, match="axis 'x' is being traced by JAX"):
        jax.jit(lambda x: reojax.sweep(lambda x: x, {"x": x}))(np.ones(2))

"""Sweeps on disk: killed, resumed, shared, damaged, and mistaken for one another."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import tracemalloc
import zipfile
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import sweep_child

import reojax
from reojax.sweeps import merge
from reojax.sweeps.store import Store, open_store

CHILD = Path(sweep_child.__file__)
AXES = {"x": np.arange(6.0), "y": np.array([1.0, 2.0])}


def area(x, y):
    return {"area": x * y, "sides": jnp.stack([x, y])}


def child(store, **options) -> subprocess.Popen:
    command = [sys.executable, str(CHILD), str(store), json.dumps(options)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def files(store) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in Path(store).iterdir()}


def small(store, function=area, axes=AXES, chunk_size=5, **options):
    return reojax.sweep(function, axes, chunk_size=chunk_size, store=store, progress=False, **options)


def test_others_read_a_store_with_numpy_alone(tmp_path):
    """Chunks have their designs in front, and say which ones these are."""
    found = small(tmp_path / "s", units={"x": "m", "area": "m^2"})
    manifest = json.loads((tmp_path / "s" / "sweep.json").read_text())
    assert manifest["units"] == {"x": "m", "area": "m^2"}
    axes = np.load(tmp_path / "s" / "axes.npz")
    np.testing.assert_array_equal(axes["axes/x"], AXES["x"])
    table = np.full(12, np.nan)
    for path in (tmp_path / "s").glob("chunk-*.npz"):
        chunk = np.load(path, allow_pickle=False)
        table[chunk["start"] : chunk["stop"]] = chunk["results/area"]
    np.testing.assert_array_equal(table.reshape(6, 2), np.outer(*AXES.values()))
    np.testing.assert_array_equal(found.results["area"], table.reshape(6, 2))
    assert found.results["sides"].shape == (6, 2, 2)


def test_a_finished_store_is_not_computed_again(tmp_path, monkeypatch):
    first = small(tmp_path / "s")
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "s").iterdir()}
    again = small(tmp_path / "s")
    np.testing.assert_array_equal(first.results["sides"], again.results["sides"])
    assert before == {path: path.stat().st_mtime_ns for path in (tmp_path / "s").iterdir()}


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "foreign"])
def test_a_damaged_chunk_is_noticed_and_done_again(tmp_path, damage):
    whole = small(tmp_path / "s").results["sides"]
    path = tmp_path / "s" / "chunk-00000001.npz"
    good = path.read_bytes()
    place = good.index(np.float64(3).tobytes())  # a number of the results
    path.write_bytes(
        {
            "cut": good[: len(good) // 2],
            "flipped": good[:place] + b"\x01" + good[place + 1 :],
            "empty": b"",
            "foreign": (tmp_path / "s" / "chunk-00000000.npz").read_bytes(),
        }[damage]
    )
    with pytest.raises(ValueError, match=r"of 3 chunks in .* there are damaged 1; run"):
        merge(tmp_path / "s")
    np.testing.assert_array_equal(small(tmp_path / "s").results["sides"], whole)
    assert path.read_bytes() == good


def test_no_damage_is_an_error_and_none_goes_unseen(tmp_path):
    """One bit flipped in every second byte of a chunk, zip directory included: as good as not there, or the same."""
    function = lambda x, y: {"a": jnp.sqrt(x - 2) * y}
    small(tmp_path / "s", function)
    store = open_store(tmp_path / "s")
    whole = store.get(0)
    good, bits, noticed = store.file(0).read_bytes(), random.Random(2), 0
    assert whole is not None
    assert len(whole.bad) == 4
    for place in range(0, len(good), 2):
        store.file(0).write_bytes(good[:place] + bytes([good[place] ^ 1 << bits.randrange(8)]) + good[place + 1 :])
        found = store.get(0)
        noticed += found is None
        if found is not None:
            np.testing.assert_array_equal(found.results[0], whole.results[0])
            assert found.bad == whole.bad
    assert noticed > 0.4 * len(good)


def rewritten(file, compression=zipfile.ZIP_STORED, **changed):
    """The archive with other arrays in it."""
    arrays = {**dict(np.load(file)), **changed}
    with zipfile.ZipFile(file, "w", compression) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, np.asarray(array))


@pytest.mark.parametrize(
    "changed",
    [
        {"bad/design": np.array([5]), "bad/reason": np.array(["of another chunk"])},
        {"bad/design": np.array([0, 0]), "bad/reason": np.array(["twice", "twice"])},
        {"bad/design": np.array([0.5]), "bad/reason": np.array(["no number"])},
        {"bad/design": np.array([1, 2]), "bad/reason": np.array(["one for two"])},
        {"start": np.array([0, 1])},
        {"hash": np.arange(3)},
        {"results/area": np.zeros((5, 1))},
        {"results/sides": np.zeros((5, 2), np.float32)},
    ],
)
def test_a_chunk_with_other_arrays_is_none(tmp_path, changed):
    small(tmp_path / "s")
    store = open_store(tmp_path / "s")
    rewritten(store.file(0))
    assert store.get(0) is not None
    rewritten(store.file(0), **changed)
    assert store.get(0) is None


def test_a_bomb_is_not_unpacked(tmp_path):
    """What would be 800 MB is refused by its size; so is a saved sweep."""
    small(tmp_path / "s")
    store = open_store(tmp_path / "s")
    bomb = np.broadcast_to(0.0, (10**8,))
    rewritten(store.file(0), zipfile.ZIP_DEFLATED, **{"results/area": bomb})
    tracemalloc.start()
    assert store.get(0) is None
    with pytest.raises(ValueError, match="cannot read .* is compressed"):
        reojax.Sweep.load(store.file(0))
    assert tracemalloc.get_traced_memory()[1] < 1e7
    tracemalloc.stop()


HOSTILE = [None, True, -1, 0, 1, 2.5, 10**30, "", "x", "float64", [], [1], [-1], {}, {"x": 1}]


def places(data, at=()):
    """Every entry of a JSON document, as a chain of keys."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    yield at
    for key, value in items:
        yield from places(value, (*at, key))


def test_no_entry_of_a_manifest_is_believed(tmp_path):
    """Each is replaced by each of a list of hostile values: a clear refusal, or results as they were."""
    whole = small(tmp_path / "s", partial(with_robot, PROTOTYPE), units={"x": "m"}).results["area"]
    file = tmp_path / "s" / "sweep.json"
    good, refusals = file.read_text(), []
    for place in places(json.loads(good)):
        for value in HOSTILE:
            data = json.loads(good)
            inner = data
            for key in place[:-1]:
                inner = inner[key]
            if place:
                inner[place[-1]] = value
            file.write_text(json.dumps(data if place else value))
            try:
                merged = merge(tmp_path / "s").results["area"]
            except ValueError as error:
                refusals.append(str(error))
            else:
                np.testing.assert_array_equal(merged, whole)
    assert len(refusals) > 400
    assert all("is not the store of a sweep" in text or "of 3 chunks in" in text for text in refusals)


@pytest.mark.parametrize("text", ["[" * 10**5, "\ud800", '{"identity": NaN}', "\x00"])
def test_a_manifest_that_is_no_json(tmp_path, text):
    small(tmp_path / "s")
    (tmp_path / "s" / "sweep.json").write_text(text, errors="surrogatepass")
    with pytest.raises(ValueError, match="is not the store of a sweep"):
        merge(tmp_path / "s")


@pytest.mark.parametrize("when", [1, 3])
def test_a_store_that_goes_while_the_sweep_runs_is_noticed(tmp_path, monkeypatch, when):
    put, done = Store.put, []

    def put_and_remove(self, chunk):
        put(self, chunk)
        done.append(chunk.number)
        if len(done) == when:
            shutil.rmtree(self.folder)

    monkeypatch.setattr(Store, "put", put_and_remove)
    with pytest.raises(ValueError, match=r"has lost 3 chunks, the first one 0|there is no folder"):
        small(tmp_path / "s")


def other_area(x, y):
    return {"area": x * y * 2, "sides": jnp.stack([x, y])}


SCALE = {"factor": 2.0}


def with_robot(robot, x, y):
    return {"area": robot.mass.sum() * x * y, "sides": jnp.stack([x, y])}


PROTOTYPE = reojax.robots.prototype()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"function": other_area}, "another function"),
        ({"function": lambda x, y: x * y}, "other results"),
        ({"axes": {"x": np.arange(6.0), "y": np.array([1.0, 3.0])}}, r"axis 'y' \(2 values\) other values"),
        ({"axes": {"y": AXES["y"], "x": AXES["x"]}}, r"axes \['x', 'y'\], now \['y', 'x'\]"),
        ({"axes": reojax.zipped(x=np.arange(2.0), y=AXES["y"])}, "zipped False, now True"),
        ({"chunk_size": 4}, "chunk size 5, now 4"),
    ],
)
def test_a_store_of_another_sweep_is_refused_by_name(tmp_path, change, message):
    small(tmp_path / "s")
    before = files(tmp_path / "s")
    with pytest.raises(ValueError, match=message):
        small(tmp_path / "s", **change)
    assert files(tmp_path / "s") == before


def test_a_store_of_another_robot_or_version_is_refused_by_name(tmp_path, monkeypatch):
    small(tmp_path / "s", partial(with_robot, PROTOTYPE))
    heavier = jax.tree.map(jnp.asarray, PROTOTYPE.replace(mass=PROTOTYPE.mass * 2))
    with pytest.raises(ValueError, match="robot 'prototype'.* with other numbers; another function"):
        small(tmp_path / "s", partial(with_robot, heavier))
    small(tmp_path / "s", partial(with_robot, jax.tree.map(np.array, PROTOTYPE)))
    monkeypatch.setattr(jax, "__version__", "0.0.1")
    with pytest.raises(ValueError, match=r"jax version '.*', now '0\.0\.1'"):
        small(tmp_path / "s", partial(with_robot, PROTOTYPE))


def test_shards_make_up_the_sweep(tmp_path):
    """Two shards in folders of their own; merged they are the sweep, and before that what is missing is named."""
    whole = small(tmp_path / "whole")
    for i in range(2):
        small(tmp_path / str(i), shard=(i, 2))
    with pytest.raises(ValueError, match="of 3 chunks in .* there are missing 1; run"):
        merge(tmp_path / "0")
    with pytest.raises(ValueError, match="missing 0, 2;"):
        _ = small(tmp_path / "1", shard=(1, 2)).results
    merged = merge(tmp_path / "0", tmp_path / "1")
    np.testing.assert_array_equal(merged.results["sides"], whole.results["sides"])
    small(tmp_path / "other", other_area)
    with pytest.raises(ValueError, match="hold different sweeps: another function"):
        merge(tmp_path / "0", tmp_path / "other")


def test_bad_designs_are_remembered(tmp_path):
    function = lambda x, y: jnp.log(5 - x) * y
    designs = [{"x": 5.0, "y": 1.0}, {"x": 5.0, "y": 2.0}]  # in the last chunk
    for _ in range(2):
        assert [bad.design for bad in small(tmp_path / "s", function).bad] == designs
    merged = merge(tmp_path / "s")
    assert [bad.design for bad in merged.bad] == designs
    merged.save(tmp_path / "m.npz")
    assert [bad.design for bad in reojax.Sweep.load(tmp_path / "m.npz").bad] == designs


def test_killed_at_any_moment_it_goes_on(tmp_path):
    """`kill -9` three times while chunks are written; no finished one is lost, and the end is the same."""
    store = tmp_path / "s"
    moments, seen = random.Random(1), 0
    for _ in range(3):
        process = child(store, function="cheap", chunk_size=1)
        while len(list(store.glob("chunk-*.npz"))) <= seen and process.poll() is None:
            time.sleep(0.002)
        time.sleep(moments.uniform(0, 0.05))
        process.send_signal(signal.SIGKILL)
        process.communicate()
        before, seen = seen, len(list(store.glob("chunk-*.npz")))
        assert seen > before or seen == 63
    stamps = {path: path.stat().st_mtime_ns for path in store.glob("chunk-*.npz")}
    found = sweep_child.run(store, function="cheap", chunk_size=1)
    np.testing.assert_array_equal(
        found.results, reojax.sweep(sweep_child.cheap, sweep_child.AXES, chunk_size=1, progress=False).results
    )
    assert {path: path.stat().st_mtime_ns for path in stamps} == stamps


def test_two_processes_share_a_store(tmp_path):
    """They end well, and the store is whole."""
    both = [child(tmp_path / "s", function="cheap", chunk_size=1) for _ in range(2)]
    for process in both:
        _, complaint = process.communicate()
        assert (process.returncode, complaint) == (0, "")
    expected = reojax.sweep(sweep_child.cheap, sweep_child.AXES, chunk_size=1, progress=False)
    np.testing.assert_array_equal(merge(tmp_path / "s").results["result"], expected.results)
    assert not list((tmp_path / "s").glob(".reojax*"))


def test_ctrl_c_keeps_what_is_stored(tmp_path, monkeypatch):
    put, done = Store.put, []

    def put_two(self, chunk):
        if len(done) == 2:
            raise KeyboardInterrupt
        done.append(chunk.number)
        put(self, chunk)

    monkeypatch.setattr(Store, "put", put_two)
    with pytest.raises(KeyboardInterrupt) as interrupt:
        small(tmp_path / "s")
    assert "the same sweep goes on from there" in interrupt.value.__notes__[0]
    assert len(list((tmp_path / "s").glob("chunk-*.npz"))) == 2


def test_axes_of_another_sweep_in_a_store_are_noticed(tmp_path):
    small(tmp_path / "s")
    small(tmp_path / "t", axes={"x": AXES["x"], "y": np.array([1.0, 3.0])})
    (tmp_path / "s" / "axes.npz").write_bytes((tmp_path / "t" / "axes.npz").read_bytes())
    with pytest.raises(ValueError, match=r"axes.npz and sweep.json do not belong together"):
        merge(tmp_path / "s")


@pytest.mark.parametrize("damage", [b"", b"{}", b'{"identity": {"schema": "x"}, "units": {}}'])
def test_a_folder_that_is_no_store(tmp_path, damage):
    with pytest.raises(ValueError, match="is not the store of a sweep"):
        merge(tmp_path)
    (tmp_path / "sweep.json").write_bytes(damage)
    with pytest.raises(ValueError, match="is not the store of a sweep"):
        small(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(ValueError, match="cannot use .* as a store"):
        small(tmp_path / "file")


def test_what_a_killed_process_left_is_removed(tmp_path):
    """Not what another one may be writing just now."""
    for name, age in (("old", 1e4), ("new", 0)):
        (tmp_path / f".reojax-{name}").touch()
        os.utime(tmp_path / f".reojax-{name}", (time.time() - age,) * 2)
    small(tmp_path)
    assert [file.name for file in tmp_path.glob(".reojax-*")] == [".reojax-new"]

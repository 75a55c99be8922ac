"""`reojax sweep` and `reojax merge`: what the library computes, in files and pictures; one line for bad input."""

import json
import os

import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import plot
from reojax.cli import _turns as turns, main
from reojax.mechanics.attitude import tilt_and_roll


@pytest.fixture(autouse=True)
def _no_cache(monkeypatch):
    monkeypatch.setenv("REOJAX_CACHE", "0")


@pytest.fixture
def _cheap(monkeypatch):
    """Instead of a turn something that compiles at once; not finite at bend 0."""

    def function(**design):
        return {"roll": design["twist"] + 10 * jnp.log(design["bend"])}

    monkeypatch.setattr(turns, "turn_function", lambda *_: function)


def test_sweep_writes_what_the_library_computes(capsys, tmp_path):
    """Degrees and kg mm^2 in, SI in the file; the roll is counted on past half a turn."""
    out, picture = tmp_path / "sweep.npz", tmp_path / "sweep.png"
    axes = ["twist=0:270:2", "end_inertia=70,100", "gear=24"]
    assert main(["sweep", *axes, "--out", str(out), "--picture", str(picture), "--json", "--quiet"]) == 0
    printed, complaint = capsys.readouterr()
    report = json.loads(printed)
    assert complaint == ""
    assert report["shape"] == {"twist": 2, "end_inertia": 2, "gear": 1}
    found = reojax.Sweep.load(out)
    np.testing.assert_allclose(found.axes["twist"], np.deg2rad([0, 270]))
    np.testing.assert_allclose(found.axes["end_inertia"], [70e-6, 100e-6])
    assert found.units["end_inertia"] == "kg m^2"
    assert found.units["roll"] == "rad"
    robot = reojax.robots.with_end_inertia(reojax.robots.prototype(), 100e-6)
    path = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
    history = np.asarray(reojax.rotation_history(robot, path, samples=16))
    tilt_x, tilt_y, roll = tilt_and_roll(history)[-1]
    here = {name: values[1, 1, 0] for name, values in found.results.items()}
    assert here["roll"] == pytest.approx(roll, abs=1e-9)
    assert here["roll"] > np.pi
    assert here["off_axis"] == pytest.approx(np.hypot(tilt_x, tilt_y), abs=1e-9)
    assert here["angle"] == pytest.approx(float(reojax.so3.angle(history[-1])), abs=1e-9)
    assert here["travel"] == pytest.approx(np.deg2rad(4 * 270 + 2 * 120))
    assert report["results"]["roll"]["most"]["value"] == pytest.approx(np.rad2deg(here["roll"]))
    assert report["results"]["roll"]["most"]["at"] == "twist 270, end_inertia 100, gear 24"
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.usefixtures("_cheap")
def test_shards_are_merged_and_what_is_missing_is_named(capsys, tmp_path):
    store, out = str(tmp_path / "s"), tmp_path / "m.npz"
    options = ["sweep", "twist=0:90:10", "bend=10,20", "--store", store, "--chunk-size", "5", "--quiet"]
    options += ["--outputs", "roll"]
    assert main([*options, "--shard", "1/3"]) == 0
    assert main(["merge", store, "--out", str(out)]) == 2
    assert "of 4 chunks" in (complaint := capsys.readouterr().err)
    assert "missing 0, 2-3;" in complaint
    assert not out.exists()
    for shard in ("0/3", "2/3"):
        assert main([*options, "--shard", shard]) == 0
    capsys.readouterr()
    assert main(["merge", store, "--out", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["designs"] == 20
    merged = reojax.Sweep.load(out)
    expected = np.add.outer(np.deg2rad(np.linspace(0, 90, 10)), 10 * np.log(np.deg2rad([10, 20])))
    np.testing.assert_allclose(merged.results["roll"], expected, rtol=1e-14)


@pytest.mark.usefixtures("_cheap")
def test_bad_designs_are_told_in_degrees_and_by_status_1(capsys, tmp_path):
    out = tmp_path / "s.npz"
    axes = ["twist=0:90:2", "bend=0:20:2", "--outputs", "roll", "--quiet"]
    assert main(["sweep", *axes, "--out", str(out)]) == 1
    printed, complaint = capsys.readouterr()
    assert complaint.splitlines() == [
        "2 of 4 designs gave no finite result:",
        "  twist 0, bend 0: `roll` is not finite",
        "  twist 90, bend 0: `roll` is not finite",
    ]
    assert "twist 90, bend 20" in printed
    assert np.isfinite(reojax.Sweep.load(out).results["roll"]).sum() == 2


@pytest.mark.usefixtures("_cheap")
def test_progress_shows_rate_and_time_left(capsys):
    assert main(["sweep", "twist=0:90:2", "bend=10,20", "--outputs", "roll"]) == 0
    complaint = capsys.readouterr().err
    assert "designs/s" in complaint
    assert "100%" in complaint


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "reojax sweep: the following arguments are required: AXIS"),
        (["twist"], "reojax sweep: argument AXIS: 'twist' is not of the form NAME=START:STOP:COUNT"),
        (["tilt=0:1:2"], "reojax sweep: argument AXIS: there is no axis 'tilt'; the axes are twist, bend,"),
        (["twist="], "reojax sweep: argument AXIS: axis 'twist': '' is not a number"),
        (["twist=0:1"], "reojax sweep: argument AXIS: 'twist=0:1': a range is START:STOP:COUNT"),
        (["twist=0:270:0"], "reojax sweep: argument AXIS: 'twist=0:270:0': the count must be from 1"),
        (["twist=0:270:1e3"], "reojax sweep: argument AXIS: 'twist=0:270:1e3': the count '1e3' is not a whole"),
        (["twist=0:270:1"], "reojax sweep: argument AXIS: 'twist=0:270:1': one value cannot reach"),
        (["twist=nan:270:3"], "reojax sweep: argument AXIS: axis 'twist': 'nan' is not a finite number"),
        (["gear=1,inf"], "reojax sweep: argument AXIS: axis 'gear': 'inf' is not a finite number"),
        (["end_inertia=0:10:3"], "reojax sweep: argument AXIS: axis 'end_inertia': '0' is not between"),
        (["rotor_inertia=-1,1"], "reojax sweep: argument AXIS: axis 'rotor_inertia': '-1' is not between"),
        (["twist=1,2", "twist=3,4"], "reojax sweep: axis 'twist' is given twice"),
        (["twist=1,2", "--outputs", "roll,yaw"], "reojax sweep: argument --outputs: there is no result 'yaw'"),
        (["twist=1,2", "--outputs", "roll,roll"], "reojax sweep: argument --outputs: result 'roll' is given twice"),
        (["twist=1,2", "--robot", "cat"], "reojax sweep: there is no robot named 'cat'"),
        (["twist=1,2", "--robot", "planar3"], "reojax sweep: 'planar3' has no layout of its own"),
        (["gear=1,2", "end_inertia=5", "--robot", "six_body"], "reojax sweep: 'six_body' has 6 links"),
        (["twist=1,2", "--out", "a.png"], "reojax sweep: cannot write 'a.png': the name of a NumPy archive"),
        (["twist=1,2", "--out", "/nowhere/a.npz"], "reojax sweep: cannot write '/nowhere/a.npz'"),
        (["twist=1,2", "--picture", "a.bmp"], "reojax sweep: cannot write 'a.bmp': the name of a picture"),
        (["twist=1", "--picture", "a.png"], "reojax sweep: --picture needs an axis of two values"),
        (["twist=1,2", "--shard", "0/2"], "reojax sweep: --shard needs --store"),
        (["twist=1,2", "--store", "s", "--shard", "2/2"], "reojax sweep: argument --shard: '2/2' is not I/N"),
        (["twist=1,2", "--devices", "0"], "reojax sweep: argument --devices: '0' is not a positive"),
        (["twist=1,2", "--devices", "4096"], "reojax sweep: `devices` is 4096; this process has"),
        (["twist=1,2", "--chunk-size", "-3"], "reojax sweep: argument --chunk-size: '-3' is not a positive"),
        (["twist=1,2", "--coordinator", "h:1"], "reojax sweep: --coordinator, --processes and --process-id"),
        (
            ["twist=1,2", "--coordinator", "h:1", "--processes", "2", "--process-id", "2"],
            "reojax sweep: --process-id is 2; it must be from 0 to 1",
        ),
        (
            ["twist=1,2", "--coordinator", "h", "--processes", "2", "--process-id", "0"],
            "reojax sweep: --coordinator is 'h'; it must be HOST:PORT",
        ),
        (
            ["twist=1,2", "--coordinator", "h:1", "--processes", "2", "--process-id", "0"],
            "reojax sweep: --coordinator needs --store",
        ),
        (
            ["twist=0:270:100000", "bend=0:120:100000", "gear=1:48:10"],
            "reojax sweep: the results of 1e+11 designs take 2.98e+03 GiB of memory",
        ),
        (
            ["twist=0:270:100000", "bend=0:120:1000000", "--store", "s", "--out", "a.npz"],
            "reojax sweep: the results of 1e+11 designs take 2.98e+03 GiB of memory",
        ),
    ],
)
def test_bad_input_is_one_line_and_status_2(capsys, monkeypatch, tmp_path, arguments, message):
    """Said before anything is computed, and nothing is written."""
    monkeypatch.chdir(tmp_path)
    assert main(["sweep", *arguments]) == 2
    out, complaint = capsys.readouterr()
    assert out == ""
    assert complaint.startswith(message)
    assert complaint.count("\n") == 1
    assert os.listdir(tmp_path) == []


def test_merge_of_what_is_no_store(capsys, tmp_path):
    assert main(["merge", str(tmp_path)]) == 2
    complaint = capsys.readouterr().err
    assert complaint.startswith("reojax merge: ")
    assert "is not the store of a sweep" in complaint
    assert complaint.count("\n") == 1


def test_pictures_of_one_two_and_more_axes():
    """Lines, and contours for each value of a third axis with the rest held; a design without a result is left out."""
    axes = {"x": np.linspace(0, 1, 5), "y": np.linspace(1, 2, 4), "z": np.array([1.0, 2.0, 3.0]), "one": [7.0]}
    units = {"x": "rad", "z": "kg m^2", "product": "rad"}

    def function(x, y, z, one):
        return {"product": jnp.where(x == 0, jnp.nan, x * y * z * one), "vector": jnp.ones(3)}

    found = reojax.sweep(function, axes, units=units, progress=False)
    figure = plot.sweep_figure(found, title="Title")
    panels = figure.axes[:3]
    titles = [f"product [deg]\nat z {z}e+06 kg mm²" for z in (1, 2, 3)]
    assert [panel.get_title("left") for panel in panels] == titles
    assert (panels[0].get_xlabel(), panels[0].get_ylabel()) == ("x [deg]", "y")
    assert figure.get_suptitle() == "Title\nat one 7"
    with pytest.raises(ValueError, match="'vector' is no scalar result"):
        plot.sweep_figure(found, results=["vector"])
    line = reojax.sweep(lambda x: x * x, reojax.zipped(x=[1.0, 2.0, 4.0]), progress=False)
    drawn = plot.sweep_figure(line).axes[0]
    np.testing.assert_array_equal(drawn.lines[0].get_xydata(), [[0, 1], [1, 4], [2, 16]])
    assert drawn.get_xlabel() == "design"
    with pytest.raises(ValueError, match="all axes of the sweep have one value"):
        plot.sweep_figure(reojax.sweep(lambda x: x, {"x": [1.0]}, progress=False))

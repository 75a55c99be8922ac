"""A plan file leads somewhere: every command that reads one runs it, and refuses a bad one in one line."""

import json

import numpy as np
import pytest

import reojax
from reojax import FreePaths, robots, save_plan
from reojax.cli import main

ROBOT = robots.satellite_arm()
"""A robot with rotors and gears of its own, and no layout."""
CORNERS = np.zeros((5, 7))
CORNERS[1:3, 1] = CORNERS[2:4, 3] = 0.6
READERS = {
    "show": ("show", "{}"),
    "simulate": ("simulate", "--plan", "{}"),
    "time": ("time", "--plan", "{}"),
    "export": ("export", "out.csv", "--plan", "{}", "--duration", "6"),
    "view": ("view", "{}", "--out", "out.html"),
    "view by option": ("view", "--plan", "{}", "--out", "out.html"),
}


@pytest.fixture(autouse=True)
def _here(monkeypatch, tmp_path):
    monkeypatch.setenv("REOJAX_CACHE", "0")
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def plan(tmp_path_factory) -> str:
    """Two runs of a rectangle in joints 2 and 4."""
    once = np.asarray(reojax.net_rotation(ROBOT, reojax.polygon(CORNERS)))
    travel = 2 * np.abs(np.diff(CORNERS, axis=0)).sum()
    path = FreePaths(CORNERS, once @ once, 0.0, travel, np.int64(2), np.True_, "converged", None)
    file = tmp_path_factory.mktemp("plans") / "plan.json"
    save_plan(path, file, robot=ROBOT, target=path.rotation)
    return str(file)


def run(capsys, reader, file):
    status = main([part.format(file) for part in READERS[reader]])
    out = capsys.readouterr()
    return status, out.out, out.err


@pytest.mark.slow
def test_show_tells_robot_path_target_and_evidence(capsys, plan):
    status, text, _ = run(capsys, "show", plan)
    assert status == 0
    assert text.startswith("satellite_arm: 8 links, 7 joints")
    assert "plan: 5 corners, run 2 times, 275.0 deg of joint travel" in text
    assert "target     rotation vector (" in text
    assert "status     converged, 0.0e+00 rad off" in text
    assert main(["show", plan, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)["plan"]
    assert report["target_rotation_vector_deg"] == report["rotation_vector_deg"]
    assert report["certificate"]["momentum"] < 1e-8


@pytest.mark.slow
def test_time_takes_the_rotors_and_gears_that_the_robot_has(capsys, plan):
    """Half the winding's resistance is faster; a plan of two runs has eight edges."""
    seconds = []
    for options in ([], ["--resistance", "4.15"]):
        assert main(["time", "--plan", plan, "--json", *options]) == 0
        report = json.loads(capsys.readouterr().out)
        assert [edge["edge"] for edge in report["edges"]] == [f"edge {k}" for k in range(1, 9)]
        seconds.append(report["duration_s"])
    assert 0 < seconds[1] < seconds[0]


@pytest.mark.slow
def test_simulate_export_and_view_run_all_runs(capsys, plan, tmp_path):
    assert main(["simulate", "--plan", plan, "--duration", "8", "--json"]) == 0
    turned = json.loads(capsys.readouterr().out)
    saved = reojax.load_plan(plan)
    np.testing.assert_allclose(turned["rotation_matrix"], saved.rotation, atol=1e-9)
    assert run(capsys, "export", plan)[0] == 0
    angles = np.genfromtxt(tmp_path / "out.csv", delimiter=",", skip_header=1)[:, 2]
    assert (np.diff(angles > 0.3).sum(), angles.max().round(9)) == (4, 0.6)
    for reader in ("view", "view by option"):
        assert run(capsys, reader, plan)[0] == 0
        assert (tmp_path / "out.html").stat().st_size > 10_000
        (tmp_path / "out.html").unlink()


def _with(**changes):
    return lambda data: json.dumps(data | changes)


BAD = {
    "cut off": (lambda data: json.dumps(data)[:-40], "cannot read"),
    "no text": (lambda data: "\x00\x01\x02", "cannot read"),
    "no object": (lambda data: "[1, 2]", "no JSON object"),
    "a number that is none": (lambda data: json.dumps(data).replace("0.6", "NaN", 1), "NaN is no number"),
    "a version to come": (_with(version=99), "version 99"),
    "a path of another robot": (_with(waypoints=[[0, 0], [1, 1]]), "`waypoints` has shape (2, 2)"),
    "no path": (_with(waypoints=[]), "0 corners"),
    "an error that is not its own": (_with(error=0.5), "error is 0.5"),
    "more runs than a path may have": (_with(repeats=2_000_000), "`repeats` is 2000000"),
    "a robot without mass": (lambda data: json.dumps(data).replace('"mass"', '"weight"', 1), "mass"),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("kind", BAD)
def test_a_bad_plan_is_one_line_and_status_2(capsys, plan, tmp_path, reader, kind):
    with open(plan) as stream:
        data = json.load(stream)
    change, words = BAD[kind]
    (tmp_path / "bad.json").write_text(change(data))
    status, text, error = run(capsys, reader, "bad.json")
    assert (status, text) == (2, "")
    assert words in error
    assert error.count("\n") == 1
    assert not list(tmp_path.glob("out.*"))


@pytest.mark.parametrize("reader", [name for name in READERS if name != "show"])
def test_what_is_no_plan_is_told_apart(capsys, tmp_path, reader):
    """A saved robot, a folder, and a file that is not there."""
    reojax.save_robot(ROBOT, "robot.json")
    (tmp_path / "folder.json").mkdir()
    for name in ("robot.json", "folder.json", "missing.json"):
        status, text, error = run(capsys, reader, name)
        assert (status, text, error.count("\n")) == (2, "", 1)
        assert name in error

"""Plan files: what is read back is what was saved; commands run it; a file that contradicts itself is refused."""

import json

import numpy as np
import pytest

import reojax
from reojax import FreePaths, load_plan, robots, save_plan
from reojax.cli import main

ROBOT = robots.planar(4)
CORNERS = np.deg2rad([[0, 20, 10], [60, 20, 10], [60, 90, 10], [0, 90, 10], [0, 20, 10]])
ONE = np.asarray(reojax.net_rotation(ROBOT, reojax.polygon(CORNERS)))


@pytest.fixture(scope="module")
def plan() -> FreePaths:
    travel = 3 * np.abs(np.diff(CORNERS, axis=0)).sum()
    return FreePaths(CORNERS, ONE @ ONE @ ONE, 0.0, travel, np.int64(3), np.True_, "converged", None)


@pytest.fixture(scope="module")
def file(plan, tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("plans") / "plan.json"
    save_plan(plan, path, robot=ROBOT, target=plan.rotation)
    return str(path)


def test_what_is_read_back_is_what_was_saved(plan, file):
    saved = load_plan(file)
    np.testing.assert_array_equal(saved.waypoints, plan.waypoints)
    np.testing.assert_array_equal(saved.rotation, plan.rotation)
    np.testing.assert_array_equal(saved.robot.inertia, ROBOT.inertia)
    assert (saved.repeats, saved.converged, saved.status, saved.clearance) == (3, True, "converged", None)
    assert saved.certificate.momentum < 1e-9
    turned = reojax.net_rotation(ROBOT, saved.path)
    np.testing.assert_allclose(turned, plan.rotation, atol=1e-10)


def test_a_word_keeps_its_amplitudes(tmp_path):
    word = reojax.Plan(
        word=("A",),
        twist=np.array([1.0]),
        bend=np.array([0.5]),
        last_twist=np.array([-1.0]),
        waypoints=np.asarray(reojax.manoeuvre_a(1.0, 0.5).waypoints),
        rotation=np.asarray(reojax.net_rotation(robots.prototype(), reojax.manoeuvre_a(1.0, 0.5))),
        error=np.float64(0.1),
        travel=np.float64(5.0),
        manoeuvres=np.int64(1),
        converged=np.False_,
        status="not found",
        clearance=0.004,
    )
    assert str(word) == "A(57.2958, 28.6479) [deg]: error 1.0e-01 rad, joint travel 286.5 deg; not found"
    save_plan(word, tmp_path / "word.json", robot=robots.prototype())
    saved = load_plan(tmp_path / "word.json")
    assert saved.manoeuvres == (("A", 1.0, 0.5, -1.0),)
    assert (saved.clearance, saved.target, saved.converged) == (0.004, None, False)


def test_commands_run_a_plan(file, capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("REOJAX_CACHE", "0")
    assert main(["simulate", "--plan", file, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(report["rotation_matrix"], ONE @ ONE @ ONE, atol=1e-10)
    table = tmp_path / "trajectory.csv"
    assert main(["export", str(table), "--plan", file, "--duration", "6", "--rate", "10"]) == 0
    rows = np.genfromtxt(table, delimiter=",", names=True)
    assert len(rows) == 61


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "reojax robot"}, "it is no plan"),
        ({"version": 2}, "version 2"),
        ({"error": 1.0}, "error is 1, but the rotation is"),
        ({"travel": 1.0}, "travel is 1, but the joints move through"),
        ({"repeats": 0}, "`repeats` is 0"),
        ({"waypoints": [[0, 0]]}, r"`waypoints` has shape \(1, 2\)"),
        ({"waypoints": []}, "0 corners"),
        ({"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 2]]}, "`rotation` is no rotation"),
        ({"converged": 1}, "converged is 1"),
        ({"certificate": {}}, "certificate has no 'momentum'"),
        ({"status": None}, "status is None"),
        ({"extra": 1}, "an entry 'extra' that is not known"),
        ({"robot": {}}, "the robot has no"),
    ],
)
def test_a_file_that_is_no_plan_is_refused_by_entry(file, tmp_path, change, message):
    with open(file) as stream:
        data = json.load(stream)
    bad = tmp_path / "bad.json"
    bad.write_text(json.dumps(data | change))
    with pytest.raises(ValueError, match=f"cannot read .*bad.json': .*{message}"):
        load_plan(bad)


def test_what_is_no_plan_is_not_saved(plan, tmp_path):
    for bad, message in (
        (plan._replace(waypoints=CORNERS[:, :2]), "moves 2 joints"),
        (plan._replace(waypoints=CORNERS[None]), "holds many plans"),
        (ROBOT, "`plan` is a Robot"),
    ):
        with pytest.raises(ValueError, match=message):
            save_plan(bad, tmp_path / "a.json", robot=ROBOT)
    with pytest.raises(ValueError, match="a plan ends in one of .json"):
        save_plan(plan, tmp_path / "a.txt", robot=ROBOT)
    assert not list(tmp_path.iterdir())

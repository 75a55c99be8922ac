"""`reojax plan`: files that replay, exit statuses, one line for a bad target; the words of many small loops."""

import dataclasses
import json

import numpy as np
import pytest
from common.replay import replay
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots
from reojax.cli import main
from reojax.cli._free import posture
from reojax.cli.plan import read_target

QUARTER = Rotation.from_rotvec([0, np.pi / 2, 0]).as_matrix()


@pytest.fixture(autouse=True)
def _no_cache(monkeypatch):
    monkeypatch.setenv("REOJAX_CACHE", "0")


@pytest.mark.slow
def test_the_files_replay(capsys, tmp_path):
    picture, table = tmp_path / "a.svg", tmp_path / "a.csv"
    command = ["plan", "--target", "rotvec 0 90 0", "--json", "--out", str(picture), "--csv", str(table)]
    assert main(command) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["converged"]
    assert report["picture"] == str(picture)
    assert picture.read_text().lstrip().startswith("<?xml")
    assert table.read_text().splitlines()[0] == "twist1 [deg],bend [deg],twist2 [deg]"
    corners = np.deg2rad(np.loadtxt(table, delimiter=",", skiprows=1))
    np.testing.assert_allclose(corners, report["waypoints_rad"], atol=1e-10)
    np.testing.assert_allclose(replay(robots.prototype(), corners[None])[0], QUARTER, atol=1e-8)


def test_not_reached_is_status_1_with_the_closest_plan(capsys):
    assert main(["plan", "--target", "rotvec 90 0 0", "--max-manoeuvres", "1"]) == 1
    out, complaint = capsys.readouterr()
    assert "NOT reached" in out
    assert complaint == ""


def test_targets_are_read_alike(tmp_path):
    """One rotation in every form."""
    file = tmp_path / "matrix.txt"
    np.savetxt(file, QUARTER)
    half = np.sqrt(0.5)
    for text in ("rotvec 0 90 0", "zxz 90 90 -90", f"quat {half} 0 {half} 0", f"matrix {file}"):
        np.testing.assert_allclose(read_target(text), QUARTER, atol=1e-12)


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("", "the target '' must begin with one of 'rotvec', 'zxz', 'quat', 'matrix'"),
        ("turn 1 2 3", "must begin with"),
        ("rotvec 1 2", "has 2 numbers; rotvec takes 3 finite ones"),
        ("rotvec 1 2 x", "has something that is not a number"),
        ("zxz 1 2 nan", "zxz takes 3 finite ones"),
        ("quat 1 1 0 0", "is no rotation: its length is 1.41421, not 1"),
        ("matrix missing", "cannot read 'missing': No such file"),
        ("matrix .", "cannot read '.': it is a folder"),
        ("matrix short", "has 8 numbers; a rotation matrix has nine"),
        ("matrix words", "has something that is not a number"),
        ("matrix bytes", "it is not text in UTF-8"),
        ("matrix stretched", "`target` is no rotation: an entry of R^T R - 1 is 0.21"),
    ],
)
def test_a_bad_target_is_one_line_and_status_2(capsys, monkeypatch, tmp_path, target, message):
    monkeypatch.chdir(tmp_path)
    np.savetxt("short", np.ones(8))
    np.savetxt("stretched", 1.1 * np.eye(3))
    (tmp_path / "words").write_text("one two three")
    (tmp_path / "bytes").write_bytes(b"\xff\xfe\xff")
    assert main(["plan", "--target", target]) == 2
    out, complaint = capsys.readouterr()
    assert out == ""
    assert complaint.startswith("reojax plan: ")
    assert message in complaint
    assert complaint.count("\n") == 1


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--twist-limit", "0", "`twist_limit` is 0.0; it must be one positive number"),
        ("--max-manoeuvres", "0", "argument --max-manoeuvres: '0' is not a positive whole number"),
        ("--out", "a.bmp", "cannot write 'a.bmp'"),
        ("--csv", "a.txt", "cannot write 'a.txt'"),
        ("--robot", "missing.urdf", "missing.urdf"),
        ("--from", "0,1", "argument --from: '0,1' has 2 angles; 'prototype' has 3 joints: twist1, bend, twist2"),
        ("--from", "elbow=3", "argument --from: 'elbow=3' must be JOINT=DEGREES; the joints are twist1, bend, twist2"),
        ("--from", "bend=3,bend=4", "argument --from: joint 'bend' is named twice"),
        ("--to", "0,1,x", "argument --to: 'x' is not an angle in degrees"),
        ("--joints", "elbow", "`joints[0]` is 'elbow'"),
        ("--repeats", "many", "argument --repeats: 'many' must be a whole number, or `least`"),
        ("--save", "plan.txt", "cannot write 'plan.txt'"),
        ("--twist-limit", "17000", "`twist_limit` is 17000 degrees, more than two turns"),
    ],
)
def test_bad_options(capsys, option, value, message):
    assert main(["plan", "--target", "rotvec 0 0 90", option, value]) == 2
    assert message in capsys.readouterr().err


def test_joints_that_follow_others_go_where_these_take_them_unless_they_are_named():
    """What is named stays as it is, for the planner to refuse."""
    robot = dataclasses.replace(
        robots.planar(4), couplings=((2, 0),), coupling_ratio=np.array([-2.0]), coupling_offset=np.array([0.1])
    )
    first, _, last = robot.joint_names
    np.testing.assert_allclose(posture("--from", f"{first}=30", robot), [np.pi / 6, 0, 0.1 - np.pi / 3])
    np.testing.assert_allclose(posture("--from", f"{first}=30,{last}=6", robot), np.deg2rad([30, 0, 6]))
    with pytest.raises(ValueError, match=f"`start` has joint {last!r} at 0.1047.* it follows {first!r}"):
        reojax.free_path(robot, np.eye(3), start=posture("--from", f"{last}=6", robot))


def test_words_need_a_layout_and_free_paths_have_options_of_their_own(capsys):
    """A layout is never guessed; a target may be written without quotes."""
    assert (
        main(["plan", "--robot", "planar3", "--vocabulary", "manoeuvres", "--target", "rotvec", "0", "0", "-90"]) == 2
    )
    assert "'planar3' has no layout of its own" in capsys.readouterr().err
    assert main(["plan", "--vocabulary", "manoeuvres", "--target", "rotvec 0 0 90", "--repeats", "2"]) == 2
    assert "argument --repeats: it is for free paths, not for manoeuvres" in capsys.readouterr().err


@pytest.mark.slow
def test_small_loops_many_times_over():
    """A quarter turn about each axis with loops of at most 40 degrees: hundreds of loops, and the path replays."""
    robot, limit = robots.prototype(), float(np.deg2rad(40))
    targets = Rotation.from_rotvec(np.pi / 2 * np.eye(3)).as_matrix()
    plan = reojax.plan_many(robot, targets, twist_limit=limit, bend_limit=limit, max_manoeuvres=400)
    assert plan.converged.all()
    assert 5 < plan.manoeuvres.min()
    assert plan.manoeuvres.max() <= 400
    assert np.abs(plan.waypoints).max() <= limit + 1e-9
    np.testing.assert_allclose(replay(robot, plan.waypoints), targets, atol=1e-8)
    few = reojax.plan(robot, targets[0], twist_limit=limit, bend_limit=limit, max_manoeuvres=20)
    assert not few.converged
    assert len(few.word) <= 20
    assert few.error < np.pi / 2

"""Trajectories in files: read back by other means, with the rules of ROS 2 controllers kept."""

import csv
import json
import os
import tempfile

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from reojax import along, manoeuvre_a, net_rotation, polygon, read_capture, robots, simulate
from reojax.cli import main
from reojax.files.trajectories import check_trajectory, write_trajectory
from reojax.planning.free_paths_result import FreePaths
from reojax.planning.plan_file import load_plan, save_plan
from reojax.planning.result import Plan

ROBOT = robots.prototype().replace(joint_names=("twist1", "bend, centre", "twist2"))
TIME = np.linspace(0.5, 1.5, 21)
_U = (TIME - 0.5)[:, None]
GOAL = np.array([1.0, -2.0, 0.5])
THETA = GOAL * (10 * _U**3 - 15 * _U**4 + 6 * _U**5)
RATE = GOAL * (30 * _U**2 - 60 * _U**3 + 30 * _U**4)
ACCELERATION = GOAL * (60 * _U - 180 * _U**2 + 120 * _U**3)
MOTION = (TIME, THETA, RATE, ACCELERATION)
PATH = manoeuvre_a(1.0, 0.5)
TURN = np.asarray(net_rotation(robots.prototype(), PATH))
PLAN = FreePaths(PATH.waypoints, TURN @ TURN, 0.0, 10.0, 2, True, "converged", None)
MANY = FreePaths(PATH.waypoints[None].repeat(2, 0), np.eye(3), np.zeros(2), 1.0, 1, True, "converged", None)
NO_ARRAYS = {"theta": None, "theta_dot": None, "theta_ddot": None}


def test_csv_has_units_and_all_digits(tmp_path):
    file = tmp_path / "t.csv"
    write_trajectory(file, ROBOT, *MOTION, RATE)
    with file.open() as lines:
        header, *rows = csv.reader(lines)
    assert header[:3] == ["time [s]", "twist1 [rad]", "bend, centre [rad]"]
    assert header[4::3] == ["rate twist1 [rad/s]", "acceleration twist1 [rad/s^2]", "torque twist1 [N m]"]
    numbers = np.array(rows, float)
    expected = np.concatenate([TIME[:, None] - 0.5, THETA, RATE, ACCELERATION, RATE], axis=1)
    np.testing.assert_allclose(numbers, expected, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("ending", ["yaml", "yml", "json"])
def test_joint_trajectory(tmp_path, ending):
    """As JSON, which is YAML; only fields of the message, times exact and increasing."""
    file = tmp_path / f"t.{ending}"
    write_trajectory(file, ROBOT, *MOTION, delay=1.98)
    message = json.loads(file.read_text())
    assert message.keys() == {"header", "joint_names", "points"}
    assert message["joint_names"] == list(ROBOT.joint_names)
    points = message["points"]
    assert points[0].keys() == {"positions", "velocities", "accelerations", "time_from_start"}
    np.testing.assert_array_equal([point["positions"] for point in points], THETA)
    np.testing.assert_array_equal([point["accelerations"] for point in points], ACCELERATION)
    stamps = [point["time_from_start"] for point in points]
    assert stamps[0] == {"sec": 1, "nanosec": 980_000_000}
    assert stamps[1] == {"sec": 2, "nanosec": 30_000_000}
    assert all(0 <= stamp["nanosec"] < 10**9 and isinstance(stamp["sec"], int) for stamp in stamps)
    write_trajectory(file, ROBOT, *MOTION, RATE)
    np.testing.assert_array_equal([point["effort"] for point in json.loads(file.read_text())["points"]], RATE)


def _rows(file):
    return np.genfromtxt(file, delimiter=",", skip_header=1)


def test_whatever_moves_the_joints_is_written(tmp_path):
    """A path with durations, its trajectory and its motion are the same; a plan is its path, all runs of it."""
    file, robot, durations = tmp_path / "t.csv", robots.prototype(), [0.1, 0.2, 0.1, 0.2]
    trajectory = along(PATH, "trapezoid", durations)
    write_trajectory(file, robot, PATH, durations=durations, law="trapezoid", rate=100)
    by_path = _rows(file)
    assert by_path.shape == (61, 10)
    np.testing.assert_allclose(by_path[:, 0], np.linspace(0, 0.6, 61), atol=1e-9)
    for row in by_path[[3, 17, 44]]:
        np.testing.assert_allclose(row[1:], np.ravel(trajectory.at(row[0])), atol=1e-9)
    write_trajectory(file, robot, trajectory, rate=100)
    np.testing.assert_array_equal(_rows(file), by_path)
    motion = simulate(robot, PATH, durations=durations, samples=8)
    write_trajectory(file, robot, motion, effort=motion.torque)
    expected = np.concatenate([np.asarray(motion.time)[:, None], *motion[1:4], motion.torque], axis=1)
    np.testing.assert_allclose(_rows(file), expected, rtol=1e-9, atol=1e-9)

    write_trajectory(file, robot, polygon(np.concatenate([PATH.waypoints, PATH.waypoints[1:]])), durations=0.1)
    twice = _rows(file)
    assert twice[-1, 0] == 0.8
    write_trajectory(file, robot, PLAN, durations=0.1)
    np.testing.assert_array_equal(_rows(file), twice)
    save_plan(PLAN, tmp_path / "p.json", robot=robot)
    write_trajectory(file, robot, load_plan(tmp_path / "p.json"), durations=0.1)
    np.testing.assert_array_equal(_rows(file), twice)
    empty = np.zeros(1)
    plan = Plan(("A",), empty, empty, empty, PATH.waypoints, np.eye(3), 0.0, 1.0, 1, True, "converged", None)
    write_trajectory(file, robot, plan, durations=0.1)
    np.testing.assert_allclose(_rows(file)[:, 1:], twice[:81, 1:], atol=1e-10)


AWKWARD = ["theta1", "theta2", "theta3", "zxz1", "zxz2", "zxz3", "qw", "qx", "time", "t", "rate theta1", "a_rad", "a"]
AWKWARD += [
    "time [s]",
    "Theta1",
    "a b",
    "a_b",
    "#",
    " ",
    "nan",
    "arm [deg]",
    "arm",
    "theta2 [rad]",
    "a;b;c;d;e;f;g",
    '"',
]
NAMES = st.lists(st.sampled_from(AWKWARD) | st.text(min_size=1, max_size=6), min_size=3, max_size=3, unique=True)


@settings(max_examples=100, deadline=None)
@given(NAMES)
def test_a_csv_is_read_back_as_it_was_written_or_refused(names):
    """Whatever the joints are called: theirs come first, also if they are called as another column or joint is."""
    robot = ROBOT.replace(joint_names=tuple(names))
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "t.csv")
        try:
            write_trajectory(file, robot, *MOTION, RATE)
        except ValueError:
            assert os.listdir(folder) == []
            return
        capture = read_capture(file, robot)
    np.testing.assert_allclose(capture.theta, THETA, atol=1e-11)
    assert capture.rotation is None


@pytest.mark.parametrize(
    "names", [("theta2", "theta1", "theta3"), ("zxz1", "zxz2", "zxz3"), ("qw", "time", "t"), ("theta1", "Theta1", "x")]
)
def test_names_of_other_columns_are_the_joints_own(tmp_path, names):
    robot = ROBOT.replace(joint_names=names)
    write_trajectory(tmp_path / "t.csv", robot, *MOTION)
    np.testing.assert_allclose(read_capture(tmp_path / "t.csv", robot).theta, THETA, atol=1e-11)


@pytest.mark.parametrize("name", ["two\nlines", "tab\t", "\x00", " space"])
def test_names_with_marks_that_do_not_print_are_refused(tmp_path, name):
    with pytest.raises(ValueError, match="cannot have a joint named"):
        write_trajectory(tmp_path / "t.csv", ROBOT.replace(joint_names=("a", name, "b")), *MOTION)
    assert os.listdir(tmp_path) == []


def test_only_rest_to_rest_goes_to_a_controller(tmp_path):
    """The whole file is refused, and the one that was there stays."""
    file = tmp_path / "t.yaml"
    file.write_text("old")
    with pytest.raises(
        ValueError, match="the trajectory does not end at rest: joint 'bend, centre' moves at -3.* rad/s"
    ):
        write_trajectory(file, ROBOT, *(column[:12] for column in MOTION))
    with pytest.raises(ValueError, match="the trajectory does not start at rest"):
        write_trajectory(file, ROBOT, *(column[10:] for column in MOTION))
    assert file.read_text() == "old"
    assert os.listdir(tmp_path) == ["t.yaml"]
    write_trajectory(tmp_path / "t.csv", ROBOT, *(column[:12] for column in MOTION))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"time": TIME[::-1]}, r"time\[1\] is 1.45 s, not after 1.5 s; times must increase"),
        ({"time": 1e-9 * TIME}, "times must increase"),
        ({"time": TIME[:1]}, "`time` has shape"),
        ({"theta": THETA[:, :2]}, r"`theta` has shape \(21, 2\); for 'prototype' it must be \(21, 3\)"),
        ({"theta_dot": RATE[1:]}, "`theta_dot` has shape"),
        ({"theta_ddot": ACCELERATION * np.nan}, r"theta_ddot\[0, 0\] is not finite"),
        ({"effort": "much"}, "`effort` is 'much'"),
        ({"delay": -1.0}, "`delay` is -1.0"),
        ({"theta": None}, "`theta` is missing: `time` is a ndarray, no motion"),
        ({"durations": 1.0}, "`durations` is given; only a path or a plan"),
        ({"time": PATH}, "angles, rates or accelerations are given; a Path has its own"),
        ({"time": PATH} | NO_ARRAYS, "`durations` is missing: a Path has no time"),
        ({"time": PATH, "durations": [0.1, 0.2]} | NO_ARRAYS, r"`durations` has shape \(2,\)"),
        ({"time": PATH, "durations": 0.1, "rate": 1e9} | NO_ARRAYS, "0.4 s at 1e.09 Hz are 400000000 points"),
        ({"time": PATH, "durations": 0.1, "rate": 0} | NO_ARRAYS, "`rate` is 0; it must be one positive number, in Hz"),
        ({"time": along(PATH, "quintic", 0.1), "durations": 0.1} | NO_ARRAYS, "a Trajectory has its own"),
        ({"time": MANY, "durations": 0.1} | NO_ARRAYS, "these are 2 plans; choose one"),
        ({"path": "t.bag"}, "the name of a trajectory ends in one of .csv, .yaml, .yml, .json"),
        ({"path": "nowhere/t.csv"}, "there is no folder"),
    ],
)
def test_bad_input_writes_nothing(monkeypatch, tmp_path, changed, message):
    monkeypatch.chdir(tmp_path)
    given = {"path": "t.yaml", "time": TIME, "theta": THETA, "theta_dot": RATE, "theta_ddot": ACCELERATION}
    with pytest.raises(ValueError, match=message):
        write_trajectory(robot=ROBOT, **(given | changed))
    assert os.listdir(tmp_path) == []


def test_a_place_can_be_asked_for_beforehand(tmp_path):
    assert check_trajectory(tmp_path / "t.yaml") == tmp_path / "t.yaml"
    assert os.listdir(tmp_path) == []


def test_the_command_line_writes_what_it_says(capsys, monkeypatch, tmp_path):
    """A manoeuvre as a file for a controller, and as one that `compare` can read."""
    monkeypatch.setenv("REOJAX_CACHE", "0")
    monkeypatch.chdir(tmp_path)
    assert main(["export", "a.yaml", "--duration", "0.1,0.1,0.1,0.1", "--rate", "100", "--bend", "60"]) == 0
    assert capsys.readouterr().out == "41 points in 0.4 s, written to a.yaml\n"
    message = json.loads((tmp_path / "a.yaml").read_text())
    np.testing.assert_allclose(message["points"][10]["positions"], [0, np.deg2rad(60), 0], atol=1e-12)
    assert main(["export", "a.json", "--duration", "0.4", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["duration_s"] == pytest.approx(0.4)
    assert main(["export", "a.csv", "--duration", "0.1,0.2,0.1,0.2", "--torques", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["points"] == 121
    capture = read_capture(tmp_path / "a.csv", robots.prototype())
    np.testing.assert_allclose(capture.theta[60], np.deg2rad([270, 120, -270]), rtol=1e-11)
    assert capture.ignored[-1] == "torque twist2 [N m]"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a.yaml"], "reojax export: --duration is missing"),
        (["a.yaml", "--duration", "0"], "reojax export: argument --duration: '0' is not a duration in seconds"),
        (
            ["a.csv", "--duration", "1e-300"],
            "reojax export: argument --duration: '1e-300' is not a duration",
        ),
        (["a.yaml", "--duration", "1,x"], "reojax export: argument --duration: 'x' is not a number"),
        (["a.yaml", "--duration", "1,2"], "reojax export: argument --duration: 2 numbers for 4 edges"),
        (["a.yaml", "--duration", "1", "--law", "jump"], "reojax export: there is no time law named 'jump'"),
        (["a.yaml", "--duration", "1", "--rate", "0"], "reojax export: argument --rate: '0' must be positive"),
        (["a.yaml", "--duration", "1e4", "--rate", "1e4"], "reojax export: 10000 s at 10000 Hz are 100000000 points"),
        (["a.bag", "--duration", "1"], "reojax export: cannot write 'a.bag': the name of a trajectory"),
        (["a.csv", "--duration", "1", "--robot", "planar2"], "reojax export: 'planar2' has no layout of its own"),
    ],
)
def test_bad_arguments_are_one_line_and_status_2(capsys, monkeypatch, tmp_path, arguments, message):
    monkeypatch.setenv("REOJAX_CACHE", "0")
    monkeypatch.chdir(tmp_path)
    assert main(["export", *arguments]) == 2
    out, complaint = capsys.readouterr()
    assert out == ""
    assert complaint.startswith(message)
    assert complaint.count("\n") == 1
    assert os.listdir(tmp_path) == []

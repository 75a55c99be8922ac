"""Captures: read whole or refused with file and line, aligned, compared, and the shipped one is what it says."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import reojax
from reojax import plot, robots
from reojax.captures import alignment, comparison, orientation
from reojax.cli import main
from reojax.mechanics.attitude import tilt_and_roll, zxz_beside, zxz_without_jumps
from reojax.robots.random import random_robot

ROOT = Path(__file__).parents[2]
SHIPPED = ROOT / "docs" / "synthetic_capture.csv"
ROBOT = robots.prototype()
TIME = np.arange(256) / 300
THETA = np.deg2rad([100, 80, -60]) * np.sin(np.pi * np.clip(TIME[:, None] / 0.6 - [0, 0.1, 0.2], 0, 1)) ** 2
TURNS = np.asarray(comparison.joints_simulated(ROBOT, reojax.make_capture(TIME, THETA)).rotation)
MOTION = comparison.Sampled(TIME, THETA, TURNS)


def csv(header: str, *rows: str) -> str:
    return "\n".join([header, *rows]) + "\n"


@pytest.fixture
def read(tmp_path):
    """Read a text as a capture."""

    def function(text: str | bytes, robot=ROBOT, **options):
        file = tmp_path / "c.csv"
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return reojax.read_capture(file, robot, **options)

    return function


@pytest.mark.parametrize(
    ("header", "row"),
    [
        ("time,theta1_deg,theta2_deg,theta3_deg", "{t},90,-45,30"),
        ("time_ms;twist1 [deg];bend (deg);twist2_deg", "{ms};90;-45;30"),
        (
            "bend_rad\ttime [s]\ttheta_1 [rad]\tTheta3_deg\tmarker_x",
            "-0.78539816339744828\t{t}\t1.5707963267948966\t30\tq",
        ),
    ],
)
def test_headers_in_any_order_unit_and_delimiter(read, header, row):
    """Three ways to write the same joint angles."""
    rows = [row.format(t=t, ms=1000 * t) for t in (0.5, 0.75)]
    capture = read("\ufeff# a comment\n\n" + csv(header, *rows))
    np.testing.assert_allclose(capture.time, [0.5, 0.75])
    np.testing.assert_allclose(capture.theta, np.deg2rad([[90, -45, 30]] * 2), rtol=1e-15)
    assert capture.rotation is None
    assert capture.ignored == (("marker_x",) if "marker_x" in header else ())


def test_quaternions_and_zxz_angles_are_the_same_orientation(read):
    turns = Rotation.random(5, random_state=1)
    rows = [f"{k},{','.join(map(repr, q))}" for k, q in enumerate(turns.as_quat(scalar_first=True).tolist())]
    angles = turns.as_euler("ZXZ", degrees=True).tolist()
    euler = [f"{k},{','.join(map(repr, a))}" for k, a in enumerate(angles)]
    for text in (csv("t,qw,qx,qy,qz", *rows), csv("t,zxz1_deg,zxz2_deg,zxz3_deg", *euler)):
        np.testing.assert_allclose(read(text).rotation, turns.as_matrix(), atol=1e-14)


def test_gaps_are_nan(read):
    """Empty cells, NaN and rows that are not there; half a quaternion is none."""
    rows = ["0,1,2,3,1,0,0,0", "1,,nan,3,0,1,,0", "2,1,2,3,,,,", "5,1,2,3,0,0,0,-1"]
    capture = read(csv("time,theta1_deg,theta2_deg,theta3_deg,qw,qx,qy,qz", *rows))
    np.testing.assert_array_equal(capture.seen_theta[1], [False, False, True])
    np.testing.assert_array_equal(capture.seen_rotation, [True, False, False, True])
    np.testing.assert_array_equal(capture.time, [0, 1, 2, 5])


def test_angles_without_a_unit_need_one(read):
    text = csv("time,theta1,theta2,theta3", "0,1,2,3", "1,1,2,3")
    with pytest.raises(ValueError, match=r"c.csv, line 1: column 'theta1' has no unit; call it 'theta1_deg'"):
        read(text)
    np.testing.assert_allclose(read(text, angle_unit="deg").theta[0], np.deg2rad([1, 2, 3]))


JOINTS = "time,theta1_rad,theta2_rad,theta3_rad"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "c.csv: the file is empty"),
        ("# only a comment\n\n", "c.csv: the file is empty"),
        (b"\xff\xfe\x00t", "it is not text in UTF-8"),
        (csv(JOINTS), "the file has 0 lines of data; a motion needs two"),
        (csv(JOINTS, "0,0,0,0"), "the file has 1 lines of data"),
        (csv("theta1_rad,theta2_rad,theta3_rad", "0,0,0"), "line 1: there is no column 'time'; the columns are th"),
        (csv("time,theta1_rad,theta3_rad", "0,0,0"), r"line 1: the column of joint 'bend' \(or theta2\) is missing"),
        (csv("time,qw,qx,qz", "0,1,0,0"), "line 1: column 'qy' is missing"),
        (csv("time,x,y", "0,1,0"), "line 1: there are neither joint angles"),
        (csv(JOINTS + ",bend_deg", "0,0,0,0,0"), "columns 'theta2_rad' and 'bend_deg' are the same quantity"),
        (csv("time,qw,qx,qy,qz,zxz1_deg,zxz2_deg,zxz3_deg", "0"), "the orientation is there twice"),
        (csv("time,theta1_s,theta2_rad,theta3_rad", "0,0,0,0"), "the unit 's'; angles are in deg or rad"),
        (csv("time_deg,theta1_rad,theta2_rad,theta3_rad", "0,0,0,0"), "the unit 'deg'; time is in s, ms, us or ns"),
        (
            csv("# c", JOINTS, "0,0,0,0", "1,0,zero,0"),
            "line 4: joint angle 'bend' is 'zero'; it must be a finite number",
        ),
        (csv(JOINTS, "0,0,0,0", "1,0,inf,0"), "line 3: joint angle 'bend' is 'inf'"),
        (csv(JOINTS, "0,0,0,0", "soon,0,0,0"), "line 3: time is 'soon'"),
        (csv(JOINTS, "0,0,0,0", ",0,0,0"), "line 3: the time is missing"),
        (csv(JOINTS, "0,0,0,0", "2,0,0,0", "1,0,0,0"), "line 4: the time is 1 s, after 2 s; times must increase"),
        (csv(JOINTS, "1.8e12,0,0,0", "1.9e12,0,0,0"), r"line 2: the time is 1.8e\+12 s, beyond reason"),
        (csv(JOINTS, "0,0,0,0", "0,0,0,0"), "line 3: the time is 0 s, after 0 s"),
        (csv(JOINTS, "0,0,0,0", "1,0,0"), "line 3: the line has 3 cells; the header has 4"),
        (csv(JOINTS, "0,0,0,0", "1,270,0,0"), "line 3: joint angle 'twist1' is 270 rad, beyond reason .* in degrees"),
        (csv("time,bend_deg,twist1_deg,twist2_deg", "0,0,0,0", "1,300,0,0"), "'bend' is 300 deg, beyond reason"),
        (csv(JOINTS, "0,0,,0", "1,0,,0"), "c.csv: no line has an angle of joint 'bend'"),
        (
            csv("time,qw,qx,qy,qz", "0,1,0,0,0", "1,0.9,0,0,0"),
            r"line 3: the quaternion .* has length 0.9; it must be 1",
        ),
        (csv("time,qw,qx,qy,qz", "0,1,0,0,0", "1,0,0,0,0"), "line 3: the quaternion .* has length 0"),
        (csv("time,qw,qx,qy,qz", "0,1,0,0,", "1,,0,0,0"), "no line has an orientation"),
        (csv("time,zxz1_rad,zxz2_rad,zxz3_rad", "0,0,0,0", "1,190,0,0"), "line 3: ZXZ angle 1 is 190 rad, beyond"),
    ],
)
def test_what_cannot_be_read_is_refused_with_file_and_line(read, text, message):
    with pytest.raises(ValueError, match=message):
        read(text)


def test_a_file_that_is_not_there():
    with pytest.raises(ValueError, match="cannot read 'nowhere.csv': No such file"):
        reojax.read_capture("nowhere.csv", ROBOT)


def test_joints_without_limits_may_turn_further(read):
    """A robot of any other kind: names of its own, no limits, two joints."""
    robot = random_robot(3, 2).replace(joint_names=("arm_s", "wrist"))
    capture = read(csv("time,arm_s,wrist_deg", "0,20,700", "1,-20,-700"), robot, angle_unit="rad")
    np.testing.assert_allclose(capture.theta[0], [20, np.deg2rad(700)])
    with pytest.raises(ValueError, match="joint angle 'arm_s' is 90 rad, beyond reason"):
        read(csv("time,arm_s,wrist_deg", "0,20,0", "1,90,0"), robot, angle_unit="rad")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0.0, 1], None, None), "neither `theta` nor `rotation`"),
        (([0.0], [[1.0]]), "`time` has shape"),
        (([0.0, 0], [[1.0]] * 2), r"time\[1\] is 0.0; times must be finite and strictly increasing"),
        (([0.0, np.nan], [[1.0]] * 2), r"time\[1\] is nan"),
        (([0.0, 1], [[1.0]]), "`theta` has shape"),
        (([0.0, 1], [[1.0], [np.inf]]), r"theta\[1, 0\] is inf"),
        (([0.0, 1], None, [np.eye(3), 2 * np.eye(3)]), r"rotation\[1\] is .* not a rotation"),
        (([0.0, 1], None, [np.eye(3), -np.eye(3)]), r"rotation\[1\] is .* not a rotation"),
        (([0.0, 1], None, np.eye(3)), "`rotation` has shape"),
    ],
)
def test_captures_from_arrays_are_checked(arguments, message):
    with pytest.raises(ValueError, match=message):
        reojax.make_capture(*arguments)


def test_zxz_angles_without_jumps_make_up_the_rotation():
    """Of a history that passes near b = 0 on both sides, and of a measured one beside it."""
    s = np.linspace(0, 1, 400)
    angles = np.stack([3 * s, 0.6 * np.cos(2 * np.pi * s) - 0.02, -9 * s], axis=1)
    turns = Rotation.from_euler("ZXZ", angles)
    read = zxz_without_jumps(turns.as_matrix())
    clear = np.abs(read[:, 1]) > 0.1
    again = Rotation.from_euler("ZXZ", read)
    np.testing.assert_allclose(again[clear].as_matrix(), turns[clear].as_matrix(), atol=1e-12)
    np.testing.assert_allclose(again.as_matrix(), turns.as_matrix(), atol=0.1)
    assert 0.7 < clear.mean() < 0.95
    assert np.abs(np.diff(read, axis=0)).max() < 0.2
    assert (read[:, 1] < -0.5).any()
    assert (read[:, 1] > 0.5).any()
    measured = (turns * Rotation.from_rotvec(1e-3 * np.random.default_rng(0).normal(size=(400, 3)))).as_matrix()
    measured[7] = np.nan
    beside = zxz_beside(measured, read)
    assert np.isnan(beside[7]).all()
    seen = np.arange(400) != 7
    assert np.abs(beside - read)[seen].max() < 0.05
    np.testing.assert_allclose(Rotation.from_euler("ZXZ", beside[seen]).as_matrix(), measured[seen], atol=0.1)


@pytest.mark.parametrize("with_joints", [True, False])
def test_time_is_aligned_below_a_frame(with_joints):
    """At another rate, with gaps, from another frame and another clock, by joints or by orientation alone."""
    rng = np.random.default_rng(2)
    when = np.sort(rng.choice(np.arange(-0.1, 0.9, 1 / 200), 160, replace=False))
    late = 5.012345
    at = alignment.interpolate(MOTION.time, MOTION.rotation)(when)
    joints = np.stack([np.interp(when, MOTION.time, column) for column in MOTION.theta.T], axis=1)
    cameras = Rotation.from_rotvec([0.3, -2.0, 0.7]).as_matrix()
    capture = reojax.make_capture(when + late, joints if with_joints else None, cameras @ at)
    found = reojax.compare(ROBOT, capture, MOTION)
    assert found.offset_found
    assert found.offset == pytest.approx(late, abs=2e-7)
    np.testing.assert_allclose(found.zxz_rms, 0, atol=1e-5)
    np.testing.assert_allclose(found.tilt_roll_rms, 0, atol=1e-5)
    assert found.angle_rms < 1e-5
    assert np.isfinite(found.theta_rms).all() == with_joints
    given = reojax.compare(ROBOT, capture, MOTION, offset=late + 0.02)
    assert given.angle_rms > 0.02
    assert not given.offset_found


def test_rms_errors_are_those_put_in():
    """A constant error of each joint, and a roll that is off by a constant after the start."""
    error = np.array([0.01, -0.02, 0.03])
    off = Rotation.from_rotvec(np.outer(np.where(TIME > 0.1, 0.05, 0), [0, 0, 1])).as_matrix()
    capture = reojax.make_capture(TIME, THETA + error, off @ TURNS)
    found = reojax.compare(ROBOT, capture, MOTION, offset=0.0)
    np.testing.assert_allclose(found.theta_rms, np.abs(error), rtol=1e-9)
    share = np.sqrt((TIME > 0.1).mean())
    assert found.angle_rms == pytest.approx(0.05 * share, rel=1e-6)
    assert found.zxz_rms[0] == pytest.approx(0.05 * share, rel=1e-6)
    np.testing.assert_allclose(found.zxz_rms[1:], 0, atol=1e-9)


def test_a_capture_at_rest_has_no_offset():
    capture = reojax.make_capture(TIME, np.zeros_like(THETA))
    assert not reojax.compare(ROBOT, capture, MOTION).offset_found


def test_gaps_in_the_joints_are_filled():
    holes = THETA.copy()
    holes[60:64] = holes[100:103, 1] = np.nan
    filled = orientation.fill_gaps(reojax.make_capture(TIME, holes))
    np.testing.assert_allclose(filled, THETA, atol=2e-3)
    np.testing.assert_array_equal(filled[np.isfinite(holes)], holes[np.isfinite(holes)])


@pytest.mark.parametrize(
    ("capture", "motion", "message"),
    [
        (reojax.make_capture(TIME, THETA), None, "the capture has no orientation"),
        (reojax.make_capture(TIME, None, TURNS), None, "the capture has no joint angles"),
        (reojax.make_capture(TIME, THETA[:, :2]), MOTION, "the capture has 2 joints; 'prototype' has 3"),
        (reojax.make_capture(1e3 * TIME, THETA), MOTION, "the capture lasts 850 s and the motion 0.85 s; cut"),
        (THETA, MOTION, "`capture` is a ndarray"),
    ],
)
def test_what_cannot_be_compared(capture, motion, message):
    with pytest.raises(ValueError, match=message):
        reojax.compare(ROBOT, capture, motion)


def test_the_shipped_capture_is_what_its_script_makes(monkeypatch):
    """It says that it is synthetic, and how it was made."""
    monkeypatch.syspath_prepend(ROOT / "experiments")
    import synthetic_capture

    text, shipped = synthetic_capture.as_csv(), SHIPPED.read_text()
    assert shipped.startswith("# SYNTHETIC: no robot was filmed. Made by experiments/synthetic_capture.py, seed 7.")
    assert [line for line in text.splitlines() if line[0] == "#"] == shipped.splitlines()[:4]
    first, second = (np.genfromtxt(t.splitlines(), delimiter=",", skip_header=5) for t in (text, shipped))
    np.testing.assert_allclose(first, second, atol=0.011)  # one digit may be rounded the other way elsewhere
    assert 0.9 < len(second) / 300 < 1
    assert np.isnan(second).any()


def test_the_command_line_prints_and_draws_what_the_library_computes(capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("REOJAX_CACHE", "0")
    out = tmp_path / "c.png"
    assert main(["compare", str(SHIPPED), "--json", "--out", str(out)]) == 0
    report = json.loads(capsys.readouterr().out)
    capture = reojax.read_capture(SHIPPED, ROBOT)
    found = reojax.compare(ROBOT, capture)
    np.testing.assert_allclose(report["rms_zxz_rad"], found.zxz_rms)
    np.testing.assert_allclose(report["offset_s"], found.offset)
    assert report["frames"] == len(capture.time)
    assert report["rms_theta_rad"] == [None] * 3
    assert out.read_bytes().startswith(b"\x89PNG")
    figure = plot.comparison_figure(ROBOT, found)
    lines = figure.axes[1].lines
    np.testing.assert_allclose(lines[4].get_ydata(), np.rad2deg(tilt_and_roll(found.simulated_rotation)[:, 2]))
    assert main(["compare", str(SHIPPED)]) == 0
    assert "simulated from the measured joint angles" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere.csv"], "reojax compare: cannot read 'nowhere.csv': No such file"),
        (
            [str(SHIPPED), "--robot", "six_body"],
            f"reojax compare: {SHIPPED}, line 5: the column of joint 'twist2' (or theta4)",
        ),
        ([str(SHIPPED), "--out", "a.bmp"], "reojax compare: cannot write 'a.bmp': the name of"),
        ([str(SHIPPED), "--calibrate", "weight"], "reojax compare: there is no parameter 'weight'"),
        ([], "reojax compare: the following arguments are required: CAPTURE.csv"),
    ],
)
def test_bad_input_is_one_line_and_status_2(capsys, monkeypatch, tmp_path, arguments, message):
    monkeypatch.setenv("REOJAX_CACHE", "0")
    monkeypatch.chdir(tmp_path)
    assert main(["compare", *arguments]) == 2
    out, complaint = capsys.readouterr()
    assert out == ""
    assert complaint.startswith(message)
    assert complaint.count("\n") == 1
    assert os.listdir(tmp_path) == []


@pytest.mark.slow
def test_a_planned_manoeuvre_is_compared_too(capsys, monkeypatch):
    """The shipped capture against the plan it was made with: the start is found, the joints are their noise off."""
    monkeypatch.setenv("REOJAX_CACHE", "0")
    plan = ["--manoeuvre", "a", "--duration", "0.1,0.2,0.1,0.2"]
    assert main(["compare", str(SHIPPED), *plan, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["offset_found"]
    assert report["offset_s"] == pytest.approx(0.18, abs=2e-4)
    np.testing.assert_allclose(report["rms_theta_rad"], np.deg2rad(0.1), rtol=0.15)
    assert report["config"]["simulated_from"] == "manoeuvre A, twist 270 deg, bend 120 deg, quintic"
    assert main(["compare", str(SHIPPED), "--manoeuvre", "a"]) == 2
    assert "--duration is missing" in capsys.readouterr().err


def test_only_files_are_read(tmp_path):
    """A device has no end, a pipe waits, a number may be an open stream of this process."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path, message in (
        ("/dev/zero", "it is not a regular file"),
        (pipe, "it is not a regular file"),
        (tmp_path, "it is a folder"),
        (1, "it is a int, not the path of a file"),
        (None, "it is a NoneType, not the path"),
        (b"c.csv", "it is a bytes, not the path"),
        ("c\0.csv", "no path has a zero byte"),
    ):
        with pytest.raises(ValueError, match=f"cannot read .*{message}"):
            reojax.read_capture(path, ROBOT)
    os.fstat(1)  # still open
    (tmp_path / "long.csv").write_text("time" * 10**6)
    with pytest.raises(ValueError, match="line 1: it has more than 1048576 bytes"):
        reojax.read_capture(tmp_path / "long.csv", ROBOT)


def test_carriage_returns_end_lines_too(tmp_path):
    (tmp_path / "c.csv").write_bytes(b"time,theta1_rad,theta2_rad,theta3_rad\r0,0,0,0\r1,.1,.2,.3\r")
    np.testing.assert_array_equal(reojax.read_capture(tmp_path / "c.csv", ROBOT).theta[1], [0.1, 0.2, 0.3])

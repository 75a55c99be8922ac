"""A capture with a usual mistake in it is told which; one that is right, or wrong in no usual way, is told nothing."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots
from reojax.captures.comparison import Sampled
from reojax.captures.orientation import orientations, steps_needed
from reojax.cli import main

ROBOT = robots.prototype()
TIME = np.arange(256) / 300
THETA = np.deg2rad([100, 80, -60]) * np.sin(np.pi * np.clip(TIME[:, None] / 0.6 - [0, 0.1, 0.2], 0, 1)) ** 2
TURNS = orientations(ROBOT, THETA)
CAMERAS = Rotation.from_rotvec([0.3, -2.0, 0.7]).as_matrix()
SEEN = CAMERAS @ TURNS
QUATERNION = Rotation.from_matrix(SEEN).as_quat(scalar_first=True)


def _read_as_wxyz(columns):
    return Rotation.from_quat(columns, scalar_first=True).as_matrix()


@pytest.mark.parametrize("planned", [False, True])
@pytest.mark.parametrize(
    ("rotation", "hint"),
    [
        (_read_as_wxyz(QUATERNION[:, [1, 2, 3, 0]]), "the columns qw, qx, qy, qz seem to hold x, y, z, w; then"),
        (_read_as_wxyz(QUATERNION[:, [3, 0, 1, 2]]), "the columns qx, qy, qz, qw seem to hold w, x, y, z; then"),
        (SEEN.swapaxes(1, 2), "the orientations seem to be the inverse ones"),
        (_read_as_wxyz(QUATERNION[:, [1, 2, 3, 0]] * [-1, -1, -1, 1]), "x, y, z, w and the orientations seem to be"),
    ],
)
def test_wrong_orientations_are_told_what_would_fit(rotation, hint, planned):
    """Against the measured joints and against a plan, with a gap."""
    rotation = np.array(rotation)
    rotation[40:44] = np.nan
    found = reojax.compare(
        ROBOT, reojax.make_capture(TIME, THETA, rotation), Sampled(TIME, THETA, TURNS) if planned else None
    )
    assert found.angle_rms > np.deg2rad(20)
    assert hint in found.hint
    assert float(found.hint.split("RMS error is ")[1].split()[0]) < 0.1


@pytest.mark.parametrize(
    ("factor", "hint"), [(180 / np.pi, "degrees taken for radians"), (np.pi / 180, "radians taken for degrees")]
)
def test_wrong_units_of_the_joints_are_told(factor, hint):
    found = reojax.compare(ROBOT, reojax.make_capture(TIME, factor * THETA, SEEN))
    assert hint in found.hint


def test_what_fits_and_what_nothing_mends_has_no_hint():
    assert reojax.compare(ROBOT, reojax.make_capture(TIME, THETA, SEEN)).hint == ""
    noise = Rotation.random(len(TIME), rng=3).as_matrix()
    found = reojax.compare(ROBOT, reojax.make_capture(TIME, THETA, noise))
    assert found.angle_rms > 1
    assert found.hint == ""


def test_the_command_line_prints_the_hint_and_the_columns_that_it_ignored(capsys, monkeypatch, tmp_path):
    """The file's own quaternions, in columns that are named the other way."""
    monkeypatch.setenv("REOJAX_CACHE", "0")
    shipped = (Path(__file__).parents[2] / "docs" / "synthetic_capture.csv").read_text()
    assert "qw,qx,qy,qz" in shipped
    lines = [line for line in shipped.replace("qw,qx,qy,qz", "qx,qy,qz,qw").splitlines() if line[0] != "#"]
    (tmp_path / "c.csv").write_text("\n".join([f"{lines[0]},marker_3", *(f"{line},1" for line in lines[1:])]))
    assert main(["compare", str(tmp_path / "c.csv")]) == 0
    out = capsys.readouterr().out
    assert "hint: the columns qx, qy, qz, qw seem to hold w, x, y, z; then the RMS error is " in out
    assert "ignored columns  marker_3" in out
    assert main(["compare", str(tmp_path / "c.csv"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["hint"].startswith("the columns qx, qy, qz, qw")
    assert report["ignored_columns"] == ["marker_3"]


@pytest.mark.parametrize(("frames", "error"), [(5, 1e-5), (21, 1e-6), (256, 1e-11)])
def test_orientations_of_coarse_captures_are_those_of_the_straight_edges(frames, error):
    """From edges of 1.2 rad to ones of 0.02 rad, against `rotation_history`, which is another method."""
    theta = THETA[np.linspace(0, 255, frames).astype(int)]
    expected = reojax.rotation_history(ROBOT, reojax.polygon(theta), samples=4)[::4]
    np.testing.assert_allclose(orientations(ROBOT, theta), expected, atol=error)


def test_jumps_that_cannot_be_followed_are_refused_by_name():
    with pytest.raises(ValueError, match=r"joint 'bend' goes 100 rad between frames 1 and 2; .* are these degrees\?"):
        steps_needed(ROBOT, np.array([[0, 0, 0.0], [0, 0, 1], [0, 100, 0]]))

"""What `view` takes, and what it refuses."""

import json
import re
from types import SimpleNamespace

import numpy as np
import pytest

import reojax
from reojax import robots

PROTOTYPE = robots.prototype()
LOOP = reojax.manoeuvre_a(np.deg2rad(90.0), np.deg2rad(60.0))
MOTION = reojax.simulate(PROTOTYPE, LOOP, durations=np.full(4, 0.1), samples=16)


def data_of(file):
    return json.loads(re.search(r'id="data">(.*?)</script>', file.read_text(), re.S)[1])


def test_motion_by_time_keeps_its_samples(tmp_path):
    """Time, joints and orientation are those of the motion, and its torques are in the table."""
    data = data_of(reojax.view(PROTOTYPE, MOTION, tmp_path / "a.html"))
    clip = data["clips"][0]
    assert data["timed"]
    np.testing.assert_allclose(clip["clock"], MOTION.time, atol=1e-8)
    np.testing.assert_allclose(clip["theta"], MOTION.theta, atol=1e-8)
    assert "largest joint torque" in dict(data["table"])


def test_quaternions_do_not_jump(tmp_path):
    """So that poses between two samples lie between them, also beyond a half turn."""
    big = reojax.manoeuvre_a(np.deg2rad(270.0), np.deg2rad(120.0))
    q = np.array(data_of(reojax.view(PROTOTYPE, big, tmp_path / "a.html"))["clips"][0]["quaternion"])
    assert (q[1:] * q[:-1]).sum(1).min() > 0.9


def test_thousands_of_corners_are_thinned_and_it_is_said(tmp_path):
    """The last corner stays, and the numbers are those of the whole path."""
    turns = np.linspace(0, 2 * np.pi, 4001)
    curve = np.stack([np.sin(turns), 1 - np.cos(turns), np.sin(turns)], axis=1)
    file = reojax.view(PROTOTYPE, reojax.polygon(curve), tmp_path / "a.html")
    data = data_of(file)
    assert file.stat().st_size < 2e6
    assert len(data["clips"][0]["clock"]) <= 1201
    assert data["clips"][0]["clock"][-1] == 4000
    assert any("Thinned: 1200 of 4001" in note and "4001 corners" in note for note in data["notes"])
    travel = float(np.rad2deg(np.abs(np.diff(curve, axis=0)).sum()))
    assert dict(data["table"])["joint travel, all joints"] == f"{travel:.0f}°"


def test_plans_and_trajectories_are_motions(tmp_path):
    trajectory = reojax.along(LOOP, "quintic", np.full(4, 0.1))
    assert data_of(reojax.view(PROTOTYPE, trajectory, tmp_path / "a.html"))["timed"]
    fastest = SimpleNamespace(trajectory=trajectory)  # as `Fastest` holds it
    assert data_of(reojax.view(PROTOTYPE, fastest, tmp_path / "c.html"))["timed"]
    target = np.asarray(reojax.net_rotation(PROTOTYPE, LOOP))
    plan = reojax.plan(PROTOTYPE, target, twist_limit=4.8, bend_limit=2.2, max_manoeuvres=2)
    data = data_of(reojax.view(PROTOTYPE, plan, tmp_path / "b.html", target=target))
    assert data["clips"][0]["left"][-1] < 1e-3


def test_measured_frames_keep_their_times(tmp_path):
    """A capture that misses its first frames is not moved in time, and what is missing is said."""
    theta, rotation = np.array(MOTION.theta), np.array(MOTION.rotation)
    theta[3, 0] = np.nan
    rotation[:5] = np.nan
    capture = reojax.make_capture(time=np.asarray(MOTION.time), theta=theta, rotation=rotation)
    comparison = reojax.compare(PROTOTYPE, capture, MOTION, offset=0.0)
    data = data_of(reojax.view(PROTOTYPE, comparison, tmp_path / "a.html"))
    simulated, measured = data["clips"]
    assert [simulated["ghost"], measured["ghost"]] == [False, True]
    np.testing.assert_allclose(measured["clock"], MOTION.time[5:], atol=1e-8)
    assert any("60 of 65 frames" in note for note in data["notes"])


def test_links_with_capsules_are_drawn_as_capsules(tmp_path):
    arm = robots.satellite_arm()
    path = reojax.polygon(np.stack([np.zeros(arm.joints), np.full(arm.joints, 0.3)]))
    data = data_of(reojax.view(arm, path, tmp_path / "a.html"))
    drawn = [len(link["capsules"]) for link in data["robots"][0]["links"]]
    assert sum(drawn) == len(arm.capsules) > 0
    assert data["up"] == "z"


def test_one_waypoint_is_a_still_picture(tmp_path):
    data = data_of(reojax.view(PROTOTYPE, reojax.polygon(np.zeros((1, 3))), tmp_path / "a.html"))
    assert data["clips"][0]["theta"] == [[0, 0, 0], [0, 0, 0]]


BACK = np.where(np.arange(65) == 4, 0.0, MOTION.time)
ANOTHER = robots.with_end_inertia(PROTOTYPE, 4e-3)
REFUSED = {
    "`robot` is a str": {"robot": "prototype"},
    "motion of another robot than 'planar3', which has 2: joint0, joint1": {"robot": robots.planar(3)},
    "is not a motion of 'prototype'": {"robot": ANOTHER, "motion": MOTION},
    "must be a Path, a Plan, a Trajectory": {"motion": np.zeros((3, 3))},
    "there is no folder": {"file": "no/where/turn.html"},
    "name of a page ends in one of .html": {"file": "turn.gif"},
    "`target` is no rotation": {"target": 2 * np.eye(3)},
    "cannot be shown on one clock": {"beside": MOTION},
    "it must name motion, ghost, in this order": {"ghost": LOOP, "names": ["one"]},
    "`up` is 'w'": {"up": "w"},
    "motion.time goes back at entry 4": {"motion": MOTION._replace(time=BACK)},
}


@pytest.mark.parametrize("words", REFUSED)
def test_refusals(words, tmp_path):
    """A `ValueError` says what is wrong, and no file is left."""
    given = {"robot": PROTOTYPE, "motion": LOOP, "file": "turn.html"} | REFUSED[words]
    with pytest.raises(ValueError, match=re.escape(words)):
        reojax.view(given.pop("robot"), given.pop("motion"), tmp_path / given.pop("file"), **given)
    assert list(tmp_path.iterdir()) == []


def test_single_precision_is_said(tmp_path):
    """Numbers of float32 look like others on a page, so the page says what they are."""
    path = reojax.polygon(np.asarray(LOOP.waypoints, np.float32))
    data = data_of(reojax.view(PROTOTYPE, path, tmp_path / "a.html"))
    assert any("float32" in note for note in data["notes"])

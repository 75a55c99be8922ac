"""The atlas: a store that goes on where it stopped, certificates that can fail, bounds that no answer is below."""

import json

import numpy as np
import pytest
from atlas_parts import animations, bounds, clear_turns, motors, subjects
from atlas_parts.store import Store
from common import proof

import reojax
from reojax import so3


def test_a_store_goes_on_where_it_stopped(tmp_path):
    """What was found is saved at once, and not found a second time."""
    first = Store(tmp_path / "atlas.json", {"quick": True})
    first.row("turns/one", lambda: {"answer": np.float64(2.5)})
    with pytest.raises(KeyboardInterrupt):
        first.row("turns/two", lambda: (_ for _ in ()).throw(KeyboardInterrupt))
    second, asked = Store(tmp_path / "atlas.json", {"quick": True}), []
    assert second.row("turns/one", lambda: asked.append(1) or {})["answer"] == 2.5
    second.row("turns/two", lambda: asked.append(2) or {"answer": 3.0})
    assert asked == [2]
    assert set(second.under("turns")) == {"one", "two"}


@pytest.mark.parametrize("text", ["", "[]", '{"rows": {}}', json.dumps({"settings": {"quick": False}, "rows": {}})])
def test_a_store_refuses_files_that_are_not_its_own(tmp_path, text):
    (tmp_path / "atlas.json").write_text(text)
    with pytest.raises(ValueError, match=r"atlas\.json"):
        Store(tmp_path / "atlas.json", {"quick": True})


ROBOT = reojax.robots.prototype()
PATH = np.asarray(reojax.manoeuvre_a(np.deg2rad(200), np.deg2rad(80)).waypoints)
TURNED = np.asarray(reojax.net_rotation(ROBOT, reojax.polygon(PATH)))


def test_a_certificate_holds_for_what_is_right_and_not_for_what_is_wrong():
    """Another target, a joint beyond its limit, more clearance than there is."""
    found = proof.prove(ROBOT, PATH, 1, TURNED, 0.005)
    assert found["holds"]
    assert found["clearance_m"] > 0.01
    assert not proof.prove(ROBOT, PATH, 1, TURNED @ np.asarray(so3.exp(np.array([1e-5, 0, 0]))), 0.005)["holds"]
    assert not proof.prove(ROBOT, PATH, 2, TURNED, 0.005)["holds"]
    assert not proof.prove(ROBOT, PATH, 1, TURNED, 0.05)["holds"]
    narrow = ROBOT.replace(upper=np.array([1.0, 2.0, 2.0]))
    assert not proof.prove(narrow, PATH, 1, TURNED, 0.005)["holds"]


@pytest.mark.parametrize("broken", ["momentum", "miss_rad", "pinocchio_rad", "beyond_limits_rad"])
def test_every_figure_of_a_certificate_counts(broken):
    good = {"momentum": 0.0, "miss_rad": 0.0, "pinocchio_rad": None, "clearance_m": None, "beyond_limits_rad": 0.0}
    assert proof.holds(good, 0.005)
    assert not proof.holds(good | {broken: 1e-3}, 0.005)


def test_a_replay_by_pinocchio_is_part_of_it():
    pytest.importorskip("pinocchio")
    assert proof.prove(ROBOT, PATH, 1, TURNED, 0.005)["pinocchio_rad"] < 1e-8


@pytest.mark.slow
def test_no_loop_turns_further_than_the_bound_allows():
    """Random loops of three and four rods in the plane and of the prototype, and the best square of small size."""
    rng = np.random.default_rng(0)
    for robot, reach in ((reojax.robots.planar(3), np.pi), (ROBOT, None)):
        low = np.asarray(robot.lower) if reach is None else np.full(robot.joints, -reach)
        largest = bounds.largest_curvature(robot, low, -low, postures=2048)
        points = rng.uniform(low, -low, (64, 5, robot.joints)) * rng.uniform(0, 1, (64, 1, 1))
        for corners in points:
            path = np.concatenate([0 * corners[:1], corners, 0 * corners[:1]])
            angle = float(so3.angle(reojax.net_rotation(robot, reojax.polygon(path), steps=16)))
            assert bounds.least_travel(angle, largest) <= np.abs(np.diff(path, axis=0)).sum()


def test_the_bound_is_close_where_curvature_is_even():
    """Two joints and a small square at the largest curvature: area (T / 4)^2 against the bound's T^2 / (4 pi)."""
    robot = reojax.robots.planar(3)
    full = np.full(2, np.pi)
    largest = bounds.largest_curvature(robot, -full, full, postures=4096)
    assert largest.of_joints == pytest.approx(largest.of_directions)
    side = 0.02
    square = largest.posture + side * (np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]) - 0.5)
    angle = float(so3.angle(reojax.net_rotation(robot, reojax.polygon(square))))
    assert bounds.least_travel(angle, largest) == pytest.approx(4 * side * np.sqrt(np.pi / 4), rel=0.01)


@pytest.mark.parametrize(("seconds", "expected"), [(0.085, True), (0.0905, False), (0.079, False), (0.13, False)])
def test_the_verdicts_of_figure_3_2(seconds, expected):
    assert motors.verdicts_hold(seconds) is expected
    assert (motors.LEAST < seconds <= motors.SLOWEST) is expected


def test_pages_share_what_they_have_in_common(tmp_path):
    """Put together again a page is the one that `view` wrote."""
    page = reojax.view(ROBOT, reojax.polygon(PATH), tmp_path / "turn.html", certificate=False)
    whole = page.read_text("utf-8")
    animations.share(page)
    text = page.read_text("utf-8")
    assert len(text) < 0.3 * len(whole)
    for name in animations.SHARED:
        script = (tmp_path / name).read_text("utf-8")
        assert script not in text
        text = text.replace(f'<script src="{name}"></script>', f"<script>{script}</script>")
    assert text != whole  # the page allows itself what lies beside it
    assert text.replace(" 'self' file:", "") == whole


@pytest.mark.slow
def test_a_search_with_few_pairs_is_proven_with_all():
    """A quarter turn of roll, asked for with a clearance: the certificate, measured from outside, holds."""
    one = subjects.subject("prototype")
    target = np.asarray(so3.exp(0.25 * np.pi * one.axes["roll"]))[None]
    effort = clear_turns.Effort(starts=1, steps=25)
    free = clear_turns.free_turns(one, target, effort)
    found = clear_turns.clear_turns(one, target, effort, free)
    assert free.reached.all()
    assert found.reached.all()
    assert proof.prove(one.robot, found.waypoints[0], int(found.runs[0]), target[0], one.clearance)["holds"]
    assert found.most[0] >= np.pi / 4

"""Plans that stay clear of the robot itself: proven along the whole path, refused where they cannot be had."""

import jax
import numpy as np
import pytest

import reojax
from reojax import so3
from reojax.collision.clearance import clearances

PROTOTYPE = reojax.robots.prototype()
PITCH = np.asarray(so3.exp(np.array([np.pi / 2, 0.0, 0.0])))
BOX = {"twist_limit": np.deg2rad(270), "bend_limit": np.deg2rad(120)}


def sampled(robot, waypoints):
    at = np.linspace(0, len(waypoints) - 1, 10_000)
    postures = np.stack([np.interp(at, np.arange(len(waypoints)), column) for column in np.asarray(waypoints).T], 1)
    return np.asarray(jax.jit(clearances)(robot, postures)).min()


@pytest.mark.slow
def test_free_path_keeps_its_clearance():
    """Pitch by 90 degrees, for which the shortest paths strike: 5 mm proven, the target met, no sample below."""
    found = reojax.free_path(PROTOTYPE, PITCH, clearance=0.005, starts=4, corners=6)
    assert found.converged
    assert found.error < 1e-9
    assert found.clearance >= 0.005
    assert sampled(PROTOTYPE, found.waypoints) >= found.clearance
    np.testing.assert_allclose(reojax.net_rotation(PROTOTYPE, reojax.Path(found.waypoints), steps=8), PITCH, atol=1e-8)


def test_clearance_that_rest_does_not_have_is_refused():
    with pytest.raises(ValueError, match=r"`clearance` is 0.04 m, which the posture at the start does not have: link0"):
        reojax.free_path(PROTOTYPE, PITCH, clearance=0.04)


def test_posture_in_contact_is_refused_with_pair_and_depth():
    postures = np.random.default_rng(0).uniform(-1, 1, (400, 3)) * [4.7, 2.09, 4.7]
    depth = np.asarray(jax.jit(clearances)(PROTOTYPE, postures))
    start = postures[depth.min(0).argmin()]
    assert depth.min() < -0.002
    with pytest.raises(ValueError, match=r"the posture at the start is in contact: link. .* overlap by 0.0"):
        reojax.free_path(PROTOTYPE, PITCH, start=start, clearance=0.001)


def test_robot_without_shapes_has_no_clearance():
    with pytest.raises(ValueError, match="'planar2' has no pairs of shapes"):
        reojax.free_path(reojax.robots.planar(2), np.eye(3), clearance=0.001)


@pytest.mark.parametrize("clearance", [-0.001, np.nan, "5mm"])
def test_clearance_is_a_number_from_zero_up(clearance):
    with pytest.raises(ValueError, match="`clearance`"):
        reojax.free_path(PROTOTYPE, PITCH, clearance=clearance)


@pytest.mark.slow
def test_plans_of_manoeuvres_keep_their_clearance():
    """Pitch by 90 degrees, for which the fewest manoeuvres strike: the plan with 5 mm is another, and proven."""
    limits = {**BOX, "max_manoeuvres": 5}
    free = reojax.plan_many(PROTOTYPE, np.stack([PITCH, np.eye(3)]), **limits)
    found = reojax.plan_many(PROTOTYPE, np.stack([PITCH, np.eye(3)]), clearance=0.005, **limits)
    assert free.clearance is None
    assert free.converged.all()
    assert sampled(PROTOTYPE, free.waypoints[0]) < 0.005
    assert found.converged.all()
    assert (found.clearance >= 0.005).all()
    assert sampled(PROTOTYPE, found.waypoints[0]) >= found.clearance[0]
    assert found.manoeuvres[0] >= free.manoeuvres[0]
    one = reojax.plan(PROTOTYPE, PITCH, clearance=0.005, **limits)
    assert one.clearance == found.clearance[0]


def test_boxes_hold_only_clear_loops():
    """Random loops within the boxes of each letter keep the clearance, and the boxes are no smaller than they must."""
    from reojax.planning.clear_boxes import clear_boxes
    from reojax.planning.clear_paths import Clear
    from reojax.planning.words import box_of, last_twist, loop_corners

    with jax.enable_x64(True):
        layout, clear = (
            reojax.layout_of(PROTOTYPE),
            Clear(PROTOTYPE, 0.005, np.asarray(reojax.clearance(PROTOTYPE, np.zeros(3)))),
        )
        whole = box_of(PROTOTYPE, layout, "AB", *BOX.values())
        boxes = clear_boxes(layout, whole, clear)
        rng = np.random.default_rng(0)
        letter = rng.integers(len(boxes.letters), size=128)
        x = rng.uniform(boxes.low[letter], boxes.high[letter]).T
        loops = loop_corners(layout, *x, last_twist(boxes.letters, letter, x))
        assert set(boxes.letters) == {"A", "B"}
        assert clear.keeps(loops).mean() > 0.97
        assert np.isclose(boxes.high, whole.high[0]).any(0).all()

"""Steering that keeps a clearance: no posture that it tells comes nearer, where a law that keeps less of it does."""

import jax
import numpy as np
import pytest

import reojax
from reojax import robots, so3
from reojax.collision.clearance import clearances
from reojax.steering.clear_of_itself import keep_of, towards
from reojax.steering.feedback import Steering
from reojax.steering.readings import Reading

ROBOT = robots.prototype()
MOTION = reojax.along(
    reojax.manoeuvre_a(np.deg2rad(250), np.deg2rad(110)), "quintic", np.array([0.12, 0.19, 0.12, 0.19])
)
LEAST = float(reojax.trajectory_clearance(ROBOT, MOTION).distance)
MARGIN = LEAST - 1e-4


def told(clearance):
    """Postures told every 2 ms where the base is read to be ever further off than planned."""
    law = Steering(ROBOT, MOTION, momentum_std=1e-5, samples=16, clearance=clearance)
    state, postures = law.start(), []
    history = reojax.simulate(ROBOT, MOTION, samples=80)
    for k in range(4, 320, 4):
        off = so3.exp(np.deg2rad([4.0, -6.0, 5.0]) * k / 320)
        joints = np.full(3, np.nan) if k % 3 else history.theta[k]
        time = float(history.time[k])
        state, references = law.step(state, Reading(time, joints, off @ history.rotation[k], time))
        postures.append(np.asarray(references.theta))
    return np.stack(postures)


def test_no_posture_told_comes_nearer():
    """Where the same law, compiled once for both, that must only not meet itself comes nearer."""
    gap = np.asarray(clearances(ROBOT, told(MARGIN))).min()
    assert np.asarray(clearances(ROBOT, told(0.0))).min() < MARGIN - 1e-3
    assert MARGIN - 1e-12 <= gap < MARGIN + 1e-3


def test_a_correction_goes_as_far_as_it_may():
    """Towards random postures: all the way where the straight way is clear, else up to the margin and no further."""
    keep, rng = keep_of(ROBOT, MOTION, 0.005), np.random.default_rng(0)
    go = jax.jit(towards)
    whole = 0
    for _ in range(40):
        wanted = rng.uniform(-1, 1, 3) * [4.0, 2.0, 4.0]
        end = np.asarray(go(ROBOT, keep, np.zeros(3), wanted))
        way = reojax.path_clearance(ROBOT, reojax.polygon(np.stack([np.zeros(3), end])))
        assert way.found >= 0.005 - 1e-12
        whole += np.allclose(end, wanted)
    assert 10 < whole < 40


def test_a_motion_that_comes_nearer_is_refused():
    with pytest.raises(ValueError, match=r"which the motion does not keep: link0 .*come within 0.02.* m at 0\."):
        Steering(ROBOT, MOTION, samples=16, clearance=LEAST + 1e-3)
    with pytest.raises(ValueError, match="the start of the motion does not have"):
        Steering(ROBOT, MOTION, samples=16, clearance=0.05)


def test_the_law_says_what_the_motion_keeps():
    law = Steering(ROBOT, MOTION, samples=16, clearance=0.005)
    np.testing.assert_allclose(law.keep.proven, LEAST)
    assert Steering(ROBOT, MOTION, samples=16).keep is None

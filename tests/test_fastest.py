"""Overlapped edges: faster than one after the other, with the same net rotation, and no motor beyond its curve."""

import numpy as np
import pytest

import reojax
from reojax import RE_MAX_17, so3

PROTOTYPE = reojax.robots.prototype()
A = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))


def test_overlapped_edges_are_faster_and_turn_as_far():
    found = reojax.overlap(PROTOTYPE, A, RE_MAX_17)
    least = reojax.minimum_time(PROTOTYPE, A, RE_MAX_17)
    assert found.converged
    assert found.duration < 0.85 * least.duration
    motion = reojax.simulate(PROTOTYPE, found.trajectory, motors=RE_MAX_17, samples=32)
    assert so3.angle(motion.rotation[-1].T @ reojax.net_rotation(PROTOTYPE, A)) < 1e-4
    assert np.asarray(motion.margin).min() > -1e-4
    np.testing.assert_allclose(motion.theta[-1], 0, atol=1e-9)
    np.testing.assert_allclose(motion.time[-1], found.duration)
    assert found.beyond < 1e-6


@pytest.mark.parametrize("target", [np.zeros((3, 3)), np.eye(2), np.diag([1.0, 1.0, -1.0])])
def test_a_target_that_is_no_rotation(target):
    with pytest.raises(ValueError, match="`target` is .*; it must be a rotation matrix"):
        reojax.fastest_loop(PROTOTYPE, target, RE_MAX_17, A)


def test_motors_and_paths_are_checked():
    with pytest.raises(ValueError, match="motors.supply is -1.0"):
        reojax.free_law(PROTOTYPE, A, RE_MAX_17._replace(supply=-1.0))
    with pytest.raises(ValueError, match="one waypoint"):
        reojax.overlap(PROTOTYPE, reojax.polygon(np.zeros((1, 3))), RE_MAX_17)

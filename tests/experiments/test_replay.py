"""The replay that checks plans in the experiments shares nothing with reojax's integrator, and agrees with it."""

import numpy as np
import pytest
from common.replay import apart, base_rate, pinocchio, replay

import reojax
from reojax.robots.random import random_robot

ROBOT = random_robot(3, 4, branched=True)
RNG = np.random.default_rng(0)


def test_base_rate_is_the_local_connection():
    theta, rate = RNG.normal(size=(2, 4, 5))
    for k, omega in enumerate(base_rate(ROBOT, theta, rate).T):
        np.testing.assert_allclose(omega, reojax.connection(ROBOT, theta[:, k]) @ rate[:, k], rtol=1e-12)


def test_paths_end_where_reojax_ends():
    """Two paths with an edge in common, one that stays where it is, and one against Pinocchio and DOP853."""
    paths = RNG.uniform(-1, 1, size=(3, 4, 4))
    paths[1, :2] = paths[0, :2]
    paths[2] = paths[2, 0]
    ends = [np.asarray(reojax.net_rotation(ROBOT, reojax.polygon(path), steps=16)) for path in paths]
    np.testing.assert_array_equal(replay(ROBOT, paths)[2], np.eye(3))
    assert apart(replay(ROBOT, paths), np.array(ends)).max() < 1e-9
    pytest.importorskip("pinocchio")
    assert apart(pinocchio(ROBOT, paths[0])[None], ends[0][None]).max() < 1e-9

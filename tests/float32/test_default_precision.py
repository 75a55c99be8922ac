"""With float64 off, JAX's default, which a new user meets first: float32 out, and close to what float64 gives.

    REOJAX_TEST_X64=0 pytest -m float32

The numbers to compare with are those of float64, as the README prints them.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots, so3

pytestmark = [
    pytest.mark.float32,
    pytest.mark.skipif(bool(jax.config.values["jax_enable_x64"]), reason="float64 is on"),
]

ROBOT = robots.prototype()
A = reojax.manoeuvre_a(np.deg2rad(270.0), np.deg2rad(120.0))
TURN = np.deg2rad([2.631, 1.555, -174.931])
"""Rotation vector of A at 270/120 degrees, by float64."""


def test_net_rotation():
    turn = reojax.net_rotation(ROBOT, A)
    assert turn.dtype == jnp.float32
    np.testing.assert_allclose(Rotation.from_matrix(np.asarray(turn)).as_rotvec(), TURN, atol=5e-5)
    np.testing.assert_allclose(reojax.rotation_history(ROBOT, A, samples=2)[-1], turn, atol=5e-6)


def test_gradient():
    """By the gear ratio, against the README's number of float64."""

    def miss(gear):
        geared = robots.with_gear_ratio(ROBOT, gear)
        return so3.angle(reojax.net_rotation(geared, A) @ jnp.diag(jnp.array([-1.0, -1.0, 1.0])))

    value, slope = jax.value_and_grad(miss)(jnp.float32(24.0))
    assert (value.dtype, slope.dtype) == (jnp.float32, jnp.float32)
    assert value == pytest.approx(0.09467414, abs=2e-5)
    assert slope == pytest.approx(3.69922147e-03, rel=1e-3)


def test_momentum_is_zero_along_the_connection():
    theta, rate = np.array([0.3, 1.0, -0.7]), np.array([1.0, -2.0, 0.5])
    A_, B = reojax.momentum_matrices(ROBOT, theta)
    omega = reojax.connection(ROBOT, theta) @ rate.astype(np.float32)
    assert A_.dtype == B.dtype == omega.dtype == jnp.float32
    size = np.abs(np.asarray(B) @ rate).max()
    np.testing.assert_allclose(reojax.angular_momentum(ROBOT, theta, rate, omega) / size, np.zeros(3), atol=1e-6)


def test_a_motion_ends_where_the_path_ends():
    motion = reojax.simulate(ROBOT, A, durations=1.0)
    assert motion.rotation.dtype == jnp.float32
    np.testing.assert_allclose(motion.rotation[-1], reojax.net_rotation(ROBOT, A), atol=2e-5)


def test_rotations_round_trip():
    vectors = np.random.default_rng(0).normal(size=(64, 3)).astype(np.float32)
    back = jax.vmap(lambda v: so3.log(so3.exp(v)))(vectors)
    assert back.dtype == jnp.float32
    np.testing.assert_allclose(back, vectors, atol=2e-6)
    assert np.isfinite(jax.jacfwd(lambda v: so3.exp(v))(jnp.zeros(3))).all()


def test_robots_keep_all_their_digits():
    """A robot's own arrays are float64, whatever JAX computes with."""
    assert ROBOT.mass.dtype == np.float64
    assert float(np.sum(ROBOT.mass)) == pytest.approx(0.3, abs=1e-15)


def test_a_certificate_says_that_float32_is_not_enough():
    with pytest.warns(UserWarning, match="jax_enable_x64"):
        reojax.certify(ROBOT, A, samples=16)


def test_planners_compute_in_double_precision_all_the_same():
    target = Rotation.from_rotvec([0.3, -0.2, 1.0]).as_matrix()
    plan = reojax.plan(ROBOT, target, twist_limit=4.0, bend_limit=2.0, max_manoeuvres=4)
    path = reojax.free_path(ROBOT, target, starts=2)
    turn = reojax.righting(ROBOT, target, momentum=[0, 0, 1e-4], duration=1.0)
    for found, least in ((plan, 1e-9), (path, 1e-9), (turn, 1e-6)):
        assert found.converged
        assert found.error <= least


def test_a_calibration_computes_in_double_precision_all_the_same():
    time = np.arange(40) / 300
    theta = np.sin(np.outer(time, [40.0, 30.0, 50.0]))
    true = robots.with_end_inertia(ROBOT, 62e-6)
    seen = reojax.joints_simulated(true, reojax.make_capture(time, theta)).rotation
    assert seen.dtype == np.float64
    fit = reojax.calibrate(ROBOT, reojax.make_capture(time, theta, seen), clock=False)
    assert fit.values[0] == pytest.approx(62e-6, rel=1e-8)
    assert not jax.config.values["jax_enable_x64"]

"""The certificate is small for right answers, and large for each kind of wrong one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import robots, so3
from reojax.mechanics import certificate
from reojax.mechanics.certificate import certify, certify_rotation, edge_momentum, momentum_residual

A = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
SAMPLES = 128


@pytest.fixture(scope="module")
def certified():
    return certify_rotation(robots.prototype(), A, steps=8, samples=SAMPLES)


@pytest.fixture(scope="module")
def history(certified):
    return certified[2]


def test_a_right_answer_has_a_small_certificate(certified):
    """Zero momentum to the rounding of the differences, a rotation to rounding, no change on halving."""
    found, rotation, _ = certified
    assert found.momentum < 3e-11
    assert found.momentum > 0  # measured, not assumed
    assert found.orthogonality < 3e-14
    assert found.halving < 1e-9
    assert found.endpoint < 1e-9
    np.testing.assert_allclose(rotation, reojax.net_rotation(robots.prototype(), A), atol=1e-8)


def test_a_coarse_step_shows():
    """One step per edge is told by halving and by the end of the motion, and by how much."""
    found, rotation, history = certify_rotation(robots.prototype(), A, steps=1)
    error = so3.angle(rotation.T @ history[-1])
    assert error > 1e-5
    assert found.endpoint == pytest.approx(float(error), rel=1e-6)
    assert 0.5 * error < found.halving < 2 * error
    assert found.momentum < 3e-11


@pytest.mark.parametrize("field", ["mass", "com", "inertia", "axis", "rotor_inertia", "gear_ratio"])
def test_a_wrong_robot_shows(field, history):
    """The motion of one robot is no motion of another that differs by one part in a thousand."""
    robot = robots.prototype()
    changed = np.array(getattr(robot, field))
    changed[0] += 1e-3 * (np.ones(3) if field == "axis" else changed[0])
    assert momentum_residual(robot.replace(**{field: changed}), A, history) > 1e-6


def test_a_base_that_does_not_turn_shows():
    """Joints that move a base held fast exchange a momentum of the order of all there is."""
    still = np.tile(np.eye(3), (4 * SAMPLES + 1, 1, 1))
    assert 0.3 < momentum_residual(robots.prototype(), A, still) <= 1


def test_the_outer_frame_does_not_matter(history):
    """Seen from another inertial frame the momentum is the same."""
    robot = robots.prototype()
    still = np.tile(so3.exp([0.4, -1.0, 2.0]), (4 * SAMPLES + 1, 1, 1))
    frame = np.tile(np.eye(3), (4 * SAMPLES + 1, 1, 1))
    assert momentum_residual(robot, A, still) == pytest.approx(float(momentum_residual(robot, A, frame)))
    turned = still[0] @ np.asarray(history)
    assert momentum_residual(robot, A, turned) < 3e-11


def test_differences_give_the_momentum_that_jacobians_give():
    """On an edge with the base spinning steadily, the measured momentum is `A omega - B theta_dot`."""
    robot = robots.prototype()
    start, end = np.array([0.2, -0.5, 0.3]), np.array([0.9, 0.8, -0.6])
    omega = np.array([0.7, -1.1, 0.4])
    fraction = np.linspace(0, 1, 65)
    turned = jax.vmap(so3.exp)(jnp.outer(fraction, omega))

    def expected(t, rotation):
        return rotation @ reojax.angular_momentum(robot, start + t * (end - start), end - start, omega)

    net, exchanged = jax.jit(edge_momentum)(robot, start, end, turned)
    np.testing.assert_allclose(net, jax.jit(jax.vmap(expected))(fraction, turned), atol=1e-10 * exchanged.max())
    assert np.abs(net).max() > 0.1 * exchanged.max()


@pytest.mark.parametrize("waypoints", [np.zeros((1, 3)), np.full((5, 3), 0.4)])
def test_a_path_that_stays_put_has_nothing_to_hide(waypoints):
    """No motion, no momentum, no change; and no 0/0."""
    assert certify(robots.prototype(), reojax.polygon(waypoints), steps=8) == (0, 0, 0, 0)


def test_float32_stays_float32(history):
    """Rotations in float32 give a float32 figure, small as differences of float32 go."""
    found = momentum_residual(robots.prototype(), A, np.asarray(history, np.float32))
    assert found.dtype == np.float32
    assert found < 3e-2


def test_it_runs_under_vmap(history):
    """A batch of histories gives what each gives alone."""
    robot = robots.prototype()
    still = np.tile(np.eye(3), (4 * SAMPLES + 1, 1, 1))
    batch = jax.vmap(lambda turned: momentum_residual(robot, A, turned))(jnp.stack([history, still]))
    alone = [momentum_residual(robot, A, history), momentum_residual(robot, A, still)]
    np.testing.assert_allclose(batch, alone, atol=1e-11)


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ((42, 3, 3), r"`rotations` has shape \(42, 3, 3\); for a path of 4 edges"),
        ((513, 3), r"`rotations` has shape \(513, 3\)"),
        ((), r"`rotations` has shape \(\)"),
        ((37, 3, 3), "9 samples per edge; differences need 10"),
    ],
)
def test_rotations_that_do_not_fit_are_refused(shape, message):
    with pytest.raises(ValueError, match=message):
        momentum_residual(robots.prototype(), A, np.zeros(shape))


def test_the_difference_formula_is_exact_for_its_polynomials():
    """Eleven points differentiate a polynomial of degree ten, at the ends too."""
    t = np.linspace(0, 1, 31)
    powers = np.arange(1, 11)
    found = certificate._derivative(jnp.asarray(t[:, None] ** powers))
    np.testing.assert_allclose(found, powers * t[:, None] ** (powers - 1), atol=1e-10)

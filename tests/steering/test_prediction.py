"""What `Steering` predicts of the end, and how the end turns with its changes, against differences and a simulation."""

import jax
import jax.numpy as jnp
import numpy as np

import reojax
from reojax import robots, so3
from reojax.steering.bumps import bumps
from reojax.steering.prediction import ahead_of, miss_and_slope

ROBOT = robots.prototype()
MOTION = reojax.along(
    reojax.manoeuvre_a(np.deg2rad(250), np.deg2rad(110)), "quintic", np.array([0.12, 0.19, 0.12, 0.19])
)
MOMENTUM = np.diag(np.asarray(reojax.momentum_matrices(ROBOT, np.zeros(3)).A)) * np.array([0.3, -0.2, 0.4])
COUNT, STEPS, NOW = 13, 200, 0.17
BOTH = jax.jit(miss_and_slope)
RNG = np.random.default_rng(0)
STEER, FILTERED, RATE = RNG.normal(size=(3, COUNT, 3)) * np.array([0.1, 0.1, 3.0])[:, None, None]


def test_bumps_are_smooth_and_begin_when_they_say():
    """Values and rates agree with differences; each is 1 at its highest and 0 outside four widths."""
    width = 0.62 / (COUNT + 3)
    times = np.linspace(0, 0.62, 16 * 40 + 1)
    values, rates = jax.vmap(lambda t: bumps(t, jnp.asarray(0.62), COUNT))(times)
    np.testing.assert_allclose(np.gradient(values, times, axis=0)[1:-1], rates[1:-1], atol=5e-3 / width)
    np.testing.assert_allclose(np.asarray(values).max(0), 1, atol=1e-12)
    start = width * np.arange(COUNT)
    inside = (times[:, None] > start + 1e-9) & (times[:, None] < start + 4 * width - 1e-9)
    np.testing.assert_array_equal(np.asarray(values) > 1e-15, inside)
    assert np.abs(np.asarray(rates)[[0, -1]]).max() < 1e-8


def _ahead(tau: float, largest: float, start: np.ndarray):
    table = {"at": np.array([0.0, 0.62]), "bias": np.zeros((2, 3))}
    now = jnp.asarray(NOW), jnp.asarray(start), jnp.asarray(MOMENTUM), jnp.zeros(())
    goal = np.asarray(so3.exp(jnp.array([0.2, -0.3, 0.1])))
    return ahead_of(ROBOT, MOTION, table, goal, now, jnp.asarray(tau), jnp.asarray(largest), STEPS, COUNT)


def test_the_slope_is_that_of_differences():
    """Through the filter; to the rule's own error."""
    start = np.asarray(so3.exp(jnp.array([0.4, 0.1, -0.2])))
    ahead, step_size = _ahead(2e-2, 9.0, start), 1e-5
    _, slope = BOTH(ahead, STEER, FILTERED, RATE)
    for n, j in ((2, 0), (4, 1), (6, 2), (8, 0), (11, 1), (12, 2)):
        step = np.zeros_like(STEER)
        step[n, j] = step_size
        after, before = (BOTH(ahead, STEER + sign * step, FILTERED, RATE)[0] for sign in (1, -1))
        turn = so3.log(so3.exp(after) @ so3.exp(before).T) / (2 * step_size)
        np.testing.assert_allclose(slope[:, n, j], turn, atol=3e-4)
    assert np.abs(slope).max() > 0.1


def test_joints_that_are_held_follow_their_limits():
    """Changes of next to nothing allowed: the end is that of the motion as planned, and no steering changes it."""
    held, free = _ahead(2e-2, 1e-7, np.eye(3)), _ahead(2e-2, 9.0, np.eye(3))
    miss, slope = BOTH(held, STEER, FILTERED, RATE)
    np.testing.assert_allclose(miss, BOTH(free, 0 * STEER, 0 * STEER, 0 * STEER)[0], atol=1e-6)
    assert np.abs(slope).max() < 1e-8


def test_the_end_is_that_of_a_simulation():
    """Nothing changed: from where the planned motion is, with its momentum, the goal is missed by as much as it is."""
    history = reojax.simulate(ROBOT, MOTION, momentum=MOMENTUM, samples=190)
    k = int(np.argmin(np.abs(np.asarray(history.time) - NOW)))
    still = jnp.zeros((COUNT, 3))
    ahead = _ahead(5e-3, 9.0, np.asarray(history.rotation[k]))
    assert abs(float(history.time[k]) - NOW) < 1e-9
    miss, _ = BOTH(ahead, still, still, still)
    wanted = so3.log(history.rotation[-1] @ ahead.goal.T)
    np.testing.assert_allclose(miss, wanted, atol=2e-4)

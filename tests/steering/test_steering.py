"""Steering: estimate and correction in flight, and what its readings must be."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import robots, so3
from reojax.steering import onboard
from reojax.steering.feedback import Steering
from reojax.steering.linear_law import smooth, steer_by
from reojax.steering.readings import Reading
from reojax.steering.tables import gain_table

ROBOT = robots.prototype()
TRAJECTORY = reojax.along(
    reojax.manoeuvre_a(np.deg2rad(250), np.deg2rad(110)), "quintic", np.array([0.12, 0.19, 0.12, 0.19])
)
SPREAD = 0.05 * np.diag(np.asarray(reojax.momentum_matrices(ROBOT, np.zeros(3)).A))
LAW = Steering(ROBOT, TRAJECTORY, momentum_std=SPREAD, drag_std=2e-7, noise=np.deg2rad(1), samples=16)
TICK, LAG = 2e-3, 5
NOTHING = np.full((3, 3), np.nan)


@jax.jit
def fall(momentum, steered, first, last):
    """End orientation and last state of a fall: joints that obey, exact orientations 10 ms late; none in the gap."""

    def omega(theta, rate, r):
        return reojax.base_velocity(ROBOT, theta, rate, momentum=r.T @ momentum)

    def tick(carry, k):
        state, joints, told, past = carry
        planned = TRAJECTORY.at((k - 1) * TICK).theta
        after = planned + steered * (told - planned)
        rate, r = (after - joints) / TICK, past[-1]
        half = r @ so3.exp(TICK / 2 * omega(joints, rate, r))
        r = r @ so3.exp(TICK * omega((joints + after) / 2, rate, half))
        past = jnp.concatenate([past[1:], r[None]])
        seen = jnp.where((k >= LAG) & ~((first <= k) & (k < last)), past[-1 - LAG], jnp.nan)
        state, references = LAW.update(state, Reading(k * TICK, after, seen, (k - LAG) * TICK))
        return (state, after, references.theta, past), None

    start, eye = TRAJECTORY.at(0.0).theta, jnp.eye(3)
    carry = LAW.start(), start, start, jnp.tile(eye, (LAG + 1, 1, 1))
    (state, _, _, past), _ = jax.lax.scan(tick, carry, jnp.arange(1, 311))
    return past[-1], state


def test_a_release_is_estimated_and_taken_back():
    """Momentum of one deviation per axis: found to a tenth, and the end nearer than without; gaps do little harm."""
    momentum = SPREAD * np.array([0.7, -0.5, 0.6])
    goal = np.asarray(so3.from_quaternion(LAW.table["quaternion"][-1]))
    free, _ = fall(momentum, 0.0, 0, 0)
    off = float(so3.angle(goal.T @ free))
    end, state = fall(momentum, 1.0, 0, 0)
    assert off > np.deg2rad(1.5)
    assert float(so3.angle(goal.T @ end)) < 0.1 * off
    np.testing.assert_allclose(state.momentum / SPREAD, momentum / SPREAD, atol=0.1)
    assert (np.linalg.eigvalsh(np.asarray(state.covariance)) > -1e-18).all()
    assert state.covariance[4, 4] < 0.1 * SPREAD[1] ** 2
    gappy, _ = fall(momentum, 1.0, 100, 150)
    assert float(so3.angle(goal.T @ gappy)) < 0.15 * off


def test_the_linear_part_is_the_law_on_board():
    """NumPy and JAX agree on steering vector and filter to the last digits, at any time and error."""
    table = gain_table(reojax.correction_gains(ROBOT, TRAJECTORY, samples=16))
    held = {name: jnp.asarray(value) for name, value in table.items()}
    rng = np.random.default_rng(0)
    both = jax.jit(steer_by)
    for time in (0.013, 0.2, 0.431, 0.6):
        row = onboard.at(table, time)
        steer, filtered, rate, error = rng.normal(size=(4, 3)) * [[0.1], [0.1], [3.0], [0.03]]
        later = table["direction"][table["at"] >= time]
        mine = onboard.corrected(row, later, steer, filtered, rate, error, 0.3, 5e-3, 0.3)
        named = {name: jnp.asarray(value) for name, value in row.items()}
        theirs, _ = both(named, held, time, steer, filtered, rate, error, 0.3, jnp.asarray(5e-3), 0.3)
        np.testing.assert_allclose(theirs, mine, rtol=1e-10, atol=1e-13)
        theirs = smooth(mine, filtered, rate, *map(jnp.asarray, (2e-3, 5e-3)))
        for a, b in zip(theirs, onboard.smooth(mine, filtered, rate, 2e-3, 5e-3), strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-15)


def test_without_a_disturbance_nothing_is_changed():
    """A perfect release, perfect readings: the joints are told the motion."""
    state, told = LAW.start(), []
    history = reojax.simulate(ROBOT, TRAJECTORY, samples=64)
    for k in range(1, 20):
        at = 4 * k
        time = float(history.time[at])
        state, references = LAW.step(state, Reading(time, history.theta[at], history.rotation[at], time))
        told.append(np.abs(references.theta - history.theta[at]).max())
    assert max(told) < 2e-4


@pytest.mark.parametrize(
    ("reading", "said"),
    [
        (Reading(0.009, np.zeros(3), np.eye(3), 0.008), "out of order"),
        (Reading(0.011, np.zeros(3), np.eye(3), 0.004), "out of order"),
        (Reading(0.011, np.zeros(3), np.eye(3), 0.012), "taken by the time"),
        (Reading(0.011, np.zeros(2), np.eye(3), 0.01), "shape"),
        (Reading(0.011, np.zeros(3), 1.1 * np.eye(3), 0.01), "no rotation"),
        (Reading(np.nan, np.zeros(3), np.eye(3), 0.01), "finite"),
    ],
)
def test_readings_that_it_refuses(reading, said):
    state, _ = LAW.step(LAW.start(), Reading(0.01, np.zeros(3), np.eye(3), 0.005))
    with pytest.raises(ValueError, match=said):
        LAW.step(state, reading)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"noise": 0.0}, "positive"),
        ({"momentum_std": -1.0}, "not negative"),
        ({"parameters": ["nonsense"], "parameters_std": [1.0]}, "there is no parameter"),
        ({"parameters": ["rotor_inertia"]}, "0 numbers for 1"),
    ],
)
def test_options_that_it_refuses(options, said):
    with pytest.raises(ValueError, match=said):
        Steering(ROBOT, TRAJECTORY, samples=16, **options)

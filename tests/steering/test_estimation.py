"""Steering with a robot that is not as believed: what is estimated, how sure it is, and what is left at the end."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import robots, so3
from reojax.steering.feedback import Steering
from reojax.steering.readings import Reading

ROBOT = robots.prototype()
WIDE = ROBOT.replace(lower=ROBOT.lower - 1, upper=ROBOT.upper + 1)
PLAN = reojax.along(reojax.manoeuvre_a(np.deg2rad(250), np.deg2rad(110)), "quintic", np.array([0.12, 0.19, 0.12, 0.19]))
SPREAD = 0.05 * np.diag(np.asarray(reojax.momentum_matrices(ROBOT, np.zeros(3)).A))
NOISE, TICK, LAG, DRAG, OFF = np.deg2rad(0.5), 4e-3, 2, 4e-7, 0.1
NAMES = [f"inertia_scale[{link}]" for link in range(4)]
LAW = Steering(
    WIDE, PLAN, momentum_std=SPREAD, drag_std=DRAG, noise=NOISE, parameters=NAMES, parameters_std=[OFF] * 4,
    samples=16, steps=24, settle=3e-2, left=1.0,
)  # fmt: skip
TICKS = round(0.62 / TICK)
GOAL = np.asarray(LAW.goal)


@jax.jit
@jax.vmap
def falls(key, momentum, drag, scale, steered):
    """End, last state and the largest jump of what the joints are told; joints that obey, a tenth of frames dropped."""
    truth = ROBOT.replace(inertia=ROBOT.inertia * scale[:, None, None])
    noise, drop = jax.random.split(key)
    tilt = jax.vmap(so3.exp)(NOISE * jax.random.normal(noise, (TICKS, 3)))
    gone = jax.random.uniform(drop, (TICKS,)) < 0.1

    def tick(carry, inputs):
        state, joints, told, past, h = carry
        k, tilt, gone = inputs
        planned = PLAN.at((k - 1) * TICK).theta
        after = planned + steered * (told - planned)
        rate, r = (after - joints) / TICK, past[-1]
        for part in range(2):
            theta = joints + (part + 0.5) / 2 * (after - joints)
            half = r @ so3.exp(TICK / 4 * reojax.base_velocity(truth, theta, rate, momentum=r.T @ h))
            omega = reojax.base_velocity(truth, theta, rate, momentum=half.T @ h)
            r, h = r @ so3.exp(TICK / 2 * omega), h - TICK / 2 * drag * (half @ omega)
        past = jnp.concatenate([past[1:], r[None]])
        seen = jnp.where(gone | (k < LAG), jnp.nan, past[-1 - LAG] @ tilt)
        state, references = LAW.update(state, Reading(k * TICK, after, seen, (k - LAG) * TICK))
        return (state, after, references.theta, past, h), jnp.abs(references.theta - told).max()

    first, eye = PLAN.at(0.0).theta, jnp.eye(3)
    carry = (LAW.start(), first, first, jnp.tile(eye, (LAG + 1, 1, 1)), momentum)
    (state, _, _, past, _), jumps = jax.lax.scan(tick, carry, (jnp.arange(1, TICKS + 1), tilt, gone))
    return past[-1], state, jumps.max()


RNG = np.random.default_rng(3)
MANY = 24
MOMENTUM, DRAGS = RNG.normal(size=(MANY, 3)) * SPREAD, np.abs(RNG.normal(size=MANY)) * DRAG
SCALES = np.exp(OFF * RNG.normal(size=(MANY, 4)))


@pytest.fixture(scope="module")
def flown():
    """Falls that are steered."""
    return falls(jax.random.split(jax.random.key(0), MANY), MOMENTUM, DRAGS, SCALES, np.ones(MANY))


@pytest.fixture(scope="module")
def free():
    """The same, let alone."""
    return falls(jax.random.split(jax.random.key(0), MANY), MOMENTUM, DRAGS, SCALES, np.zeros(MANY))


def errors(ends) -> np.ndarray:
    return np.array([so3.angle(jnp.asarray(GOAL.T @ end)) for end in np.asarray(ends)])


@pytest.mark.slow
def test_it_helps_a_robot_whose_inertias_are_wrong(flown, free):
    """Inertias off by 10 %, momentum, drag, noise, latency, dropped frames: most of the error is taken back."""
    steered, alone = errors(flown[0]), errors(free[0])
    assert np.median(alone) > np.deg2rad(3)
    assert np.median(steered) < 0.3 * np.median(alone)
    assert np.quantile(steered, 0.9) < 0.4 * np.quantile(alone, 0.9)


def test_estimates_are_as_near_as_their_covariance_says(flown, free):
    """Mean of the squared errors in the metric of the covariance: one for each number; and better than the prior."""
    for ends in (free, flown):
        state = ends[1]
        off = np.concatenate([np.asarray(state.momentum) - MOMENTUM, np.asarray(state.values) - SCALES], axis=1)
        chosen = np.r_[3:6, 7:11]
        covariance = np.asarray(state.covariance)[:, chosen[:, None], chosen[None]]
        size = np.einsum("ma,mab,mb->m", off, np.linalg.inv(covariance), off) / 7
        assert 0.4 < np.median(size) < 2.5
        deviation = np.sqrt(np.einsum("maa->ma", covariance))
        assert (np.median(deviation[:, :3], axis=0) < 0.5 * SPREAD).all()
        assert np.median(deviation[:, 3:]) < 0.8 * OFF
        assert np.sqrt((off[:, 3:] ** 2).mean()) < 0.8 * OFF


def test_what_the_joints_are_told_does_not_jump(flown):
    """From tick to tick, by no more than the motion's own rate and a share of the largest change."""
    assert np.asarray(flown[2]).max() < 0.45


def test_the_estimate_goes_on_into_the_next_motion(flown):
    """After `resume`, time begins again; in the first motion's frame, what is believed is what was believed."""
    state = jax.tree.map(lambda x: x[0], flown[1])
    onward, begun = LAW.resume(state, LAW)
    before, after = LAW.believed(state), onward.believed(begun)
    np.testing.assert_allclose(after.rotation, before.rotation, atol=1e-12)
    np.testing.assert_allclose(after.momentum, before.momentum, atol=1e-18)
    np.testing.assert_allclose(after.robot.inertia, before.robot.inertia, atol=1e-18)
    values = np.linalg.eigvalsh(np.asarray(before.covariance)), np.linalg.eigvalsh(np.asarray(after.covariance))
    np.testing.assert_allclose(values[0], values[1], rtol=1e-6, atol=1e-15)
    assert float(begun.time) == 0
    assert float(begun.taken) <= 0
    # a reading of the true orientation in the first motion's frame fits what is believed
    seen = np.asarray(before.rotation)
    went, _ = onward.step(begun, Reading(TICK, PLAN.at(TICK).theta, seen, TICK))
    assert so3.angle(onward.believed(went).rotation.T @ seen) < np.deg2rad(1)
    with pytest.raises(ValueError, match="both must be the same"):
        LAW.resume(state, dataclasses.replace(LAW, model=dataclasses.replace(LAW.model, parameters=())))


def test_joints_that_are_not_read_are_where_they_were_told_to_be():
    state, told = LAW.start(), []
    for k in range(1, 6):
        state, references = LAW.step(state, Reading(k * TICK, np.full(3, np.nan), np.full((3, 3), np.nan), np.nan))
        told.append(np.asarray(references.theta))
    assert np.isfinite(told).all()
    np.testing.assert_allclose(told[-1], PLAN.at(5 * TICK).theta, atol=2e-3)

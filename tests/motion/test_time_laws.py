"""Time laws and trajectories: ends, rates, least jerk, and what is refused."""

import jax
import numpy as np
import pytest
from scipy.interpolate import PPoly

import reojax
from reojax.motion.splines import least_jerk
from reojax.motion.time_laws import LAWS
from reojax.motion.trajectory import overlap_pieces, stretch

PATH = reojax.polygon([[0.0, 1.0], [2.0, 1.0], [2.0, -1.0]])


def polynomials(law) -> PPoly:
    """A law in SciPy."""
    return PPoly(np.asarray(law.coefficients).T[::-1], np.asarray(law.breaks))


@pytest.mark.parametrize("law", [*(make() for make in LAWS.values()), reojax.minimum_jerk([0.2, 0.5], [0.1, 0.8])])
def test_laws_go_from_rest_to_rest(law):
    """From 0 to 1, at rest at both ends, without jumps of place or rate."""
    s = polynomials(law)
    np.testing.assert_allclose(s([0, 1]), [0, 1], atol=1e-12)
    np.testing.assert_allclose(s.derivative()([0, 1]), 0, atol=1e-10)
    inner = np.asarray(law.breaks)[1:-1]
    for order in (0, 1):
        np.testing.assert_allclose(s(inner - 1e-9, order), s(inner, order), atol=1e-7)


def test_a_trapezoid_s_rate_and_acceleration():
    s = polynomials(reojax.trapezoid(0.25))
    np.testing.assert_allclose(s([0.3, 0.5, 0.7], 1), 4 / 3)
    np.testing.assert_allclose(s([0.1, 0.5, 0.9], 2), [16 / 3, 0, -16 / 3], atol=1e-12)


def test_the_least_jerk_is_least():
    """The spline's integral of squared jerk is not beaten by a wiggle that keeps its points and its rest."""
    lengths, values = np.array([0.3, 0.5, 0.2]), np.array([0.0, 0.7, 0.2, 1.0])
    powers = np.asarray(least_jerk(lengths, values[:, None]))[:, :, 0]
    spline = PPoly(powers.T[::-1], np.concatenate([[0], np.cumsum(lengths)]))
    np.testing.assert_allclose(spline(spline.x), values, atol=1e-12)
    for order in (1, 2, 3, 4):  # smooth inside
        np.testing.assert_allclose(spline(spline.x[1:-1] - 1e-12, order), spline(spline.x[1:-1], order), rtol=1e-6)
    t = np.linspace(0, 1, 20001)
    jerk = spline(t, 3)
    wiggle = t**3 * (1 - t) ** 3 * (t - 0.3) * (t - 0.8)
    change = np.gradient(np.gradient(np.gradient(wiggle, t), t), t)
    inner = slice(5, -5)
    assert abs(np.trapezoid((jerk * change)[inner], t[inner])) < 1e-3 * np.trapezoid(
        np.abs(jerk * change)[inner], t[inner]
    )
    np.testing.assert_allclose(
        np.asarray(reojax.minimum_jerk().coefficients), reojax.quintic().coefficients, atol=1e-12
    )


def test_along_and_at():
    """Corners at their times; rates and accelerations are the derivatives; held outside of its time."""
    trajectory = reojax.along(PATH, "quintic", [0.5, 2.0])
    at = jax.jit(trajectory.at)
    np.testing.assert_allclose(
        [at(t).theta for t in (0.0, 0.5, 2.5, 9.0, -1.0)], PATH.waypoints[[0, 1, 2, 2, 0]], atol=1e-12
    )
    for t in (0.2, 1.3):
        ahead, behind, here = at(t + 1e-5), at(t - 1e-5), at(t)
        np.testing.assert_allclose((ahead.theta - behind.theta) / 2e-5, here.theta_dot, atol=1e-6)
        np.testing.assert_allclose((ahead.theta_dot - behind.theta_dot) / 2e-5, here.theta_ddot, atol=1e-6)
    slower = stretch(trajectory, 2.0)
    np.testing.assert_allclose(slower.at(0.5).theta_ddot, trajectory.at(0.25).theta_ddot / 4, atol=1e-12)


def test_through_does_not_stop():
    trajectory = reojax.through(PATH, [0.5, 0.5])
    np.testing.assert_allclose(trajectory.at(0.5).theta, PATH.waypoints[1], atol=1e-12)
    assert np.abs(trajectory.at(0.5).theta_dot).min() > 1
    np.testing.assert_allclose(trajectory.at(1.0).theta_dot, 0, atol=1e-10)


@pytest.mark.parametrize("law", ["quintic", "trapezoid"])
def test_moves_one_after_the_other_do_not_overlap(law):
    """Each in the time of its edge they make the motion along the path; started earlier they round the corner."""
    law = LAWS[law]()
    moves, edge = ((0, 0), (1, 1)), reojax.along(PATH, law, [0.5, 2.0])
    build = jax.jit(lambda start: overlap_pieces(PATH.waypoints, law, start, np.array([0.5, 2.0]), moves))
    apart = build(np.array([0.0, 0.5]))
    for t in (0.1, 0.26, 0.49, 0.9, 2.2, 2.5):
        for got, expected in zip(apart.at(t), edge.at(t), strict=True):
            np.testing.assert_allclose(got, expected, atol=1e-10)
    early = build(np.array([0.0, 0.2]))
    assert early.duration == pytest.approx(2.2)
    assert np.abs(early.at(0.35).theta_dot).min() > 0.1


@pytest.mark.parametrize("ramp", [0, 0.6, np.nan, [0.1, 0.2], "long"])
def test_ramps_that_cannot_be(ramp):
    with pytest.raises(ValueError, match="`ramp` is"):
        reojax.trapezoid(ramp)


@pytest.mark.parametrize(
    ("times", "places", "message"),
    [
        ([0.5, 0.2], [0.1, 0.2], "must increase"),
        ([0.5], [0.1, 0.2], "both must be"),
        ([0.5], [np.nan], "finite"),
        ([1.0], [1.0], "inside"),
    ],
)
def test_points_that_cannot_be(times, places, message):
    with pytest.raises(ValueError, match=message):
        reojax.minimum_jerk(times, places)


def test_still_edges_may_take_no_time():
    """Only an edge that moves something needs a duration."""
    path = reojax.polygon([[0.0], [0.0], [1.0]])
    trajectory = reojax.along(path, "quintic", [0.0, 1.0])
    assert np.isfinite(trajectory.at(0.0).theta_dot).all()
    with pytest.raises(ValueError, match=r"durations\[1\] is 0.0 s"):
        reojax.along(path, "quintic", [1.0, 0.0])

"""Calibration: what was put in comes out, within what the calibration says of itself; what cannot be known is said."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import reojax
from reojax import calibrate as calibrate_function, robots
from reojax.captures.parameters import Parameter
from reojax.robots.random import random_robot

ROOT = Path(__file__).parents[2]
PAIR = ("end_inertia", "rotor_inertia")
LATENCY = 0.0023


@pytest.fixture(scope="module")
def synthetic():
    """The script that makes the synthetic capture."""
    import sys

    sys.path.insert(0, str(ROOT / "experiments"))
    try:
        import synthetic_capture
    finally:
        sys.path.pop(0)
    return synthetic_capture


@pytest.fixture(scope="module")
def exact(synthetic):
    """The motion behind the synthetic capture, seen without noise and gaps, in a frame of the cameras."""
    real = synthetic.truth()
    cameras = Rotation.from_rotvec([2.0, -0.4, 1.0]).as_matrix()
    return reojax.make_capture(real.time, real.theta, cameras @ real.rotation), cameras


def test_without_noise_the_true_numbers_come_out(synthetic, exact):
    """Up to what the straight edges between frames leave out."""
    capture, cameras = exact
    fit = calibrate_function(robots.prototype(), capture, PAIR)
    assert fit.converged
    assert fit.warning == ""
    assert fit.identifiable == (True, True)
    np.testing.assert_allclose(fit.values, [synthetic.END_INERTIA, synthetic.ROTOR_INERTIA], rtol=4e-3)
    np.testing.assert_allclose(fit.frame, cameras, atol=1e-3)
    assert fit.offset == pytest.approx(LATENCY, abs=2e-5)
    assert fit.rms < 1e-3 < 0.02 < fit.rms_before
    np.testing.assert_allclose(fit.start, [70e-6, 0.1e-6], rtol=1e-12)
    again = reojax.compare(fit.robot, capture)
    assert again.angle_rms < 2e-3


@pytest.mark.slow
def test_the_truth_lies_within_the_stated_uncertainty(synthetic):
    """Over seeds: standard scores of all three numbers are about normal, and the noise is found."""
    scores, noise = [], []
    for seed in range(12):
        seen, there = synthetic.observed(seed)
        capture = reojax.make_capture(seen.time[there], seen.theta[there], seen.rotation[there])
        fit = calibrate_function(robots.prototype(), capture, PAIR)
        assert fit.converged
        off = fit.values - [synthetic.END_INERTIA, synthetic.ROTOR_INERTIA]
        scores.append([*(off / fit.std), (fit.offset - LATENCY) / fit.offset_std])
        noise.append(fit.joint_noise)
    scores = np.array(scores)
    assert np.abs(scores).max() < 4
    assert 0.6 < np.sqrt((scores**2).mean()) < 1.4  # 36 normal numbers are outside once in 10 000 times
    np.testing.assert_allclose(np.mean(noise), synthetic.JOINT_NOISE, rtol=0.1)


@pytest.mark.slow
def test_noise_of_the_joints_does_not_shift_the_clocks(synthetic):
    """3.1 ms at 300 Hz is 7 % of a frame from a frame, where noise is largest: least squares alone finds less."""
    real, latency, found = synthetic.truth(0.0031), 0.0031, []
    for seed in range(6):
        noise = 3 * synthetic.JOINT_NOISE * np.random.default_rng([1, seed]).normal(size=real.theta.shape)
        capture = reojax.make_capture(real.time, real.theta + noise, real.rotation)
        found.append(calibrate_function(synthetic.true_robot(), capture, PAIR).offset)
    assert np.std(found) < 2e-4
    assert np.mean(found) == pytest.approx(latency, abs=1.2e-4)


def test_the_derivatives_are_those_of_the_residuals(synthetic, exact):
    """Gauss-Newton's derivatives against differences, and the pull of the joints' noise against a push."""
    from reojax.captures.fit import FitProblem
    from reojax.captures.parameters import resolve

    capture, _ = exact
    robot = robots.prototype()
    fitted = resolve(robot, PAIR)
    problem = FitProblem(robot, capture, fitted, True)
    x = np.array([synthetic.END_INERTIA, synthetic.ROTOR_INERTIA])
    state = problem.fit_window(x)
    for k in range(2):
        step = np.zeros(2)
        step[k] = 1e-4 * problem.scale[k]
        ends = [problem._state(x + sign * step, state.frame, state.offset).residual for sign in (1, -1)]
        np.testing.assert_allclose(state.derivative[:, :, k], (ends[0] - ends[1]) / 2e-4, atol=3e-3)
    ends = [problem._state(x, state.frame, state.offset + sign * 1e-5).residual for sign in (1, -1)]
    np.testing.assert_allclose(state.derivative[:, :, 5], (ends[0] - ends[1]) / 2e-5, atol=0.3)
    jacobian = state.derivative.reshape(-1, 6)
    pull = problem.push(state).reshape(6, -1, 3)
    for frame, joint in ((60, 1), (90, 0), (120, 2)):
        pushed = []
        for sign in (1, -1):
            theta = problem.theta.copy()
            theta[frame, joint] += sign * 1e-5
            problem.theta, kept = theta, problem.theta
            pushed.append(problem._state(x, state.frame, state.offset).residual.ravel())
            problem.theta = kept
        expected = jacobian.T @ (pushed[0] - pushed[1]) / 2e-5
        off = np.abs(pull[:, frame, joint] - expected) / np.abs(pull[..., joint]).max(axis=1)
        assert off.max() < 0.05


def test_rotor_and_gear_cannot_be_told_apart(exact):
    """Only their product is in the momentum equation."""
    fit = calibrate_function(robots.prototype(), exact[0], ("rotor_inertia", "gear_ratio"))
    assert fit.warning == "rotor_inertia and gear_ratio cannot be told apart by this capture"
    assert np.isinf(fit.std).all()
    assert fit.identifiable == (False, False)
    assert fit.condition > 1e6


@pytest.mark.slow
def test_what_hardly_moves_is_hardly_determined():
    """A robot at rest, seen through noise."""
    rng = np.random.default_rng(0)
    turns = Rotation.from_rotvec(0.005 * rng.normal(size=(300, 3))).as_matrix()
    capture = reojax.make_capture(np.arange(300) / 300, 0.001 * rng.normal(size=(300, 3)), turns)
    fit = calibrate_function(robots.prototype(), capture, PAIR)
    assert fit.identifiable == (False, False)
    assert fit.warning == "end_inertia and rotor_inertia are hardly determined by this capture"


def test_other_robots_and_parameters_of_ones_own():
    """A random tree, an entry of a field, and a scale of all lengths as a parameter."""
    robot = random_robot(5, 3, branched=True)
    time = np.linspace(0, 2, 257)
    theta = np.stack([np.sin(2 * time), 1 - np.cos(3 * time), np.sin(time) ** 2], axis=1)
    real = robot.replace(com=robot.com + np.array([[0, 0, 0.01]] + [[0, 0, 0]] * 3), mass=robot.mass * [1, 1, 1.1, 1])
    turns = reojax.joints_simulated(real, reojax.make_capture(time, theta)).rotation
    capture = reojax.make_capture(time, theta, turns)
    mass = Parameter("weight of link 2", float(robot.mass[2]), _with_mass, "kg", 0.1, True)
    fit = calibrate_function(robot, capture, ("com[0, 2]", mass), joint_noise=0.0)
    assert fit.converged
    assert fit.names == ("com[0,2]", "weight of link 2")
    np.testing.assert_allclose(fit.values, [real.com[0, 2], real.mass[2]], rtol=1e-5)


def _with_mass(robot, value):
    return robot.replace(mass=np.eye(robot.links)[2] * (value - robot.mass[2]) + robot.mass)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ((), "at least one is needed"),
        (("mass[1]", "mass[1]"), "none twice"),
        (("weight",), "there is no parameter 'weight'"),
        (("axis[0,0]",), r"there is no parameter 'axis\[0,0\]'"),
        (("com[0]",), r"there is no com\[0\] on 'prototype'; com has shape \(4, 3\)"),
        (("com[4,0]",), r"there is no com\[4,0\]"),
        (3, "`parameters` is 3"),
    ],
)
def test_parameters_that_are_not_there(exact, parameters, message):
    with pytest.raises(ValueError, match=message):
        calibrate_function(robots.prototype(), exact[0], parameters)


def test_captures_that_cannot_be_used(exact):
    capture, _ = exact
    robot = robots.prototype()
    for lacking in (capture._replace(theta=None), capture._replace(rotation=None)):
        with pytest.raises(ValueError, match="needs joint angles and orientation"):
            calibrate_function(robot, lacking)
    with pytest.raises(ValueError, match="end_inertia is defined for the four-link robot; 'random' has 3"):
        calibrate_function(random_robot(0, 2), capture)
    with pytest.raises(ValueError, match="the capture has 3 joints; 'random' has 2"):
        calibrate_function(random_robot(0, 2), capture, ("mass[0]",))
    with pytest.raises(ValueError, match="`joint_noise` is -1"):
        calibrate_function(robot, capture, joint_noise=-1)
    few = reojax.make_capture(capture.time[:2], capture.theta[:2], capture.rotation[:2])
    with pytest.raises(ValueError, match="2 frames with an orientation cannot determine 6 numbers"):
        calibrate_function(robot, few, PAIR)


@pytest.mark.slow
def test_a_capture_in_which_nothing_moves_tells_nothing():
    """Slopes of exactly 0, from which SciPy's steps are no numbers: the fit ends there, and says what is not known."""
    time = np.linspace(0, 1, 12)
    still = reojax.make_capture(time, np.zeros((12, 3)), np.broadcast_to(np.eye(3), (12, 3, 3)))
    for noise, clock in ((None, False), (1e-300, True), (0.5, True)):
        fit = reojax.calibrate(robots.prototype(), still, joint_noise=noise, clock=clock)
        assert np.isfinite(fit.values).all()
        assert np.isfinite(fit.offset)
        assert not any(fit.identifiable)
        assert "no effect" in fit.warning

"""Fastest motions: faster than edge by edge, with the net rotation wanted, motors and joints within their limits."""

import numpy as np
import pytest

import reojax
from reojax import RE_MAX_17, so3
from reojax.optimisation.status import Status

PROTOTYPE = reojax.robots.prototype()
A = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))


def padded(trajectory, pieces=12):
    """The same motion with further pieces that take no time, so that all are run by one program."""
    still = np.zeros((pieces - trajectory.pieces, *trajectory.coefficients.shape[1:]))
    breaks = np.append(trajectory.breaks, np.full(len(still), trajectory.duration))
    return reojax.Trajectory(breaks, np.concatenate([trajectory.coefficients, still]))


def check(found, target):
    """Of a motion run by other means: its net rotation, motors, joints, ends."""
    assert found.converged
    assert found.status == Status.CONVERGED
    assert found.message == "converged"
    assert found.error < 1e-9
    assert found.beyond == 0
    motion = reojax.simulate(PROTOTYPE, padded(found.trajectory), motors=RE_MAX_17, samples=64)
    assert so3.angle(motion.rotation[-1].T @ target) < 1e-8
    assert -1e-4 < np.asarray(motion.margin).min() < 2e-3
    assert (np.asarray(motion.theta) <= PROTOTYPE.upper).all()
    assert (np.asarray(motion.theta) >= PROTOTYPE.lower).all()
    for end in (0, 64 * found.trajectory.pieces):
        np.testing.assert_allclose(motion.theta[end], 0, atol=1e-9)
        np.testing.assert_allclose(motion.theta_dot[end], 0, atol=1e-7)
    np.testing.assert_allclose(motion.time[-1], found.duration)


@pytest.mark.slow
def test_overlapped_edges_are_faster_and_turn_as_far():
    found = reojax.overlap(PROTOTYPE, A, RE_MAX_17)
    check(found, reojax.net_rotation(PROTOTYPE, A))
    assert found.duration < 0.85 * reojax.minimum_time(PROTOTYPE, A, RE_MAX_17).duration


@pytest.mark.slow
def test_the_fastest_loop_with_a_rotation_of_its_own():
    """A half turn, which the path it starts from is not, in less time, joints up to their limits."""
    target = so3.exp([0.0, 0.0, np.pi])
    found = reojax.fastest_loop(PROTOTYPE, target, RE_MAX_17, A, knots=5, starts=1)
    check(found, target)
    assert found.duration < 0.85 * reojax.minimum_time(PROTOTYPE, A, RE_MAX_17).duration


@pytest.mark.parametrize("target", [np.zeros((3, 3)), np.eye(2), np.diag([1.0, 1.0, -1.0])])
def test_a_target_that_is_no_rotation(target):
    with pytest.raises(ValueError, match="`target` (is no rotation|has shape)"):
        reojax.fastest_loop(PROTOTYPE, target, RE_MAX_17, A)


STILL = reojax.polygon(np.zeros((3, 3)))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: reojax.overlap(PROTOTYPE, A, RE_MAX_17, "trapezium"), "no time law named 'trapezium'.*trapezoid"),
        (lambda: reojax.overlap(PROTOTYPE, A, RE_MAX_17, 3.0), "`law` is 3.0"),
        (lambda: reojax.overlap(PROTOTYPE, STILL, RE_MAX_17), "`path` stays where it is"),
        (lambda: reojax.free_law(PROTOTYPE, STILL, RE_MAX_17), "`path` stays where it is"),
        (lambda: reojax.free_law(PROTOTYPE, A, RE_MAX_17, points=0.5), "`points` is 0.5"),
        (lambda: reojax.free_law(PROTOTYPE, A, RE_MAX_17, points=0), "`points` is 0"),
        (lambda: reojax.fastest_loop(PROTOTYPE, np.eye(3), RE_MAX_17, A, knots=1), "`knots` is 1"),
        (lambda: reojax.fastest_loop(PROTOTYPE, np.eye(3), RE_MAX_17, A, starts=0), "`starts` is 0"),
        (lambda: reojax.fastest_loop(PROTOTYPE, np.eye(3), RE_MAX_17, STILL), "`near` stays where it is"),
        (
            lambda: reojax.fastest_loop(PROTOTYPE, np.eye(3), RE_MAX_17, reojax.polygon(A.waypoints[:3])),
            "`near` does not end where it begins",
        ),
        (lambda: reojax.overlap(PROTOTYPE, np.zeros((2, 3)), RE_MAX_17), "`path` is a ndarray"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_motors_and_paths_are_checked():
    with pytest.raises(ValueError, match="motors.supply is -1.0"):
        reojax.free_law(PROTOTYPE, A, RE_MAX_17._replace(supply=-1.0))
    with pytest.raises(ValueError, match="one waypoint"):
        reojax.overlap(PROTOTYPE, reojax.polygon(np.zeros((1, 3))), RE_MAX_17)

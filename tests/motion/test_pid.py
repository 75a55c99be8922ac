"""Joints under control: good controllers track, motors and encoders limit them, orientation obeys momentum."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import Gains, robots, so3
from reojax.captures import comparison
from reojax.mechanics.dynamics import joint_load
from reojax.motion.closed_loop import track
from reojax.motion.driven_joints import joint_acceleration
from reojax.motion.motor import check_motors, drive, per_joint
from reojax.motion.pid import gains

ROBOT = robots.prototype()
PATH = reojax.manoeuvre_a(np.deg2rad(90), np.deg2rad(60))
PLAN = reojax.along(PATH, "quintic", 0.1)
REAL = reojax.RE_MAX_17._replace(friction=1e-4)
IDEAL = reojax.RE_MAX_17._replace(supply=1e4, efficiency=1.0, efficiency_back=1.0, drag=0.0)
FAST = gains(ROBOT, 200.0)
SETTLE = 0.1  # the same everywhere, for one program


def run(motors=REAL, controller=FAST, **options):
    return jax.tree.map(np.asarray, track(ROBOT, PLAN, motors, controller, **({"settle": SETTLE} | options)))


def test_precomputed_torques_do_the_planned_motion():
    """Motors that can do anything, perfect encoders: what is left is that commands are held for a millisecond."""
    tracking = run(IDEAL, feedforward=True, counts=None)
    assert not tracking.saturated.any()
    np.testing.assert_allclose(tracking.theta, tracking.planned, atol=2e-3)
    np.testing.assert_allclose(tracking.rotation[-1], reojax.net_rotation(ROBOT, PATH), atol=1e-3)
    assert np.abs(tracking.planned).max() > 1.5
    alone = run(IDEAL, counts=None)
    assert np.abs(alone.theta - alone.planned).max() > 3e-3


def test_orientation_follows_the_joints_whatever_they_do():
    """At zero momentum it is the rotation of the path that the joints really took, thesis eq. 2.14."""
    tracking = run(controller=gains(ROBOT, 50.0))
    assert np.abs(tracking.theta - tracking.planned).max() > 0.1
    history = comparison.joints_simulated(ROBOT, reojax.make_capture(tracking.time, tracking.theta)).rotation
    np.testing.assert_allclose(tracking.rotation, history, atol=2e-4)


def test_a_spin_goes_on_while_the_joints_move():
    """With momentum, the orientation is that of the same joint motion, cubics between the samples, by other means."""
    spin = np.array([1e-4, -2e-4, 3e-4])
    tracking = run(momentum=spin)
    h = 1e-3
    start, end, rate, last = tracking.theta[:-1], tracking.theta[1:], tracking.theta_dot[:-1], tracking.theta_dot[1:]
    square = (3 * (end - start) - h * (2 * rate + last)) / h**2
    cube = (2 * (start - end) + h * (rate + last)) / h**3
    joints = reojax.Trajectory(tracking.time, np.stack([start, rate, square, cube], axis=1))
    expected = reojax.released(ROBOT, joints, reojax.Release(spin), samples=1)
    np.testing.assert_allclose(tracking.rotation, expected.rotation, atol=1e-4)
    still = comparison.joints_simulated(ROBOT, reojax.make_capture(tracking.time, tracking.theta)).rotation
    assert so3.angle(still[-1].T @ tracking.rotation[-1]) > 0.1


@pytest.mark.parametrize("efficiency", [1.0, 0.81])
def test_the_motors_are_those_of_the_inverse_problem(efficiency):
    """Accelerations that a command gives take that command, driving and driven back."""
    motors = REAL._replace(efficiency=efficiency, efficiency_back=efficiency, supply=100.0)
    motors = per_joint(check_motors(motors, ROBOT), np.dtype(float))
    theta, momentum = jnp.array([0.3, 0.8, -0.4]), jnp.array([1e-5, 0.0, -2e-5])
    for rate in (jnp.array([20.0, -15.0, 10.0]), jnp.array([-20.0, 15.0, 10.0])):
        command = jnp.array([4e-3, -3e-3, 5e-3])
        acceleration, omega = joint_acceleration(ROBOT, motors, command, theta, rate, momentum)
        load = joint_load(ROBOT, theta, rate, acceleration, momentum=momentum)
        np.testing.assert_allclose(drive(ROBOT, motors, rate, load).torque, command, rtol=1e-10)
        np.testing.assert_allclose(load.omega, omega, rtol=1e-12)


def test_no_motor_gives_more_than_its_supply_allows():
    weak = REAL._replace(supply=4.0)
    tracking = run(weak)
    voltage = weak.resistance * tracking.motor_torque / weak.torque_constant
    voltage = voltage + weak.torque_constant * ROBOT.gear_ratio * tracking.theta_dot
    assert np.abs(voltage).max() < 4.0 + 1e-9
    assert 0.1 < tracking.saturated.mean() < 1
    np.testing.assert_array_equal(tracking.saturated, tracking.motor_torque != tracking.command)


def test_the_joints_lag_and_the_end_is_right_all_the_same():
    """What the thesis saw, on motors that saturate on the way."""
    tracking = run(controller=gains(ROBOT, 100.0))
    assert np.abs(tracking.theta - tracking.planned).max() > 0.02
    assert so3.angle(tracking.rotation[-1].T @ reojax.net_rotation(ROBOT, PATH)) < 0.01


def test_encoders_count():
    """A controller cannot see less than a count: joints rest within a few counts, off by a share of one."""
    exact = run(counts=None)
    for counts in (16, 128):
        size = 2 * np.pi / (counts * 24)
        tracking = run(counts=counts)
        resting = np.abs(tracking.theta[-50:] - tracking.planned[-50:]).max(axis=0)
        assert (resting < 2 * size).all()
        assert 0.1 * size < np.abs(tracking.theta - exact.theta).max() < 10 * size


def test_gradients_agree_with_differences():
    """Of the tracking error by the gains' bandwidth, through the whole loop; of another robot, with one joint."""
    robot = reojax.with_motors(robots.planar(2), IDEAL)
    plan = reojax.along(reojax.polygon([[0.0], [1.0]]), "quintic", 0.2)

    def lag(bandwidth):
        tracking = track(robot, plan, IDEAL, gains(robot, bandwidth), counts=None)
        return ((tracking.theta - tracking.planned) ** 2).mean()

    slope = jax.jit(jax.jvp, static_argnums=0)(lag, (100.0,), (1.0,))[1]
    both = jax.jit(jax.vmap(lag))(jnp.array([99.99, 100.01]))
    np.testing.assert_allclose(slope, (both[1] - both[0]) / 0.02, rtol=1e-4)
    assert slope < 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sample_time": 0.0}, "`sample_time` is 0.0; it must be one positive"),
        ({"counts": -1.0}, "`counts` is -1.0"),
        ({"settle": np.nan}, "`settle` is nan"),
        ({"substeps": 0}, "`substeps` is 0"),
        ({"momentum": [0, 0]}, r"`momentum` is \[0, 0\]"),
        ({"model": robots.planar(2)}, "`model` is .*; it must be a Robot of 3 joints"),
        ({"controller": Gains(1.0, -1.0, 1.0)}, "gains.integral is -1.0; it must be zero or positive"),
        ({"controller": Gains(1.0, [1.0, 2.0], 1.0)}, r"gains.integral has shape \(2,\)"),
        ({"controller": 3}, "`gains` is a int"),
        ({"motors": REAL._replace(supply=0.0)}, "motors.supply is"),
    ],
)
def test_bad_input(options, message):
    with pytest.raises(ValueError, match=message):
        run(**options)


def test_more_bad_input():
    with pytest.raises(ValueError, match="`trajectory` is a Path"):
        track(ROBOT, PATH, REAL, FAST)
    with pytest.raises(ValueError, match="`trajectory` moves 3 joints; 'planar2' has 1"):
        track(robots.planar(2), PLAN, REAL, FAST)
    with pytest.raises(ValueError, match="`bandwidth` is -1"):
        gains(ROBOT, -1.0)
    with pytest.raises(ValueError, match="traced durations"):
        jax.jit(lambda t: track(ROBOT, reojax.along(PATH, "quintic", t), REAL, FAST))(0.1)

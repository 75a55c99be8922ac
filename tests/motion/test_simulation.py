"""Motions by time: the law does not matter for the net rotation, the momentum stays, and MuJoCo moves alike."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import RE_MAX_17, interop, so3
from reojax.cli import main
from reojax.mechanics.certificate import _derivative
from reojax.mechanics.kinematics import kinematics
from reojax.robots.random import random_robot

PROTOTYPE = reojax.robots.prototype()
A = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
DURATIONS = np.array([0.13, 0.21, 0.14, 0.2])
VIA = reojax.minimum_jerk([0.3, 0.6], [0.2, 0.7])


@pytest.mark.parametrize("law", ["quintic", "trapezoid", "minimum-jerk", VIA, reojax.trapezoid(0.5)])
def test_the_net_rotation_is_the_same_by_every_law(law):
    """Only the path matters (thesis 2.4)."""
    motion = reojax.simulate(PROTOTYPE, A, law, durations=DURATIONS)
    expected = reojax.net_rotation(PROTOTYPE, A)
    assert so3.angle(motion.rotation[-1].T @ expected) < 1e-9
    np.testing.assert_allclose(motion.time[-1], DURATIONS.sum(), rtol=1e-13)
    assert (np.diff(motion.time) > 0).all()
    np.testing.assert_allclose(motion.theta[-1], A.waypoints[-1], atol=1e-12)
    np.testing.assert_allclose(motion.theta_dot[np.array([0, -1])], 0, atol=1e-9)


def measured_momentum(robot, motion, pieces: int) -> tuple[np.ndarray, np.ndarray]:
    """Momentum of bodies and rotors whose poses are differentiated, inertial frame, and its parts' lengths."""
    net, exchanged = [], []
    samples = (len(motion.time) - 1) // pieces
    side = np.array([1 if side == "parent" else -1 for side in robot.rotor_on])
    pose = jax.jit(jax.vmap(lambda theta: kinematics(robot, theta)))(motion.theta)
    for piece in range(pieces):
        part = slice(piece * samples, (piece + 1) * samples + 1)
        length = motion.time[part][-1] - motion.time[part][0]
        base = motion.rotation[part]
        turn = jnp.einsum("sab,sibc->siac", base, pose.rotation[part])
        place = jnp.einsum("sab,sib->sia", base, pose.com[part])
        axis = jnp.einsum("sab,skb->ska", base, pose.axis[part])
        spinning = jnp.einsum("siba,sibc->siac", turn, _derivative(turn) / length)
        omega = 0.5 * np.stack([spinning[..., i, k] - spinning[..., k, i] for i, k in ((2, 1), (0, 2), (1, 0))], -1)
        spin = jnp.einsum("siab,ibc,sic->sia", turn, robot.inertia, omega)
        orbit = robot.mass[None, :, None] * np.cross(place, _derivative(place) / length)
        rate = np.asarray(_derivative(motion.theta[part])) / length
        rotor = ((robot.rotor_inertia * robot.gear_ratio * side)[None] * rate)[..., None] * axis
        parts = np.concatenate([spin, orbit, rotor], axis=1)
        net.append(parts.sum(1))
        exchanged.append(np.linalg.norm(parts, axis=-1).sum(1))
    return np.concatenate(net), np.concatenate(exchanged)


@pytest.mark.parametrize("momentum", [np.zeros(3), np.array([2e-4, -1e-3, 5e-4])])
def test_the_momentum_stays_for_ten_seconds(momentum):
    """Drift below 1e-10 of the momenta that the links have or exchange, with and without a spin, measured from poses.

    The spins here are up to 5 rad/s: several turns in the ten seconds.
    """
    motion = reojax.simulate(PROTOTYPE, A, durations=2.5, momentum=momentum, samples=400)
    net, exchanged = measured_momentum(PROTOTYPE, motion, 4)
    assert motion.time[-1] == pytest.approx(10)
    assert np.abs(net - momentum).max() < 1e-10 * exchanged.max()
    assert np.abs(net).max() > 0  # measured
    spun = np.abs(np.diff(np.unwrap(np.arctan2(motion.rotation[:, 1, 0], motion.rotation[:, 0, 0])))).sum()
    assert spun > 2 * np.pi or not momentum.any()


def test_a_still_robot_that_spins():
    """Joints at rest, momentum along a principal axis: a steady spin. And twice the momentum turns twice as far."""
    robot = reojax.make_robot(
        mass=[1.0, 1.0],
        com=np.zeros((2, 3)),
        inertia=[np.diag([1.0, 2, 2.5])] * 2,
        axis=[(0, 0, 1)],
        anchor=[(0, 0, 0)],
    )
    path = reojax.polygon([[0.0], [0.0]])
    motion = reojax.simulate(robot, path, durations=3.0, momentum=[0, 4.0, 0], samples=20)
    np.testing.assert_allclose(motion.omega, np.tile([0, 1.0, 0], (21, 1)), atol=1e-12)
    np.testing.assert_allclose(motion.rotation[-1], so3.exp([0, 3.0, 0]), atol=1e-12)
    assert np.abs(motion.torque).max() < 1e-12


def test_a_robot_without_joints_is_a_free_rigid_body():
    """Its kinetic energy stays, as its momentum does; at rest it stays put."""
    robot, path = random_robot(0, 0), reojax.polygon(np.zeros((2, 0)))
    motion = reojax.simulate(robot, path, durations=2.0, momentum=[0.01, 0, 0])
    energy = np.einsum("ma,ab,mb->m", motion.omega, np.asarray(robot.inertia[0]), motion.omega)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-11)
    assert so3.angle(motion.rotation[-1]) > 0.5
    still = reojax.released(robot, reojax.along(path, "quintic", 1.0))
    np.testing.assert_array_equal(still.rotation[-1], np.eye(3))


def test_the_order_is_six():
    """Halving the step takes the error to a sixty-fourth, of a robot that spins while it moves."""
    ends = [
        reojax.simulate(PROTOTYPE, A, durations=0.3, momentum=[1e-3, 2e-3, -1e-3], samples=n, substeps=1).rotation[-1]
        for n in (20, 40, 400)
    ]
    coarse, fine = (float(so3.angle(end.T @ ends[-1])) for end in ends[:2])
    assert 5.3 < np.log2(coarse / fine) < 7


@pytest.mark.oracle
@pytest.mark.parametrize("branched", [False, True])
def test_mujoco_moves_alike(branched):
    """Constant joint torques on a spinning robot: forward dynamics and momentum equation against MuJoCo's RK4."""
    mujoco = pytest.importorskip("mujoco")
    robot = random_robot(5, 3, branched=branched, rotors=False)
    rng = np.random.default_rng(6)
    theta, rate, torque = rng.normal(size=(3, 3)) * [[1.0], [0.5], [0.05]]
    momentum = 0.1 * rng.normal(size=3)
    step, steps = 2e-3, 250
    model = interop.mujoco_model(robot).model
    model.opt.timestep, model.opt.integrator = step, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    data.qpos[3:7], data.qpos[7:] = [1, 0, 0, 0], theta
    data.qvel[3:6], data.qvel[6:] = reojax.base_velocity(robot, theta, rate, momentum=momentum), rate
    data.qfrc_applied[6:] = torque

    @jax.jit
    def run(theta, rate):
        def slope(state):
            theta, rate, rotation = state
            h = rotation.T @ momentum
            omega = reojax.base_velocity(robot, theta, rate, momentum=h)
            acceleration = reojax.forward_dynamics(robot, theta, rate, torque, momentum=h)
            return rate, acceleration, rotation @ so3.hat(omega)

        def add(state, slope, h):
            return jax.tree.map(lambda a, b: a + h * b, state, slope)

        def advance(_, state):
            a = slope(state)
            b = slope(add(state, a, step / 2))
            c = slope(add(state, b, step / 2))
            d = slope(add(state, c, step))
            return jax.tree.map(lambda x, *k: x + step / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3]), state, a, b, c, d)

        return jax.lax.fori_loop(0, steps, advance, (theta, rate, jnp.eye(3)))

    end, end_rate, rotation = run(theta, rate)
    mujoco.mj_step(model, data, steps)
    assert np.abs(end - theta).max() > 0.3
    np.testing.assert_allclose(end, data.qpos[7:], atol=1e-6)
    np.testing.assert_allclose(end_rate, data.qvel[6:], atol=1e-5)
    np.testing.assert_allclose(so3.to_quaternion(rotation), data.qpos[3:7] * np.sign(data.qpos[3]), atol=1e-6)


def test_power_and_voltage_go_together():
    """Electrical power is heat in the winding and mechanical power; the energy of a closed motion ends as it began."""
    motor = RE_MAX_17._replace(efficiency=1.0, efficiency_back=1.0, drag=0.0)
    motion = reojax.simulate(PROTOTYPE, A, durations=DURATIONS, motors=motor)
    assert motion.current is not None
    assert motion.voltage is not None
    assert motion.motor_torque is not None
    electrical = motion.current * motion.voltage
    mechanical = motion.torque * motion.theta_dot
    np.testing.assert_allclose(electrical - 8.3 * motion.current**2, mechanical, atol=1e-10)
    np.testing.assert_allclose(motion.motor_torque, motion.torque / 24, rtol=1e-12, atol=1e-15)
    power = np.asarray(mechanical).sum(1)
    assert abs(np.trapezoid(power, motion.time)) < 1e-3 * np.trapezoid(np.abs(power), motion.time)


def test_the_motor_s_curve():
    """Published figures of the RE-max 17 at 12 V; losses help while braking and cost while driving."""
    from reojax.mechanics.dynamics import Load
    from reojax.motion.motor import drive, no_load_speed, stall_torque

    assert stall_torque(RE_MAX_17) == pytest.approx(15.5e-3, abs=5e-5)
    assert no_load_speed(RE_MAX_17) * 30 / np.pi == pytest.approx(10640, abs=5)
    load = Load(np.array([0.2, -0.2, 0.2]), np.array([0.05, 0.05, 0.0]), np.zeros(3), np.zeros(3))
    asked = drive(PROTOTYPE, RE_MAX_17._replace(drag=0.0), np.array([1.0, 1.0, 0.0]), load)
    expected = np.array([0.15 / 0.81 + 0.05, -0.25 * 0.81 + 0.05, 0.2 / 0.81]) / 24
    np.testing.assert_allclose(asked.torque, expected, rtol=1e-12)
    np.testing.assert_allclose(asked.speed, [24, 24, 0])
    line = (1 - 24 * 10.7e-3 / 12) - np.abs(expected[0]) / stall_torque(RE_MAX_17)
    assert asked.margin[0] == pytest.approx(line)


@pytest.mark.slow
def test_float32_vmap_and_gradients():
    """dtype follows the inputs; durations differentiate."""
    single = jax.tree.map(np.float32, PROTOTYPE)
    motion = reojax.simulate(single, reojax.polygon(np.float32(A.waypoints)), durations=np.float32(0.2), samples=32)
    assert {leaf.dtype for leaf in jax.tree.leaves(motion)} == {np.dtype(np.float32)}
    momentum = np.array([1e-3, 0, 2e-3])
    robot, path = random_robot(1, 1), reojax.polygon([[0.0], [1.0]])

    @jax.jit
    def turned(duration):
        motion = reojax.simulate(robot, path, durations=duration, momentum=momentum, samples=16)
        return so3.log(motion.rotation[-1])[0]

    difference = (turned(0.3 + 1e-5) - turned(0.3 - 1e-5)) / 2e-5
    np.testing.assert_allclose(jax.jit(jax.grad(turned))(0.3), difference, rtol=1e-6)
    several = jax.vmap(turned)(jnp.array([0.2, 0.3]))
    np.testing.assert_allclose(several[1], turned(0.3), rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"durations": None}, "`durations` is missing"),
        ({"durations": [0.1, 0.0, 0.1, 0.1]}, r"durations\[1\] is 0.0 s; a duration must be positive"),
        ({"durations": [0.1, 0.1]}, r"`durations` has shape \(2,\); it must be one number or \(4,\)"),
        ({"durations": np.nan}, r"durations\[0\] is nan s"),
        ({"durations": "fast"}, "`durations` is 'fast'"),
        ({"law": "jump"}, "no time law named 'jump'; the names are quintic, trapezoid, minimum-jerk"),
        ({"law": 3}, "`law` is 3"),
        ({"path": "a"}, "`path` is a str"),
        ({"path": reojax.polygon(np.zeros((1, 3)))}, "one waypoint; a motion needs an edge"),
        ({"path": reojax.polygon([[0.0], [1.0]])}, "`path` moves 1 joints; 'prototype' has 3"),
        ({"momentum": [0, 1]}, r"`momentum` is \[0, 1\]; it must be 3 finite numbers"),
        ({"samples": 0}, "`samples` is 0"),
        ({"robot": None}, "`robot` is a NoneType"),
        ({"motors": 12}, "`motors` is 12; it must be a Motor"),
        ({"motors": [RE_MAX_17] * 2}, "`motors` has 2 motors; 'prototype' has 3 joints"),
        ({"motors": RE_MAX_17._replace(supply=0.0)}, r"motors.supply is 0.0; it must be positive"),
        ({"motors": RE_MAX_17._replace(efficiency=1.2)}, "motors.efficiency is 1.2; it must be above 0 and at most 1"),
        (
            {"motors": RE_MAX_17._replace(gear_ratio=50.0)},
            r"motors.gear_ratio is 50 at joint 0, where the robot has 24",
        ),
        ({"motors": RE_MAX_17._replace(drag=[0.0, 1.0])}, r"motors.drag has shape \(2,\)"),
    ],
)
def test_bad_input_is_named(change, message):
    given = {"robot": PROTOTYPE, "path": A, "law": "quintic", "durations": 0.2} | change
    with pytest.raises(ValueError, match=message):
        reojax.simulate(given.pop("robot"), given.pop("path"), given.pop("law"), **given)


def test_with_motors_gives_the_robot_the_motors_numbers():
    robot = reojax.with_motors(PROTOTYPE, RE_MAX_17._replace(gear_ratio=[10.0, 20.0, 30.0]))
    np.testing.assert_allclose(robot.gear_ratio, [10, 20, 30])
    np.testing.assert_allclose(robot.rotor_inertia, 0.868e-7)
    with pytest.raises(ValueError, match=r"motors.gear_ratio is 0.0; it must be other than zero"):
        reojax.with_motors(PROTOTYPE, RE_MAX_17._replace(gear_ratio=0.0))


def test_momentum_at_the_command_line(capsys):
    """It is the library's motion; a spin that the steps do not resolve is refused, as is one without a time."""
    command = ["simulate", "--json", "--duration", "0.8"]
    assert main([*command, "--momentum", "-0.001,0,0.002"]) == 0
    motion = json.loads(capsys.readouterr().out)["motion"]
    path = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
    angles = np.abs(np.diff(path.waypoints, axis=0)).max(axis=1)
    durations = 0.8 * angles / angles.sum()
    same = reojax.simulate(PROTOTYPE, path, durations=durations, momentum=(-0.001, 0, 0.002))
    np.testing.assert_allclose(motion["rotation_vector_deg"], np.rad2deg(reojax.so3.log(same.rotation[-1])), atol=1e-7)
    for arguments, message in (
        ([*command, "--momentum", "0,0,1e6"], "too fast to be resolved"),
        (["simulate", "--momentum", "0,0,1"], "needs a --duration"),
        ([*command, "--momentum", "0,nan,1"], "is not three finite numbers"),
    ):
        assert main(arguments) == 2
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1

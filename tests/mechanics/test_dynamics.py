"""Joint torques against Pinocchio and MuJoCo, whose rotors are bodies, and against the laws of energy and momentum."""

from functools import cache, partial

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import reojax
from reojax import interop
from reojax.mechanics.dynamics import joint_load
from reojax.robots.random import random_robot

SHAPES = [(1, False), (3, False), (4, True), (7, True)]
load = jax.jit(joint_load)
forward = jax.jit(reojax.forward_dynamics)
inverse = jax.jit(reojax.inverse_dynamics)
inertia = jax.jit(reojax.joint_inertia)
energy_of = jax.jit(reojax.kinetic_energy)


@cache
def moving(joints: int, branched: bool) -> tuple:
    """A random robot, its motion and its momentum, and what reojax says of them."""
    robot = random_robot(3, joints, branched=branched)
    rng = np.random.default_rng([joints, branched])
    theta, rate, acceleration = rng.normal(size=(3, joints)) * [[1.0], [2.0], [5.0]]
    momentum = 0.2 * rng.normal(size=3)
    return robot, theta, rate, acceleration, momentum, load(robot, theta, rate, acceleration, momentum=momentum)


@pytest.mark.oracle
@pytest.mark.parametrize(("joints", "branched"), SHAPES)
def test_torques_are_those_of_pinocchio(joints, branched):
    """Recursive Newton-Euler of all bodies, rotors too: no force or torque on the base, ours on the joints."""
    pin = pytest.importorskip("pinocchio")
    robot, theta, rate, acceleration, _, found = moving(joints, branched)
    foreign = interop.pinocchio_model(robot)
    data = foreign.model.createData()
    attitude = Rotation.random(random_state=np.random.default_rng(joints))
    q = np.concatenate([[0.3, -1.0, 2.0], attitude.as_quat(), foreign.angles @ theta])
    v = foreign.drive @ np.concatenate([[0.4, 0.1, -0.2], found.omega, rate])

    def forces(linear):
        a = foreign.drive @ np.concatenate([linear, found.omega_dot, acceleration])
        return foreign.drive.T @ pin.rnea(foreign.model, data, q, v, a)

    base = forces(np.zeros(3))[:3]
    push = np.stack([forces(unit)[:3] - base for unit in np.eye(3)], axis=1)
    balanced = forces(-np.linalg.solve(push, base))  # the centre of mass goes straight on
    scale = np.abs(found.torque).max()
    np.testing.assert_allclose(balanced[:6], 0, atol=1e-12 * scale)
    np.testing.assert_allclose(balanced[6:], found.torque, atol=1e-12 * scale)


@pytest.mark.oracle
@pytest.mark.parametrize(("joints", "branched"), SHAPES)
def test_torques_are_those_of_mujoco(joints, branched):
    """MuJoCo's inverse dynamics at the same motion. Its principal axes are good to about 1e-9."""
    mujoco = pytest.importorskip("mujoco")
    robot, theta, rate, acceleration, _, found = moving(joints, branched)
    foreign = interop.mujoco_model(robot)
    data = mujoco.MjData(foreign.model)
    data.qpos[3:7] = [1, 0, 0, 0]
    data.qpos[7:] = foreign.angles @ theta
    data.qvel[:] = foreign.drive @ np.concatenate([np.zeros(3), found.omega, rate])

    def forces(linear):
        data.qacc[:] = foreign.drive @ np.concatenate([linear, found.omega_dot, acceleration])
        mujoco.mj_inverse(foreign.model, data)
        return foreign.drive.T @ data.qfrc_inverse

    base = forces(np.zeros(3))[:3]
    push = np.stack([forces(unit)[:3] - base for unit in np.eye(3)], axis=1)
    balanced = forces(-np.linalg.solve(push, base))
    scale = np.abs(found.torque).max()
    np.testing.assert_allclose(balanced[3:6], 0, atol=1e-8 * scale)
    np.testing.assert_allclose(balanced[6:], found.torque, atol=1e-8 * scale)


@pytest.mark.parametrize(("joints", "branched"), SHAPES)
def test_power_is_the_rate_of_the_energy(joints, branched):
    """What the joints' torques do is all that changes the kinetic energy, with a momentum too."""
    robot, theta, rate, acceleration, momentum, found = moving(joints, branched)
    energy = lambda *state: reojax.kinetic_energy(robot, *state[:2], momentum=state[2])
    motion = (rate, acceleration, np.cross(momentum, found.omega))
    _, power = jax.jit(partial(jax.jvp, energy))((theta, rate, momentum), motion)
    np.testing.assert_allclose(power, found.torque @ rate, rtol=1e-11)


@pytest.mark.parametrize(("joints", "branched"), SHAPES)
def test_forward_undoes_inverse(joints, branched):
    robot, theta, rate, acceleration, momentum, found = moving(joints, branched)
    back = forward(robot, theta, rate, found.torque, momentum=momentum)
    np.testing.assert_allclose(back, acceleration, atol=1e-10)
    matrix = inertia(robot, theta)
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-12, atol=1e-15)
    energy = energy_of(robot, theta, rate)
    np.testing.assert_allclose(0.5 * rate @ matrix @ rate, energy, rtol=1e-12)


@pytest.mark.parametrize("side", ["parent", "child"])
def test_a_geared_wheel(side):
    """One axis, two bodies: every number by hand. The rotor turns with its stator, and N times as fast besides."""
    body, wheel, rotor, ratio = 5.0, 2.0, 0.01, 7.0
    robot = reojax.make_robot(
        mass=[1, 1], com=np.zeros((2, 3)), inertia=[body * np.eye(3), wheel * np.eye(3)], axis=[(0, 0, 1)],
        anchor=[(0, 0, 0)], rotor_inertia=[rotor], gear_ratio=[ratio], rotor_on=[side],
    )  # fmt: skip
    spin = ratio if side == "parent" else -ratio
    # h = (body + wheel) w + (wheel + rotor spin) x = 0 with x the joint's rate, and the same of accelerations
    coupling = wheel + rotor * spin
    if side == "child":
        fixed = wheel + 2 * rotor * spin + rotor * ratio**2
    else:
        fixed = wheel + rotor * ratio**2
    felt = fixed - coupling**2 / (body + wheel)
    np.testing.assert_allclose(inertia(robot, np.array([0.4])), [[felt]], rtol=1e-13)
    found = load(robot, np.array([0.4]), np.array([0.9]), np.array([3.0]))
    np.testing.assert_allclose(found.torque, [3 * felt], rtol=1e-13)
    np.testing.assert_allclose(found.omega_dot, [0, 0, -coupling / (body + wheel) * 3], atol=1e-13)
    stator = found.omega_dot[2] + (3.0 if side == "child" else 0.0)
    np.testing.assert_allclose(found.rotor, [rotor * spin * (stator + spin * 3)], rtol=1e-12)


def test_torques_differentiate_and_keep_their_dtype():
    """By the robot and the motion, under vmap; float32 stays float32."""
    robot, theta, rate, acceleration, momentum, found = moving(3, False)

    @jax.jit
    def total(scale):
        heavier = robot.replace(mass=scale * robot.mass, rotor_inertia=scale**2 * robot.rotor_inertia)
        return (reojax.inverse_dynamics(heavier, scale * theta, rate, acceleration, momentum=momentum) ** 2).sum()

    step = 1e-5
    difference = (total(1 + step) - total(1 - step)) / (2 * step)
    np.testing.assert_allclose(jax.grad(total)(1.0), difference, rtol=1e-7)
    many = jax.jit(jax.vmap(lambda push: inverse(robot, theta, rate, push)))(np.stack([acceleration, 0 * rate]))
    np.testing.assert_allclose(many[0], load(robot, theta, rate, acceleration).torque, rtol=1e-10)
    single = np.float32
    short = load(*jax.tree.map(single, (robot, theta, rate, acceleration)), momentum=single(momentum))
    torque = inverse(robot, single(theta), rate, acceleration, momentum=momentum)
    np.testing.assert_allclose(torque, short.torque, rtol=1e-4)
    assert torque.dtype == single
    assert {leaf.dtype for leaf in short} == {np.dtype(single)}
    np.testing.assert_allclose(short.torque, found.torque, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"theta_dot": np.zeros(2)}, r"`theta_dot` has shape \(2,\)"),
        ({"theta_ddot": [0, np.nan, 0]}, "`theta_ddot` is .*nan.*; it must be finite"),
        ({"momentum": np.zeros(2)}, r"`momentum` has shape \(2,\)"),
        ({"robot": "cat"}, "`robot` is a str"),
        ({"theta": ["a", "b", "c"]}, "`theta` is .*only real numbers"),
    ],
)
def test_bad_input_is_named(change, message):
    given = {"robot": random_robot(0, 3), **dict.fromkeys(("theta", "theta_dot", "theta_ddot"), np.zeros(3))}
    with pytest.raises(ValueError, match=message):
        reojax.inverse_dynamics(**{**given, **change})


def test_a_robot_without_joints_has_no_torques():
    robot = random_robot(0, 0)
    nothing = np.zeros(0)
    assert inverse(robot, nothing, nothing, nothing).shape == (0,)
    assert forward(robot, nothing, nothing, nothing).shape == (0,)
    np.testing.assert_allclose(jax.jit(reojax.base_velocity)(robot, nothing, nothing, momentum=np.zeros(3)), 0)

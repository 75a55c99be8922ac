"""The MJCF that reojax writes: MuJoCo's momentum is reojax's, its replay shows the same turn, and it reads back."""

import jax
import numpy as np
import pytest

import reojax
from reojax import load_robot, robots, write_mjcf
from reojax.robots.random import random_robot

mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.oracle

ROBOTS = [*robots.NAMES, "random"]


def robot_of(name):
    return random_robot(3, 5, branched=True) if name == "random" else robots.by_name(name)


def open_in_mujoco(path):
    model = mujoco.MjModel.from_xml_path(str(path))
    return model, mujoco.MjData(model)


def momentum(model, data, qvel) -> np.ndarray:
    """Angular momentum about the centre of mass, inertial frame."""
    data.qvel[:] = qvel
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    return np.array(data.subtree_angmom[model.body("world").id if model.nbody else 0])


@pytest.mark.parametrize("name", ROBOTS)
def test_momentum_is_the_same_in_mujoco(name, tmp_path):
    """Random posture and rates, rotors turning at their gear ratios: A omega - B theta_dot."""
    robot = robot_of(name)
    write_mjcf(robot, tmp_path / "robot.xml")
    model, data = open_in_mujoco(tmp_path / "robot.xml")
    np.testing.assert_allclose(model.body_mass.sum(), robot.mass.sum(), rtol=1e-9)
    rng = np.random.default_rng(0)
    theta, rate, omega = rng.uniform(-1, 1, robot.joints), rng.normal(size=robot.joints), rng.normal(size=3)
    qvel = np.zeros(model.nv)
    qvel[3:6] = omega
    for k, joint in enumerate(robot.joint_names):
        side = 1 if robot.rotor_on[k] == "parent" else -1
        for hinge, turns in ((joint, 1.0), (f"{joint} rotor", side * float(robot.gear_ratio[k]))):
            found = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, hinge)
            if found >= 0:
                data.qpos[model.jnt_qposadr[found]] = turns * theta[k]
                qvel[model.jnt_dofadr[found]] = turns * rate[k]
    own = reojax.angular_momentum(robot, theta, rate, omega)
    A = np.abs(reojax.momentum_matrices(robot, theta).A).max()
    np.testing.assert_allclose(momentum(model, data, qvel), own, atol=2e-10 * A * (1 + np.abs(rate).max()))


@pytest.mark.parametrize("name", ["prototype", "satellite_arm"])
def test_the_replay_of_a_path_is_its_turn(name, tmp_path):
    """Base quaternions are those of `rotation_history`, and the centre of mass stays put."""
    robot = robot_of(name)
    corners = np.array([[0.0] * robot.joints, [0.5, 0.8] + [0.3] * (robot.joints - 2), [0.0] * robot.joints])
    corners = np.insert(corners, 2, [0.9, -0.4] + [0.6] * (robot.joints - 2), axis=0)
    path = reojax.polygon(corners)
    write_mjcf(robot, tmp_path / "robot.xml", path, samples=6)
    model, data = open_in_mujoco(tmp_path / "robot.xml")
    assert model.nkey == 3 * 6 + 1
    turned = np.asarray(reojax.rotation_history(robot, path, samples=6))
    assert float(reojax.so3.angle(turned[-1])) > 1e-3
    for key in range(model.nkey):
        mujoco.mj_resetDataKeyframe(model, data, key)
        mujoco.mj_forward(model, data)
        base = data.body(robot.link_names[0]).xmat.reshape(3, 3)
        np.testing.assert_allclose(base, turned[key], atol=1e-9)
        if not key:
            centre, start = np.array(data.subtree_com[0]), data.body(robot.link_names[0]).xpos.copy()
        np.testing.assert_allclose(data.subtree_com[0], centre, atol=1e-9)
        poses = reojax.link_poses(robot, [float(data.joint(n).qpos[0]) for n in robot.joint_names])
        for i, link in enumerate(robot.link_names):
            body = data.body(link)
            np.testing.assert_allclose(body.xmat.reshape(3, 3), turned[key] @ poses.rotation[i], atol=1e-9)
            place = data.body(robot.link_names[0]).xpos + turned[key] @ poses.position[i]
            np.testing.assert_allclose(body.xpos, place, atol=1e-9)
    np.testing.assert_allclose(start, 0, atol=1e-12)


def test_the_replay_of_a_motion_has_its_times(tmp_path):
    robot = robots.prototype()
    motion = reojax.simulate(robot, reojax.manoeuvre_a(1.0, 0.5), durations=0.1, samples=5)
    write_mjcf(robot, tmp_path / "robot.xml", motion)
    model, _ = open_in_mujoco(tmp_path / "robot.xml")
    np.testing.assert_allclose(model.key_time, motion.time, atol=1e-12)
    np.testing.assert_allclose(model.key_qpos[:, 3:7], jax.vmap(reojax.so3.to_quaternion)(motion.rotation), atol=1e-9)


def test_what_is_written_reads_back(tmp_path):
    """Without rotors, links and joints are the same robot: A and B at a random posture."""
    robot = robots.quadruped()
    write_mjcf(robot, tmp_path / "robot.xml", rotors=False)
    again = load_robot(tmp_path / "robot.xml", shapes=False)
    assert (again.link_names, again.joint_names) == (robot.link_names, robot.joint_names)
    np.testing.assert_allclose(again.upper, robot.upper)
    theta = np.linspace(-1, 1, 12)
    still = robot.replace(rotor_inertia=np.zeros(12))
    for own, read in zip(reojax.momentum_matrices(still, theta), reojax.momentum_matrices(again, theta), strict=True):
        np.testing.assert_allclose(read, own, atol=1e-10 * np.abs(own).max())


def test_bad_input(tmp_path):
    robot, file = robots.prototype(), tmp_path / "robot.xml"
    with pytest.raises(ValueError, match="ends in one of .xml, .mjcf"):
        write_mjcf(robot, tmp_path / "robot.txt")
    with pytest.raises(ValueError, match=r"must be \(n, 3\)|shape"):
        write_mjcf(robot, file, np.zeros((4, 2)))
    with pytest.raises(ValueError, match="`samples`"):
        write_mjcf(robot, file, reojax.manoeuvre_a(1, 1), samples=0)
    with pytest.raises(ValueError, match="not the inertia of the rotors of 'bend'|rotors"):
        write_mjcf(robot.replace(rotor_inertia=np.array([0, 1e-4, 0])), file)
    with pytest.raises(ValueError, match="must be a Robot"):
        write_mjcf("prototype", file)
    assert not file.exists()

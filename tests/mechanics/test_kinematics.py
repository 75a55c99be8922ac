"""Poses of links and the centre of mass, against MuJoCo."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import interop
from reojax.robots.random import random_robot


@pytest.mark.oracle
@pytest.mark.parametrize("branched", [False, True])
def test_link_poses_and_centre_of_mass_are_those_of_mujoco(branched):
    mujoco = pytest.importorskip("mujoco")
    robot = random_robot(8, 6, branched=branched, rotors=False)
    theta = np.linspace(-2.5, 2.0, 6)
    model = interop.mujoco_model(robot).model
    data = mujoco.MjData(model)
    data.qpos[3] = 1
    for name, angle in zip(robot.joint_names, theta, strict=True):
        data.joint(name).qpos = angle
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    own = [model.body(name).id for name in robot.link_names]  # MuJoCo orders bodies by branches
    pose = reojax.link_poses(robot, theta)
    np.testing.assert_allclose(pose.rotation.reshape(-1, 9), data.xmat[own], atol=1e-13)
    np.testing.assert_allclose(pose.position, data.xpos[own], atol=1e-13)
    np.testing.assert_allclose(reojax.centre_of_mass(robot, theta), data.subtree_com[0], atol=1e-13)


def test_poses_keep_their_dtype_and_differentiate():
    """By central differences of one joint; float32 in, float32 out."""
    robot = random_robot(8, 6, branched=True)
    theta, step = np.linspace(-2.5, 2.0, 6), 1e-6 * np.eye(6)[2]
    slope = jax.jacfwd(lambda t: reojax.link_poses(robot, t).position)(jnp.asarray(theta))[..., 2]
    high, low = (reojax.link_poses(robot, theta + sign * step).position for sign in (1, -1))
    np.testing.assert_allclose(slope, (high - low) / 2e-6, atol=1e-8)
    single = reojax.link_poses(robot, theta.astype(np.float32))
    assert {leaf.dtype for leaf in single} == {np.dtype(np.float32)}
    np.testing.assert_allclose(single.position, reojax.link_poses(robot, theta).position, atol=1e-6)


def test_a_robot_without_joints_has_one_pose():
    robot = random_robot(1, 0)
    rotation, position = reojax.link_poses(robot, np.zeros(0))
    np.testing.assert_array_equal(rotation, np.eye(3)[None])
    np.testing.assert_array_equal(position, np.zeros((1, 3)))
    np.testing.assert_allclose(reojax.centre_of_mass(robot, np.zeros(0)), robot.com[0], rtol=1e-15)


@pytest.mark.parametrize("function", [reojax.link_poses, reojax.centre_of_mass])
def test_bad_angles_are_named(function):
    robot = reojax.robots.prototype()
    with pytest.raises(ValueError, match=r"`theta` has shape \(2,\)"):
        function(robot, np.zeros(2))
    with pytest.raises(ValueError, match=r"`theta` is \[nan, 0.0, 0.0\]; it must be finite"):
        function(robot, np.array([np.nan, 0, 0]))

"""A joint locked: momentum, shapes and names are those of the robot with that joint held, on every robot."""

import jax
import numpy as np
import pytest

import reojax
from reojax import Capsule, Layout, load_robot, make_robot, robots

MATRICES = jax.jit(reojax.momentum_matrices)
POSES = jax.jit(reojax.link_poses)
ANGLE = 0.3


def box(mass, x, y, z):
    return mass / 12 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])


def tree(**more):
    """A trunk with a jointed arm of two links, from whose first one a finger hangs, and a leg."""
    return make_robot(
        mass=[5.0, 2.0, 1.0, 0.5, 3.0],
        com=[(0, 0, 0.1), (0.1, 0, 0), (0.2, 0.05, 0), (0, 0.1, 0), (0, 0, -0.3)],
        inertia=[box(5, 0.3, 0.4, 0.5), box(2, 0.4, 0.1, 0.1), box(1, 0.3, 0.1, 0.05), box(0.5, 0.1, 0.2, 0.1)]
        + [box(3, 0.1, 0.1, 0.6)],
        axis=[(0, 0, 1), (0, 1, 0), (0.6, 0, 0.8), (1, 0, 0)],
        anchor=[(0.2, 0, 0.2), (0.4, 0, 0), (0.1, 0.1, 0), (0, 0, -0.2)],
        parent=(0, 1, 1, 0),
        rotor_inertia=[1e-4, 2e-4, 0, 1e-4],
        gear_ratio=[50, 30, 1, 50],
        rotor_on=["parent", "child", "parent", "child"],
        lower=-2.0 * np.ones(4),
        upper=1.5 * np.ones(4),
        link_names=["trunk", "arm", "fore", "finger", "leg"],
        joint_names=["shoulder", "elbow", "knuckle", "hip"],
        capsules=[Capsule(i, (0, 0, 0), (0.1, 0, 0.05), 0.03) for i in ("trunk", "arm", "fore", "finger", "leg")],
        collision_pairs=[(0, 2), (1, 4), (0, 3), (2, 3)],
        **more,
    )


def centres(robot, theta):
    """Ends of all capsules in the base frame, in their order."""
    rotation, position = (np.asarray(part) for part in POSES(robot, theta))
    at = list(robot.capsule_link)
    return [
        np.einsum("cij,cj->ci", rotation[at], np.asarray(end)) + position[at]
        for end in (robot.capsule_start, robot.capsule_end)
    ]


@pytest.mark.parametrize("name", [name for name in robots.NAMES if name != "planar2"])
def test_momentum_is_that_of_the_robot_with_the_joint_held(name):
    """A joint in the middle, whose subtree turns with it."""
    robot = robots.by_name(name)
    joint = robot.joints // 2
    locked = robots.with_joint_locked(robot, robot.joint_names[joint], ANGLE)
    assert (locked.joints, locked.links) == (robot.joints - 1, robot.links - 1)
    rest = np.random.default_rng(0).uniform(-1, 1, robot.joints - 1)
    A, B = MATRICES(robot, np.insert(rest, joint, ANGLE))
    A_locked, B_locked = MATRICES(locked, rest)
    size = np.abs(A).max()
    np.testing.assert_allclose(A_locked, A, atol=1e-13 * size, rtol=0)
    np.testing.assert_allclose(B_locked, np.delete(B, joint, axis=1), atol=1e-13 * size, rtol=0)


@pytest.mark.parametrize("joint", [0, 1, 2, 3])
def test_a_tree_keeps_momentum_shapes_and_names(joint):
    robot = tree()
    locked = robots.with_joint_locked(robot, joint, ANGLE)
    rest = np.array([0.4, -0.7, 0.9])
    whole = np.insert(rest, joint, ANGLE)
    for mine, its in zip(MATRICES(locked, rest), MATRICES(robot, whole), strict=True):
        its = np.delete(its, joint, axis=1) if its.shape[1] == 4 else its
        np.testing.assert_allclose(mine, its, atol=1e-14)
    for mine, its in zip(centres(locked, rest), centres(robot, whole), strict=True):
        np.testing.assert_allclose(mine, its, atol=1e-15)
    assert locked.joint_names == tuple(np.delete(robot.joint_names, joint))
    assert locked.link_names == tuple(np.delete(robot.link_names, joint + 1))
    kept = np.delete(np.arange(4), joint)
    np.testing.assert_array_equal(locked.rotor_inertia, robot.rotor_inertia[kept])
    assert locked.rotor_on == tuple(robot.rotor_on[k] for k in kept)
    assert f"locked: joint {robot.joint_names[joint]!r} at 0.3 rad" in locked.notes[-1]


def test_pairs_that_are_one_body_now_are_dropped():
    locked = robots.with_joint_locked(tree(), "elbow")
    assert locked.capsule_link == (0, 1, 1, 2, 3)
    assert locked.collision_pairs == ((0, 2), (1, 4), (0, 3), (2, 3))
    assert robots.with_joint_locked(locked, "shoulder").collision_pairs == ((1, 4), (0, 3), (2, 3))


def test_what_follows_a_locked_joint_is_held_too():
    robot = tree(couplings={"knuckle": ("elbow", -2.0, 0.1), "hip": ("shoulder", 0.5, 0.0)})
    locked = robots.with_joint_locked(robot, "elbow", ANGLE)
    assert locked.joint_names == ("shoulder", "hip")
    assert (locked.couplings, locked.coupling_ratio.tolist()) == (((1, 0),), [0.5])
    A, _ = MATRICES(robot, np.array([0.2, ANGLE, -0.5, 0.1]))
    np.testing.assert_allclose(MATRICES(locked, np.array([0.2, 0.1]))[0], A, atol=1e-14)


def test_a_layout_that_does_not_need_the_joint_stays():
    robot = tree(layout=Layout(4, (0, 3), 2))
    assert robots.with_joint_locked(robot, "elbow").layout == Layout(3, (0, 2), 1)
    assert robots.with_joint_locked(robot, "hip").layout is None


def test_locking_agrees_with_a_file_read_with_the_joint_locked(tmp_path):
    """Another way to the same robot: the file's joint becomes a fixed one before links are merged."""
    link = '<link name="{0}"><inertial><origin xyz="0.1 0 {1}" rpy="0.3 0.2 0.1"/><mass value="{1}"/><inertia '
    link += 'ixx="0.1" ixy="0.01" ixz="0" iyy="0.2" iyz="0" izz="0.25"/></inertial></link>'
    joint = '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="0.5 0.1 0" '
    joint += 'rpy="0.4 0 {3}"/><axis xyz="0 {3} 1"/><limit lower="-2" upper="2"/></joint>'
    parts = [link.format(name, mass) for name, mass in (("a", 3), ("b", 1), ("c", 2), ("d", 0.5))]
    parts += [joint.format("ab", "a", "b", 0.5), joint.format("bc", "b", "c", 1), joint.format("cd", "c", "d", 2)]
    file = tmp_path / "arm.urdf"
    file.write_text(f'<robot name="arm">{"".join(parts)}</robot>')
    for name in ("ab", "bc", "cd"):
        mine = robots.with_joint_locked(load_robot(file), name, ANGLE)
        its = load_robot(file, lock={name: ANGLE})
        assert (mine.parent, mine.link_names, mine.joint_names) == (its.parent, its.link_names, its.joint_names)
        for key in ("mass", "com", "inertia", "axis", "anchor"):
            np.testing.assert_allclose(getattr(mine, key), getattr(its, key), atol=1e-14, err_msg=key)


def test_the_angle_may_be_traced():
    """Derivative of A by the locked angle is that by the joint angle; float32 stays."""
    robot, rest = robots.planar(4), np.array([0.4, -0.2])
    of_locked = lambda q: reojax.momentum_matrices(robots.with_joint_locked(robot, 1, q), rest)[0][2, 2]
    of_joint = lambda q: reojax.momentum_matrices(robot, np.insert(rest, 1, 0.0) + q * np.eye(3)[1])[0][2, 2]
    np.testing.assert_allclose(jax.grad(of_locked)(0.5), jax.grad(of_joint)(0.5), rtol=1e-12)
    single = jax.tree.map(lambda leaf: np.asarray(leaf, np.float32), robot)
    assert robots.with_joint_locked(single, 1, 0.5).com.dtype == np.float32


@pytest.mark.parametrize(
    ("joint", "angle", "words"),
    [
        ("tail", 0.0, "`joint` is 'tail'; it must be a joint of the robot"),
        (4, 0.0, "`joint` is 4"),
        ("elbow", np.nan, "`angle` is nan; it must be one finite number"),
        ("elbow", [0.1, 0.2], r"`angle` is \[0.1, 0.2\]"),
        ("elbow", 3.0, "joint 'elbow' would be held at 3 rad; its limits are -2 to 1.5"),
        ("knuckle", 0.0, "`joint` 'knuckle' follows 'elbow'; lock 'elbow', which holds both"),
        ("elbow", 1.4, "joint 'knuckle' would be held at -2.8 rad"),
    ],
)
def test_a_joint_that_cannot_be_locked_is_refused(joint, angle, words):
    robot = tree(couplings={"knuckle": ("elbow", -2.0, 0.0)})
    with pytest.raises(ValueError, match=words):
        robots.with_joint_locked(robot, joint, angle)

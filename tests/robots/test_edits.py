"""Edits by the names of links and joints, on any robot."""

import jax
import numpy as np
import pytest

from reojax import Capsule, design, robots, save_robot

ARM = robots.satellite_arm()


@pytest.mark.parametrize("name", robots.NAMES)
def test_motors_and_limits_of_named_joints_change_alone(name):
    robot = robots.by_name(name)
    joint = robot.joint_names[-1]
    changed = robots.with_gear_ratio(robot, {joint: 7.0})
    changed = robots.with_rotor_inertia(changed, {robot.joints - 1: 1e-9})
    changed = robots.with_limits(changed, upper={joint: np.inf}, lower={joint: -3.0})
    assert (changed.gear_ratio[-1], changed.rotor_inertia[-1]) == (7.0, 1e-9)
    assert (changed.lower[-1], changed.upper[-1]) == (-3.0, np.inf)
    for key in ("gear_ratio", "rotor_inertia", "lower", "upper"):
        np.testing.assert_array_equal(getattr(changed, key)[:-1], getattr(robot, key)[:-1])


def test_one_number_for_all_joints():
    np.testing.assert_array_equal(robots.with_limits(ARM, -1.0, 2.0).lower, -np.ones(7))
    np.testing.assert_array_equal(robots.with_limits(ARM, upper=2.0).lower, ARM.lower)


def test_named_edits_take_traced_numbers():
    slope = jax.grad(lambda n: robots.with_gear_ratio(ARM, {"joint_3": n}).gear_ratio.sum())(2.0)
    assert slope == 1.0


def test_shapes_can_be_changed():
    """Pairs as `make_robot` chooses them: not those that are joined directly."""
    robot = robots.with_capsules(
        ARM, [Capsule("bus", [0, 0, 0], [0, 0, 0], 0.1), Capsule("wrist_2", [0, 0, 0], [0, 0, 0], 0.05)]
    )
    assert robot.capsule_link == (0, 6)
    assert robot.collision_pairs == ((0, 1),)
    assert robots.with_capsules(ARM, []).capsules == ()
    with pytest.raises(ValueError, match=r"capsules\[0\].link is 'tail'"):
        robots.with_capsules(ARM, [Capsule("tail", [0, 0, 0], [0, 0, 0], 0.1)])


def test_links_are_edited_by_name():
    heavy = design.with_mass(ARM, "forearm", 2.0)
    assert float(heavy.mass[4]) == pytest.approx(2.0)
    assert float(design.with_joint_inertia(ARM, "joint_4", 0.02).com[4, 2]) != float(ARM.com[4, 2])


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda: robots.with_gear_ratio(ARM, {"tail": 1.0}), "'tail'.*joint"),
        (lambda: robots.with_gear_ratio(ARM, {"joint_1": np.nan}), "finite"),
        (lambda: robots.with_rotor_inertia(ARM, {"joint_1": -1.0}), "not negative"),
        (lambda: robots.with_limits(ARM, lower={"joint_1": 9.0}), r"lower\[0\] \(joint_1\) is 9.0 rad"),
        (lambda: robots.with_limits(ARM, upper=[1.0, 2.0]), r"`upper` has shape \(2,\)"),
        (lambda: design.with_mass(ARM, "tail", 1.0), "`link` is 'tail'"),
    ],
)
def test_edits_refuse_by_name(edit, words):
    with pytest.raises(ValueError, match=words):
        edit()


def test_limits_in_degrees_are_asked_about():
    """As `make_robot` does; and the robot is made all the same."""
    with pytest.warns(UserWarning, match="are these degrees"):
        limited = robots.with_limits(robots.prototype(), -170.0, 170.0)
    assert limited.upper[0] == 170.0


def test_a_stack_of_robots_is_refused_by_name(tmp_path):
    stacked = jax.tree.map(lambda leaf: np.stack([leaf, leaf]), robots.prototype())
    for use in (robots.with_joint_locked, lambda robot, _: save_robot(robot, tmp_path / "a.json")):
        with pytest.raises(ValueError, match=r"`robot.mass` has shape \(2, 4\)"):
            use(stacked, 0)

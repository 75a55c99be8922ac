"""What `design_opt --robot` changes of a robot, and what the constrained choice is measured by."""

import design_opt
import numpy as np
import pytest
from common.script import length
from design_opt_parts import any_robot, in_time

import reojax
from reojax import RE_MAX_17
from reojax.design import Outcome


def _about(robot, joint):
    """Inertia of what a joint carries, the link alone, about the joint's axis."""
    axis, com = np.asarray(robot.axis[joint]), np.asarray(robot.com[joint + 1])
    return axis @ np.asarray(robot.inertia[joint + 1]) @ axis + robot.mass[joint + 1] * np.sum(np.cross(axis, com) ** 2)


@pytest.mark.parametrize("make", [reojax.robots.prototype, reojax.robots.quadruped])
def test_ends_and_gears_change_by_their_factors_and_nothing_else_does(make):
    robot = make()
    other = any_robot.changed(robot, 1.5, 0.75)
    leaves = set(range(1, robot.links)) - set(robot.parent)
    for joint in range(robot.joints):
        share = _about(other, joint) / _about(robot, joint)
        assert share == pytest.approx(1.5 if joint + 1 in leaves else 1.0)
    np.testing.assert_allclose(other.gear_ratio, 0.75 * np.asarray(robot.gear_ratio))
    np.testing.assert_array_equal(other.mass, robot.mass)
    same = any_robot.changed(robot, 1.0, 1.0)
    np.testing.assert_allclose(same.inertia, robot.inertia, rtol=1e-12, atol=1e-18)


def test_a_robot_is_a_name_or_a_file(tmp_path):
    file = tmp_path / "arm.json"
    reojax.save_robot(reojax.robots.planar(3), file)
    assert any_robot.robot_of(str(file)) == reojax.robots.planar(3)
    assert any_robot.robot_of("quadruped").name == "quadruped"
    with pytest.raises(ValueError, match="nonsense"):
        any_robot.robot_of("nonsense.urdf")


def test_joints_without_limits_get_half_a_turn():
    limited = any_robot.limited(reojax.robots.planar(3))
    np.testing.assert_array_equal(limited.upper, [np.pi, np.pi])
    np.testing.assert_array_equal(any_robot.limited(reojax.robots.prototype()).upper, reojax.robots.prototype().upper)


def test_the_duration_of_a_design_is_that_of_its_own_gears():
    """With the thesis's gears that of `minimum_time`; another gear, another time."""
    robot = reojax.robots.prototype()
    path = reojax.manoeuvre_a(np.deg2rad(200), np.deg2rad(100))
    motors = RE_MAX_17._replace(gear_ratio=24.0, rotor_inertia=1e-7)
    least = float(reojax.minimum_time(robot, path, motors, "quintic", samples=64).duration)

    def seconds(robot):
        return float(in_time.least_time(Outcome({}, robot, path, 4), RE_MAX_17).duration)

    assert seconds(robot) == pytest.approx(least, rel=1e-12)
    assert seconds(reojax.robots.with_gear_ratio(robot, 40.0)) > 1.2 * least


def test_edges_that_take_what_their_joints_need_are_just_in_time():
    """No less than a joint needs, and no more; in units of half a second."""
    robot = reojax.robots.prototype()
    path = reojax.manoeuvre_a(np.deg2rad(200), np.deg2rad(100))
    durations = np.asarray(in_time.least_time(Outcome({}, robot, path, 4), RE_MAX_17).durations)
    outcome = Outcome({"times": durations / 0.5}, robot, path, 4)
    needs = np.asarray(in_time.in_time(RE_MAX_17, 0.5)(outcome)).reshape(len(durations), -1)
    np.testing.assert_allclose(needs.max(1), 0.0, atol=1e-12)
    assert (np.asarray(in_time.in_time(RE_MAX_17, 0.4)(outcome)) > 0).any()
    assert float(in_time.total(outcome)) == pytest.approx(2 * durations.sum())


@pytest.mark.parametrize(("text", "metres"), [("5mm", 0.005), ("5", 0.005), ("2cm", 0.02), ("0.1m", 0.1)])
def test_a_clearance_has_a_unit(text, metres):
    assert length(text) == pytest.approx(metres)


@pytest.mark.slow
def test_the_command_answers_for_a_robot_of_a_file(tmp_path):
    """Rods in a plane, from a file: all that it says holds, and gradients leave no design worse than the robot is."""
    file = tmp_path / "rods.json"
    reojax.save_robot(reojax.robots.planar(3), file)
    answer = design_opt.main(tmp_path, quick=True, target=20.0, robot=str(file), clearance=0.005)
    assert answer["converged"]
    rows = {row["case"]: row for row in answer["choices"]}
    assert all(row["certificate"]["clearance_m"] >= 0.005 for row in rows.values())
    assert rows["ends free"]["travel_deg"] < rows["as it is"]["travel_deg"]
    assert (tmp_path / "design_opt.json").exists()
    assert (tmp_path / "design_opt.html").exists()

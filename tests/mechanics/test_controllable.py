"""Controllable directions: the rank of the algebra that closed loops generate, on robots whose answer is known."""

import dataclasses

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import reojax
from reojax import controllable_directions, robots
from reojax.robots.random import random_robot


def bus_with_wheels(axes: list, wheel: float = 1e-3, bus: float = 1.0) -> reojax.Robot:
    """Wheels whose centres of mass stay put: the connection is constant."""
    n = len(axes)
    return reojax.make_robot(
        mass=[10.0] + [0.1] * n,
        com=np.zeros((n + 1, 3)),
        inertia=[bus * np.diag([1.0, 1.2, 1.5]), *[wheel * np.eye(3)] * n],
        axis=axes,
        anchor=np.zeros((n, 3)),
        parent=[0] * n,
    )


def turned(robot: reojax.Robot, turn: np.ndarray) -> reojax.Robot:
    """The same robot seen in other axes."""
    com, axis, anchor = (np.asarray(field) @ turn.T for field in (robot.com, robot.axis, robot.anchor))
    return robot.replace(com=com, axis=axis, anchor=anchor, inertia=turn @ np.asarray(robot.inertia) @ turn.T)


def coupled(robot: reojax.Robot, ratio: float, pair: tuple[int, int]) -> reojax.Robot:
    """The same robot, one of its joints following another."""
    return dataclasses.replace(robot, coupling_ratio=np.array([ratio]), coupling_offset=np.zeros(1), couplings=(pair,))


@pytest.mark.parametrize("robot", [robots.prototype(), robots.six_body(), random_robot(0, 7, branched=True)])
def test_a_robot_in_space_has_rank_three(robot):
    for theta in (np.zeros(robot.joints), np.linspace(-1, 1, robot.joints)):
        found = controllable_directions(robot, theta)
        assert found.rank == 3
        np.testing.assert_allclose(found.axes @ found.axes.T, np.eye(3), atol=1e-12)


def test_a_planar_robot_turns_about_its_normal_in_any_frame():
    turn = Rotation.random(random_state=0).as_matrix()
    for dtype in (np.float64, np.float32):
        for theta in (np.zeros(3), np.array([0.3, -0.5, 1.0])):
            robot = jax.tree.map(lambda leaf, dtype=dtype: np.asarray(leaf, dtype), turned(robots.planar(4), turn))
            found = controllable_directions(robot, theta)
            assert found.rank == 1
            np.testing.assert_allclose(abs(found.axes[0] @ turn[:, 2]), 1, atol=1e-5 if dtype == np.float32 else 1e-12)


def test_one_joint_and_no_joint_turn_nothing():
    robot = robots.prototype()
    assert controllable_directions(robots.planar(2), [0.4]).rank == 0
    assert controllable_directions(random_robot(0, 0), np.zeros(0)).axes.shape == (0, 3)
    assert controllable_directions(robot, np.zeros(3), joints=[1]).rank == 0
    assert controllable_directions(robot, np.zeros(3), joints=[]).rank == 0
    assert controllable_directions(robot, np.zeros(3), joints=[robot.joint_names[0], 1]).rank == 3


@pytest.mark.parametrize(("wheel", "bus"), [(1e-3, 1.0), (1e-6, 1.0), (1e-9, 1e3)])
def test_wheels_turn_by_their_brackets_however_heavy_the_bus(wheel, bus):
    """Two wheels on different axes reach everything, on one axis nothing."""
    assert controllable_directions(bus_with_wheels([[1, 0, 0], [0, 1, 0]], wheel, bus), np.zeros(2)).rank == 3
    assert controllable_directions(bus_with_wheels([[0, 0, 1]] * 2, wheel, bus), np.zeros(2)).rank == 0


def test_coupled_joints_count_as_one():
    """Two coupled joints are one joint; a third one of a planar robot makes two, which turn it about one axis."""
    assert controllable_directions(coupled(robots.planar(3), 2.0, (1, 0)), np.zeros(2)).rank == 0
    assert controllable_directions(coupled(robots.planar(4), 2.0, (1, 0)), np.zeros(3)).rank == 1
    space = coupled(random_robot(1, 3), -1.0, (2, 0))
    assert controllable_directions(space, np.zeros(3)).rank == 3
    assert controllable_directions(space, np.zeros(3), joints=[0, 2]).rank == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"theta": np.zeros(2)}, r"`theta` has shape \(2,\)"),
        ({"theta": [0, np.nan, 0]}, "must be finite"),
        ({"joints": [3]}, r"`joints\[0\]` is 3"),
        ({"joints": ["elbow"]}, r"`joints\[0\]` is 'elbow'; .* twist1, bend, twist2"),
        ({"joints": [0, 0]}, "twice"),
        ({"robot": 3}, "`robot` is a int"),
    ],
)
def test_bad_input_is_named(change, message):
    with pytest.raises(ValueError, match=message):
        controllable_directions(**({"robot": robots.prototype(), "theta": np.zeros(3)} | change))


def test_traced_values_are_refused():
    with pytest.raises(ValueError, match="outside of jit"):
        jax.jit(lambda theta: controllable_directions(robots.prototype(), theta).axes)(np.zeros(3))

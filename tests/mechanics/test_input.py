"""What no mechanics can answer is refused by name; what may be wrong is told; a certificate never flatters."""

import dataclasses
import inspect
import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax.mechanics.certificate import momentum_residual
from reojax.path import Path
from reojax.robots.random import random_robot

ROBOT = reojax.robots.prototype()
PATH = reojax.manoeuvre_a(2.0, 1.2)
THETA = np.zeros(3)
STACK = jax.tree.map(lambda leaf: jnp.stack([leaf, leaf]), ROBOT)


def half(robot: reojax.Robot, dtype) -> reojax.Robot:
    return robot.replace(mass=np.asarray(robot.mass, dtype))


@pytest.mark.parametrize("count", [2**70, 2**21, 0, -1, 1.5, True, "4", None])
@pytest.mark.parametrize("entry", ["steps", "samples"])
def test_counts(entry, count):
    function = {"steps": reojax.net_rotation, "samples": reojax.rotation_history}[entry]
    with pytest.raises(ValueError, match=rf"^`{entry}` is .*; it must be"):
        function(ROBOT, PATH, **{entry: count})
    with pytest.raises(ValueError, match=rf"^`{entry}` .*"):
        reojax.certify(ROBOT, PATH, **{entry: count})


FUNCTIONS = {
    "net_rotation": lambda robot: reojax.net_rotation(robot, PATH),
    "rotation_history": lambda robot: reojax.rotation_history(robot, PATH, samples=2),
    "certify": lambda robot: reojax.certify(robot, PATH),
    "connection": lambda robot: reojax.connection(robot, THETA),
    "curvature": lambda robot: reojax.curvature(robot, THETA),
    "link_poses": lambda robot: reojax.link_poses(robot, THETA),
    "inverse_dynamics": lambda robot: reojax.inverse_dynamics(robot, THETA, THETA, THETA),
}
every_function = pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS.keys())


@every_function
def test_a_stack_of_robots(function):
    with pytest.raises(ValueError, match=r"`robot.mass` has shape \(2, 4\); .* use jax.vmap"):
        function(STACK)


@every_function
@pytest.mark.parametrize("dtype", [np.float16, np.longdouble, jnp.bfloat16])
def test_unusual_precision(function, dtype):
    with pytest.raises(ValueError, match=r"`robot.mass` has dtype \w+; it must be float32, float64 or integers"):
        function(half(ROBOT, dtype))


@every_function
def test_no_robot(function):
    with pytest.raises(ValueError, match="`robot` is a dict; it must be a Robot"):
        function({})


def test_paths_that_are_none():
    with pytest.raises(ValueError, match=r"`path.waypoints` has shape \(2, 5, 3\); .* use jax.vmap"):
        reojax.net_rotation(ROBOT, Path(np.zeros((2, 5, 3))))
    with pytest.raises(ValueError, match=r"`path.waypoints` has dtype float16"):
        reojax.net_rotation(ROBOT, Path(np.zeros((5, 3), np.float16)))
    with pytest.raises(ValueError, match="`path` has waypoints of 2 joint angles; 'prototype' has 3 joints"):
        reojax.certify(ROBOT, reojax.polygon(np.zeros((5, 2))))


@pytest.mark.parametrize(
    ("waypoints", "options"),
    [
        (reojax.manoeuvre_a(np.deg2rad(36000), 1.2).waypoints, {}),
        ([[0, 0, 0], [90.0, 0, 0]], {}),
        ([[0, 0, 0], [4.9, 0, 0]], {}),
        ([[0, 0, 0], [9.7, 0, 0]], {"steps": 8}),
    ],
)
def test_edges_beyond_the_steps_are_told(waypoints, options):
    """The rule holds; and one that follows the warning has no further one."""
    path = reojax.polygon(waypoints)
    with pytest.warns(UserWarning, match=r"in (4|8) steps; beyond 1.2 rad a step .* give `steps` of (\d+)") as told:
        inspect.unwrap(reojax.net_rotation)(ROBOT, path, **options)
    assert [warning.filename for warning in told] == [__file__]
    assert "certify" in str(told[0].message)
    with warnings.catch_warnings(action="error"):
        reojax.net_rotation(ROBOT, path, steps=int(np.ceil(np.abs(np.diff(path.waypoints, axis=0)).max() / 1.2)))
        jax.jit(lambda points: reojax.net_rotation(ROBOT, Path(points)))(path.waypoints)


def test_edges_within_the_steps_are_not():
    """Up to 270 degrees with the default; more with more steps, or where samples bring steps with them."""
    with warnings.catch_warnings(action="error"):
        reojax.net_rotation(ROBOT, reojax.manoeuvre_a(np.deg2rad(270), 1.2))
        reojax.net_rotation(ROBOT, reojax.manoeuvre_a(9.0, 1.2), steps=8)
        reojax.rotation_history(ROBOT, reojax.manoeuvre_a(9.0, 1.2), samples=8)
    with pytest.warns(UserWarning, match="give `samples` of 8"):
        reojax.rotation_history(ROBOT, reojax.manoeuvre_a(9.0, 1.2), samples=2)


def test_a_certificate_of_nan_is_nan():
    """Of a robot with NaN, and of a motion with NaN."""
    with jax.debug_nans(False):
        certificate = reojax.certify(dataclasses.replace(ROBOT, mass=ROBOT.mass * np.nan), PATH)  # past the door
        assert all(np.isnan(field) for field in certificate)
        history = np.array(reojax.rotation_history(ROBOT, PATH, samples=16))
        history[20, 1, 2] = np.nan
        assert np.isnan(momentum_residual(ROBOT, PATH, history))
        path = Path(np.asarray(PATH.waypoints) * np.array([[1], [1], [np.nan], [1], [1]]))
        assert all(np.isnan(field) for field in reojax.certify(ROBOT, path))


def test_a_robot_without_joints_has_a_certificate():
    robot, path = random_robot(1, 0), reojax.polygon(np.zeros((3, 0)))
    np.testing.assert_array_equal(reojax.net_rotation(robot, path), np.eye(3))
    assert [float(field) for field in reojax.certify(robot, path)] == [0, 0, 0, 0]

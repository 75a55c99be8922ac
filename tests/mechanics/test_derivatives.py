"""Derivatives of the net rotation by every number of a robot and of a path, against differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

import reojax
from reojax import FOUR_BODY, make_robot, manoeuvre_a, manoeuvre_b, net_rotation, polygon
from reojax.robots.random import random_robot

LIMITS = (-3.0, 2.0)
SERIAL = random_robot(1, 2, limits=LIMITS)
TREE = random_robot(9, 2, branched=True, limits=LIMITS)
ROBOTS = pytest.mark.parametrize("robot", [SERIAL, TREE], ids=["serial", "tree"])
OPEN = np.random.default_rng(0).uniform(-2, 2, (4, 2))
PATHS = {"open": OPEN, "loop": OPEN[[0, 1, 2, 0]], "zero": np.zeros((4, 2)), "still": OPEN[[3, 3, 3, 3]]}
EFFECTIVE = ("mass", "com", "inertia", "axis", "anchor", "rotor_inertia", "gear_ratio")
LIMITS_ONLY = ("lower", "upper")


def test_robots_have_what_is_differentiated():
    assert (SERIAL.parent, TREE.parent) == ((0, 1), (0, 0))
    for robot in (SERIAL, TREE):
        assert set(robot.rotor_on) == {"parent", "child"}
        assert np.all(robot.rotor_inertia > 0)


def outcome(robot, waypoints):
    """Rotation vector and angle of the net rotation."""
    rotation = net_rotation(robot, polygon(waypoints))
    return jnp.append(reojax.so3.log(rotation), reojax.so3.angle(rotation))


push = jax.jit(lambda robot, waypoints, *by: jax.jvp(outcome, (robot, waypoints), by))
pull = jax.jit(lambda robot, waypoints, weight: jax.vjp(outcome, robot, waypoints)[1](weight))


def central(function, step: float = 1e-3) -> np.ndarray:
    """Derivative at 0 of a function of one number, by differences of fourth order."""
    one, two = (function(c * step) - function(-c * step) for c in (1, 2))
    return (8 * one - two) / (12 * step)


def derivatives(robot, waypoints):
    """Value (4,) and its derivatives (4, numbers): forward, reverse, by differences; and the tree of the numbers.

    Each number is in units of the largest of its array. Where the rotation vector jumps between the two
    of a half turn, differences take the one near the value.
    """
    numbers, build = ravel_pytree((robot, waypoints))
    largest = jax.tree.map(lambda leaf: np.full(leaf.shape, np.abs(leaf).max(initial=0.0) or 1.0), (robot, waypoints))
    units = np.diag(ravel_pytree(largest)[0])
    still = build(np.zeros(len(numbers)))
    value = np.asarray(push(robot, waypoints, *still)[0])

    def near(unit, shift):
        end = np.array(push(*build(numbers + shift * unit), *still)[0])
        if end[:3] @ value[:3] < 0 and end[3] > 3:
            end[:3] *= 1 - 2 * np.pi / end[3]
        return end

    forward = [push(robot, waypoints, *build(unit))[1] for unit in units]
    reverse = [units @ ravel_pytree(pull(robot, waypoints, weight))[0] for weight in np.eye(4)]
    difference = [central(lambda shift, unit=unit: near(unit, shift)) for unit in units]
    return value, np.stack(forward, axis=1), np.stack(reverse), np.stack(difference, axis=1), build


@ROBOTS
@pytest.mark.parametrize("path", PATHS)
def test_forward_reverse_and_differences_agree(robot, path):
    """By all numbers at once; limits have no effect, and without motion only the path has one."""
    value, forward, reverse, difference, build = derivatives(robot, PATHS[path])
    moves = path in ("open", "loop")
    assert (value[3] > 0.05) == moves
    np.testing.assert_allclose(forward, reverse, atol=1e-12)
    np.testing.assert_allclose(forward[:3], difference[:3], atol=1e-9)
    if moves:
        np.testing.assert_allclose(forward[3], difference[3], atol=1e-9)
    else:
        assert not forward[3].any()  # the angle has a kink at the identity, where its slope is 0 by choice
    slopes = [build(row) for row in forward]

    def largest(entry):
        return max(np.abs(getattr(by_robot, entry)).max() for by_robot, _ in slopes)

    assert all((largest(entry) > 1e-3) == moves for entry in EFFECTIVE)
    assert all(largest(entry) == 0 for entry in LIMITS_ONLY)
    assert np.min(np.abs([by_path for _, by_path in slopes[:3]]).max(axis=(0, 1))) > 1e-2


def half_turn() -> tuple[reojax.Robot, np.ndarray]:
    """A body with a wheel about x, and a way to turn the wheel that turns the body by exactly half a turn.

    The other arm is on the x axis and at rest, so `R = exp(-x J phi / A_xx)` (see test_exact_cases).
    """
    moments = np.array([[0.2, 0.3, 0.25], [0.15, 0.1, 0.1], [0.04, 0.05, 0.06]])
    robot = make_robot(
        mass=[2.0, 1.0, 0.5],
        com=[[0.1, 0, 0], [0.05, 0, 0], [-0.2, 0, 0]],
        inertia=[np.diag(row) for row in moments],
        axis=[[1.0, 0, 0], [0, 0.6, 0.8]],
        anchor=[[0.3, 0, 0], [-0.3, 0, 0]],
        parent=TREE.parent,
        rotor_inertia=[1e-3, 2e-3],
        gear_ratio=[20.0, 10.0],
        rotor_on=TREE.rotor_on,
        lower=TREE.lower,
        upper=TREE.upper,
        name=TREE.name,
    )
    assert robot.rotor_on[0] == "parent"
    angle = np.pi * moments[:, 0].sum() / (moments[1, 0] + 20.0 * 1e-3)
    return robot, np.outer(np.array([0.0, 0.3, 0.6, 1.0]) * -angle, [1, 0])


def test_at_half_a_turn():
    """The rotation vector's on the branch of its value; the angle's from one of the two sides of its kink."""
    value, forward, reverse, difference, _ = derivatives(*half_turn())
    np.testing.assert_allclose(np.abs(value), [np.pi, 0, 0, np.pi], atol=1e-12)
    np.testing.assert_allclose(forward, reverse, atol=1e-12)
    np.testing.assert_allclose(forward[:3], difference[:3], atol=1e-8)
    along = value[:3] / np.pi @ forward[:3]
    assert np.abs(along).max() > 1
    assert min(np.abs(forward[3] - along).max(), np.abs(forward[3] + along).max()) < 1e-12


# --- by the amplitudes of the manoeuvres -----------------------------------------------------------------

CAT = random_robot(1, FOUR_BODY.joints)


def after_manoeuvre(amplitudes, weight):
    """Rotation vector of manoeuvre A (weight 0) or B (weight 1), of a robot that is known beforehand."""
    a, b = manoeuvre_a(*amplitudes).waypoints, manoeuvre_b(*amplitudes).waypoints
    return reojax.so3.log(net_rotation(CAT, polygon((1 - weight) * a + weight * b)))


push_amplitudes = jax.jit(lambda x, weight, dx: jax.jvp(lambda x: after_manoeuvre(x, weight), (x,), (dx,)))
pull_amplitudes = jax.jit(lambda x, weight, dv: jax.vjp(lambda x: after_manoeuvre(x, weight), x)[1](dv)[0])


@pytest.mark.slow
@pytest.mark.parametrize("weight", [0.0, 1.0], ids=["A", "B"])
@pytest.mark.parametrize("amplitudes", [(1.9, 0.8), (0.0, 0.8), (1.9, 0.0), (0.0, 0.0)])
def test_by_the_amplitudes(weight, amplitudes):
    """Forward, reverse and differences agree; a loop is stationary only if it has no amplitude at all."""
    x, still = np.array(amplitudes), np.zeros(2)
    forward = [push_amplitudes(x, weight, unit)[1] for unit in np.eye(2)]
    reverse = [pull_amplitudes(x, weight, unit) for unit in np.eye(3)]
    difference = [central(lambda d, unit=unit: push_amplitudes(x + d * unit, weight, still)[0]) for unit in np.eye(2)]
    np.testing.assert_allclose(forward, np.transpose(reverse), atol=1e-12)
    np.testing.assert_allclose(forward, difference, atol=1e-9)
    assert (np.abs(forward).max() > 1e-2) == any(amplitudes)


@pytest.mark.slow
def test_reverse_is_the_transpose_of_forward_in_a_long_robot():
    """By every number at once, where what the links hand on is kept one by one."""
    robot = random_robot(4, 5, branched=True, limits=LIMITS)
    waypoints = np.random.default_rng(1).uniform(-2, 2, (4, 5))
    numbers, build = ravel_pytree((robot, waypoints))
    change = np.random.default_rng(2).normal(size=len(numbers)) * np.maximum(np.abs(numbers), 0.1)
    weight = np.random.default_rng(3).normal(size=4)
    _, moved = push(robot, waypoints, *build(change))
    slopes, _ = ravel_pytree(pull(robot, waypoints, weight))
    assert np.abs(moved).max() > 0.1
    np.testing.assert_allclose(slopes @ change, weight @ moved, rtol=1e-10)

"""Plans: they end on the target, replay, stay inside the box, use as few loops as were planted, and refuse nonsense."""

from functools import partial

import jax
import numpy as np
import pytest
from common.replay import apart, replay
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots
from reojax.planning import quaternions
from reojax.planning.residual import Word, miss
from reojax.planning.words import word_corners

LIMITS = {"twist_limit": float(np.deg2rad(270)), "bend_limit": float(np.deg2rad(120))}
ROBOT = robots.prototype()
PLAN = partial(reojax.plan_many, ROBOT, **LIMITS, max_manoeuvres=5)


def lopsided(robot: reojax.Robot) -> reojax.Robot:
    """Unequal end links, one with its centre of mass out of the bending plane."""
    mass, com, inertia = (np.array(field) for field in (robot.mass, robot.com, robot.inertia))
    mass[-1] *= 1.3
    inertia[-1] *= 1.3
    com[0] += [0.006, -0.003, 0.002]
    return robot.replace(mass=mass, com=com, inertia=inertia)


def planted(rng: np.random.Generator, loops: int, count: int, bent: bool = False) -> np.ndarray:
    """Rotations after `loops` random manoeuvres, that bend to a limit if `bent`."""
    letters, x = rng.integers(2, size=(count, loops)), rng.uniform(-1, 1, (2, count, loops))
    if bent:
        x[1] = np.sign(x[1])
    twist, bend = LIMITS["twist_limit"] * x[0], LIMITS["bend_limit"] * x[1]
    last = np.where(letters == 0, -twist, twist)
    corners = [word_corners(reojax.FOUR_BODY, *row) for row in zip(twist, bend, last, strict=True)]
    return replay(ROBOT, np.array(corners))


def test_random_targets_are_reached_within_the_box_and_replay():
    targets = Rotation.random(24, random_state=0).as_matrix()
    plan = PLAN(targets)
    assert plan.converged.all()
    assert (plan.error <= 1e-9).all()
    assert plan.manoeuvres.max() <= 5
    turned = replay(ROBOT, plan.waypoints)
    assert apart(turned, plan.rotation).max() < 2e-9
    assert apart(turned, targets).max() < 3e-9
    assert (np.abs(plan.waypoints).max((0, 1)) <= ROBOT.upper + 1e-9).all()
    np.testing.assert_allclose(plan.travel, np.abs(np.diff(plan.waypoints, axis=1)).sum((1, 2)))
    for m in range(24):
        k = plan.manoeuvres[m]
        assert (plan.word[m, k:] == "").all()
        assert set(plan.word[m, :k]) <= {"A", "B"}
        assert not plan.twist[m, k:].any()
        corners = plan.waypoints[m, : 4 * k + 1]
        np.testing.assert_array_equal(plan.waypoints[m, 4 * k :], np.zeros_like(plan.waypoints[m, 4 * k :]))
        np.testing.assert_array_equal(corners[2::4, 0], plan.twist[m, :k])
        np.testing.assert_array_equal(corners[2::4, 1], plan.bend[m, :k])
        signs = np.where(plan.word[m, :k] == "A", -1, 1)
        np.testing.assert_array_equal(corners[2::4, 2], signs * plan.twist[m, :k])


@pytest.mark.parametrize("loops", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_what_some_manoeuvres_made_takes_no_more(loops):
    """The fewest are found: a plan never takes more loops than the target was made of."""
    targets = planted(np.random.default_rng(loops), loops, 12)
    plan = PLAN(targets, max_manoeuvres=loops)
    assert plan.converged.all()
    assert plan.manoeuvres.max() <= loops
    more = PLAN(targets)
    assert (more.manoeuvres <= loops).all()


@pytest.mark.slow
@pytest.mark.parametrize("loops", [3, 5])
def test_what_is_barely_within_reach_is_reached(loops):
    """Targets that take all the bending there is, many of which no fewer loops reach."""
    plan = PLAN(planted(np.random.default_rng(3), loops, 24, bent=True), max_manoeuvres=loops)
    assert plan.converged.all()
    assert plan.manoeuvres.max() <= loops


@pytest.mark.slow
def test_identity_half_turns_and_small_turns():
    """Also about pitch, about which no single manoeuvre turns."""
    turns = [np.zeros(3), *np.pi * np.eye(3), *1e-4 * np.eye(3), *1e-7 * np.eye(3)]
    plan = PLAN(Rotation.from_rotvec(turns).as_matrix())
    assert plan.converged.all()
    assert plan.manoeuvres[0] == 0
    assert (plan.manoeuvres[1:] > 0).all()
    assert not plan.waypoints[0].any()
    alone = reojax.plan(ROBOT, np.eye(3), **LIMITS, max_manoeuvres=1)
    assert alone.word == ()
    assert alone.waypoints.shape == (1, 3)
    assert alone.converged
    assert alone.travel == alone.error == 0


@pytest.mark.slow
def test_other_robots():
    """Unequal ends and a centre of mass out of the bending plane; six links that fold their feet."""
    targets = Rotation.random(4, random_state=2).as_matrix()
    for robot in (lopsided(ROBOT), robots.six_body()):
        plan = reojax.plan_many(robot, targets, **LIMITS, max_manoeuvres=6)
        assert plan.converged.all()
        assert apart(replay(robot, plan.waypoints), targets).max() < 3e-9
        assert (plan.waypoints <= robot.upper + 1e-9).all()
        assert (plan.waypoints >= robot.lower - 1e-9).all()


def test_out_of_reach_is_the_closest_plan():
    far = Rotation.from_rotvec([np.pi / 2, 0, 0]).as_matrix()
    plan = reojax.plan(ROBOT, far, **LIMITS, max_manoeuvres=1)
    assert not plan.converged
    assert len(plan.word) <= 1
    assert 0.1 < plan.error <= np.pi / 2
    assert apart(plan.rotation[None], far[None]) == pytest.approx(plan.error)


@pytest.mark.slow
def test_a_planar_robot_turns_in_its_plane_only():
    """Elsewhere the closest plan is to do nothing."""
    robot = robots.planar(4).replace(layout=reojax.FOUR_BODY)
    out_of_plane = Rotation.from_rotvec([0.5, 0, 0]).as_matrix()
    plan = reojax.plan(robot, out_of_plane, **LIMITS, max_manoeuvres=2)
    assert not plan.converged
    assert plan.error == pytest.approx(0.5)
    assert plan.status.startswith("unreachable: loops of the joints that move turn the base about the axis (0, 0, ")
    assert plan.status.endswith("28.6479 deg are left at the least")


@pytest.mark.slow
def test_less_travel_when_travel_counts():
    targets = Rotation.random(6, random_state=5).as_matrix()
    few, short = PLAN(targets), PLAN(targets, objective="travel")
    assert short.converged.all()
    assert (short.travel <= few.travel + 1e-9).all()
    assert short.travel.sum() < 0.95 * few.travel.sum()
    assert (few.manoeuvres <= short.manoeuvres).all()


def test_replan_goes_from_what_was_measured():
    target, measured = Rotation.random(2, random_state=7).as_matrix()
    plan = reojax.replan(ROBOT, target, measured, **LIMITS, max_manoeuvres=5)
    assert plan.converged
    end = measured @ replay(ROBOT, plan.waypoints[None])
    assert apart(end, target[None]) < 3e-9


@pytest.mark.parametrize("count", [1.0, 7.0])
def test_derivatives_of_a_word(count):
    """Against differences, powers of loops too."""
    from reojax.planning.plan import _scene

    here = _scene(ROBOT, reojax.FOUR_BODY, "AB", *LIMITS.values(), None)
    rng = np.random.default_rng(3)
    letter = np.array([[0], [1], [0], [-1]])
    low, high = (np.moveaxis(edge[np.maximum(letter, 0)], -1, 0) for edge in here.box[1:])
    x = 0.3 * rng.uniform(low, high)
    target = quaternions.from_matrices(Rotation.random(1, random_state=1).as_matrix())
    word = Word(letter, np.full((4, 1), count), target, low, high)
    at = jax.jit(lambda x: miss(here.table, word, x))
    h = 1e-6
    for i, k in np.ndindex(2, 3):
        e = np.zeros_like(x)
        e[i, k] = h
        difference = (at(x + e).residual - at(x - e).residual) / (2 * h)
        np.testing.assert_allclose(at(x).jacobian[i, k], difference, atol=1e-6 * count)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"target": 1.1 * np.eye(3)}, r"`target` is no rotation: an entry of R\^T R - 1 is 0.21"),
        ({"target": np.diag([1.0, 1, -1])}, "determinant is -1, a reflection"),
        ({"target": np.full((3, 3), np.nan)}, "nan; a rotation is finite"),
        ({"target": np.eye(2)}, r"`target` has shape \(2, 2\); it must be \(3, 3\)"),
        ({"twist_limit": 0.0}, "`twist_limit` is 0.0; it must be one positive number"),
        ({"bend_limit": -1.0}, "`bend_limit` is -1.0; it must be one positive number"),
        ({"bend_limit": np.nan}, "`bend_limit` is nan; it must be one positive number"),
        ({"max_manoeuvres": 0}, "`max_manoeuvres` is 0; it must be a positive integer"),
        ({"tolerance": -1e-9}, "`tolerance` is -1e-09"),
        ({"objective": "time"}, "`objective` is 'time'; it must be one of 'count', 'travel'"),
        ({"vocabulary": "C"}, "`vocabulary` is 'C'"),
        ({"layout": reojax.SIX_BODY}, "`layout` is for 5 joints; 'prototype' has 3"),
        ({"robot": robots.planar(2)}, "has no layout of its own"),
    ],
)
def test_bad_input_is_named(change, message):
    given = {"robot": ROBOT, "target": np.eye(3), **LIMITS, "max_manoeuvres": 3} | change
    with pytest.raises(ValueError, match=message):
        reojax.plan(given.pop("robot"), given.pop("target"), **given)

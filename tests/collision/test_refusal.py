"""Paths that do not keep a clearance are refused, with the pair and the place; those that do have it proven."""

import jax
import numpy as np
import pytest

import reojax
from reojax.collision.refusal import require_clearance

PROTOTYPE = reojax.robots.prototype()
MEETING = reojax.manoeuvre_b(np.deg2rad(-270), np.deg2rad(120))
PASSING = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))


def test_paths_are_refused_or_proven():
    assert require_clearance(PROTOTYPE, PASSING, 0.01).distance >= 0.01
    with pytest.raises(ValueError, match=r"come within 0.0162.* m, between link0 .* and link3 .*, 1.* edges along"):
        require_clearance(PROTOTYPE, PASSING, 0.02)
    with pytest.raises(ValueError, match="parts overlap by 0.01"):
        require_clearance(PROTOTYPE, MEETING, 0.0)


def test_least_time_of_a_path_in_contact_is_refused():
    with pytest.raises(ValueError, match="parts overlap by 0.01"):
        reojax.minimum_time(PROTOTYPE, MEETING, reojax.RE_MAX_17, clearance=0.005)


def test_traced_numbers_are_refused():
    def under_jit(points):
        require_clearance(PROTOTYPE, reojax.Path(points), 0.01)
        return points

    with pytest.raises(ValueError, match="call `path_clearance`"):
        jax.jit(under_jit)(PASSING.waypoints)


def test_robots_without_pairs_are_refused():
    with pytest.raises(ValueError, match="no pairs of shapes"):
        require_clearance(reojax.robots.planar(2), reojax.polygon(np.zeros((2, 1))), 0.01)


def test_capsules_that_make_no_pairs_are_told_apart_from_none():
    caps = [reojax.Capsule(0, (0, 0, 0), (0.1, 0, 0), 0.01), reojax.Capsule(0, (0, 1, 0), (0.1, 1, 0), 0.01)]
    robot = reojax.make_robot(
        mass=np.ones(2),
        com=np.zeros((2, 3)),
        inertia=np.tile(np.eye(3), (2, 1, 1)),
        axis=[[0, 0, 1.0]],
        anchor=np.zeros((1, 3)),
        capsules=caps,
    )
    with pytest.raises(ValueError, match="its capsules are on one link, .* give `collision_pairs`"):
        require_clearance(robot, reojax.polygon(np.zeros((2, 1))), 0.01)

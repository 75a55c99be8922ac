"""Aerial righting: motions that end where they should with angular momentum, against other mechanics."""

import importlib.util

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import RE_MAX_17, robots, so3
from reojax.optimisation.status import Status
from reojax.steering.result import Righting, trajectory_through
from reojax.steering.righting import righting, righting_many

ROBOT = robots.prototype()
INERTIA = np.asarray(reojax.momentum_matrices(ROBOT, np.zeros(3)).A)
TARGETS = np.stack([np.asarray(so3.exp(jnp.asarray(v))) for v in ([0.3, 0.1, 2.0], [0.2, -0.2, 1.0], [0.1, 0.2, -0.6])])
MOMENTA = np.array([[0.3, 0.2, 1.0], [0.2, -0.4, 0.5], [0.0, 0.0, 0.0]]) @ INERTIA
FOUND = righting_many(ROBOT, TARGETS, momenta=MOMENTA, duration=0.62)


def one(i: int) -> Righting:
    return Righting(*(field[i] for field in FOUND))


def test_it_ends_on_the_target_at_rest_and_within_limits():
    """By the simulation with other steps, at the momentum; joints at rest at zero at both ends."""
    assert FOUND.converged.all()
    for i in range(3):
        motion = reojax.simulate(ROBOT, one(i).trajectory, momentum=MOMENTA[i], samples=48)
        assert so3.angle(motion.rotation[-1].T @ TARGETS[i]) < 2e-6
        assert np.abs(np.asarray(motion.theta)[[0, -1]]).max() < 1e-9
        assert np.abs(np.asarray(motion.theta_dot)[[0, -1]]).max() < 1e-6
        assert (np.asarray(motion.theta) <= ROBOT.upper + 1e-4).all()
        assert (np.asarray(motion.theta) >= ROBOT.lower - 1e-4).all()
        np.testing.assert_allclose(motion.omega[-1], FOUND.omega[i], atol=1e-5)


def test_without_momentum_it_is_a_loop_that_turns_the_robot():
    """The net rotation of its path at zero momentum, which does not depend on time."""
    path = reojax.polygon(np.asarray(reojax.simulate(ROBOT, one(2).trajectory, samples=64).theta))
    assert so3.angle(reojax.net_rotation(ROBOT, path, steps=1).T @ TARGETS[2]) < 1e-4


def test_conservation_by_muj_co():
    """Full dynamics with a floating base: the same joints, the same momentum, the same end, within 1e-3 rad."""
    if importlib.util.find_spec("mujoco") is None:
        pytest.skip("needs mujoco")
    from reojax import interop

    foreign = interop.mujoco_model(ROBOT)
    trajectory, rotation, eye = one(0).trajectory, np.eye(3), np.eye(3)
    steps, h = 400, 0.62 / 400
    for k in range(steps):  # omega from MuJoCo's momentum matrix, midpoint rule on the rotation
        state = trajectory.at((k + 0.5) * h)
        inertia, coupling, _ = interop.split(
            interop.mujoco_momentum(foreign, np.asarray(state.theta), np.zeros(3), eye), eye
        )

        def omega(r, inertia=inertia, coupling=coupling, state=state):
            return np.linalg.solve(inertia, coupling @ np.asarray(state.theta_dot) + r.T @ MOMENTA[0])

        half = rotation @ np.asarray(so3.exp(h / 2 * omega(rotation)))
        rotation = rotation @ np.asarray(so3.exp(h * omega(half)))
    assert so3.angle(jnp.asarray(rotation).T @ TARGETS[0]) < 1e-3


def test_motors_are_held():
    """In 0.3 s, the motion found without them asks for more than their supply; with them for less, and it is told."""
    free = righting_many(ROBOT, TARGETS, momenta=MOMENTA, duration=0.3)
    held = righting(ROBOT, TARGETS[0], momentum=MOMENTA[0], duration=0.3, motors=RE_MAX_17)
    assert free.converged[0]
    assert held.converged
    margins = []
    for points in (free.points[0], held.points):
        motion = trajectory_through(points, 0.3)
        driven = reojax.simulate(ROBOT, motion, momentum=MOMENTA[0], motors=RE_MAX_17, samples=64)
        margins.append(np.asarray(driven.margin, float).min())
    assert margins[0] < -0.05
    assert margins[1] > 0
    np.testing.assert_allclose(held.margin, margins[1], atol=3e-3)


@pytest.mark.slow
def test_too_short_for_the_motors():
    """Not converged, with the least duration found; which then does."""
    found = righting(ROBOT, TARGETS[1], momentum=MOMENTA[1], duration=0.12, motors=RE_MAX_17, starts=2, pieces=5)
    assert not found.converged
    assert int(found.status) in (Status.NOT_FOUND, Status.INFEASIBLE)
    assert 0.12 < found.least_duration < 0.8


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"momentum": [0.0, 0.0, 5.0]}, "body rate"),
        ({"momentum": [np.nan, 0, 0]}, "momentum"),
        ({"target": 2 * np.eye(3)}, "no rotation"),
        ({"duration": -1.0}, "positive"),
        ({"duration": None}, "motors"),
        ({"start": [9.0, 0, 0]}, "goes from"),
        ({"weights": [1, 0, 1]}, "positive"),
        ({"clearance": 0.001, "robot": ROBOT.replace(collision_pairs=())}, "collision pairs"),
    ],
)
def test_what_it_refuses(options, said):
    given = {"robot": ROBOT, "target": np.eye(3), "momentum": np.zeros(3), "duration": 0.5} | options
    with pytest.raises(ValueError, match=said):
        righting(given.pop("robot"), given.pop("target"), **given)


@pytest.mark.slow
def test_clearance_is_proven_along_the_whole_motion():
    """No sample between the nodes is nearer than what is said, and what is said is not far from the nearest."""
    found = righting(ROBOT, TARGETS[1], momentum=MOMENTA[1], duration=0.62, clearance=0.004)
    assert found.converged
    assert found.clearance > 0.004 - 1.1e-4
    times = np.linspace(0, 0.62, 1501)
    postures = jax.vmap(found.trajectory.at)(times).theta
    sampled = np.asarray(jax.vmap(lambda theta: reojax.clearance(ROBOT, theta))(postures)).min()
    assert found.clearance <= sampled < found.clearance + 5e-4
    assert np.isnan(FOUND.clearance).all()
    with pytest.raises(ValueError, match="posture at the start has only"):
        righting(ROBOT, TARGETS[1], momentum=MOMENTA[1], duration=0.62, clearance=0.5)

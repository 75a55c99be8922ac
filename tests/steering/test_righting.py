"""Aerial righting: motions that end where they should with angular momentum, against other mechanics."""

import importlib.util

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import RE_MAX_17, robots, so3
from reojax.optimisation.status import Status
from reojax.steering.limits import nearest
from reojax.steering.result import Righting, trajectory_through
from reojax.steering.righting import righting, righting_many, task_of
from reojax.steering.search import least_durations
from reojax.steering.starts import RobotKey, starts_of

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


def test_the_end_may_be_turned_about_an_axis_of_the_base():
    """Feet down, facing anywhere: the axis ends where the target has it, with less effort than the whole target."""
    found = righting_many(ROBOT, TARGETS, momenta=MOMENTA, duration=0.62, about=[0, 0, 2.0])
    assert found.converged.all()
    assert (found.error < 1e-6).all()
    turned = []
    for i in range(3):
        own = Righting(*(field[i] for field in found))
        end = np.asarray(reojax.simulate(ROBOT, own.trajectory, momentum=MOMENTA[i], samples=48).rotation[-1])
        assert np.abs(end[:, 2] - TARGETS[i][:, 2]).max() < 2e-6
        turned.append(float(so3.angle(end.T @ TARGETS[i])))
    assert max(turned) > 0.1
    assert found.effort.sum() < 0.9 * FOUND.effort.sum()


def test_the_nearest_end():
    """`nearest` against a search over all turns about the axis; for no axis, the goal itself."""
    task = task_of(ROBOT, MOMENTA, 0.62, None, None, None, None, None, None, [1.0, 2.0, -1.0])[0]
    rng = np.random.default_rng(0)
    turns = np.linspace(-np.pi, np.pi, 721)[:, None] * np.asarray(task.about)
    for _ in range(5):
        goal, now = (np.asarray(so3.exp(jnp.asarray(v))) for v in rng.normal(size=(2, 3)))
        best = so3.angle(now.T @ nearest(task, goal, now))
        others = jax.vmap(lambda turn, goal=goal, now=now: so3.angle(now.T @ goal @ so3.exp(turn)))(turns)
        assert best <= others.min() + 1e-12
        assert best > others.min() - 1e-2
        none = task._replace(about=np.zeros(3))
        np.testing.assert_allclose(nearest(none, goal, now), goal, atol=1e-15)


def test_loops_turn_further_than_random_motions():
    """Of a robot of many joints, whose random motions turn it little."""
    robot = robots.planar(8)
    key = RobotKey(robot)
    still = np.zeros(robot.joints).tobytes()
    turns = np.asarray(jax.vmap(so3.angle)(starts_of(key, 8, 0, still, still).ends))
    middle = len(turns) // 2
    assert np.median(turns[middle:]) > 2 * np.median(turns[:middle])


def test_least_durations_of_many_releases():
    """Of releases that can do with durations known beforehand: each is found from above, to a few per cent."""
    least = np.array([0.31, 0.62, 0.7, 1.9, 40.0])
    count = len(least)
    calls = []

    class Known:
        def __call__(self, goals, momenta, durations, guesses=None):
            calls.append(len(goals))
            can = np.asarray(durations) >= least[np.asarray(goals, int)]
            m = len(goals)
            row = {name: np.zeros(m) for name in Righting._fields}
            row |= {"momentum": np.zeros((m, 3)), "omega": np.zeros((m, 3)), "rotation": np.zeros((m, 3, 3))}
            row |= {"duration": np.array(durations, float), "converged": can, "points": np.zeros((m, 8, 3))}
            return Righting(**(row | {"least_duration": np.full(m, np.nan)}))

    numbers = np.arange(count)
    first = Known()(numbers, numbers, np.full(count, 0.62))
    found = least_durations(Known(), first, numbers, numbers, keep=False)
    np.testing.assert_array_equal(found.converged, [True] * 4 + [False])
    ratio = found.duration[:4] / least[:4]
    assert (ratio >= 1).all()
    assert (ratio < 1.05).all()
    np.testing.assert_array_equal(found.least_duration[:4], found.duration[:4])
    assert np.isnan(found.least_duration[4])
    kept = least_durations(Known(), first, numbers, numbers, keep=True)
    np.testing.assert_array_equal(kept.duration, np.full(count, 0.62))
    assert np.isnan(kept.least_duration[[0, 1, 4]]).all()
    assert (kept.least_duration[[2, 3]] >= least[[2, 3]]).all()
    assert max(calls) == count


@pytest.mark.slow
def test_least_times_within_the_motors():
    """Side by side: each within its motors by the simulation, and near to what they can do."""
    found = righting_many(ROBOT, TARGETS[:2], momenta=MOMENTA[:2], duration=None, motors=RE_MAX_17, starts=3, pieces=5)
    assert found.converged.all()
    np.testing.assert_array_equal(found.duration, found.least_duration)
    for i in range(2):
        own = Righting(*(field[i] for field in found))
        motion = reojax.simulate(ROBOT, own.trajectory, momentum=MOMENTA[i], motors=RE_MAX_17, samples=64)
        assert so3.angle(motion.rotation[-1].T @ TARGETS[i]) < 1e-5
        assert -3e-3 < np.asarray(motion.margin).min() < 0.3


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
        ({"about": [0, 0, 0]}, "direction"),
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

"""The proven clearance along a path: never above what dense samples find, never further below than asked."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from test_clearance import arm

import reojax
from reojax.collision.chains import acceleration_bound, geometry_of, links_between, structure_of, unit_axes
from reojax.collision.clearance import clearances
from reojax.collision.path_clearance import least_clearance, posture_at

PROTOTYPE = reojax.robots.prototype()
DEGREE = np.pi / 180
path_clearance = jax.jit(reojax.path_clearance)
dense = jax.jit(clearances)


def sampled(robot, waypoints, count=10_000):
    """Clearances (p, s) at many postures along a path, and where they are."""
    at = np.linspace(0, len(waypoints) - 1, count)
    postures = np.stack([np.interp(at, np.arange(len(waypoints)), column) for column in np.asarray(waypoints).T], 1)
    return np.asarray(dense(robot, postures)), at


def paths(robot, count, edges, size, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (count, edges + 1, robot.joints)) * size


@pytest.mark.parametrize(
    ("robot", "size"),
    [(PROTOTYPE, np.array([270, 120, 270]) * DEGREE), (arm(), 2.0), (reojax.robots.six_body(), 2.0)],
    ids=["prototype", "tree", "six_body"],
)
def test_proven_bound_against_dense_samples(robot, size):
    """Of random paths, colliding ones among them: below every sample, within the tolerance of the least one."""
    for waypoints in paths(robot, 12, 4, size):
        result = path_clearance(robot, reojax.Path(waypoints))
        least = sampled(robot, waypoints)[0].min()
        assert result.distance <= least + 1e-15
        assert result.found >= result.distance
        assert result.found - result.distance <= 1e-4
        here = reojax.clearance(robot, posture_at(waypoints, result.at))
        np.testing.assert_allclose(here[result.pair], result.found, atol=1e-12)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-6])
def test_tolerance_is_kept(tolerance):
    for waypoints in paths(PROTOTYPE, 4, 4, 2.0, seed=5):
        result = path_clearance(PROTOTYPE, reojax.Path(waypoints), tolerance=tolerance)
        assert result.found - result.distance <= tolerance
        assert result.distance <= sampled(PROTOTYPE, waypoints)[0].min() + 1e-15


def test_short_touch_between_far_corners_is_found():
    """A path that strikes for a hundredth of an edge only: two feet pass through each other within a long edge."""
    robot = reojax.make_robot(
        mass=[1, 1, 1],
        com=np.zeros((3, 3)),
        inertia=[np.eye(3) * 1e-2] * 3,
        axis=[[0, 0, 1], [0, 0, 1]],
        anchor=[[0, 0, 0], [0, 0, 0]],
        parent=[0, 0],
        capsules=[
            reojax.Capsule(1, (1.0, 0, 0), (1.0, 0, 0.3), 0.005),
            reojax.Capsule(2, (1.0, 0, 0.1), (1.0, 0, 0.2), 0.005),
        ],
        collision_pairs=[(0, 1)],
    )
    for meet in np.random.default_rng(2).uniform(0.05, 0.95, 20):
        path = reojax.polygon([[0, 6 * meet], [6, 6 * meet]])
        result = path_clearance(robot, path)
        assert result.distance < 0
        assert result.at == pytest.approx(meet, abs=0.002)


def test_known_collision_of_the_prototype():
    """`manoeuvre_b(-270 deg, 120 deg)` makes the feet meet; A at 270/120 and B the other way pass."""
    meeting = path_clearance(PROTOTYPE, reojax.manoeuvre_b(-270 * DEGREE, 120 * DEGREE))
    assert meeting.distance < -0.005
    for clear in (reojax.manoeuvre_a, reojax.manoeuvre_b):
        assert path_clearance(PROTOTYPE, clear(270 * DEGREE, 120 * DEGREE)).distance > 0.01


def test_acceleration_bound_holds():
    """The second derivative of the vector between any two points of a pair, seen from its frame, by differences."""
    robot = arm(capsules=8)
    structure, geometry = structure_of(robot), unit_axes(geometry_of(robot), np.dtype(float))
    rng = np.random.default_rng(1)
    from reojax.collision.placement import pair_ends_from_between

    ends = jax.jit(lambda theta: pair_ends_from_between(structure, geometry, theta))
    for _ in range(10):
        start, turn = rng.uniform(-3, 3, (2, robot.joints))
        bound = np.asarray(acceleration_bound(structure, geometry, jnp.asarray(turn)[:, None]))[:, 0]
        s = np.linspace(0, 1, 401)
        a0, a1, b0, b1 = (np.asarray(x) for x in ends(jnp.asarray(start[:, None] + turn[:, None] * s)))
        for a in (a0, a1):
            for b in (b0, b1):
                second = np.diff(a - b, 2, axis=2) / (s[1] - s[0]) ** 2
                assert (np.linalg.norm(second, axis=0).max(1) <= bound * (1 + 1e-4) + 1e-6).all()


def test_one_joint_bound_is_reached():
    """About one joint the bound is the centripetal acceleration itself, so that nothing is given away."""
    robot = PROTOTYPE
    structure, geometry = structure_of(robot), unit_axes(geometry_of(robot), np.dtype(float))
    bound = acceleration_bound(structure, geometry, jnp.array([[2.0], [0.0], [0.0]]))
    foot_and_middle = structure.pairs.index((1, 4))
    tip = np.asarray(robot.capsule_end[1])
    np.testing.assert_allclose(bound[foot_and_middle, 0], 4.0 * np.hypot(tip[0], tip[1]), rtol=1e-12)


def test_waypoints_that_repeat_and_paths_that_stay():
    """Padding a path changes nothing; a posture alone has its own clearance; one waypoint is a path."""
    path = reojax.manoeuvre_a(1.0, 1.0)
    padded = np.concatenate([path.waypoints, np.repeat(path.waypoints[-1:], 3, 0)])
    here, there = path_clearance(PROTOTYPE, path), path_clearance(PROTOTYPE, reojax.Path(padded))
    np.testing.assert_allclose(here.distance, there.distance, atol=1e-4)
    theta = np.array([0.3, 1.0, -2.0])
    for points in (theta[None], np.tile(theta, (3, 1))):
        result = path_clearance(PROTOTYPE, reojax.polygon(points))
        np.testing.assert_allclose(result.distance, reojax.clearance(PROTOTYPE, theta).min(), atol=1e-12)
        assert result.at == 0


def test_edges_of_many_turns():
    """Forty radians on an edge."""
    waypoints = np.array([[0.0, 1.0, 0.0], [40.0, 1.2, -37.0]])
    result = path_clearance(PROTOTYPE, reojax.Path(waypoints))
    least = sampled(PROTOTYPE, waypoints, 40_000)[0].min()
    assert least - 1e-4 <= result.distance <= least + 1e-15


def test_single_precision():
    """float32 in, float32 out, below what float64 samples find, and by little."""
    robot = jax.tree.map(lambda leaf: np.asarray(leaf, np.float32), PROTOTYPE)
    exact = jax.tree.map(lambda leaf: np.asarray(leaf, np.float64), robot)
    for waypoints in paths(PROTOTYPE, 6, 4, 3.0, seed=3).astype(np.float32):
        result = path_clearance(robot, reojax.Path(waypoints))
        assert result.distance.dtype == np.float32
        least = sampled(exact, waypoints.astype(float))[0].min()
        assert least - 3e-4 <= float(result.distance) <= least


def test_many_paths_at_once():
    """`vmap` gives what single calls give."""
    many = paths(PROTOTYPE, 5, 4, 2.0, seed=8)
    batch = jax.jit(jax.vmap(lambda waypoints: reojax.path_clearance(PROTOTYPE, reojax.Path(waypoints))))(many)
    for i, waypoints in enumerate(many):
        single = path_clearance(PROTOTYPE, reojax.Path(waypoints))
        np.testing.assert_allclose(batch.distance[i], single.distance, atol=1e-12)
        assert batch.pair[i] == single.pair


@pytest.mark.slow
def test_derivative_is_that_of_the_closest_place():
    """By the waypoints, against differences."""
    waypoints = paths(PROTOTYPE, 1, 3, 2.0, seed=4)[0]
    sharp = jax.jit(lambda points: reojax.path_clearance(PROTOTYPE, reojax.Path(points), tolerance=1e-9).distance)
    gradient = jax.jit(jax.grad(sharp))(waypoints)
    change = np.random.default_rng(5).normal(size=waypoints.shape)
    h = 1e-4
    numeric = (sharp(waypoints + h * change) - sharp(waypoints - h * change)) / (2 * h)
    np.testing.assert_allclose((gradient * change).sum(), numeric, atol=1e-4)


def test_early_stops():
    """Enough is known at the first sample below a clearance, or once a margin is proven."""
    points = reojax.manoeuvre_a(270 * DEGREE, 120 * DEGREE).waypoints  # 16.3 mm
    assert float(least_clearance(PROTOTYPE, points, 1e-9, 0.005, 0.005).distance) >= 0.005
    assert float(least_clearance(PROTOTYPE, points, 1e-9, 0.02, 0.02).found) < 0.02


def test_a_robot_without_pairs_is_always_clear():
    result = reojax.path_clearance(reojax.robots.planar(2), reojax.polygon([[0.0], [3.0]]))
    assert (result.distance, result.pair, result.at) == (np.inf, -1, 0)


def test_chains_go_up_and_down_the_tree():
    assert links_between((0, 1, 1, 3), 2, 4) == [2, 1, 3, 4]
    assert links_between((0, 1, 1, 3), 4, 0) == [4, 3, 1, 0]


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan, "1"])
def test_tolerance_must_be_positive(tolerance):
    with pytest.raises(ValueError, match="`tolerance`"):
        reojax.path_clearance(PROTOTYPE, reojax.polygon(np.zeros((2, 3))), tolerance=tolerance)


def test_path_must_fit():
    with pytest.raises(ValueError, match="waypoints of 2 joint angles"):
        reojax.path_clearance(PROTOTYPE, reojax.polygon(np.zeros((2, 2))))

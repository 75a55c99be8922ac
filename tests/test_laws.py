"""Laws that the net rotation of any free-floating robot obeys, and how well the integration keeps them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from random_robots import random_link, random_robot, random_unit
from scipy.spatial.transform import Rotation

import reojax
from reojax import make_robot, manoeuvre_a, manoeuvre_b, net_rotation, polygon, rotation_history

SERIAL = random_robot(1, 3)
TREE = random_robot(4, 3, branched=True)
ROBOTS = pytest.mark.parametrize("robot", [SERIAL, TREE], ids=["serial", "tree"])
FINE = 12
"""Steps per edge that leave no error of integration."""
ROUNDING = 1e-13
"""What is left then [rad]."""
INTEGRATION = 1e-9
"""Promised error of the default number of steps [rad]."""
ORDER = 10
"""The integration's error falls at least with this power of the step, see `net_rotation`."""


def corners(seed: int, count: int, joints: int = 3) -> np.ndarray:
    """Random corners of a path, up to 2 rad from zero."""
    return np.random.default_rng([7, seed]).uniform(-2, 2, (count, joints))


def loop(seed: int, count: int = 4, joints: int = 3) -> np.ndarray:
    """Corners of a closed path that does not begin at zero."""
    points = corners(seed, count, joints)
    return np.concatenate([points, points[:1]])


LOOP = loop(8)
OPEN = corners(0, 4)


def turned(robot, waypoints, steps: int = FINE) -> np.ndarray:
    return np.asarray(net_rotation(robot, polygon(waypoints), steps=steps))


def distance(rotation, exact) -> float:
    """Angle between two rotations that are close [rad]."""
    assert np.shape(rotation) == np.shape(exact) == (3, 3)
    return np.linalg.norm(np.asarray(rotation) - exact) / np.sqrt(2)


def turn(vector) -> np.ndarray:
    return Rotation.from_rotvec(vector).as_matrix()


def log(rotation) -> np.ndarray:
    return Rotation.from_matrix(np.asarray(rotation)).as_rotvec()


def poses(robot, theta) -> list[np.ndarray]:
    """Orientation of each link in the base frame."""
    result = [np.eye(3)]
    for k, p in enumerate(robot.parent):
        result.append(result[p] @ turn(theta[k] * robot.axis[k]))
    return result


def remade(robot, **changes) -> reojax.Robot:
    """The robot with some entries changed, through the door; changed arrays may have other sizes."""
    names = ("mass", "com", "inertia", "axis", "anchor", "parent", "rotor_inertia", "gear_ratio", "rotor_on")
    return make_robot(**{name: getattr(robot, name) for name in names} | changes)


def test_the_paths_turn_the_robots():
    """The laws below speak of rotations that are large."""
    for robot in (SERIAL, TREE):
        for waypoints in (corners(0, 4), LOOP, loop(2)):
            assert 0.1 < np.linalg.norm(log(turned(robot, waypoints)))


# --- the path ----------------------------------------------------------------------------------------------


@ROBOTS
def test_a_retraced_path_gives_nothing(robot):
    there = OPEN[:3]
    assert distance(turned(robot, np.concatenate([there, there[-2::-1]])), np.eye(3)) < ROUNDING


@ROBOTS
@pytest.mark.parametrize("waypoints", [LOOP, OPEN], ids=["loop", "open"])
def test_a_reversed_path_undoes(robot, waypoints):
    assert distance(turned(robot, waypoints[::-1]), turned(robot, waypoints).T) < ROUNDING


@ROBOTS
def test_paths_in_succession_multiply(robot):
    """In the order in which they are run, each in the frame where the last one ended."""
    points = corners(4, 5)
    product = turned(robot, points[:3]) @ turned(robot, points[2:])
    assert distance(turned(robot, points), product) < ROUNDING


@ROBOTS
@pytest.mark.parametrize("waypoints", [LOOP, OPEN], ids=["loop", "open"])
def test_the_time_law_does_not_matter(robot, waypoints):
    """Every edge run in three uneven pieces: other instants, other speeds, the same path."""
    pieces = [a + np.outer([0.0, 0.13, 0.71], b - a) for a, b in zip(waypoints, waypoints[1:], strict=False)]
    split = np.concatenate([*pieces, waypoints[-1:]])
    assert distance(turned(robot, split), turned(robot, waypoints)) < ROUNDING


@ROBOTS
def test_standing_still_changes_nothing(robot):
    """Corners repeated at the end, or anywhere, and a path of one corner."""
    points = OPEN[:3]
    still = np.repeat(points, [2, 1, 2], axis=0)
    assert distance(turned(robot, still), turned(robot, points)) < ROUNDING
    assert np.array_equal(turned(robot, points[:1]), np.eye(3))


@ROBOTS
def test_whole_turns_of_the_joints_change_nothing(robot):
    """The same shapes, described by angles a few turns away."""
    moved = LOOP + 2 * np.pi * np.array([3, -1, 40])
    assert distance(turned(robot, moved), turned(robot, LOOP)) < ROUNDING


# --- the description ---------------------------------------------------------------------------------------


@ROBOTS
def test_only_ratios_of_masses_matter(robot):
    heavier = robot.replace(
        mass=7 * robot.mass, inertia=7 * robot.inertia, rotor_inertia=7 * robot.rotor_inertia
    )
    assert distance(turned(heavier, LOOP), turned(robot, LOOP)) < ROUNDING


@ROBOTS
def test_only_ratios_of_lengths_matter(robot):
    k = 0.04
    smaller = robot.replace(
        com=k * robot.com,
        anchor=k * robot.anchor,
        inertia=k**2 * robot.inertia,
        rotor_inertia=k**2 * robot.rotor_inertia,
    )
    assert distance(turned(smaller, LOOP), turned(robot, LOOP)) < ROUNDING


@ROBOTS
def test_a_rotor_is_its_inertia_times_its_ratio(robot):
    """A slow heavy rotor and a fast light one that turns the other way on the other side are the same."""
    other = {"parent": "child", "child": "parent"}
    same = robot.replace(
        rotor_inertia=robot.rotor_inertia / 5,
        gear_ratio=-5 * robot.gear_ratio,
        rotor_on=[other[side] for side in robot.rotor_on],
    )
    assert distance(turned(same, LOOP), turned(robot, LOOP)) < ROUNDING


@ROBOTS
def test_turned_axes_of_the_description(robot):
    """The robot described in axes turned by Q turns by `Q R Q^T`."""
    Q = turn([0.4, -1.9, 0.8])
    vectors = {name: getattr(robot, name) @ Q.T for name in ("com", "axis", "anchor")}
    described = robot.replace(inertia=Q @ robot.inertia @ Q.T, **vectors)
    for waypoints in (LOOP, OPEN):
        assert distance(turned(described, waypoints), Q @ turned(robot, waypoints) @ Q.T) < ROUNDING


@ROBOTS
def test_moved_origins_of_the_description(robot):
    """The base frame's origin may lie anywhere, and each joint's anywhere along its axis."""
    moved = robot
    com, anchor = np.array(robot.com), np.array(robot.anchor)
    shifts = [
        np.array([0.3, -0.2, 0.5]),
        *(d * axis for d, axis in zip((0.2, -0.4, 0.1), robot.axis, strict=True)),
    ]
    for link, shift in enumerate(shifts):
        com[link] -= shift
        for k, p in enumerate(robot.parent):
            anchor[k] -= shift if p == link else 0
            anchor[k] += shift if k + 1 == link else 0
    moved = robot.replace(com=com, anchor=anchor)
    assert distance(turned(moved, LOOP), turned(robot, LOOP)) < ROUNDING


@ROBOTS
def test_reversed_axes_of_the_joints(robot):
    """A joint angle counted the other way about the opposite axis; the rotor's spin is counted likewise."""
    sign = np.array([-1.0, 1.0, -1.0])
    described = robot.replace(axis=sign[:, None] * robot.axis)
    assert distance(turned(described, sign * LOOP), turned(robot, LOOP)) < ROUNDING


@ROBOTS
def test_another_zero_of_the_joint_angles(robot):
    """All frames parallel, and all angles zero, at another shape."""
    zero = np.array([0.9, -0.4, 2.0])
    pose = poses(robot, zero)
    described = robot.replace(
        com=np.stack([Q @ c for Q, c in zip(pose, robot.com, strict=True)]),
        inertia=np.stack([Q @ inertia @ Q.T for Q, inertia in zip(pose, robot.inertia, strict=True)]),
        axis=np.stack([pose[p] @ e for p, e in zip(robot.parent, robot.axis, strict=True)]),
        anchor=np.stack([pose[p] @ a for p, a in zip(robot.parent, robot.anchor, strict=True)]),
    )
    assert distance(turned(described, LOOP - zero), turned(robot, LOOP)) < ROUNDING


def test_relabelled_branches():
    """A tree of six links whose links and joints are numbered in another order."""
    robot = remade(random_robot(3, 5), parent=[0, 0, 1, 1, 2])
    order = np.array([1, 0, 4, 2, 3])  # joint of the old description at each place of the new
    links = np.concatenate([[0], order + 1])
    place = {old: new for new, old in enumerate(links.tolist())}
    relabelled = remade(
        robot,
        **{name: getattr(robot, name)[links] for name in ("mass", "com", "inertia")},
        **{name: getattr(robot, name)[order] for name in ("axis", "anchor", "rotor_inertia", "gear_ratio")},
        parent=[place[robot.parent[k]] for k in order],
        rotor_on=[robot.rotor_on[k] for k in order],
    )
    assert relabelled.parent == (0, 0, 1, 2, 2)
    waypoints = loop(8, joints=5)
    assert distance(turned(relabelled, waypoints[:, order]), turned(robot, waypoints)) < ROUNDING


def rerooted(robot: reojax.Robot, base: int) -> tuple[reojax.Robot, list[int]]:
    """The same robot described from another base link, and the old joint at each place of the new order.

    Joints between the old base and the new one change direction: the old child carries the old parent about
    the opposite axis, from a frame on the joint. What sat on the parent sits on the child; the rotor's spin
    relative to it is unchanged, counted about the opposite axis.
    """
    upward = []
    while not upward or upward[-1] != 0:
        upward.append(base if not upward else robot.parent[upward[-1] - 1])
    shift = np.zeros((robot.links, 3))  # new origin of each link's frame, in its old one
    for child, parent in zip(upward, upward[1:], strict=False):
        shift[parent] = robot.anchor[child - 1]
    links, order, parents, entries = [base], [], [], []
    while len(order) < robot.joints:
        for k, p in enumerate(robot.parent):
            ends = (p, k + 1)
            if k not in order and (ends[0] in links) != (ends[1] in links):
                reverse = ends[1] in links
                near, far = ends[::-1] if reverse else ends
                place = np.zeros(3) if reverse else robot.anchor[k]  # of the joint in the old frame of `near`
                other = {"parent": "child", "child": "parent"}[robot.rotor_on[k]]
                parents.append(links.index(near))
                entries.append(
                    (
                        -robot.axis[k] if reverse else robot.axis[k],
                        place - shift[near],
                        other if reverse else robot.rotor_on[k],
                    )
                )
                order.append(k)
                links.append(far)
    axis, anchor, side = zip(*entries, strict=True)
    return make_robot(
        mass=robot.mass[links],
        com=(robot.com - shift)[links],
        inertia=robot.inertia[links],
        axis=axis,
        anchor=anchor,
        parent=parents,
        rotor_inertia=robot.rotor_inertia[order],
        gear_ratio=robot.gear_ratio[order],
        rotor_on=side,
    ), order


@pytest.mark.parametrize("base", [1, 2, 3])
@ROBOTS
def test_another_base_link_gives_a_conjugate(robot, base):
    """`R_base = Q_start^T R Q_end`, with Q the pose of the new base on the old one; for loops a conjugate."""
    described, order = rerooted(robot, base)
    for waypoints in (LOOP, OPEN):
        start, end = (poses(robot, theta)[base] for theta in (waypoints[0], waypoints[-1]))
        exact = start.T @ turned(robot, waypoints) @ end
        assert distance(turned(described, waypoints[:, order]), exact) < ROUNDING


def test_a_joint_that_does_not_move_may_be_welded():
    """Links 1 and 2 made one body by the parallel axis theorem; the rotors of the other joints stay."""
    robot, angle = SERIAL, 0.7
    Q = turn(angle * robot.axis[1])
    m = robot.mass[1:3]
    com = np.stack([robot.com[1], robot.anchor[1] + Q @ robot.com[2]])
    middle = m @ com / m.sum()
    inertia = robot.inertia[1] + Q @ robot.inertia[2] @ Q.T
    for mass, arm in zip(m, com - middle, strict=True):
        inertia = inertia + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    welded = make_robot(
        mass=[robot.mass[0], m.sum(), robot.mass[3]],
        com=[robot.com[0], middle, Q @ robot.com[3]],
        inertia=[robot.inertia[0], inertia, Q @ robot.inertia[3] @ Q.T],
        axis=[robot.axis[0], Q @ robot.axis[2]],
        anchor=[robot.anchor[0], robot.anchor[1] + Q @ robot.anchor[2]],
        rotor_inertia=robot.rotor_inertia[[0, 2]],
        gear_ratio=robot.gear_ratio[[0, 2]],
        rotor_on=[robot.rotor_on[0], robot.rotor_on[2]],
    )
    waypoints = loop(9, joints=2)
    still = np.insert(waypoints, 1, angle, axis=1)
    assert distance(turned(welded, waypoints), turned(robot, still)) < ROUNDING


# --- symmetric robots --------------------------------------------------------------------------------------

MIRROR = np.diag([-1.0, 1.0, 1.0])
HALF_TURN = np.diag([-1.0, -1.0, 1.0])


def symmetric_robot(seed: int, symmetry: np.ndarray, centre_rotor: float = 0.0) -> reojax.Robot:
    """Four links of which the last two are images of the first two, under a mirror or a half turn.

    The base frame's origin is on the centre joint, whose axis is free in the plane that the symmetry
    allows. Each distal motor sits on the inner link; a rotor of the centre joint breaks the symmetry.
    """
    rng = np.random.default_rng([11, seed])
    masses, coms, inertias = zip(*(random_link(rng) for _ in range(2)), strict=True)
    place = np.array([-0.2, 0.0, 0.0]) + 0.05 * rng.normal(size=3)
    outer, inner = np.array([-0.4, 0.0, 0.0]) + coms[0], np.array([-0.1, 0.0, 0.0]) + coms[1]
    distal = random_unit(rng, 1)[0]
    centre = np.array([0.0, 0.8, 0.6]) if symmetry is MIRROR else np.array([0.6, 0.8, 0.0])
    return make_robot(
        mass=[*masses, *masses[::-1]],
        com=[outer, inner - place, symmetry @ inner, symmetry @ (outer - place)],
        inertia=[*inertias, *(symmetry @ inertia @ symmetry for inertia in inertias[::-1])],
        axis=[distal, centre, -symmetry @ distal],
        anchor=[place, -place, symmetry @ place],
        rotor_inertia=[2e-5, centre_rotor, 2e-5],
        gear_ratio=[24.0, 24.0, 24.0],
        rotor_on=["child", "parent", "parent"],
    )


@pytest.mark.parametrize(
    ("manoeuvre", "symmetry", "pure"), [(manoeuvre_a, MIRROR, 0), (manoeuvre_b, HALF_TURN, 2)], ids=["A", "B"]
)
def test_symmetry_makes_the_rotation_pure(manoeuvre, symmetry, pure):
    """A is pure roll for a mirror-symmetric robot, B pure yaw for one with a half turn's symmetry."""
    for seed in range(3):
        for twist, bend in ((2.0, 1.0), (-4.7, 2.1)):
            path = manoeuvre(twist, bend)
            vector = log(net_rotation(symmetric_robot(seed, symmetry), path, steps=16))
            impure = log(net_rotation(symmetric_robot(seed, symmetry, 2e-5), path, steps=16))
            off_axis = [np.linalg.norm(np.delete(v, pure)) for v in (vector, impure)]
            assert abs(vector[pure]) > 1e-2
            assert off_axis[0] < ROUNDING
            assert off_axis[1] > 1e-4


@pytest.mark.parametrize(
    ("manoeuvre", "part", "powers"), [(manoeuvre_a, 0, (1, 2)), (manoeuvre_b, 2, (1, 1))], ids=["A", "B"]
)
def test_small_manoeuvres_grow_as_powers(manoeuvre, part, powers):
    """A turns by about twist * bend^2, B by about twist * bend, on a robot straight and slender as a cat."""
    end, middle = np.diag([2e-4, 6e-4, 7e-4]), np.diag([1e-4, 3e-4, 2e-4])
    robot = make_robot(
        mass=[0.2, 0.1, 0.1, 0.2],
        com=np.outer([-0.05, 0.03, 0.02, 0.05], [1, 0, 0]),
        inertia=[end, middle, middle, end],
        axis=[[1, 0, 0], [0, 1, 0], [1, 0, 0]],
        anchor=np.outer([0.0, 0.05, 0.05], [1, 0, 0]),
        rotor_inertia=[1e-7, 0, 1e-7],
        gear_ratio=[24.0, 1.0, 24.0],
        rotor_on=["child", "parent", "parent"],
    )

    def size(twist, bend):
        return abs(log(net_rotation(robot, manoeuvre(twist, bend)))[part])

    small = 0.02
    measured = np.log2(
        [size(small, small) / size(small / 2, small), size(small, small) / size(small, small / 2)]
    )
    np.testing.assert_allclose(measured, powers, atol=2e-3)
    large = [size(2.0, 1.5) / size(1.0, 1.5), size(2.0, 1.5) / size(2.0, 0.75)]
    assert np.abs(np.log2(large) - powers).max() > 0.05  # powers are for small ones


# --- the integration ---------------------------------------------------------------------------------------


@ROBOTS
def test_default_steps_keep_the_promise(robot):
    for waypoints in (LOOP, OPEN):
        assert distance(net_rotation(robot, polygon(waypoints)), turned(robot, waypoints)) < INTEGRATION


@ROBOTS
def test_order_of_convergence(robot):
    """Halving the steps of a long edge divides the error by `2^ORDER` at least, until it reaches rounding."""
    waypoints = np.array([[-3.0, -1.0, 2.0], [2.0, 3.0, -3.0]])
    exact = turned(robot, waypoints, steps=64)
    error = np.array([distance(turned(robot, waypoints, steps=n), exact) for n in (2, 4, 8)])
    assert error[0] > 1e-6  # there was something to gain
    slope = np.log2(error[:-1] / error[1:])
    assert np.all((slope > ORDER - 0.5) | (error[1:] < ROUNDING))


@ROBOTS
@pytest.mark.parametrize("samples", [1, 4, 7])
def test_history_is_the_net_rotation_so_far(robot, samples):
    """It begins at the identity, ends at the net rotation, and passes through rotations of partial paths."""
    waypoints = OPEN
    history = np.asarray(rotation_history(robot, polygon(waypoints), samples=samples))
    assert history.shape == (3 * samples + 1, 3, 3)
    assert np.array_equal(history[0], np.eye(3))
    assert distance(history[-1], turned(robot, waypoints)) < ROUNDING
    np.testing.assert_allclose(
        history @ history.swapaxes(1, 2), np.tile(np.eye(3), (len(history), 1, 1)), atol=1e-14
    )
    np.testing.assert_allclose(np.linalg.det(history), 1, rtol=1e-14)
    for edge in range(3):
        for i in {1, samples - 1, samples} - {0}:
            point = waypoints[edge] + i / samples * (waypoints[edge + 1] - waypoints[edge])
            padded = np.concatenate([waypoints[: edge + 1], [point] * (3 - edge)])
            assert distance(history[edge * samples + i], turned(robot, padded)) < ROUNDING


@ROBOTS
def test_net_rotation_is_a_rotation(robot):
    rotation = turned(robot, np.random.default_rng(0).uniform(-3, 3, (1001, 3)), steps=3)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-13)
    np.testing.assert_allclose(np.linalg.det(rotation), 1, rtol=1e-13)


@ROBOTS
def test_float32_is_kept_and_right_to_its_precision(robot):
    low = jax.tree.map(lambda leaf: leaf.astype(np.float32), robot)
    for waypoints in (LOOP, OPEN):
        path = polygon(waypoints.astype(np.float32))
        for chosen in (low, robot):
            rotation = net_rotation(chosen, path)
            assert rotation.dtype == np.float32
            assert distance(rotation, turned(robot, waypoints)) < 1e-5
        history = rotation_history(low, path, samples=4)
        assert history.dtype == np.float32
        exact = rotation_history(robot, polygon(waypoints), samples=4)
        np.testing.assert_allclose(history, exact, atol=1e-5)


@ROBOTS
def test_batches_are_their_members(robot):
    """Over paths, and over one array of the robot."""
    paths = np.stack([LOOP, loop(0)])
    batch = jax.vmap(lambda points: net_rotation(robot, polygon(points)))(jnp.asarray(paths))
    ratios = np.stack([robot.gear_ratio, 0 * robot.gear_ratio])
    designs = jax.vmap(lambda ratio: net_rotation(robot.replace(gear_ratio=ratio), polygon(paths[0])))(ratios)
    for i in range(2):
        assert distance(batch[i], turned(robot, paths[i])) < ROUNDING
        assert distance(designs[i], turned(robot.replace(gear_ratio=ratios[i]), paths[0])) < ROUNDING


def test_known_zeros_and_ones_change_nothing():
    """A robot full of zeros, ones and minus ones, known and traced."""
    robot = make_robot(
        mass=[1.0, 2.0, 1.0, 0.5],
        com=[[0, 0, 0], [0, 1, 0], [-1, 0, 0.3], [0, 0, 1]],
        inertia=[
            np.eye(3),
            np.diag([1, 2, 2]),
            [[1, 0.5, 0], [0.5, 1, 0], [0, 0, 1]],
            np.diag([0.2, 0.2, 0.3]),
        ],
        axis=[[1, 0, 0], [0, -1, 0], [0, 0.6, 0.8]],
        anchor=[[0, 0, 0], [1, 0, -1], [0, 0.5, 0]],
        parent=[0, 0, 1],
        rotor_inertia=[0, 1, 0.1],
        gear_ratio=[3, -1, 1],
        rotor_on=["parent", "child", "parent"],
    )
    traced = jax.jit(net_rotation)(robot, polygon(LOOP))
    assert distance(turned(robot, LOOP), traced) < ROUNDING
    assert np.linalg.norm(log(traced)) > 0.1


@pytest.mark.parametrize("function", [net_rotation, lambda *a: rotation_history(*a, samples=2)])
def test_a_path_of_other_joints_is_refused(function):
    with pytest.raises(ValueError, match="`path`.* 2 joint"):
        function(SERIAL, polygon(np.zeros((4, 2))))


@pytest.mark.parametrize("count", [0, -1, 2.0, True])
def test_a_number_of_steps_is_a_positive_integer(count):
    with pytest.raises(ValueError, match="`steps` is"):
        net_rotation(SERIAL, polygon(LOOP), steps=count)
    with pytest.raises(ValueError, match="`samples` is"):
        rotation_history(SERIAL, polygon(LOOP), samples=count)


# --- derivatives -------------------------------------------------------------------------------------------


def vector(robot, waypoints):
    """Rotation vector of the net rotation."""
    return reojax.so3.log(net_rotation(robot, polygon(waypoints)))


@jax.jit
def derivatives(robot, waypoints, rotation):
    """Value, and derivatives by every number of the robot and the path: forward, reverse, by differences.

    Each number in units of the largest of its array. Differences are central, of fourth order; where the
    rotation vector jumps between the two of a half turn, the one near `rotation` is taken.
    """
    numbers, build = ravel_pytree((robot, waypoints))
    largest = jax.tree.map(lambda leaf: jnp.full(leaf.shape, jnp.abs(leaf).max()), (robot, waypoints))
    unit = ravel_pytree(largest)[0]
    unit = jnp.where(unit > 0, unit, 1.0)

    def value(shift):
        return vector(*build(numbers + unit * shift))

    def near(shift):
        v = value(shift)
        other = v - 2 * jnp.pi * v / jnp.linalg.norm(jnp.where(v @ v > 0, v, 1.0))
        return jnp.where(v @ rotation < 0, other, v)

    zero, step = jnp.zeros_like(numbers), 2e-3
    ends = [jax.vmap(near)(c * step * jnp.eye(len(numbers))) for c in (1, -1, 2, -2)]
    difference = (8 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / (12 * step)
    return value(zero), jax.jacfwd(value)(zero), jax.jacrev(value)(zero), difference.T


LIMITED = {"lower": [-3.0] * 3, "upper": [2.0] * 3}
WAYPOINTS = {
    "loop": loop(8, 3),
    "open": OPEN,
    "manoeuvre": np.array(manoeuvre_a(2.0, 1.0).waypoints)[1:],
    "zero": np.zeros((4, 3)),
    "still": np.tile(corners(5, 1), (4, 1)),
}


@ROBOTS
@pytest.mark.parametrize("path", WAYPOINTS)
def test_derivatives_by_every_number_of_the_robot_and_the_path(robot, path):
    """Forward, reverse and differences agree, for an amplitude of zero too; limits have no effect."""
    robot = robot.replace(**LIMITED)
    value, forward, reverse, difference = derivatives(robot, WAYPOINTS[path], np.zeros(3))
    np.testing.assert_allclose(forward, reverse, atol=1e-12)
    np.testing.assert_allclose(forward, difference, atol=1e-8)
    _, build = ravel_pytree((robot, WAYPOINTS[path]))
    slopes = [build(row) for row in np.asarray(forward)]
    assert np.all(np.isfinite(forward))
    by_path = np.stack([slope[1] for slope in slopes])
    assert np.all(np.abs(by_path).max(axis=(0, 1)) > 1e-3)
    for entry in (
        "mass",
        "com",
        "inertia",
        "axis",
        "anchor",
        "rotor_inertia",
        "gear_ratio",
        "lower",
        "upper",
    ):
        sensitive = path not in ("zero", "still") and entry not in ("lower", "upper")
        by_entry = np.stack([getattr(slope[0], entry) for slope in slopes])
        assert (np.abs(by_entry).max() > 1e-5) == sensitive
    moved = path not in ("zero", "still")
    assert (np.linalg.norm(value) > 0.05) == moved


def half_turn() -> tuple[reojax.Robot, np.ndarray]:
    """A robot and a path after which it has made exactly half a turn.

    Both halves of a mirror-symmetric robot turn alike when its centre joint makes a whole turn, and end as
    mirror images in the same pose: the rotation commutes with the mirror, and is no turn about roll.
    """
    path = np.outer([0.0, 2.0, 4.0, 2 * np.pi], [0, 1, 0])
    return symmetric_robot(0, MIRROR).replace(name=SERIAL.name, **LIMITED), path


def test_a_whole_turn_of_the_centre_joint_is_half_a_turn():
    robot, path = half_turn()
    angle = reojax.so3.angle(turned(robot, path))
    assert abs(angle - np.pi) < ROUNDING


def test_derivatives_at_half_a_turn():
    """Of the rotation vector on the branch of its value, and of the angle, up to its sign."""
    robot, path = half_turn()
    rotation = np.asarray(vector(robot, path))
    value, forward, reverse, difference = derivatives(robot, path, rotation)
    assert np.array_equal(value, rotation)
    scale = np.abs(forward).max()
    np.testing.assert_allclose(forward, reverse, atol=1e-12 * scale)
    np.testing.assert_allclose(forward, difference, atol=1e-8 * scale)
    by_path = jax.grad(lambda points: reojax.so3.angle(net_rotation(robot, polygon(points))))(path)
    by_path = np.ravel(by_path) * np.abs(path).max()
    along = rotation / np.linalg.norm(rotation) @ forward[:, -path.size :]
    assert np.abs(along).max() > 0.1
    assert min(np.abs(by_path - along).max(), np.abs(by_path + along).max()) < 1e-9


@pytest.mark.parametrize("manoeuvre", [manoeuvre_a, manoeuvre_b])
def test_derivatives_by_the_amplitudes(manoeuvre):
    """At large amplitudes those of differences; a loop without area is stationary."""

    @jax.jit
    def both(amplitudes):
        def by_amplitudes(x):
            return reojax.so3.log(net_rotation(SERIAL, manoeuvre(x[0], x[1])))

        steps = 1e-3 * jnp.array([[1.0, 0.0], [0.0, 1.0]])
        ends = [jax.vmap(lambda d, c=c: by_amplitudes(amplitudes + c * d))(steps) for c in (1, -1, 2, -2)]
        difference = (8 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / 12e-3
        return jax.jacfwd(by_amplitudes)(amplitudes), jax.jacrev(by_amplitudes)(amplitudes), difference.T

    for amplitudes in ((1.9, 0.8), (0.0, 0.8), (1.9, 0.0), (0.0, 0.0)):
        forward, reverse, difference = both(jnp.array(amplitudes))
        np.testing.assert_allclose(forward, reverse, atol=1e-12)
        np.testing.assert_allclose(forward, difference, atol=1e-9)
        assert (np.abs(forward).max() > 1e-2) == any(amplitudes)

"""Laws that the net rotation of any free-floating robot obeys, and how well the integration keeps them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import reojax
from reojax import make_robot, manoeuvre_a, manoeuvre_b, net_rotation, polygon, rotation_history
from reojax.robots.random import random_link, random_robot, random_unit

SERIAL = random_robot(1, 3)
TREE = random_robot(4, 3, branched=True)
NAME = SERIAL.name
"""Of all robots here: robots of one name and structure share one compiled program."""
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


traced = jax.jit(net_rotation, static_argnames="steps")


def turned(robot, waypoints, steps: int = FINE, edges: int = 12) -> np.ndarray:
    """Net rotation; the last corner is repeated so that all paths share one compiled program."""
    still = np.repeat(waypoints[-1:], edges + 1 - len(waypoints), axis=0)
    return np.asarray(traced(robot, polygon(np.concatenate([waypoints, still])), steps=steps))


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
    """The robot with some entries changed, through the door."""
    names = ("mass", "com", "inertia", "axis", "anchor", "parent", "rotor_inertia", "gear_ratio", "rotor_on")
    return make_robot(**{name: getattr(robot, name) for name in names} | {"name": NAME} | changes)


def test_the_paths_turn_the_robots():
    """The laws below speak of rotations that are large."""
    for robot in (SERIAL, TREE):
        for waypoints in (OPEN, LOOP):
            assert 0.4 < np.linalg.norm(log(turned(robot, waypoints)))


# --- the path --------------------------------------------------------------------------------------------


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
    """Corners repeated anywhere, and a path of one corner."""
    still = np.repeat(LOOP, [2, 1, 2, 1, 3], axis=0)
    assert distance(turned(robot, still), turned(robot, LOOP)) < ROUNDING
    assert np.array_equal(net_rotation(robot, polygon(LOOP[:1])), np.eye(3))


@ROBOTS
def test_whole_turns_of_the_joints_change_nothing(robot):
    """The same shapes, described by angles a few turns away."""
    moved = LOOP + 2 * np.pi * np.array([3, -1, 40])
    assert distance(turned(robot, moved), turned(robot, LOOP)) < ROUNDING


# --- the description -------------------------------------------------------------------------------------


@ROBOTS
def test_only_ratios_of_masses_matter(robot):
    heavier = robot.replace(mass=7 * robot.mass, inertia=7 * robot.inertia, rotor_inertia=7 * robot.rotor_inertia)
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


def test_a_rotor_is_its_inertia_times_its_ratio():
    """A slow heavy rotor and a fast light one that turns the other way on the other side are the same."""
    robot, other = TREE, {"parent": "child", "child": "parent"}
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
    """A tree whose links and joints are numbered in another order."""
    robot, order = TREE, np.array([1, 0, 2])  # joint of the old description at each place of the new
    links = np.concatenate([[0], order + 1])
    place = {old: new for new, old in enumerate(links.tolist())}
    relabelled = remade(
        robot,
        **{name: getattr(robot, name)[links] for name in ("mass", "com", "inertia")},
        **{name: getattr(robot, name)[order] for name in ("axis", "anchor", "rotor_inertia", "gear_ratio")},
        parent=[place[robot.parent[k]] for k in order],
        rotor_on=[robot.rotor_on[k] for k in order],
    )
    assert (robot.parent, relabelled.parent) == ((0, 0, 2), (0, 0, 1))
    assert distance(turned(relabelled, LOOP[:, order]), turned(robot, LOOP)) < ROUNDING


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
        name=NAME,
    ), order


@pytest.mark.parametrize(("robot", "base"), [(SERIAL, 2), (TREE, 3)])
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


# --- symmetric robots ------------------------------------------------------------------------------------

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
        name=NAME,
    )


@pytest.mark.parametrize(
    ("manoeuvre", "symmetry", "pure"), [(manoeuvre_a, MIRROR, 0), (manoeuvre_b, HALF_TURN, 2)], ids=["A", "B"]
)
def test_symmetry_makes_the_rotation_pure(manoeuvre, symmetry, pure):
    """A is pure roll for a mirror-symmetric robot, B pure yaw for one with a half turn's symmetry."""
    for seed in range(3):
        for twist, bend in ((2.0, 1.0), (-4.7, 2.1)):
            path = manoeuvre(twist, bend).waypoints
            pair = [symmetric_robot(seed, symmetry, centre_rotor) for centre_rotor in (0.0, 2e-5)]
            vectors = [log(turned(robot, path)) for robot in pair]
            off_axis = [np.linalg.norm(np.delete(v, pure)) for v in vectors]
            assert abs(vectors[0][pure]) > 1e-2
            assert off_axis[0] < 1e-11
            assert off_axis[1] > 1e-4


def test_a_whole_turn_of_the_centre_joint_is_half_a_turn():
    """Both halves of a mirror-symmetric robot turn alike when its centre joint makes a whole turn.

    They end as mirror images in the same pose, so the rotation commutes with the mirror, and it is no roll.
    """
    path = np.outer([0.0, 2.0, 4.0, 2 * np.pi], [0, 1, 0])
    for seed in range(3):
        angle = reojax.so3.angle(turned(symmetric_robot(seed, MIRROR), path))
        assert abs(angle - np.pi) < ROUNDING


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
        name=NAME,
    )

    def size(twist, bend):
        return abs(log(turned(robot, manoeuvre(twist, bend).waypoints))[part])

    small = 0.02
    measured = np.log2([size(small, small) / size(small / 2, small), size(small, small) / size(small, small / 2)])
    np.testing.assert_allclose(measured, powers, atol=2e-3)
    large = [size(2.0, 1.5) / size(1.0, 1.5), size(2.0, 1.5) / size(2.0, 0.75)]
    assert np.abs(np.log2(large) - powers).max() > 0.05  # powers are for small ones


# --- the integration -------------------------------------------------------------------------------------


def test_default_steps_keep_the_promise():
    robot = SERIAL
    for waypoints in (LOOP, np.array(manoeuvre_a(3.5, 2.1).waypoints)):
        default = np.asarray(net_rotation(robot, polygon(waypoints)))
        assert distance(default, turned(robot, waypoints)) < INTEGRATION


def in_pieces(robot, edge: np.ndarray, count: int) -> np.ndarray:
    """Net rotation along an edge divided into equal ones, in one step each."""
    corners = edge[0] + np.linspace(0, 1, count + 1)[:, None] * (edge[1] - edge[0])
    return turned(robot, corners, steps=1, edges=5000)


def test_order_of_convergence():
    """Halving the steps of a long edge divides the error by `2^ORDER` at least."""
    edge = np.array([[-1.5, -0.5, 1.0], [1.0, 1.5, -1.5]])
    error = np.array([distance(in_pieces(TREE, edge, n), turned(TREE, edge)) for n in (2, 4, 8)])
    assert error[0] > 1e-6
    assert np.all(np.log2(error[:-1] / error[1:]) > ORDER - 0.5)


def test_steps_are_pieces_of_an_edge():
    assert distance(in_pieces(TREE, OPEN[:2], FINE), turned(TREE, OPEN[:2])) < ROUNDING


@pytest.mark.parametrize(("robot", "samples"), [(SERIAL, 1), (TREE, 7)])
def test_history_is_the_net_rotation_so_far(robot, samples):
    """It begins at the identity, ends at the net rotation, and passes through rotations of partial paths."""
    history = np.asarray(rotation_history(robot, polygon(OPEN), samples=samples))
    assert history.shape == (3 * samples + 1, 3, 3)
    assert np.array_equal(history[0], np.eye(3))
    np.testing.assert_allclose(history @ history.swapaxes(1, 2), np.tile(np.eye(3), (len(history), 1, 1)), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(history), 1, rtol=1e-14)
    for edge in range(3):
        for i in range(1, samples + 1):
            end = OPEN[edge] + i / samples * (OPEN[edge + 1] - OPEN[edge])
            so_far = turned(robot, np.concatenate([OPEN[: edge + 1], [end]]))
            assert distance(history[edge * samples + i], so_far) < INTEGRATION
    assert distance(history[-1], turned(robot, OPEN)) < INTEGRATION


def test_a_sampled_curve_of_many_corners_gives_a_rotation():
    """And twice around it in steps of one edge is twice the rotation."""
    t = np.linspace(0, 2 * np.pi, 2501)
    curve = np.stack([np.cos(t), np.sin(2 * t), 0.5 * np.sin(3 * t)], axis=1)
    once = turned(TREE, curve, 1, 5000)
    twice = turned(TREE, np.concatenate([curve, curve[1:]]), 1, 5000)
    np.testing.assert_allclose(once @ once.T, np.eye(3), atol=1e-13)
    np.testing.assert_allclose(np.linalg.det(once), 1, rtol=1e-13)
    assert distance(twice, once @ once) < 1e-12
    assert np.linalg.norm(log(once)) > 0.1


def test_float32_is_kept_and_right_to_its_precision():
    """Float32 anywhere is float32 altogether."""
    low, path = jax.tree.map(lambda leaf: leaf.astype(np.float32), (TREE, polygon(OPEN)))
    rotation = net_rotation(low, path)
    assert rotation.dtype == np.float32
    assert distance(rotation, turned(TREE, OPEN)) < 3e-6
    history = rotation_history(TREE, path, samples=7)
    assert history.dtype == np.float32
    exact = rotation_history(TREE, polygon(OPEN), samples=7)
    for rotation, right in zip(np.asarray(history), np.asarray(exact), strict=True):
        assert distance(rotation, right) < 3e-6


def test_batches_are_their_members():
    """Over paths, and over one array of the robot."""
    paths = np.stack([LOOP, loop(0)])
    batch = jax.vmap(lambda points: net_rotation(TREE, polygon(points), steps=FINE))(jnp.asarray(paths))
    ratios = np.stack([TREE.gear_ratio, 0 * TREE.gear_ratio])
    designs = jax.vmap(lambda ratio: net_rotation(TREE.replace(gear_ratio=ratio), polygon(LOOP), steps=FINE))(ratios)
    for i in range(2):
        assert distance(batch[i], turned(TREE, paths[i])) < ROUNDING
        assert distance(designs[i], turned(TREE.replace(gear_ratio=ratios[i]), LOOP)) < ROUNDING


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
        parent=TREE.parent,
        rotor_inertia=[0, 1, 0.1],
        gear_ratio=[3, -1, 1],
        rotor_on=TREE.rotor_on,
        name=NAME,
    )
    rotation = turned(robot, LOOP)
    assert distance(net_rotation(robot, polygon(LOOP), steps=FINE), rotation) < ROUNDING
    assert np.linalg.norm(log(rotation)) > 0.1


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

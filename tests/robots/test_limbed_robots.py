"""The satellite with its arm, the quadruped and the astronaut: published numbers kept, symmetric, clear at rest."""

import numpy as np
import pytest

import reojax
from reojax import robots
from reojax._internal.capsule_checks import segment_distance
from reojax.mechanics.kinematics import kinematics
from reojax.robots.astronaut import HEAD, TRUNK

LIMBED = ("satellite_arm", "quadruped", "astronaut")
MIRROR = np.diag([1.0, -1.0, 1.0])
"""From left to right."""


def test_the_arm_is_as_long_and_as_heavy_as_its_maker_says():
    """Kinova: 1187.3 mm from foot to flange stretched; the file's masses."""
    arm = robots.satellite_arm()
    top = kinematics(arm, np.zeros(7)).origin[-1][2] + 0.0615250
    assert float(top) - 0.3 == pytest.approx(1.1873, abs=2e-4)
    assert arm.mass[1:].sum() + 1.697 == pytest.approx(8.0519)
    assert arm.mass[0] - 1.697 == pytest.approx(100.0)


def test_the_arm_s_joints_alternate_between_roll_and_pitch():
    axes = robots.satellite_arm().axis
    np.testing.assert_allclose(axes[::2], [[0, 0, -1]] * 4, atol=1e-15)
    np.testing.assert_allclose(axes[1::2], [[0, 1, 0]] * 3, atol=1e-15)


def test_the_astronaut_has_the_mass_and_the_height_of_de_leva_s_subjects():
    """73 kg in all; 1741 mm stand between the heels and the top of the head, the chosen ankle included."""
    man = robots.astronaut()
    assert man.mass.sum() == pytest.approx(73.0)
    feet = kinematics(man, np.zeros(14)).origin[man.link_names.index("left_shank"), 2] - 0.434 - 0.045
    assert 0.8462 - float(feet) == pytest.approx(1.741, abs=0.01)


@pytest.mark.parametrize(
    ("segment", "length", "centre", "radii"),
    [(HEAD, 0.2429, 50.02, (30.3, 31.5, 26.1)), (TRUNK, 0.6033, 51.38, (32.8, 30.6, 16.9))],
)
def test_head_and_trunk_agree_with_de_leva_s_other_end_points(segment, length, centre, radii):
    """His table has both twice, also with the seventh neck vertebra as an end, 71.4 mm over the sternum's."""
    over = 0.0 if segment is HEAD else length - segment.length
    assert centre / 100 * length - over == pytest.approx(segment.centre / 100 * segment.length, abs=1e-4)
    np.testing.assert_allclose(length * np.array(radii), segment.length * np.array(segment.radii), rtol=5e-3)


@pytest.mark.parametrize("name", ["quadruped", "astronaut"])
def test_left_and_right_mirror_each_other(name):
    robot = robots.by_name(name)
    other = {"left": "right", "FL": "FR", "HL": "HR"}
    for i, link in enumerate(robot.link_names):
        side, _, part = link.partition("_")
        if side in other:
            twin = robot.link_names.index(f"{other[side]}_{part}")
            assert robot.mass[i] == robot.mass[twin]
            np.testing.assert_allclose(robot.com[i], MIRROR @ robot.com[twin], atol=3e-5)  # Solo12's motors are turned
            np.testing.assert_allclose(robot.inertia[i], MIRROR @ robot.inertia[twin] @ MIRROR, atol=1e-15)
            np.testing.assert_allclose(robot.anchor[i - 1], MIRROR @ robot.anchor[twin - 1], atol=1e-15)


def test_the_quadruped_s_numbers_are_solo12_s():
    robot = robots.quadruped()
    assert robot.mass.sum() == pytest.approx(1.16115091 + 4 * (2 * 0.14853845 + 0.03763607))
    np.testing.assert_allclose(robot.anchor[0], [0.1946, 0.0875, 0])


@pytest.mark.parametrize("name", LIMBED)
def test_all_kept_pairs_of_capsules_are_clear_at_rest(name):
    """By a millimetre at least; every heavy link has a shape."""
    robot = robots.by_name(name)
    origin = np.asarray(kinematics(robot, np.zeros(robot.joints)).origin)
    shapes = [(origin[c.link] + c.start, origin[c.link] + c.end, float(c.radius)) for c in robot.capsules]
    for a, b in robot.collision_pairs:
        (p, q, r), (u, v, w) = shapes[a], shapes[b]
        assert segment_distance(p, q, u, v) - r - w > 1e-3, (robot.capsules[a], robot.capsules[b])
    assert {i for i in range(robot.links) if robot.mass[i] > 0} == set(robot.capsule_link)
    assert len(robot.collision_pairs) > 10


def test_the_bus_lies_inside_its_capsules():
    """Corners, edges and faces of the cube."""
    robot = robots.satellite_arm()
    side = np.linspace(-0.3, 0.3, 25)
    points = np.array(np.meshgrid(side, side, side)).reshape(3, -1).T
    depth = np.full(len(points), np.inf)
    for capsule in robot.capsules[:4]:
        start, along = np.asarray(capsule.start), np.subtract(capsule.end, capsule.start)
        share = np.clip((points - start) @ along / (along @ along), 0, 1)
        depth = np.minimum(depth, np.linalg.norm(points - start - share[:, None] * along, axis=1) - capsule.radius)
    assert depth.max() <= 1e-12


@pytest.mark.oracle
@pytest.mark.parametrize("name", LIMBED)
def test_momentum_is_pinocchio_s(name):
    """A and B at random postures, massless links and rotors included."""
    pytest.importorskip("pinocchio")
    from reojax.interop import pinocchio_model, pinocchio_momentum, split

    robot = robots.by_name(name)
    foreign = pinocchio_model(robot)
    theta = np.random.default_rng(0).uniform(-1, 1, robot.joints)
    A, B, _ = split(pinocchio_momentum(foreign, theta, np.zeros(3), np.eye(3)), np.eye(3))
    own = reojax.momentum_matrices(robot, theta)
    np.testing.assert_allclose(own.A, A, atol=1e-12 * np.abs(A).max())
    np.testing.assert_allclose(own.B, B, atol=1e-12 * np.abs(A).max())


@pytest.mark.parametrize("name", LIMBED)
def test_notes_tell_sources_and_choices(name):
    notes = " ".join(robots.by_name(name).notes)
    assert "chosen" in notes

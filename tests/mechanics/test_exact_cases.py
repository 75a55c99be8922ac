"""Robots whose net rotation is known in closed form or from the literature, built from plain numbers."""

import jax
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

import reojax
from reojax.robots.random import random_link, random_unit

TOLERANCE = 1e-9
"""[rad]"""
STEPS = 10
"""Enough for an edge on which joints make a whole turn; the default is for shorter edges."""

net_rotation = jax.jit(reojax.net_rotation, static_argnames="steps")
X, Y, Z = np.eye(3)


def turn(vector) -> np.ndarray:
    """Rotation matrix of a rotation vector, by SciPy."""
    return Rotation.from_rotvec(vector).as_matrix()


def distance(rotation, exact) -> float:
    """Angle between two rotations that are close [rad]."""
    assert np.shape(rotation) == np.shape(exact) == (3, 3)
    return np.linalg.norm(np.asarray(rotation) - exact) / np.sqrt(2)


def along(robot, *waypoints, edges: int = 4) -> np.ndarray:
    """Net rotation; the last corner is repeated so that most cases share one compiled program."""
    waypoints = np.array(waypoints, float)
    still = np.repeat(waypoints[-1:], edges + 1 - len(waypoints), axis=0)
    return np.array(net_rotation(robot, reojax.polygon(np.concatenate([waypoints, still])), steps=STEPS))


# --- 1. one body and a wheel -----------------------------------------------------------------------------


def body_with_wheel(seed: int, **motor) -> tuple[reojax.Robot, np.ndarray]:
    """A random body, a balanced wheel on a random axis, and the locked inertia of the two."""
    rng = np.random.default_rng(seed)
    mass, com, inertia = random_link(rng)
    axis, anchor = random_unit(rng, 1)[0], rng.normal(size=3) * 0.1
    axial = np.outer(axis, axis)
    wheel = 0.003 * axial + 0.002 * (np.eye(3) - axial)
    robot = reojax.make_robot(
        mass=[mass, 0.4],
        com=[com, 0.05 * axis],
        inertia=[inertia, wheel],
        axis=[axis],
        anchor=[anchor],
        **motor,
    )
    arm = anchor + 0.05 * axis - com
    shared = mass * 0.4 / (mass + 0.4)
    return robot, inertia + wheel + shared * (arm @ arm * np.eye(3) - np.outer(arm, arm))


@pytest.mark.parametrize("angle", [0.5, -2.0, 2 * np.pi, 40.0])
def test_wheel(angle):
    """`R = exp(-A^-1 J e phi)`, whatever the axis and however far it turns."""
    for seed in range(4):
        robot, locked = body_with_wheel(seed)
        exact = turn(-np.linalg.solve(locked, 0.003 * robot.axis[0] * angle))
        assert distance(along(robot, [0], [angle]), exact) < TOLERANCE


@pytest.mark.parametrize(("side", "direction"), [("parent", 1), ("child", -1)])
def test_geared_rotor(side, direction):
    """The motor's rotor is a second wheel that turns `N` times as far, backwards if it sits on the first."""
    for seed in range(4):
        motor = {"rotor_inertia": [2e-5], "gear_ratio": [30.0], "rotor_on": [side]}
        robot, locked = body_with_wheel(seed, **motor)
        spin = 0.003 + direction * 30 * 2e-5
        exact = turn(-np.linalg.solve(locked, spin * robot.axis[0] * 3.0))
        assert distance(along(robot, [1.0], [4.0]), exact) < TOLERANCE


# --- 2. and 3. two wheels --------------------------------------------------------------------------------

PER_RADIAN = -np.array([0.02 / 0.2, 0.03 / 0.3])
"""Turn of the body below about x and y per turn of its wheels."""


def body_with_two_wheels() -> reojax.Robot:
    """Wheels on x and y in the middle of a body; locked inertia 0.2 and 0.3 kg m^2 about x and y."""
    wheels = np.array([[0.02, 0.01, 0.01], [0.02, 0.03, 0.02]])
    body = np.array([0.2, 0.3, 0.4]) - wheels.sum(axis=0)
    return reojax.make_robot(
        mass=[5.0, 1.0, 2.0],
        com=np.zeros((3, 3)),
        inertia=[np.diag(moments) for moments in (body, *wheels)],
        axis=[X, Y],
        anchor=np.zeros((2, 3)),
        parent=[0, 0],
    )


def test_two_wheels_round_a_square():
    """Turns do not commute: `exp(x a) exp(y b) exp(-x a) exp(-y b)`, about 56 degrees for 50 and 70."""
    a, b = np.deg2rad([50.0, 70.0])
    corners = np.array([[0, 0], [a, 0], [a, b], [0, b], [0, 0]]) / PER_RADIAN
    rotation = along(body_with_two_wheels(), *corners)
    assert distance(rotation, turn(X * a) @ turn(Y * b) @ turn(-X * a) @ turn(-Y * b)) < TOLERANCE
    half = np.arccos(1 - 2 * np.sin(a / 2) ** 2 * np.sin(b / 2) ** 2)
    assert abs(reojax.so3.angle(rotation) - 2 * half) < TOLERANCE
    assert abs(reojax.so3.angle(rotation) - np.deg2rad(56.1138505815731)) < TOLERANCE


def test_two_wheels_round_a_circle():
    """Body rate `k (-sin t, cos t, 0)` for a whole turn: `exp(2 pi (0, k, 1))`, 42.49 degrees for k = 1/2.

    The wheels' circle is a polygon of N edges here, wrong by `c / N^2 + d / N^4 + ...`, and three N give
    the limit. The wrong sign of a commutator would give another one.
    """
    robot, k = body_with_two_wheels(), 0.5

    def polygon(edges: int) -> np.ndarray:
        t = np.linspace(0, 2 * np.pi, edges + 1)[:, None]
        corners = k * np.hstack([np.cos(t), np.sin(t)]) / PER_RADIAN
        return Rotation.from_matrix(along(robot, *corners, edges=2000)).as_rotvec()

    coarse, middle, fine = map(polygon, (500, 1000, 2000))
    better = [(4 * middle - coarse) / 3, (4 * fine - middle) / 3]
    limit = (16 * better[1] - better[0]) / 15
    assert np.linalg.norm(fine - limit) > 10 * TOLERANCE  # there was something to extrapolate
    assert distance(turn(limit), turn(2 * np.pi * np.array([0, k, 1]))) < TOLERANCE
    assert abs(np.linalg.norm(limit) - np.deg2rad(42.4922359500)) < TOLERANCE


# --- 4. and 5. planar chains of rods ---------------------------------------------------------------------


def rods(mass, length) -> reojax.Robot:
    """Thin uniform rods on one line, joined end to end by hinges about z; base frame in rod 1's middle."""
    mass, length = np.array(mass, float), np.array(length, float)
    thickness = 1e-3
    along, across = mass * thickness**2, mass * length**2 / 12
    com = 0.5 * length[:, None] * X
    com[0] = 0
    anchor = np.outer(np.concatenate([[0.5 * length[0]], length[1:-1]]), X)
    return reojax.make_robot(
        mass=mass,
        com=com,
        inertia=[np.diag([i, j, j]) for i, j in zip(along, across, strict=True)],
        axis=np.tile(Z, (len(mass) - 1, 1)),
        anchor=anchor,
    )


@pytest.mark.parametrize(("degrees", "exact"), [(90, -20.44674731982584), (360, -44.21942835455569)])
def test_two_unequal_rods(degrees, exact):
    robot = rods([2.0, 1.0], [1.0, 0.5])
    rotation = along(robot, [0], [np.deg2rad(degrees)])
    assert distance(rotation, turn(Z * np.deg2rad(exact))) < TOLERANCE


@pytest.mark.parametrize(("start", "end"), [(0.0, 1.0), (2.5, -0.7), (-3.0, 3.0)])
def test_two_rods_between_any_angles(start, end):
    """`d alpha1 / d theta = -(b + k cos theta) / (a + b + 2 k cos theta)`, integrated by SciPy."""
    m1, m2, l1, l2 = 1.3, 0.4, 0.8, 1.1
    mu = m1 * m2 / (m1 + m2)
    a, b = m1 * l1**2 / 12 + mu * l1**2 / 4, m2 * l2**2 / 12 + mu * l2**2 / 4
    k = mu * l1 * l2 / 4
    exact = quad(lambda t: -(b + k * np.cos(t)) / (a + b + 2 * k * np.cos(t)), start, end, epsabs=1e-13)[0]
    assert distance(along(rods([m1, m2], [l1, l2]), [start], [end]), turn(Z * exact)) < TOLERANCE


def test_equal_rods_turn_half_as_far():
    """By symmetry each of two equal links does half of any turn; exactly half a turn back for a whole one."""
    robot = rods([0.7, 0.7], [0.6, 0.6])
    for angle in (1.0, 2 * np.pi):
        assert distance(along(robot, [0], [angle]), turn(-0.5 * Z * angle)) < TOLERANCE


@pytest.mark.parametrize(
    ("sides", "exact"), [((90, 90), -7.508704554953), ((60, -120), -1.634222061396), ((70, -70), 0.0)]
)
def test_three_equal_rods_round_a_rectangle(sides, exact):
    a, b = np.deg2rad(sides)
    rotation = along(rods([1.0] * 3, [1.0] * 3), [0, 0], [a, 0], [a, b], [0, b], [0, 0])
    assert distance(rotation, turn(Z * np.deg2rad(exact))) < TOLERANCE


# --- 6. two-cylinder cat ---------------------------------------------------------------------------------


def two_cylinders(axial_to_transverse: float) -> reojax.Robot:
    """Two equal cylinders on x, joined by twist, bend (about y) and twist; what joins them weighs nothing."""
    cylinder = 0.05 * np.diag([axial_to_transverse, 1.0, 1.0])
    return reojax.make_robot(
        mass=[3.0, 1e-13, 1e-13, 3.0],
        com=[[0, 0, 0], [0, 0, 0], [0, 0, 0], [0.2, 0, 0]],
        inertia=[cylinder, 1e-15 * np.eye(3), 1e-15 * np.eye(3), cylinder],
        axis=[X, Y, X],
        anchor=[[0.2, 0, 0], [0, 0, 0], [0, 0, 0]],
    )


def kane_and_scher(bend: float, j: float) -> float:
    """Turn [rad] of a cat bent by `bend` whose halves twist once round (Kane and Scher 1969)."""
    return 2 * np.pi * j * np.cos(bend / 2) / (np.sin(bend / 2) ** 2 + j * np.cos(bend / 2) ** 2)


CATS = [(60.0, 0.25), (90.0, 0.4), (30.0, 0.1)]


def test_the_cat_s_number():
    assert np.rad2deg(kane_and_scher(np.deg2rad(60), 0.25)) == pytest.approx(178.15379734994, abs=1e-11)


@pytest.mark.parametrize(("bend", "j"), CATS)
def test_bent_cat_twists_once_round(bend, j):
    """It turns about the line through the two cylinders' centres."""
    bend = np.deg2rad(bend)
    rotation = along(two_cylinders(j), [0, bend, 0], [2 * np.pi, bend, -2 * np.pi])
    chord = X + turn(Y * bend) @ X
    exact = turn(kane_and_scher(bend, j) * chord / np.linalg.norm(chord))
    assert distance(rotation, exact) < TOLERANCE


@pytest.mark.parametrize(("bend", "j"), CATS)
def test_cat_in_manoeuvre_a(bend, j):
    """Manoeuvre A with a whole twist is the cat's turn about roll; bending and untwisting add nothing."""
    bend = np.deg2rad(bend)
    rotation = along(two_cylinders(j), *reojax.manoeuvre_a(2 * np.pi, bend).waypoints)
    assert distance(rotation, turn(kane_and_scher(bend, j) * X)) < TOLERANCE

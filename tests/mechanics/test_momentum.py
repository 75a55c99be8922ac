"""The momentum matrices against Pinocchio, MuJoCo, the thesis's own equations and plain differences."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import barycentric
from scipy.spatial.transform import Rotation

import reojax
from reojax import interop
from reojax.robots.random import random_robot

SHAPES = [(joints, branched) for joints in range(1, 9) for branched in (False, True)]
SEEDS = (0, 1, 2)
matrices = jax.jit(reojax.momentum_matrices)
connection = jax.jit(reojax.connection)
angular_momentum = jax.jit(reojax.angular_momentum)
net_rotation = jax.jit(reojax.net_rotation)
rotation_history = jax.jit(reojax.rotation_history, static_argnames="samples")


def relative(value, exact) -> float:
    """Largest difference over the largest entry."""
    assert np.shape(value) == np.shape(exact)
    return np.abs(np.asarray(value) - exact).max() / np.abs(exact).max()


def random_shapes(seed: int, joints: int, count: int = 1) -> np.ndarray:
    return np.random.default_rng([99, seed]).uniform(-np.pi, np.pi, (count, joints))


@functools.cache
def evaluated(joints: int, branched: bool) -> list:
    """Random robots with random shapes and reojax's matrices."""
    robots = [random_robot(seed, joints, branched=branched) for seed in SEEDS]
    shapes = [random_shapes(seed, joints, 2) for seed in SEEDS]
    cases = [(robot, theta) for robot, pair in zip(robots, shapes, strict=True) for theta in pair]
    return [(*case, *map(np.asarray, matrices(*case))) for case in cases]


# --- other people's code ---------------------------------------------------------------------------------


@pytest.mark.oracle
@pytest.mark.parametrize("library", ["pinocchio", "mujoco"])
@pytest.mark.parametrize(("joints", "branched"), SHAPES)
def test_matrices_are_those_of(library, joints, branched):
    """Rotors included, whatever the pose of the base; the base's linear velocity gives no momentum."""
    pytest.importorskip(library)
    build = getattr(interop, f"{library}_model")
    momentum = getattr(interop, f"{library}_momentum")
    rng = np.random.default_rng(joints)
    for robot, theta, A, B in evaluated(joints, branched):
        rotation = Rotation.random(random_state=rng).as_matrix()
        exact = momentum(build(robot), theta, rng.normal(size=3), rotation)
        exact_A, exact_B, linear = interop.split(exact, rotation)
        assert relative(A, exact_A) < 1e-12
        assert relative(B, exact_B) < 1e-12
        assert np.abs(linear).max() < 1e-12 * robot.mass.sum()


@pytest.mark.parametrize("joints", range(1, 9))
def test_matrices_are_the_thesis_s(joints):
    """Barycentric vectors (thesis 1.5, 2.5) give the same matrices for serial robots, rotors included."""
    for robot, theta, A, B in evaluated(joints, False):
        exact_A, exact_B = barycentric.momentum_matrices(robot, theta)
        assert relative(A, exact_A) < 1e-12
        assert relative(B, exact_B) < 1e-12


def test_rotors_are_seen_by_the_oracles():
    """The comparisons above would notice a missing rotor, a wrong side and a wrong ratio."""
    robot = random_robot(0, 2)
    theta = random_shapes(0, 2)[0]
    other_side = tuple({"parent": "child", "child": "parent"}[side] for side in robot.rotor_on)
    exact = barycentric.momentum_matrices(robot, theta)[1]
    for wrong in (
        robot.replace(rotor_inertia=[0.0, robot.rotor_inertia[1]]),
        robot.replace(rotor_on=other_side),
        robot.replace(gear_ratio=robot.gear_ratio + 1),
    ):
        assert relative(matrices(wrong, theta)[1], exact) > 1e-4


# --- momentum itself -------------------------------------------------------------------------------------


@pytest.mark.parametrize("branched", [False, True])
def test_momentum_is_zero_along_the_motion(branched):
    """Momentum summed over bodies and rotors whose poses are differenced in the inertial frame is zero."""
    robot = random_robot(3, 3, branched=branched)
    start, end = random_shapes(3, 3, 2)
    samples = 1500
    history = np.asarray(rotation_history(robot, reojax.polygon([start, end]), samples=samples))
    shapes = np.linspace(start, end, samples + 1)
    inertia = np.array(robot.inertia)
    for rotor in interop.rotors(robot):
        inertia[rotor.link] -= rotor.inertia * np.outer(rotor.axis, rotor.axis)
    turned, place = link_poses(robot, shapes, history)
    total, scale = np.zeros((samples - 5, 3)), np.zeros(samples - 5)

    def add(momentum):
        nonlocal total, scale
        total, scale = total + momentum, scale + np.linalg.norm(momentum, axis=1)

    for i in range(robot.links):
        spin = body_rate(turned[:, i])
        add(np.einsum("tab,bc,tdc,td->ta", turned[3:-3, i], inertia[i], turned[3:-3, i], spin))
        add(robot.mass[i] * np.cross(place[3:-3, i], difference(place[:, i])))
    for rotor in interop.rotors(robot):
        angle = rotor.spin * shapes[:, rotor.joint]
        pose = turned[:, rotor.link] @ Rotation.from_rotvec(np.outer(angle, rotor.axis)).as_matrix()
        axial = rotor.inertia * np.outer(rotor.axis, rotor.axis)
        add(np.einsum("tab,bc,tdc,td->ta", pose[3:-3], axial, pose[3:-3], body_rate(pose)))
    assert np.all(np.linalg.norm(total, axis=1) < 1e-10 * scale)


def link_poses(robot, shapes, history) -> tuple[np.ndarray, np.ndarray]:
    """Orientations (t, n, 3, 3) and centres of mass from the robot's own (t, n, 3), inertial frame."""
    turned, origin = [history], [np.zeros((len(shapes), 3))]
    for k, p in enumerate(robot.parent):
        joint = Rotation.from_rotvec(np.outer(shapes[:, k], robot.axis[k])).as_matrix()
        turned.append(turned[p] @ joint)
        origin.append(origin[p] + turned[p] @ robot.anchor[k])
    centre = np.stack([o + r @ c for o, r, c in zip(origin, turned, robot.com, strict=True)], axis=1)
    middle = np.einsum("i,tia->ta", robot.mass, centre) / robot.mass.sum()
    return np.stack(turned, axis=1), centre - middle[:, None]


def difference(values: np.ndarray) -> np.ndarray:
    """Sixth-order central difference along the first axis, per sample; three samples shorter on each side."""
    step = [values[3 + k : len(values) - 3 + k] - values[3 - k : len(values) - 3 - k] for k in (1, 2, 3)]
    return (45 * step[0] - 9 * step[1] + step[2]) / 60


def body_rate(pose: np.ndarray) -> np.ndarray:
    """Angular velocity in the inertial frame, from `R' R^T`."""
    skew = difference(pose) @ pose[3:-3].swapaxes(1, 2)
    return 0.5 * np.stack([skew[:, c, b] - skew[:, b, c] for b, c in ((1, 2), (2, 0), (0, 1))], axis=1)


@pytest.mark.parametrize("joints", [1, 3, 6])
def test_angular_momentum_is_the_thesis_s(joints):
    robot = random_robot(5, joints)
    theta, theta_dot = random_shapes(5, joints, 2)
    omega = np.array([0.3, -1.1, 0.7])
    exact = barycentric.momentum(robot, theta, theta_dot, omega)
    assert relative(angular_momentum(robot, theta, theta_dot, omega), exact) < 1e-12


@pytest.mark.parametrize(("joints", "branched"), [(1, False), (3, True), (6, False)])
def test_connection_leaves_no_momentum(joints, branched):
    robot = random_robot(6, joints, branched=branched)
    theta, theta_dot = random_shapes(6, joints, 2)
    omega = np.asarray(connection(robot, theta)) @ theta_dot
    left = angular_momentum(robot, theta, theta_dot, omega)
    from_joints = angular_momentum(robot, theta, theta_dot, np.zeros(3))
    assert np.linalg.norm(left) < 1e-13 * np.linalg.norm(from_joints)


@pytest.mark.parametrize(("joints", "branched"), [(2, False), (8, True)])
def test_connection_solves_the_momentum_equation(joints, branched):
    robot = random_robot(7, joints, branched=branched)
    theta = random_shapes(7, joints)[0]
    A, B = map(np.asarray, matrices(robot, theta))
    assert relative(connection(robot, theta), np.linalg.solve(A, B)) < 1e-12


@pytest.mark.parametrize(("joints", "branched"), [(0, False), (1, False), (8, True)])
def test_locked_inertia_is_a_rigid_body_s(joints, branched):
    """Symmetric, positive definite, and no principal moment above the sum of the other two."""
    robot = random_robot(8, joints, branched=branched)
    for theta in random_shapes(8, joints, 5):
        A = np.asarray(matrices(robot, theta).A)
        assert np.abs(A - A.T).max() <= 1e-15 * np.abs(A).max()
        small, middle, large = np.linalg.eigvalsh(A)
        assert small > 0
        assert large < small + middle


def test_a_robot_without_joints():
    """One rigid body: A is its inertia, nothing can turn it, and its momentum is that of a rigid body."""
    robot = random_robot(9, 0)
    theta = np.zeros(0)
    A, B = matrices(robot, theta)
    assert relative(A, robot.inertia[0]) < 1e-15
    assert B.shape == connection(robot, theta).shape == (3, 0)
    omega = np.array([1.0, 2.0, 3.0])
    assert relative(angular_momentum(robot, theta, theta, omega), robot.inertia[0] @ omega) < 1e-15
    net = net_rotation(robot, reojax.polygon(np.zeros((3, 0))))
    assert np.array_equal(net, np.eye(3))


# --- arrays: dtype, batching, shapes ---------------------------------------------------------------------


@pytest.mark.parametrize("branched", [False, True])
def test_float32_is_kept_and_right_to_its_precision(branched):
    robot = random_robot(10, 4, branched=branched)
    low = jax.tree.map(lambda leaf: leaf.astype(np.float32), robot)
    theta, theta_dot = random_shapes(10, 4, 2)
    omega = np.array([0.3, -1.1, 0.7])
    low_arguments = tuple(np.float32(value) for value in (theta, theta_dot, omega))
    cases = (
        (matrices, 1),
        (connection, 1),
        (angular_momentum, 3),
    )
    for function, count in cases:
        exact = function(robot, *(theta, theta_dot, omega)[:count])
        for chosen in (low, robot):  # float32 anywhere is float32 altogether
            value = function(chosen, *low_arguments[:count])
            for got, wanted in zip(jax.tree.leaves(value), jax.tree.leaves(exact), strict=True):
                assert (got.dtype, wanted.dtype) == (np.float32, np.float64)
                assert relative(got, wanted) < 5e-6


def test_a_batch_is_its_members():
    robot = random_robot(11, 2)
    shapes = random_shapes(11, 2, 4)
    batch = jax.jit(jax.vmap(reojax.momentum_matrices, (None, 0)))(robot, shapes)
    for i, theta in enumerate(shapes):
        for got, wanted in zip(batch, matrices(robot, theta), strict=True):
            assert relative(got[i], np.asarray(wanted)) < 1e-14


@pytest.mark.parametrize("shape", [(), (2,), (4,), (1, 3), (3, 1)])
@pytest.mark.parametrize("entry", ["theta", "theta_dot", "omega"])
def test_a_wrong_shape_is_named(entry, shape):
    robot = random_robot(12, 3)
    right = {"theta": np.zeros(3), "theta_dot": np.zeros(3), "omega": np.zeros(3)}
    wrong = right | {entry: np.zeros(shape)}
    functions = [
        lambda a: reojax.angular_momentum(robot, **a),
        jax.jit(lambda a: reojax.angular_momentum(robot, **a)),
    ]
    if entry == "theta":
        functions += [
            lambda a: reojax.momentum_matrices(robot, a["theta"]),
            lambda a: reojax.connection(robot, a["theta"]),
            jax.jit(lambda a: reojax.connection(robot, a["theta"])),
        ]
    for function in functions:
        with pytest.raises(ValueError, match=rf"`{entry}` has shape \({', '.join(map(str, shape))}"):
            function(wrong)


def test_integer_angles_are_angles():
    robot = random_robot(13, 2)
    got = connection(robot, jnp.array([1, 2]))
    assert got.dtype == np.float64
    assert relative(got, np.asarray(connection(robot, np.array([1.0, 2.0])))) < 1e-15

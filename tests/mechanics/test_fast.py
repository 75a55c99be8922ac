"""The parts of the fast net rotation one by one: sine and cosine, recursion, step, product, loops; its compiled form.

The last tests are canaries: they count loops in compiled text, so an XLA that undoes what `materialize` and `blocking`
rely on shows here before it shows as a slow program.
"""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import reojax
from reojax import so3
from reojax.mechanics._fast import net_rotation as fast, rolled
from reojax.mechanics._fast.blocking import _BYTES
from reojax.mechanics._fast.magnus import step_rotations
from reojax.mechanics._fast.materialize import materialize
from reojax.mechanics._fast.nodes import NODES, path_nodes
from reojax.mechanics._fast.parameters import components, flatten, known_parameters, parameters, pattern_of, split
from reojax.mechanics._fast.quaternions import ordered_product, products_up_to, to_matrix
from reojax.mechanics._fast.recursion import inward, solve
from reojax.mechanics._fast.scalar import scale
from reojax.mechanics._fast.sincos import sincos
from reojax.robots.random import random_robot

ROBOT = jax.tree.map(jnp.asarray, random_robot(6, 5, branched=True))
CORNERS = jnp.asarray(np.random.default_rng(6).normal(size=(3, 5)))


matrices = jax.jit(jax.vmap(to_matrix))
whole = jax.jit(lambda factors: to_matrix(ordered_product(factors)))
so_far_of = jax.jit(lambda factors: jax.vmap(to_matrix)(products_up_to(factors)))


@pytest.mark.parametrize(("dtype", "largest", "error"), [(np.float64, 1e6, 3e-16), (np.float32, 1e4, 2e-7)])
def test_sine_and_cosine_are_what_they_promise(dtype, largest, error):
    """Against NumPy in extended precision: everywhere, at multiples of an eighth of a turn, and near zero."""
    rng = np.random.default_rng(1)
    eighths = np.arange(-4000, 4000) * (np.pi / 4)
    tiny = 10.0 ** rng.uniform(-30, 0, 2000)
    angle = np.concatenate([rng.uniform(-largest, largest, 200_000), eighths, tiny, [0.0]]).astype(dtype)
    s, c = jax.jit(sincos)(angle)
    exact = angle.astype(np.longdouble)
    assert np.abs(np.asarray(s, np.longdouble) - np.sin(exact)).max() < error
    assert np.abs(np.asarray(c, np.longdouble) - np.cos(exact)).max() < error


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("robot", [reojax.robots.prototype(), random_robot(6, 5, branched=True)], ids=["axes", "any"])
def test_recursion_is_the_connection(robot, known):
    """At single nodes, with what is known of the robot and with nothing known."""
    rng = np.random.default_rng(2)
    theta, rate = rng.normal(size=(2, robot.joints, 4))
    numbers = split(flatten(parameters(jax.tree.map(jnp.asarray, robot))))
    if known:
        numbers = [x if k is None else k for x, k in zip(numbers, known_parameters(pattern_of(robot)), strict=True)]

    @jax.jit
    def omega(theta, rate):
        base = inward(components(numbers, robot.parent), [sincos(angle) for angle in theta], list(rate))
        return jnp.stack(jnp.broadcast_arrays(*solve(base.inertia, scale(-1, base.momentum))))

    connections = jax.jit(jax.vmap(lambda theta: reojax.connection(robot, theta)))(theta.T)
    np.testing.assert_allclose(omega(theta, rate), np.einsum("nak,kn->an", connections, rate), atol=1e-12)


def test_a_step_is_the_exponential():
    """Constant rates of up to half a turn: `expm`; and rates that turn with the body, exactly solvable."""
    omega = np.random.default_rng(3).normal(size=(3, 4))
    steps = jax.jit(lambda omega: step_rotations(tuple(omega)).rotation)
    found = matrices(steps(np.repeat(omega, len(NODES), axis=1)))
    for turned, vector in zip(found, omega.T, strict=True):
        np.testing.assert_allclose(turned, expm(np.asarray(so3.hat(vector))), atol=1e-14)
    k, t = 0.5, np.pi / 4 * (np.arange(8)[:, None] + NODES).ravel()  # R(2 pi) = exp(2 pi (0, k, 1))
    along = np.pi / 4 * k * np.stack([-np.sin(t), np.cos(t), 0 * t])
    turned = steps(along)
    exact = Rotation.from_rotvec([0, 2 * np.pi * k, 2 * np.pi]).as_matrix()
    np.testing.assert_allclose(whole(turned), exact, atol=1e-13)


@pytest.mark.parametrize("count", [1, 2, 7, 16])
def test_products_are_in_order(count):
    turns = Rotation.random(count, random_state=np.random.default_rng(count))
    factors = tuple(jnp.asarray(turns.as_quat(scalar_first=True)).T)
    so_far, expected = np.eye(3), []
    for matrix in turns.as_matrix():
        so_far = so_far @ matrix
        expected.append(so_far)
    np.testing.assert_allclose(whole(factors), expected[-1], atol=1e-14)
    np.testing.assert_allclose(so_far_of(factors), np.array(expected), atol=1e-14)


@pytest.mark.slow
def test_loops_over_joints_are_the_code_for_every_joint(monkeypatch):
    """Value, reverse and forward mode by every array and by the path, alone and in a batch."""

    def weighed(robot, corners):
        weights = jnp.arange(9.0).reshape(3, 3)
        return (reojax.net_rotation(robot, reojax.polygon(corners)) * weights).sum()

    def everything(robot, corners):
        moved = jax.tree.map(lambda leaf: jnp.cos(3 * leaf), (robot, corners))
        reverse = jax.value_and_grad(weighed, (0, 1))(robot, corners)
        return *reverse, jax.jvp(weighed, (robot, corners), moved)[1]

    found = []
    batch = jnp.stack([CORNERS, 0.5 * CORNERS])
    for longest in (8, 2):
        monkeypatch.setattr(fast, "ROLLED_ALONE", longest)
        monkeypatch.setattr(fast, "ROLLED_IN_BATCHES", longest)
        jax.clear_caches()
        program = jax.jit(jax.vmap(everything, (None, 0))).lower(ROBOT, batch)
        assert ("while" in program.as_text()) == (longest == 2)
        found.append(program.compile()(ROBOT, batch))
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-11, atol=1e-12), *found)
    single = jax.jit(everything)(ROBOT, CORNERS)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b[0], rtol=1e-11, atol=1e-12), single, found[0])


def test_nodes_of_loops_are_those_of_the_code():
    """Angles, rates, and the transpose of their dependence on the corners."""
    nodes = lambda corners: [jnp.stack(x) for x in path_nodes(corners, 3)]
    theta, rate = jax.jit(nodes)(CORNERS)
    motion = jax.jit(lambda corners: rolled.motion_at_nodes(corners, 3))(CORNERS)
    np.testing.assert_allclose(motion.sine, np.sin(theta), atol=1e-14)
    np.testing.assert_allclose(motion.rate, rate, atol=1e-15)
    by_theta, by_rate = np.random.default_rng(0).normal(size=(2, *motion.rate.shape))
    expected = jax.jit(lambda *pull: jax.vjp(nodes, CORNERS)[1](list(pull))[0])(by_theta, by_rate)
    found = jax.jit(lambda *pull: rolled.to_points(*pull, 3))(by_theta, by_rate)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def compiled(function, *args) -> str:
    return jax.jit(function).lower(*args).compile().as_text()


def test_materialized_values_are_computed_in_one_loop():
    """Three results that share a sine: one loop computes it; without `materialize` each would do so again."""
    x = jnp.linspace(0, 1, 4096)

    def three(x, keep):
        shared = jnp.sin(x)
        values = (shared * 2, shared + x, shared * x)
        values = materialize(values) if keep else values
        return [v[::-1] * 3 for v in values]

    assert compiled(lambda x: three(x, True), x).count(" sine(") == 1
    assert compiled(lambda x: three(x, False), x).count(" sine(") == 3


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(8,), (2, 8)])
def test_materialized_values_are_the_same_to_the_last_digit(dtype, shape):
    tiny, huge = np.finfo(dtype).tiny, np.finfo(dtype).max
    values = np.broadcast_to(np.array([0.0, 1.0, -np.pi, tiny, huge, -huge, np.inf, -np.inf], dtype), shape)
    for kept, value in zip(jax.jit(materialize)((values, -values)), (values, -values), strict=True):
        assert kept.dtype == dtype
        np.testing.assert_array_equal(np.asarray(kept), value)


def test_the_inward_pass_is_computed_once():
    """A reduce with all six results of inertia or momentum, and each sine's polynomial once for each joint."""
    robot = reojax.robots.prototype()
    text = compiled(jax.vmap(lambda c: reojax.net_rotation(robot, reojax.polygon(c))), jnp.zeros((64, 3, 3)))
    rounds = len(re.findall(r"round-nearest-even\(", text))
    assert robot.joints <= rounds <= 3 * robot.joints
    assert "custom-call" not in text or "lapack" not in text


def test_batches_go_block_by_block():
    """A batch of many designs is a loop over blocks whose values fit the cache, not one array of all."""
    robot = reojax.robots.prototype()
    edges, many = 2, 20_000
    text = compiled(jax.vmap(lambda c: reojax.net_rotation(robot, reojax.polygon(c))), jnp.zeros((many, edges + 1, 3)))
    assert " while(" in text
    widest = max(int(n) for n in re.findall(r"f64\[(\d+),64\]", text))  # designs at 64 nodes
    assert widest * 64 * 8 <= 1.01 * _BYTES

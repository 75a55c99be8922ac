"""Batches run in blocks: the same numbers as design by design, for any batch size, and the same derivatives."""

import os
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import robots, session
from reojax.mechanics._fast.blocking import _BYTES, Call, in_blocks
from reojax.mechanics._fast.nodes import NODES as GAUSS_NODES

NODES = _BYTES // 8 // 4
"""So that a block is 4 designs in float64."""


def _value(power, x, y):
    return [jnp.sin(x).sum() * y**power]


def _push(power, x, y, dx):
    return [(jnp.cos(x) * dx).sum() * y**power]


def _pull(power, x, y, by_result):
    return [jnp.cos(x) * (y**power * by_result).sum()]


def value(x, y):
    return in_blocks(Call(_value, 2, ((2,),), NODES), x, y)[0]


def push(x, y, dx):
    return in_blocks(Call(_push, 2, ((2,),), NODES, transpose=_pull, linear=1), x, y, dx)[0]


def numbers(*shape):
    return np.random.default_rng(3).uniform(0.5, 1.5, shape)


@pytest.mark.parametrize("size", [1, 7, 8, 9, 21])
def test_a_batch_is_its_designs(size):
    """With few designs, whole blocks, and a last block that is filled up; an argument may be shared."""
    x, y = numbers(size, 3), numbers(size, 2)
    each = np.stack([np.sin(a).sum() * b**2 for a, b in zip(x, y, strict=True)])
    np.testing.assert_allclose(jax.jit(jax.vmap(value))(x, y), each, rtol=1e-14)
    shared = np.sin(x).sum(1)[:, None] * y[0] ** 2
    np.testing.assert_allclose(jax.jit(jax.vmap(value, (0, None)))(x, y[0]), shared, rtol=1e-14)


def test_batches_of_batches():
    """Two axes are run as one, whichever arguments have them, and wherever."""
    x, y = numbers(5, 7, 3), numbers(7, 2)
    inner = jax.vmap(value, (0, 0))
    expected = np.sin(x).sum(-1)[..., None] * y**2
    np.testing.assert_allclose(jax.jit(jax.vmap(inner, (0, None)))(x, y), expected, rtol=1e-14)
    last = jax.jit(jax.vmap(inner, (-1, None)))(np.moveaxis(x, 0, -1), y)
    np.testing.assert_allclose(last, expected, rtol=1e-14)


def test_a_linear_function_has_its_transpose():
    """In a batch, with a shared linear argument too, whose cotangent is the sum; and back again."""
    x, y, dx, weight = numbers(11, 3), numbers(11, 2), numbers(3), numbers(11, 2)
    batched = jax.jit(lambda dx: jax.vmap(push, (0, 0, None))(x, y, dx))
    expected = (np.cos(x) @ dx)[:, None] * y**2
    np.testing.assert_allclose(batched(dx), expected, rtol=1e-14)
    pull = jax.jit(lambda w: jax.linear_transpose(batched, dx)(w)[0])
    np.testing.assert_allclose(pull(weight), (np.cos(x) * (y**2 * weight).sum(1)[:, None]).sum(0), rtol=1e-14)
    np.testing.assert_allclose(jax.linear_transpose(pull, weight)(dx)[0], expected, rtol=1e-14)


def test_derivatives_by_the_other_arguments():
    """Forward and reverse, in a batch."""
    x, y, dx = numbers(11, 3), numbers(11, 2), numbers(11, 3)
    total = lambda y: jax.vmap(push)(x, y, dx).sum()
    expected = 2 * y * (np.cos(x) * dx).sum(1)[:, None]
    np.testing.assert_allclose(jax.jit(jax.grad(total))(y), expected, rtol=1e-14)
    np.testing.assert_allclose(jax.jit(lambda v: jax.jvp(total, (y,), (v,))[1])(y), (expected * y).sum(), rtol=1e-13)


def test_net_rotations_and_gradients_in_blocks():
    """Of more designs than two blocks, an odd number, with the robot shared: the numbers of a small batch."""
    robot, designs, steps = robots.planar(2), 265, 64
    assert designs > 2 * _BYTES // 8 // (steps * len(GAUSS_NODES))
    corners = np.cumsum(numbers(designs, 2, robot.joints), axis=1)

    def roll(robot, corners):
        return reojax.so3.log(reojax.net_rotation(robot, reojax.polygon(corners), steps=steps))[2]

    slopes = jax.jit(jax.vmap(jax.value_and_grad(roll, argnums=(0, 1)), (None, 0)))
    whole, few = slopes(robot, corners), slopes(robot, corners[-8:])
    for a, b in zip(jax.tree.leaves(whole), jax.tree.leaves(few), strict=True):
        np.testing.assert_allclose(a[-8:], b, rtol=1e-12, atol=1e-13)


@pytest.mark.slow
def test_a_robot_without_data():
    """All of its numbers are known zeros and ones: the same rotation and slope as with the numbers given as data."""
    ones = reojax.make_robot(
        mass=[1, 1], com=np.zeros((2, 3)), inertia=[np.eye(3)] * 2, axis=[[0, 0, 1]], anchor=[[1, 0, 0]]
    )

    def roll(robot, angle):
        return reojax.so3.log(reojax.net_rotation(robot, reojax.polygon([[0.0], [angle]]), steps=1))[2]

    known = jax.value_and_grad(lambda angle: roll(ones, angle))(1.2)
    given = jax.jit(jax.value_and_grad(roll, argnums=1))(ones, 1.2)
    np.testing.assert_allclose(known, given, rtol=1e-14)
    assert abs(known[0]) > 0.1


@pytest.mark.parametrize(("told", "calls"), [(None, 2), ("0", 0)])
def test_freed_memory_is_held_from_the_first_program_on(monkeypatch, told, calls):
    """Two settings of the allocator, unless the environment says to leave it alone."""
    given = []
    monkeypatch.setattr(session.sys, "platform", "linux")
    libc = SimpleNamespace(mallopt=lambda *setting: given.append(setting))
    monkeypatch.setattr(session.ctypes, "CDLL", lambda _: libc)
    for name in [name for name in os.environ if name.startswith("MALLOC_")]:
        monkeypatch.delenv(name)
    monkeypatch.delenv("REOJAX_HOLD_MEMORY", raising=False)
    if told:
        monkeypatch.setenv("REOJAX_HOLD_MEMORY", told)
    jax.jit(lambda x: in_blocks(Call(lambda _, x: [2 * x], told, ((),), 1), x)[0]).lower(1.0)
    assert len(given) == calls

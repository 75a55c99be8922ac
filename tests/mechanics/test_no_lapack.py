"""No public function calls LAPACK: batched LAPACK calls can deadlock on CPU, and are slow for 3x3 matrices."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax.robots.random import random_robot

ROBOT = random_robot(0, 2, branched=True)
ANGLES = np.array([0.3, -0.4])
CORNERS = np.array([[0.0, 0.0], [1.0, 0.5], [-0.5, 1.0]])
CALLS = {
    "momentum_matrices": lambda robot, path: reojax.momentum_matrices(robot, path[0]),
    "connection": lambda robot, path: reojax.connection(robot, path[0]),
    "angular_momentum": lambda robot, path: reojax.angular_momentum(robot, path[0], path[1], jnp.ones(3)),
    "curvature": lambda robot, path: reojax.curvature(robot, path[0]),
    "inverse_dynamics": lambda robot, path: reojax.inverse_dynamics(robot, *path),
    "forward_dynamics": lambda robot, path: reojax.forward_dynamics(robot, *path),
    "simulate": lambda robot, path: reojax.simulate(robot, reojax.polygon(path), durations=1.0, samples=2),
    "through": lambda robot, path: reojax.through(reojax.polygon(path), 1.0),
    "net_rotation": lambda robot, path: reojax.net_rotation(robot, reojax.polygon(path)),
    "rotation_history": lambda robot, path: reojax.rotation_history(robot, reojax.polygon(path), samples=3),
}


def program(function, *arguments) -> str:
    """What a function becomes for the CPU, calls to libraries included."""
    return jax.jit(function).trace(*arguments).lower(lowering_platforms=("cpu",)).as_text()


def batched(function):
    """Of robots and of paths, both on their first axis."""
    return jax.vmap(function), jax.tree.map(lambda leaf: np.stack([leaf, leaf]), (ROBOT, CORNERS))


def total(function):
    return lambda *arguments: sum(leaf.sum() for leaf in jax.tree.leaves(function(*arguments)))


def test_a_lapack_call_would_be_seen():
    assert "lapack_" in program(jax.vmap(jnp.linalg.solve), np.stack([np.eye(3)] * 2), np.ones((2, 3, 1)))


@pytest.mark.parametrize("name", CALLS)
def test_values(name):
    function, arguments = batched(CALLS[name])
    text = program(function, *arguments)
    assert "stablehlo" in text
    assert "lapack_" not in text


LONG = [(name, jax.jacrev) for name in ("simulate", "rotation_history")]
"""Derivatives that take longest to trace."""


@pytest.mark.parametrize(
    ("name", "mode"),
    [
        pytest.param(name, mode, marks=[pytest.mark.slow] * ((name, mode) in LONG), id=f"{name}-{mode.__name__}")
        for name in CALLS
        for mode in (jax.jacrev, jax.jacfwd)
    ],
)
def test_derivatives(name, mode):
    function, arguments = batched(mode(total(CALLS[name]), argnums=(0, 1)))
    text = program(function, *arguments)
    assert "stablehlo" in text
    assert "lapack_" not in text


PLAN = reojax.Trajectory(np.array([0.0, 0.002]), CORNERS[None])
LOOPS = {
    "released": lambda robot, path: reojax.released(robot, PLAN, reojax.Release((*path[1], 1.0)), samples=2),
    "track": lambda robot, path: reojax.track(robot, PLAN, reojax.RE_MAX_17, reojax.Gains(*path[1] ** 2, 1.0)),
}


@pytest.mark.parametrize("name", LOOPS)
def test_values_of_loops_over_time(name):
    function, arguments = batched(LOOPS[name])
    text = program(function, *arguments)
    assert "stablehlo" in text
    assert "lapack_" not in text

"""Net rotation and connection depend on ratios of masses and lengths, in any units that the dtype can write."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import reojax
from reojax.robots.random import random_robot

ROBOT = random_robot(4, 3)
PATH = reojax.manoeuvre_a(2.0, 1.2)
THETA = np.array([0.4, -0.9, 1.3])
RANGE = {np.float32: (25, 8), np.float64: (200, 50)}
"""Powers of ten of masses, and of lengths."""


def scaled(mass: float, length: float, dtype: type) -> reojax.Robot:
    inertia = (mass * length) * length
    robot = ROBOT.replace(
        mass=ROBOT.mass * mass,
        com=ROBOT.com * length,
        anchor=ROBOT.anchor * length,
        inertia=ROBOT.inertia * inertia,
        rotor_inertia=ROBOT.rotor_inertia * inertia,
    )
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), robot)


@jax.jit
def outcomes(robot, theta, corners):
    turned, slope = jax.value_and_grad(lambda c: reojax.net_rotation(robot, reojax.polygon(c))[0, 1])(corners)
    return {
        "connection": reojax.connection(robot, theta),
        "entry": turned,
        "slope": slope,
        "curvature": reojax.curvature(robot, theta),
    }


@pytest.mark.parametrize("dtype", RANGE)
def test_any_unit_of_mass_and_length(dtype):
    masses, lengths = RANGE[dtype]
    theta, corners = THETA.astype(dtype), np.asarray(PATH.waypoints, dtype)
    expected = outcomes(scaled(1, 1, dtype), theta, corners)
    atol = 30 * np.finfo(dtype).eps

    @settings(max_examples=60, deadline=None, derandomize=True)
    @given(st.floats(-masses, masses), st.sampled_from([-1.0, 0.0, 1.0]))
    def unchanged(mass, length):
        room = 1 - abs(mass) / (1.5 * masses)  # mass * length^2 is a number of the dtype too
        robot = scaled(10.0**mass, 10.0 ** (length * lengths * room), dtype)
        for name, value in outcomes(robot, theta, corners).items():
            size = max(1.0, np.abs(expected[name]).max())
            np.testing.assert_allclose(value, expected[name], atol=atol * size, err_msg=name)

    unchanged()


@pytest.mark.filterwarnings("ignore:the levels of a certificate")
def test_the_certificate_in_any_unit():
    """In float32, where squares of such momenta are out of range."""
    certify = jax.jit(lambda robot: reojax.certify(robot, PATH).momentum)
    small = certify(scaled(1, 1, np.float32))
    for power in (-25, 25):
        assert 0.1 < certify(scaled(10.0**power, 1, np.float32)) / small < 10


def test_derivatives_by_the_robot_count_the_units():
    """All masses and inertias, or all lengths, grown together: the rotation stays, so the derivative vanishes."""

    def turned(growth):
        return reojax.net_rotation(scaled(jnp.exp(growth[0]), jnp.exp(growth[1]), np.float64), PATH)

    slope = jax.jit(jax.jacrev(turned))(jnp.array([0.3, -0.2]))
    np.testing.assert_allclose(slope, 0, atol=1e-12)

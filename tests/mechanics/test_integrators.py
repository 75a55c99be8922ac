"""Magnus and Runge-Kutta methods against an exact solution: a rate that turns about z, seen from the body.

`omega(t) = k (-sin t, cos t, 0)` gives `R(2 pi) = exp(2 pi (0, k, 1))`; a wrong sign of a commutator shows.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from reojax import so3
from reojax.mechanics import integrators
from reojax.mechanics.integrators import GAUSS_4, RK4, RK6, magnus4, runge_kutta_step

K = 0.5
EXACT = Rotation.from_rotvec([0, 2 * np.pi * K, 2 * np.pi]).as_matrix()
MOMENTUM = np.array([0.3, -0.2, 0.4])


def rate(t):
    return K * jnp.stack([-jnp.sin(t), jnp.cos(t), 0 * t], axis=-1)


def grid(steps: int, nodes) -> tuple[float, jax.Array]:
    h = 2 * np.pi / steps
    return h, h * (np.arange(steps)[:, None] + np.array(nodes))


def by_magnus4(steps):
    h, t = grid(steps, GAUSS_4)
    turns = jax.vmap(so3.exp)(magnus4(*(h * rate(t[:, i]) for i in (0, 1))))
    return functools.reduce(jnp.matmul, list(turns))


def by_magnus6(steps):
    h, t = grid(steps, integrators.GAUSS)
    return integrators.end_rotation(jnp.full(steps, h), rate(t))


def by_runge_kutta(method):
    def solve(steps):
        h, _ = grid(steps, [0.0])

        def step(state, _):
            turned, t = runge_kutta_step(method, lambda _, t, __: (rate(t), jnp.ones(())), h, *state)
            return (turned, t), None

        (turned, t), _ = jax.lax.scan(step, (jnp.eye(3), jnp.zeros(())), length=steps)
        return turned

    return solve


def by_orientations(steps):
    """The same rate, half of it as the momentum's: `M R^T H` is made to give it."""
    h, t = grid(steps, RK6.nodes)
    turned = jax.vmap(jax.vmap(lambda t: so3.exp(jnp.array([0, K, 1.0]) * t) @ so3.exp(jnp.array([0, 0, -1.0]) * t)))(t)
    seen = jnp.einsum("snba,b->sna", turned, MOMENTUM)  # R^T H along the exact solution
    mobility = rate(t)[..., :, None] * seen[..., None, :] / (MOMENTUM @ MOMENTUM) / 2
    return integrators.orientations(jnp.full(steps, h), rate(t) / 2, mobility, MOMENTUM)[-1]


METHODS = {
    "magnus 4": (by_magnus4, 4),
    "magnus 6": (by_magnus6, 6),
    "runge-kutta 4": (by_runge_kutta(RK4), 4),
    "runge-kutta 6": (by_runge_kutta(RK6), 6),
    "orientations": (by_orientations, 6),
}


@pytest.mark.parametrize(("solve", "order"), METHODS.values(), ids=METHODS.keys())
def test_order_on_an_exact_case(solve, order):
    """The error falls as the power of the step that it should, from a fraction of a degree on, and R is a rotation."""
    coarse, fine = (jax.jit(solve, static_argnums=0)(steps) for steps in (16, 32))
    errors = [np.abs(np.asarray(turned) - EXACT).max() for turned in (coarse, fine)]
    assert errors[0] < 1e-3
    assert np.log2(errors[0] / errors[1]) > order - 0.4
    np.testing.assert_allclose(coarse.T @ coarse, np.eye(3), atol=1e-14)


def test_a_state_beside_the_rotation():
    """A damped oscillator that turns the body about x: exact angle, by Runge-Kutta of fourth order."""

    def rates(_, state, damping):
        x, v = state
        return jnp.array([1.0, 0, 0]) * v, (v, -x - damping * v)

    def step(state, _):
        return runge_kutta_step(RK4, rates, 0.02, *state, jnp.full(3, 0.2)), None

    start = (jnp.eye(3), (jnp.ones(()), jnp.zeros(())))
    (turned, (x, _)), _ = jax.jit(lambda start: jax.lax.scan(step, start, length=100))(start)
    w = np.sqrt(1 - 0.01)
    exact = np.exp(-0.2) * (np.cos(2 * w) + 0.1 / w * np.sin(2 * w))
    assert abs(x - exact) < 1e-8
    np.testing.assert_allclose(turned, Rotation.from_rotvec([exact - 1, 0, 0]).as_matrix(), atol=1e-8)


def test_tableaux_are_consistent():
    """Each stage's row sums to its node, and the weights to one."""
    for method in (RK4, RK6):
        np.testing.assert_allclose(method.stages.sum(1), np.array(method.nodes)[list(method.node)], atol=1e-15)
        assert method.weights.sum() == pytest.approx(1, abs=1e-15)

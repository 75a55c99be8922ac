"""Joint angles and rates at the quadrature nodes of a polygon, and sums over nodes.

Values at the nodes are one-dimensional arrays, step by step: `vmap` makes them (designs, nodes), and XLA runs along
the nodes in one vectorised loop. Means and integrals over a step are products with a constant matrix, for the loops of
plain reductions are short and slow.
"""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from reojax.mechanics._fast.materialize import materialize

_x, _w = np.polynomial.legendre.leggauss(8)

NODES: np.ndarray = 0.5 * (_x + 1)
"""Gauss nodes in a step, as fractions of the step: a quadrature of order 16."""
WEIGHTS: np.ndarray = 0.5 * _w
"""Their weights, for a step of length 1."""
LEGENDRE: np.ndarray = np.polynomial.legendre.legvander(_x, len(_x) - 1)
"""(node, degree) Legendre polynomials on the step, at the nodes."""


def per_step(values: jax.Array, matrix: np.ndarray) -> jax.Array:
    """Multiply the values in each step, or in each edge, (steps, n), by a constant (n, m) matrix."""
    constant = jnp.asarray(matrix, values.dtype)
    return jax.lax.dot(values.reshape(-1, matrix.shape[0]), constant, precision=jax.lax.Precision.HIGHEST)


def path_nodes(points: jax.Array, steps: int) -> tuple[list[jax.Array], list[jax.Array]]:
    """Joint angles and their rates per step at all nodes of the polygon `points` (v, j), joint by joint."""
    # change of the angles in a step, and the angles where each step begins
    rate = (points[1:] - points[:-1])[:, None, :] / steps
    start = points[:-1, None, :] + rate * jnp.arange(steps, dtype=points.dtype)[None, :, None]
    rate = jnp.broadcast_to(rate, start.shape)
    theta, theta_dot = [], []
    for k in range(points.shape[1]):
        a, b = (x[:, None] for x in materialize((start[..., k].reshape(-1), rate[..., k].reshape(-1))))
        # theta at the nodes; the rate is that of the edge
        along = a + b * jnp.asarray(NODES[None, :], points.dtype)
        both = materialize((along.reshape(-1), jnp.broadcast_to(b, along.shape).reshape(-1)))
        theta.append(both[0])
        theta_dot.append(both[1])
    return theta, theta_dot


def to_points(theta: list[jax.Array], rate: list[jax.Array], steps: int) -> jax.Array:
    """Transpose of `path_nodes`: from cotangents of all angles and rates to that of the points (v, j)."""
    # share of its edge at which each node lies: what the edge's two ends are worth there
    along = ((np.arange(steps)[:, None] + NODES) / steps).reshape(-1, 1)
    ends_of_theta = np.hstack([1 - along, along])
    ends_of_rate = np.tile([[-1 / steps, 1 / steps]], (len(along), 1))
    found = []
    for x, y in zip(theta, rate, strict=True):
        ends = per_step(x, ends_of_theta) + per_step(y, ends_of_rate)  # of each edge
        found.append(jnp.pad(ends[:, 0], (0, 1)) + jnp.pad(ends[:, 1], (1, 0)))
    return jnp.stack(found, axis=1)


@jax.custom_jvp
def to_nodes(value: jax.Array, like: jax.Array) -> jax.Array:
    """Repeat a number at all nodes, in the shape of `like`."""
    return jnp.broadcast_to(value, like.shape)


@to_nodes.defjvp
def _to_nodes_jvp(primals, tangents):
    value, like = primals
    ones = jnp.ones((1, like.shape[0]), like.dtype)
    change = jax.lax.dot(tangents[0].reshape(1, 1), ones, precision=jax.lax.Precision.HIGHEST)
    return to_nodes(value, like), change.reshape(-1)


def sum_over_nodes(values: Sequence[Any]) -> Sequence[jax.Array]:
    """Sum each of several arrays of nodes, in one loop."""
    if len(values) == 1:
        ones = jnp.ones((values[0].shape[0], 1), values[0].dtype)
        return [jax.lax.dot(values[0][None, :], ones, precision=jax.lax.Precision.HIGHEST).reshape(())]
    zeros = [jnp.zeros((), x.dtype) for x in values]
    return jax.lax.reduce(list(values), zeros, lambda a, b: [x + y for x, y in zip(a, b, strict=True)], (0,))

"""Joint angles and rates at the quadrature nodes of a polygon, and sums over nodes.

Values at the nodes are one-dimensional arrays, step by step: `vmap` makes them (designs, nodes), and XLA runs along
the nodes in one vectorised loop. What is known per step comes to its nodes by a product with a constant matrix,
and sums over nodes are such products too; the loops of plain broadcasts and reductions are short and slow.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

_x, _w = np.polynomial.legendre.leggauss(8)

NODES: np.ndarray = 0.5 * (_x + 1)
"""Gauss nodes in a step, as fractions of the step: a quadrature of order 16."""
WEIGHTS: np.ndarray = 0.5 * _w
"""Their weights, for a step of length 1."""
LEGENDRE: np.ndarray = np.polynomial.legendre.legvander(_x, len(_x) - 1)
"""(node, degree) Legendre polynomials on the step, at the nodes."""


def per_step(values: jax.Array, matrix: np.ndarray) -> jax.Array:
    """Multiply the values in each step, (steps, n), by a constant (n, m) matrix."""
    constant = jnp.asarray(matrix, values.dtype)
    return jax.lax.dot(values.reshape(-1, matrix.shape[0]), constant, precision=jax.lax.Precision.HIGHEST)


_LINE = np.stack([np.ones_like(NODES), NODES])
_LEVEL = np.stack([np.zeros_like(NODES), np.ones_like(NODES)])


def path_nodes(points: jax.Array, steps: int) -> tuple[list[jax.Array], list[jax.Array]]:
    """Joint angles and their rates per step at all nodes of the polygon `points` (v, j), joint by joint."""
    rate = (points[1:] - points[:-1]) / steps
    index = jnp.arange(steps, dtype=points.dtype)[None, :, None]
    start = points[:-1, None, :] + rate[:, None, :] * index
    lines = jnp.stack([start, jnp.broadcast_to(rate[:, None, :], start.shape)])  # (2, edges, steps, j)
    theta, theta_dot = [], []
    for k in range(points.shape[1]):
        line = lines[..., k].reshape(2, -1).T
        theta.append(per_step(line, _LINE).reshape(-1))
        theta_dot.append(per_step(line, _LEVEL).reshape(-1))
    return theta, theta_dot


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


def sum_over_nodes(values: Sequence[jax.Array]) -> Sequence[jax.Array]:
    """Sum each of several arrays of nodes, in one loop."""
    zeros = [jnp.zeros((), x.dtype) for x in values]
    return jax.lax.reduce(list(values), zeros, lambda a, b: [x + y for x, y in zip(a, b, strict=True)], (0,))

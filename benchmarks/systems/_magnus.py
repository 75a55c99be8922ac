"""Fourth-order Magnus method with two Gauss nodes a step, for systems that have no integrator of their own.

On every edge, `R' = R hat(omega)`; over a step `exp((w1 + w2) / 2 + sqrt(3) / 12 w1 x w2)`, with omega per step.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import reojax
from reojax import so3

from ._measure import compiled, fewest
from ._task import TOLERANCE, Loops, Reference, edges, path_of, robot_of

GAUSS = np.array([0.5 - 3**0.5 / 6, 0.5 + 3**0.5 / 6])
NODES = len(GAUSS)


def evaluations(steps: int) -> int:
    """Evaluations of omega in a loop of four edges."""
    return 4 * NODES * steps


def nodes(loop: Loops, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Joint angles and rates per step at all nodes of one loop, (4 * steps * 2, j) each."""
    at = (np.arange(steps)[:, None] + GAUSS).reshape(-1, 1) / steps
    pairs = [(start + at * change, np.broadcast_to(change / steps, (len(at), 3))) for start, change in edges(loop)]
    theta, rate = zip(*pairs, strict=True)
    return np.concatenate(theta), np.concatenate(rate)


def product(omega: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) from omega per step at all nodes (4 * steps * 2, 3), in NumPy."""
    first, second = omega[0::2], omega[1::2]
    turns = (first + second) / 2 + 3**0.5 / 12 * np.cross(first, second)
    angle = np.linalg.norm(turns, axis=1)[:, None, None]
    x, y, z = turns.T
    zero = np.zeros_like(x)
    hat = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    rotations = np.eye(3) + np.sinc(angle / np.pi) * hat + 0.5 * np.sinc(angle / 2 / np.pi) ** 2 * hat @ hat
    while len(rotations) > 1:
        if len(rotations) % 2:
            rotations = np.concatenate([rotations, np.eye(3)[None]])
        rotations = rotations[0::2] @ rotations[1::2]
    return rotations[0]


def rotation(omega: Callable[[jax.Array, jax.Array], Any], loop: Loops, steps: int) -> jax.Array:
    """Rotation (3, 3) after one loop, all nodes under `vmap`; `omega(theta, rate)` is the base's angular velocity."""
    return traced_product(jax.vmap(omega)(*traced_nodes(loop, steps)))


def traced_nodes(loop: Loops, steps: int) -> tuple[jax.Array, jax.Array]:
    """Same as `nodes`, in JAX."""
    corners = jnp.asarray(path_of(loop).waypoints)
    at, change = ((jnp.arange(steps)[:, None] + GAUSS) / steps).reshape(-1), jnp.diff(corners, axis=0)
    theta = corners[:-1, None] + at[None, :, None] * change[:, None]
    return theta.reshape(-1, 3), jnp.repeat(change / steps, len(at), axis=0)


def traced_product(omega: jax.Array) -> jax.Array:
    """Same as `product`, in JAX."""
    turns = jax.vmap(_turn)(omega.reshape(-1, NODES, 3))
    return jax.lax.scan(lambda done, turn: (done @ so3.exp(turn), None), jnp.eye(3, dtype=omega.dtype), turns)[0]


def _turn(w: jax.Array) -> jax.Array:
    return (w[0] + w[1]) / 2 + 3**0.5 / 12 * jnp.cross(w[0], w[1])


def plain_error(reference: Reference) -> Callable[[int], float]:
    """Return the error of this method with `reojax.mechanics.momentum`, as a function of its steps."""

    def one(loop: Loops, steps: jax.Array) -> jax.Array:
        robot, corners = robot_of(loop), path_of(loop).waypoints

        def edge(done, ends):
            start, change = ends

            def step(i, done):
                angle = start + (i + GAUSS)[:, None] * (change / steps)[None]
                w = jax.vmap(partial(reojax.connection, robot))(angle) @ (change / steps)
                return done @ so3.exp(_turn(w))

            return jax.lax.fori_loop(0, steps, step, done), None

        return jax.lax.scan(edge, jnp.eye(3), (corners[:-1], jnp.diff(corners, axis=0)))[0]

    call, _ = compiled(jax.vmap(one, in_axes=(0, None)), reference.loops, 1)
    return lambda steps: reference.error(np.asarray(call(reference.loops, steps)))


def fewest_steps(reference: Reference) -> int:
    """Return the fewest steps an edge with which this method reaches the tolerance."""
    return fewest(plain_error(reference), TOLERANCE, start=8)

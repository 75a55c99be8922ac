"""First variation of a path's net rotation, put together from what the library knows at each instant."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

import reojax
from reojax.mechanics.variation import turn_per_change

NODES = 32
"""Gauss nodes of each edge that bring the first variation within 1e-12 of its size on manoeuvres of 270 degrees."""


def first_variation(robot: reojax.Robot, path: reojax.Path, change: np.ndarray) -> jax.Array:
    """Turn of the end of a path, seen from the start, for a small change (v, j) of its corners, by the curvature.

    `net_rotation` of the changed path is `exp(e) net_rotation(path)` but for second order in the change, with
    `e = integral of R F(p, theta') + R_end Gamma_end p_end - Gamma_start p_start`, p linear between the corners.
    """
    return _first_variation(robot, path.waypoints, change)


@jax.jit
def _first_variation(robot: reojax.Robot, corners: jax.Array, moved: jax.Array) -> jax.Array:
    place, weight = np.polynomial.legendre.leggauss(NODES)
    edges, joints = corners.shape[0] - 1, corners.shape[1]
    share = np.concatenate([[0.0], (place + 1) / 2])[None, :, None]
    step, by = jnp.diff(corners, axis=0)[:, None], jnp.diff(moved, axis=0)[:, None]
    theta = (corners[:-1, None] + share * step).reshape(-1, joints)
    rotation = reojax.rotation_history(robot, reojax.Path(jnp.concatenate([theta, corners[-1:]])), samples=1)
    inside = np.arange(edges * (NODES + 1)).reshape(edges, -1)[:, 1:].ravel()
    rate = jnp.broadcast_to(step, (edges, NODES, joints)).reshape(-1, joints)
    at = partial(turn_per_change, robot, momentum=jnp.zeros(3))
    g, _ = jax.vmap(at)(theta[inside], rate, rotation[inside])
    p = (moved[:-1, None] + share[:, 1:] * by).reshape(-1, joints)
    area = jnp.einsum("n,nai,ni->a", np.tile(weight / 2, edges), g, p)
    ends = [rotation[k] @ reojax.connection(robot, corners[k]) @ moved[k] for k in (0, -1)]
    return area + ends[1] - ends[0]

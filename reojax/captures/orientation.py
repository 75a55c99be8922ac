"""From measured joint angles to the orientation of the base: the one way, for comparison and calibration alike.

The angles of each joint, gaps filled, are joined by straight edges, and along each edge `R' = R hat(omega)`,
`A omega = B theta_dot`, is solved by Magnus steps of sixth order: one, or as many as the longest edge needs. What
straight edges leave out of a curved motion is more than the steps do.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array
from reojax.captures.capture import Capture
from reojax.mechanics.integrators import GAUSS, magnus6
from reojax.mechanics.momentum import connection
from reojax.mechanics.own_units import without_names
from reojax.robot import Robot

BLOCK = 256
"""Sampled paths are filled up to a multiple of this many edges, so that few programs are compiled."""
_RESOLVED = 0.5
"""Farthest that a joint may go in one step [rad]: there a step is within 5e-6 rad, with half of it within 1e-7."""
_MOST_STEPS = 64
"""Most steps of an edge."""


def fill_gaps(capture: Capture) -> Float[np.ndarray, "m j"]:
    """Joint angles of a capture [rad]; gaps are filled by monotone cubics (PCHIP), and held at the ends.

    Raises:
        ValueError: if a joint was never seen.
    """
    from scipy.interpolate import PchipInterpolator

    theta = np.array(capture.theta, float)
    for k, seen in enumerate(capture.seen_theta.T):
        if not seen.any():
            raise ValueError(f"joint {k + 1} of {len(capture.seen_theta.T)} was seen in no frame.")
        gaps = np.clip(capture.time[~seen], capture.time[seen][0], capture.time[seen][-1])
        if seen.sum() > 1:
            theta[~seen, k] = PchipInterpolator(capture.time[seen], theta[seen, k])(gaps)
        theta[~seen, k] = theta[~seen, k] if seen.sum() > 1 else theta[seen, k][0]
    return theta


def steps_needed(robot: Robot, theta: Float[np.ndarray, "m j"]) -> int:
    """Magnus steps of every edge, a power of two.

    Raises:
        ValueError: if a joint goes farther between two frames than the most steps resolve.
    """
    moved = np.abs(np.diff(theta, axis=0))
    farthest = float(moved.max(initial=0))
    if farthest > _RESOLVED * _MOST_STEPS:
        frame, joint = np.unravel_index(int(moved.argmax()), moved.shape)
        raise ValueError(
            f"joint {robot.joint_names[int(joint)]!r} goes {farthest:.4g} rad between frames {frame} and {frame + 1}; "
            f"at most {_RESOLVED * _MOST_STEPS:g} rad can be followed. Angles are in radians: are these degrees?"
        )
    return 1 << max(0, int(np.ceil(np.log2(max(farthest / _RESOLVED, 1)) - 1e-9)))


def fill_up(theta: Float[np.ndarray, "m j"]) -> Float[np.ndarray, "n j"]:
    """The angles, the last ones repeated up to a whole number of blocks of edges and one."""
    edges = len(theta) - 1
    return theta[np.minimum(np.arange(-(-edges // BLOCK) * BLOCK + 1), edges)]


def edge_turn(robot: Robot, start: Float[Array, " j"], end: Float[Array, " j"], steps: int) -> Float[Array, "3 3"]:
    """Turn of the base along one straight edge, by `steps` Magnus steps (static)."""
    move = (end - start) / steps
    shares = (np.arange(steps)[:, None] + np.array(GAUSS)).ravel() / steps
    nodes = jax.vmap(lambda share: start + share * (end - start))(jnp.asarray(shares, start.dtype))
    omega = jax.vmap(lambda node: connection(robot, node) @ move)(nodes).reshape(steps, 3, 3)
    turns = jax.vmap(so3.exp)(magnus6(omega[:, 0], omega[:, 1], omega[:, 2]))
    while len(turns) > 1:  # a power of two: products in pairs
        turns = jnp.matmul(turns[::2], turns[1::2], precision="highest")
    return turns[0]


def chain(turns: Float[np.ndarray, "e 3 3"]) -> Float[np.ndarray, "e+1 3 3"]:
    """Orientation before the first edge, the identity, and after each."""
    turned = np.empty((len(turns) + 1, 3, 3))
    turned[0] = np.eye(3)
    for k, turn in enumerate(turns):
        turned[k + 1] = turned[k] @ turn
    return turned


def orientations(robot: Robot, theta: Float[np.ndarray, "m j"]) -> Float[np.ndarray, "m 3 3"]:
    """Orientation of the base at each of the joint angles, from the identity.

    Raises:
        ValueError: if a joint goes farther between two frames than can be followed.
    """
    turns = _edge_turns(without_names(robot), fill_up(theta), steps_needed(robot, theta))
    return chain(np.asarray(turns, float)[: len(theta) - 1])


@partial(jax.jit, static_argnums=2)
def _edge_turns(robot: Robot, theta: Array, steps: int) -> Array:
    theta = jnp.asarray(theta)
    return jax.vmap(lambda start, end: edge_turn(robot, start, end, steps))(theta[:-1], theta[1:])

"""Late authority of a loop: how much of an error of the orientation its rest can still take back."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax.design.outcome import Measure, Outcome
from reojax.mechanics.holonomy import rotation_history
from reojax.mechanics.own_units import without_names
from reojax.mechanics.variation import turn_per_change
from reojax.path import Path
from reojax.robot import Robot

_NODES = 8
"""Of each edge, at the middles of equal parts."""


def authority(*, after: float = 0.5) -> Measure:
    """Least eigenvalue of what the rest of the loop can turn, once a share `after` of its edges is done.

    The Gramian of `correction_gains`, `integral of G W G^T` with `G` the turn of the end per change of the joints and a
    weight that vanishes at every corner: the more, the smaller the change of the joints that takes back an error about
    the worst axis. As an objective, `weighted({authority(after=0.5): -1.0})` makes loops that can be corrected late.

    Args:
        after: share of the edges that is done, from 0 up, below 1.

    Raises:
        ValueError: if the share is out of its range.
    """
    share = checks.number("after", after, least=0.0, most=1.0)
    if share == 1:
        raise ValueError("`after` is 1; nothing is left of the loop then.")
    return lambda outcome: late_authority(outcome.robot, outcome.path, share)


def authority_above(least: float, *, after: float = 0.5) -> Measure:
    """Whether `authority(after=after)` is at least `least`, for an inequality: what is missing, as a share of it.

    Args:
        least: least authority that is wanted, above 0 [rad^2].
        after: share of the path that has been done, as for `authority`.

    Raises:
        ValueError: if `least` is not positive, or the share out of its range.
    """
    wanted, measure = checks.positive("least", least, "rad^2"), authority(after=after)

    def missing(outcome: Outcome) -> Array:
        return 1 - measure(outcome) / wanted

    return missing


def late_authority(robot: Robot, path: Path, after: float) -> Float[Array, ""]:
    """The measure of `authority`, of one path."""
    edges = path.edges
    share = (np.arange(_NODES) + 0.5) / _NODES
    place = np.arange(edges)[:, None] + share[None]
    weight = 30 * (share * (1 - share)) ** 2 * np.ones((edges, 1)) / _NODES
    # the first cell that is done only in part counts as much as lies ahead
    weight = weight * np.clip((place - after * edges) * _NODES + 0.5, 0, 1)
    return _weighted_authority(without_names(robot), path, weight.ravel())


@jax.jit
def _weighted_authority(robot: Robot, path: Path, weight: Float[Array, " n"]) -> Float[Array, ""]:
    """The same with the weight of each node."""
    points = jnp.asarray(path.waypoints)
    edges = points.shape[0] - 1
    # postures and rates in the middle of equal parts of each edge, and the base's orientation there
    fine = 2 * _NODES
    share = (np.arange(_NODES) + 0.5) / _NODES
    step = jnp.diff(points, axis=0)
    theta = points[:-1, None] + jnp.asarray(share, points.dtype)[None, :, None] * step[:, None]
    rotation = rotation_history(robot, path, samples=fine)[:-1].reshape(edges, fine, 3, 3)[:, 1::2]
    rates = jnp.broadcast_to(step[:, None], theta.shape)
    # what a change of the joints there turns the end by, and its Gramian
    flat = [x.reshape(-1, *x.shape[2:]) for x in (theta, rates, rotation)]
    still = jnp.zeros(3, points.dtype)
    g, _ = jax.vmap(partial(turn_per_change, robot), (0, 0, 0, None))(flat[0], flat[1], flat[2], still)
    gramian = jnp.einsum("n,nai,nbi->ab", weight.astype(points.dtype), g, g)
    return _least_eigenvalue(gramian)


def _least_eigenvalue(matrix: Float[Array, "3 3"]) -> Float[Array, ""]:
    """From the angle of the characteristic cubic; its derivative is finite unless two eigenvalues meet."""
    # eigenvalues mean + 2 r cos(f + 2 pi k / 3): r and f of the part without trace (Smith 1961)
    mean = jnp.trace(matrix) / 3
    off = matrix - mean * jnp.eye(3, dtype=matrix.dtype)
    size = (off * off).sum() / 6
    safe = jnp.where(size > 0, size, 1)
    x, y, z = off
    cosine = jnp.dot(x, jnp.cross(y, z)) / (2 * safe * jnp.sqrt(safe))
    angle = jnp.arccos(jnp.clip(cosine, -1 + 1e-12, 1 - 1e-12)) / 3
    return mean + 2 * jnp.sqrt(safe) * jnp.cos(angle + 2 * jnp.pi / 3) * (size > 0)

"""Clearance as a smooth condition for optimisers: sampled along the edges, and rounded off where the least one changes.

An optimiser needs one function with derivatives, `path_clearance` decides. So solve with `clearance_shortfall`, look at
the answer with `path_clearance`, and where samples missed something, ask for some more `margin` and solve again.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array, common_float
from reojax.collision.chains import acceleration_bound, geometry_of, structure_of, unit_axes
from reojax.collision.clearance import clearances, radii
from reojax.robot import Robot

_ROUND = 0.02
"""Rounding of the least of several clearances, as a share of the mean sum of a pair's radii."""
_SAMPLES = 96
"""Samples of a path by default, one an edge at least."""
_GROUPS = 12
"""Most conditions by default: the edges of a longer path share some."""


def edge_clearances(robot: Robot, waypoints: Float[Array, "v j"], samples: int) -> Float[jax.Array, "e k p"]:
    """Clearance of all pairs at k = `samples + 1` equally spaced postures of each edge, both ends included [m].

    Unchecked, with derivatives; `waypoints` has two corners or more.
    """
    points = jnp.asarray(waypoints)
    share = jnp.linspace(0, 1, samples + 1, dtype=points.dtype)[None, :, None]
    postures = points[:-1, None] + share * (points[1:] - points[:-1])[:, None]
    found = clearances(robot, postures.reshape(-1, points.shape[1]))
    return jnp.asarray(found).T.reshape(len(points) - 1, samples + 1, -1)


def clearance_shortfall(
    robot: Robot,
    waypoints: Float[Array, "v j"],
    margin: ArrayLike,
    *,
    samples: int | None = None,
    between: float = 0.0,
) -> Float[jax.Array, " g"]:
    """What is missing to a clearance of `margin` along a path: negative where it is kept, smooth, for an inequality.

    Per edge, or per run of edges of a long path; in units of the mean sum of two radii, which makes it some 1 in size.
    The least over samples and pairs is rounded off to the safe side. Empty for robots without pairs.

    Args:
        robot: the robot.
        waypoints: corners [rad], two or more.
        margin: wanted clearance [m]; may be traced.
        samples: per edge, static; default 96 for the whole path.
        between: how much more is asked for because of what lies between samples, as a multiple of the bound
            `M h^2 / 8` on how far a point leaves its chord: 2 makes a proof by `path_clearance` all but sure, at a cost
            where edges are long.
    """
    points = jnp.asarray(waypoints)
    edges = len(points) - 1
    samples = samples or max(1, -(-_SAMPLES // edges))
    structure = structure_of(robot)
    if not structure.pairs:
        return jnp.zeros(0, points.dtype)
    geometry = unit_axes(geometry_of(robot), common_float(robot, points))
    size = radii(structure, geometry).mean()
    least = edge_clearances(robot, points, samples)
    if between:
        bend = acceleration_bound(structure, geometry, (points[1:] - points[:-1]).T)
        least = least - (between / (8 * samples**2)) * bend.T[:, None]
    flat = least.reshape(edges, -1) / size
    groups = np.array_split(np.arange(edges), min(edges, _GROUPS))
    rounded = [_ROUND * jax.nn.logsumexp(-flat[group[0] : group[-1] + 1] / _ROUND) for group in groups]
    return jnp.stack(rounded) + jnp.asarray(margin) / size

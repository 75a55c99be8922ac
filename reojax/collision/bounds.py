"""Proven lower bounds of the distance between two capsules over intervals of an edge.

Between two samples of an edge, h apart, a point of one capsule as seen from a point of the other, w(s), leaves its
chord by at most M h^2 / 8, M the bound on |w''| of `chains.acceleration_bound`. For every unit vector n,

    |w(s)| >= n . w(s) >= min over both samples, and over all pairs of points, of n . w  -  M h^2 / 8,

and over all pairs of points n . w is least between ends of the centre lines. With n halfway between the two samples'
own directions the bound falls short of the distance by some h^2 only. It stands however the nearest points move, slide
or jump; what rounding can do to it is taken off.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax.collision.chains import Geometry, Structure, acceleration_bound, chains_of, levers
from reojax.collision.clearance import radii
from reojax.collision.placement import PairEnds, pair_ends_from_between
from reojax.collision.segments import Points, between, dot
from reojax.mechanics._fast.materialize import materialize


class Edges(NamedTuple):
    """The edges of a path, and what bounds how fast the pairs move along them."""

    start: Float[jax.Array, "j e"]
    turn: Float[jax.Array, "j e"]
    """Angles at the start, and turned by until the end [rad]."""
    bend: Float[jax.Array, "p e"]
    """M: bound on the acceleration of one capsule against the other in unit time [m]."""
    rounding: Float[jax.Array, " p"]
    """What rounding can do to a distance at most [m]."""


def edges_of(structure: Structure, geometry: Geometry, waypoints: Float[jax.Array, "v j"]) -> Edges:
    """Edges of a path; one that stays put has one edge, of no length."""
    points = waypoints if waypoints.shape[0] > 1 else jnp.concatenate([waypoints, waypoints])
    turn = (points[1:] - points[:-1]).T
    bend = acceleration_bound(structure, geometry, turn)
    return Edges(points[:-1].T, turn, bend, _rounding(structure, geometry, jnp.abs(points).max(0)))


def _rounding(structure: Structure, geometry: Geometry, angle: Float[jax.Array, " j"]) -> Float[jax.Array, " p"]:
    """Bound on the rounding of a distance [m]: of lengths along the chain, and of the angles, up to `angle` [rad]."""
    # of angles: how far a point moves for each radian
    joint = chains_of(structure).joint
    by_angle = jnp.where(joint >= 0, levers(structure, geometry) * angle[joint], 0).sum((1, 2)) if angle.size else 0
    # of lengths: those along the chain to each link, and the capsule's own
    depth, reach = [0], [jnp.zeros((), geometry.axis.dtype)]
    for k, p in enumerate(structure.parent):
        depth.append(depth[p] + 1)
        reach.append(reach[p] + jnp.sqrt((geometry.anchor[k] ** 2).sum()))
    link = np.array(structure.capsule_link, int)
    square = jnp.maximum((geometry.start**2).sum(1), (geometry.end**2).sum(1))
    extent = jnp.stack(reach)[link] + jnp.sqrt(square) + geometry.radius
    # a rounding of both for each operation on the way
    pairs = np.array(structure.pairs, int).reshape(-1, 2)
    operations = 8 + 2 * np.array(depth)[link][pairs].max(1).astype(geometry.axis.dtype)
    return 8 * jnp.finfo(geometry.axis.dtype).eps * (operations * extent[pairs].sum(1) + by_angle)


def interval_bounds(
    structure: Structure,
    geometry: Geometry,
    theta: Float[jax.Array, "j c k"],
    width: Float[jax.Array, "c i"],
    bend: Float[jax.Array, "p c"],
    rounding: Float[jax.Array, " p"],
) -> tuple[Float[jax.Array, "p c i"], Float[jax.Array, "p c k"]]:
    """Lower bounds of the clearance between neighbouring samples (k = i + 1), and the clearance at the samples [m].

    Args:
        structure: of the robot.
        geometry: of the robot.
        theta: joint angles at the samples of stretches c, each on one edge [rad].
        width: from each sample to the next, as a share of the edge.
        bend: of `Edges`, for the edge of each stretch.
        rounding: of `Edges`.
    """
    joints, stretches, samples = theta.shape
    flat = pair_ends_from_between(structure, geometry, theta.reshape(joints, stretches * samples))
    ends = PairEnds(*(x.reshape(3, -1, stretches, samples) for x in flat))
    # distances and directions at the samples
    w = jnp.stack(materialize(tuple(between(*ends))))
    square = dot(w, w)
    distance = jnp.sqrt(square)
    normal = w / jnp.sqrt(jnp.where(square > 0, square, 1))[None]
    # least n . w at both ends of each interval, n halfway between the two directions
    halfway = _unit(normal[..., 1:] + normal[..., :-1])
    here = _support(halfway, PairEnds(*(x[..., :-1] for x in ends)))
    there = _support(halfway, PairEnds(*(x[..., 1:] for x in ends)))
    # and what a point leaves its chord by, M h^2 / 8
    chord = jnp.minimum(here, there) - bend[..., None] * (width * width)[None] / 8
    # less both radii, and rounding
    both = radii(structure, geometry)[:, None, None]
    return jnp.maximum(chord, 0) - both - rounding[:, None, None], distance - both


def _unit(vectors: Points) -> Points:
    """Vectors at unit length, or a little less; zero stays zero."""
    square = dot(vectors, vectors)
    shrink = 1 - 4 * jnp.finfo(square.dtype).eps
    scale = shrink / jnp.sqrt(jnp.where(square > 0, square, 1))
    return jnp.stack(materialize(tuple(scale * x for x in vectors)))


def _support(normal: Points, ends: PairEnds) -> jax.Array:
    """Least of `normal . (a - b)` over all points a, b of the two centre lines."""
    a0, a1, b0, b1 = (dot(normal, x) for x in ends)
    return jnp.minimum(a0, a1) - jnp.maximum(b0, b1)

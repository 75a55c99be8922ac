"""Clearance as a smooth condition for optimisers: sampled along the edges, and rounded off where the least one changes.

An optimiser needs one function with derivatives, `path_clearance` decides. So solve with `clearance_shortfall`, look at
the answer with `path_clearance`, and where samples missed something, ask for some more `margin` and solve again.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array, common_float
from reojax.collision.chains import Geometry, Structure, acceleration_bound, geometry_of, structure_of, unit_axes
from reojax.collision.clearance import radii
from reojax.collision.placement import pair_ends
from reojax.collision.segments import quick_distance, segment_distance
from reojax.robot import Robot

_ROUND = 0.001
"""Rounding of the least of several clearances, as a share of the mean sum of a pair's radii: hardly any, so that a
margin that rest barely has can be kept."""
_SHARE = 0.5
"""Share of what a pair has beyond the margin that is asked of it at most; rounding off takes some of the rest."""
_LONG = 4
"""Samples of an edge from which its nearest place is made more exact by a parabola; edges of a curve are short enough
without."""
_SAMPLES = 256
"""Samples of a path by default, one an edge at least. With 96, links pass through each other between two samples of a
fast loop of the prototype."""
_GROUPS = 12
"""Most conditions by default: the edges of a longer path share some."""


def clearance_shortfall(
    robot: Robot,
    waypoints: Float[Array, "v j"],
    margin: ArrayLike,
    *,
    samples: int | None = None,
    between: float = 0.0,
    groups: int = _GROUPS,
    more: Float[Array, " p"] | None = None,
) -> Float[jax.Array, " g"]:
    """What is missing to a clearance of `margin` along a path: negative where it is kept, for an inequality.

    Per edge, or per run of edges of a long path; in units of the mean sum of two radii, which makes it some 1 in size.
    The least over samples and pairs is rounded off to the safe side. Empty for robots without pairs.

    Args:
        robot: the robot.
        waypoints: corners [rad], two or more.
        margin: wanted clearance [m]; may be traced.
        samples: per edge, static; default 256 for the whole path.
        between: how much more is asked for because of what lies between samples, as a multiple of the bound
            `M h^2 / 8` on how far a point leaves its chord: 2 makes a proof by `path_clearance` all but sure, at a cost
            where edges are long.
        groups: most conditions.
        more: (p,) clearance wanted of each pair on top of `margin` [m], without derivatives; default none.
    """
    edges = waypoints.shape[0] - 1
    samples = samples or max(1, -(-_SAMPLES // edges))
    geometry, structure = geometry_of(robot), structure_of(robot)
    dtype = common_float(geometry, waypoints)
    points, geometry = jnp.asarray(waypoints, dtype), unit_axes(geometry, dtype)
    if not structure.pairs:
        return jnp.zeros(0, dtype)
    further = jnp.zeros(len(structure.pairs), dtype) if more is None else jnp.asarray(more, dtype)
    # least clearance of each edge, then rounded off over runs of edges
    least = _least(structure, samples, between, geometry, points[:-1], points[1:], jax.lax.stop_gradient(further))
    runs = np.array_split(np.arange(edges), min(edges, groups))
    rounded = [_ROUND * jax.nn.logsumexp(-least[run[0] : run[-1] + 1] / _ROUND) for run in runs]
    return jnp.stack(rounded) + jnp.asarray(margin, dtype) / _size(structure, geometry)


def with_spare(margin: float, spare: float, have: Float[np.ndarray, " p"]) -> Float[np.ndarray, " p"]:
    """Clearance to ask of each pair at samples [m]: some more than the margin, for what lies between them.

    Of a pair that has hardly the margin where the path has to pass, no more than half of what it `have`s beyond it.
    """
    return margin + np.minimum(spare, _SHARE * np.maximum(have - margin, 0.0))


def _size(structure: Structure, geometry: Geometry) -> jax.Array:
    return radii(structure, geometry).mean()


@partial(jax.custom_jvp, nondiff_argnums=(0, 1, 2))
def _least(
    structure: Structure,
    samples: int,
    between: float,
    geometry: Geometry,
    start: jax.Array,
    end: jax.Array,
    more: jax.Array,
) -> jax.Array:
    """Least clearance of each edge (e,), rounded off over the pairs, as `clearance_shortfall` has it.

    Its derivative is that at the nearest place of each edge alone, found first: one posture an edge.
    """
    share = _closest(structure, samples, geometry, start, end, more)
    return _at(structure, samples, between, geometry, start, end, more, share)


@partial(_least.defjvp, symbolic_zeros=True)
def _least_jvp(structure, samples, between, primals, tangents):
    geometry, start, end, more = primals
    share = _closest(structure, samples, geometry, start, end, more)

    def value(geometry: Geometry, start: jax.Array, end: jax.Array) -> jax.Array:
        return _at(structure, samples, between, geometry, start, end, more, share)

    least, back = jax.vjp(lambda start, end: value(geometry, start, end), start, end)
    by_start, by_end = back(jnp.ones_like(least))  # edges do not depend on each other: one pass for all
    change = jnp.zeros_like(least)
    for slope, moved in ((by_start, tangents[1]), (by_end, tangents[2])):
        if not _is_zero(moved):
            change = change + (slope * moved).sum(1)
    if not all(map(_is_zero, tangents[0])):
        filled = [jnp.zeros_like(x) if _is_zero(t) else t for x, t in zip(geometry, tangents[0], strict=True)]
        change = change + jax.jvp(lambda geometry: value(geometry, start, end), (geometry,), (Geometry(*filled),))[1]
    return least, change


def _is_zero(tangent: object) -> bool:
    return isinstance(tangent, SymbolicZero)


def _closest(
    structure: Structure, samples: int, geometry: Geometry, start: jax.Array, end: jax.Array, more: jax.Array
) -> Float[jax.Array, " e"]:
    """Where on each edge the robot comes nearest to itself, from 0 to 1.

    That is the nearest sample, moved to where the parabola through it and its two neighbours is least, if the robot is
    nearer there: so the place goes along smoothly as the edge changes, and little lies between the samples.
    """
    edges, reserve = len(start), radii(structure, geometry) + more

    def ends_at(share: jax.Array) -> list[jax.Array]:
        """Ends of the centre lines of all pairs (3, p, e, k) at places (e, k) of the edges."""
        theta = start.T[:, :, None] + (end - start).T[:, :, None] * share[None]
        flat = pair_ends(structure, geometry, theta.reshape(len(theta), -1))
        return [x.reshape(*x.shape[:2], *share.shape) for x in flat]

    # the nearest pair and sample of each edge
    share = jnp.broadcast_to(jnp.arange(samples + 1, dtype=start.dtype)[None] / samples, (edges, samples + 1))
    gap = (quick_distance(*ends_at(share)) - reserve[:, None, None]).swapaxes(0, 1)
    flat = gap.reshape(edges, -1).argmin(1)
    pair, nearest = flat // (samples + 1), flat % (samples + 1)
    place = nearest.astype(start.dtype)
    if samples >= _LONG:
        # vertex of the parabola through it and its neighbours
        edge, middle = np.arange(edges), jnp.clip(nearest, 1, samples - 1)
        before, here, after = (gap[edge, pair, middle + by] for by in (-1, 0, 1))
        least, bend = gap[edge, pair, nearest], before - 2 * here + after
        vertex = jnp.where(bend > 0, middle + 0.5 * (before - after) / jnp.where(bend > 0, bend, 1), place)
        vertex = jnp.clip(vertex, jnp.maximum(place - 1, 0), jnp.minimum(place + 1, samples))
        there = quick_distance(*(x[:, pair, edge, 0] for x in ends_at(vertex[:, None] / samples))) - reserve[pair]
        # where centre lines nearly cross, distances are no parabola: the sample, whose place does not move, is better
        smooth = least > -0.5 * reserve[pair]
        place = jnp.where(smooth & (there < least), vertex, place)
    return place / samples


def _at(
    structure: Structure,
    samples: int,
    between: float,
    geometry: Geometry,
    start: jax.Array,
    end: jax.Array,
    more: jax.Array,
    share: Float[jax.Array, " e"],
) -> Float[jax.Array, " e"]:
    """Least clearance of the pairs at one place of each edge, rounded off, in units of the mean sum of two radii."""
    theta = start + (end - start) * share[:, None]
    gap = segment_distance(*pair_ends(structure, geometry, theta.T)) - (radii(structure, geometry) + more)[:, None]
    # what lies between samples: the bound M h^2 / 8
    if between:
        gap = gap - between / (8 * samples**2) * acceleration_bound(structure, geometry, (end - start).T)
    # soft minimum over the pairs, -r log sum exp(-gap / r)
    return -_ROUND * jax.nn.logsumexp(-gap / (_ROUND * _size(structure, geometry)), axis=0)

"""Clearance along a whole path, proven: conservative advancement over intervals, until the least is known.

Conservative advancement (B. Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems, Berkeley 1996) with the
second-order bound of `bounds.py`. Every edge is cut into cells. Cells whose bound is not good enough, the worst first,
are gone through again in steps that are as long as the bound allows, as an integrator of differential equations
chooses its own.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array, common_float, is_concrete
from reojax.collision.bounds import Edges, edges_of, interval_bounds
from reojax.collision.chains import Geometry, Structure, geometry_of, structure_of, unit_axes
from reojax.collision.clearance import radii
from reojax.collision.placement import pair_ends
from reojax.collision.segments import segment_distance
from reojax.mechanics.input_checks import check_path, check_robot
from reojax.path import Path
from reojax.robot import Robot

_CELLS, _MOST_CELLS = 64, 16
"""Cells of a path to begin with, if its edges are few, and of an edge at most."""
_STEPS = 16
"""Intervals that are looked at together in a cell."""
_LONGEST = 20_000
"""Most rounds of these: a bound that is not as close as wanted by then is given as it is."""
_FINEST = 1e-6
"""Shortest interval, as a share of a cell."""


class PathClearance(NamedTuple):
    """How clear a robot stays of itself along a path."""

    distance: Float[Array, ""]
    """Proven: no pair comes closer than this anywhere along the path [m]; infinite for a robot without pairs."""
    pair: Int[Array, ""]
    """Which of `robot.collision_pairs` comes closest; -1 without pairs."""
    at: Float[Array, ""]
    """Where, from 0 to the number of edges: 2.25 is a quarter along the third edge."""
    found: Float[Array, ""]
    """Clearance of that pair there [m]: the true least lies from `distance` to `found`."""


def path_clearance(robot: Robot, path: Path, *, tolerance: float = 1e-4) -> PathClearance:
    """Least clearance along a whole path, as a proven lower bound that is within `tolerance` of the true least.

    Proven means: not sampled. Between samples a capsule leaves its chord no further than the joints between the two
    capsules can bend its way, so intervals are shortened until that decides. Rounding is allowed for. The derivative of
    `distance` is that of the clearance of `pair` at `at`.

    Args:
        robot: the robot.
        path: the path in shape space.
        tolerance: how far `distance` may lie below the true least [m]; rounding (in float32 some 1e-5 of the robot's
            size) may make it more.

    Raises:
        ValueError: if the path's joints do not match the robot's, its angles are not finite, or `tolerance` is not
            positive.
    """
    points = check_path(check_robot(robot), path).waypoints
    if is_concrete(tolerance):
        tolerance = checks.positive("tolerance", tolerance, "m")
    return least_clearance(robot, points, tolerance)


def least_clearance(
    robot: Robot,
    waypoints: Float[Array, "v j"],
    tolerance: ArrayLike = 1e-4,
    enough: ArrayLike = -np.inf,
    margin: ArrayLike = np.inf,
) -> PathClearance:
    """`path_clearance` of checked waypoints, which may also stop as soon as it is known what is asked.

    Many paths under `vmap` go one after another: side by side all would wait for the slowest, out of the cache.

    Args:
        robot: the robot.
        waypoints: corners [rad].
        tolerance: as there [m].
        enough: stop at any sample below this clearance [m]; default never.
        margin: stop once this clearance is proven [m]; default never.
    """
    geometry = geometry_of(robot)
    dtype = common_float(geometry, waypoints)
    return _least_clearance(geometry, waypoints, (tolerance, enough, margin), structure_of(robot), dtype)


def look_for(margin: float) -> tuple[float, float, float]:
    """Limits of `least_clearance` that look no closer than it takes to tell whether a margin [m] is kept."""
    return 0.02 * abs(margin) + 1e-5, margin, margin


@partial(jax.jit, static_argnums=(3, 4))
def _least_clearance(
    geometry: Geometry,
    waypoints: Array,
    limits: tuple[ArrayLike, ArrayLike, ArrayLike],
    structure: Structure,
    dtype: np.dtype,
) -> PathClearance:
    if not structure.pairs:
        far = jnp.full((), jnp.inf, dtype)
        return PathClearance(far, jnp.full((), -1), jnp.zeros((), dtype), far)
    geometry, points = unit_axes(geometry, dtype), jnp.asarray(waypoints, dtype)
    numbers = jax.lax.stop_gradient((geometry, points, *(jnp.asarray(x, dtype) for x in limits)))
    result = jax.custom_batching.sequential_vmap(partial(_search, structure))(*numbers)
    # what the least clearance gains is what the pair gains where it is closest (envelope theorem)
    theta = posture_at(points, result.at)[:, None]
    here = (segment_distance(*pair_ends(structure, geometry, theta))[:, 0] - radii(structure, geometry))[result.pair]
    gain = here - jax.lax.stop_gradient(here)
    return result._replace(distance=result.distance + gain, found=result.found + gain)


def posture_at(waypoints: Float[Array, "v j"], at: ArrayLike) -> Float[jax.Array, " j"]:
    """Joint angles [rad] at a place along a path, from 0 to the number of edges."""
    points = jnp.asarray(waypoints)
    if points.shape[0] == 1:
        return points[0]
    at = jnp.asarray(at, points.dtype)
    edge = jnp.clip(at.astype(int), 0, points.shape[0] - 2)
    return points[edge] + (at - edge.astype(points.dtype)) * (points[edge + 1] - points[edge])


class _Search(NamedTuple):
    """Where the search is: what is known of all cells, and how far the present one has been gone through."""

    low: jax.Array
    """(c,) proven bound of each cell."""
    best: PathClearance
    """The least sample so far."""
    cell: jax.Array
    done: jax.Array
    """Share of the cell that is proven, and the bound of it."""
    proven: jax.Array
    step: jax.Array
    """Next step, as a share of the cell."""
    rounds: jax.Array


def _search(
    structure: Structure,
    geometry: Geometry,
    waypoints: jax.Array,
    tolerance: jax.Array,
    enough: jax.Array,
    margin: jax.Array,
) -> PathClearance:
    edges = edges_of(structure, geometry, waypoints)
    tolerance = jnp.maximum(tolerance, 4 * edges.rounding.max())
    cells = max(1, min(_CELLS // edges.start.shape[1], _MOST_CELLS))

    def goal(least: Array) -> jax.Array:
        """Bound that is good enough everywhere."""
        return jnp.where(least < enough, -jnp.inf, jnp.minimum(least - tolerance, margin))

    def going(search: _Search) -> jax.Array:
        return (search.low.min() < goal(search.best.found)) & (search.rounds < _LONGEST)

    def advance(search: _Search) -> _Search:
        seen = _look_ahead(structure, geometry, edges, cells, search)
        best = jax.tree.map(
            lambda new, old: jnp.where(seen.least.found < search.best.found, new, old), seen.least, search.best
        )
        return _advance(search._replace(best=best), seen, goal(best.found))

    last = jax.lax.while_loop(going, advance, _look_at_all(structure, geometry, edges, cells))
    return last.best._replace(distance=last.low.min(), at=jnp.minimum(last.best.at, waypoints.shape[0] - 1))


def _look_at_all(structure: Structure, geometry: Geometry, edges: Edges, cells: int) -> _Search:
    """The search at its beginning: a bound for each of the `cells` of every edge, and the least sample between them."""
    count, dtype = edges.start.shape[1], edges.start.dtype
    # postures at the ends of all cells (j, e, cells + 1)
    share = jnp.arange(cells + 1, dtype=dtype) / cells
    theta = edges.start[:, :, None] + edges.turn[:, :, None] * share[None, None]
    width = jnp.full((count, cells), 1 / cells, dtype)
    lower, sampled = interval_bounds(structure, geometry, theta, width, edges.bend, edges.rounding)
    place = jnp.arange(count, dtype=dtype)[:, None] + share[None]
    # the cell of least bound is the first to be looked into
    low = lower.min(0).reshape(-1)
    done, proven, step = (jnp.full((), x, low.dtype) for x in (0, jnp.inf, 1 / _STEPS))
    return _Search(low, _least(sampled, place), low.argmin(), done, proven, step, jnp.zeros((), int))


class _Seen(NamedTuple):
    """What the next intervals of a cell are like."""

    least: PathClearance
    """The least of their samples."""
    bound: jax.Array
    """(i,) proven bound of each interval, over all pairs."""
    nearest: jax.Array
    """(i + 1,) least sample at each end."""


def _look_ahead(structure: Structure, geometry: Geometry, edges: Edges, cells: int, search: _Search) -> _Seen:
    """The next `_STEPS` intervals of the present cell."""
    dtype = search.low.dtype
    edge, inside = search.cell // cells, (search.cell % cells).astype(dtype)
    # postures at the ends of the intervals, held within the cell
    ahead = jnp.minimum(search.done + search.step * jnp.arange(_STEPS + 1, dtype=dtype), 1)
    share = (inside + ahead) / cells
    theta = edges.start[:, edge, None] + edges.turn[:, edge, None] * share[None]
    # bounds of the intervals, and the samples between them
    width = (share[1:] - share[:-1])[None]
    bend = edges.bend[:, edge, None]
    lower, sampled = interval_bounds(structure, geometry, theta[:, None], width, bend, edges.rounding)
    least = _least(sampled, (edge.astype(dtype) + share)[None])
    return _Seen(least, lower.min((0, 1)), sampled.min((0, 1)))


def _advance(search: _Search, seen: _Seen, wanted: jax.Array) -> _Search:
    """Go over the intervals whose bound is good enough, choose the next step, and the next cell if this one is done."""
    dtype = search.low.dtype
    # intervals proven one after another
    good = (seen.bound >= wanted) | (search.step <= _FINEST)
    run = jnp.cumprod(good.astype(int)).sum()
    proven = jnp.minimum(search.proven, jnp.where(jnp.arange(_STEPS) < run, seen.bound, jnp.inf).min())
    done = search.done + run * search.step
    # the bound falls short by some h^2: the step with which the next one just does
    least = jnp.minimum(seen.nearest[1:], seen.nearest[:-1])
    short = jnp.maximum(least - seen.bound, jnp.finfo(dtype).tiny)
    room = jnp.sqrt(jnp.maximum(least - wanted, 0) / short)
    room = jnp.where(run == _STEPS, room.min(), room[jnp.minimum(run, _STEPS - 1)])
    step = jnp.maximum(search.step * jnp.clip(0.9 * room, 0.1, 4), _FINEST)
    # through with this cell: on to the one of least bound
    through = done >= 1
    low = search.low.at[search.cell].set(jnp.where(through, proven, search.low[search.cell]))
    return _Search(
        low,
        search.best,
        jnp.where(through, low.argmin(), search.cell),
        jnp.where(through, 0, done),
        jnp.where(through, jnp.inf, proven),
        jnp.where(through, 1 / _STEPS, step),
        search.rounds + 1,
    )


def _least(sampled: Float[jax.Array, "p c k"], place: Float[jax.Array, "c k"]) -> PathClearance:
    """The least of samples, and where it is."""
    number = sampled.argmin()
    samples = place.size
    least = sampled.reshape(-1)[number]
    return PathClearance(least, number // samples, place.reshape(-1)[number % samples], least)

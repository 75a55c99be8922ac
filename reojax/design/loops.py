"""Families of closed loops in shape space, each as a vector of coefficients in a box: rectangles and polygons.

Joint travel has a kink wherever a joint rests on an edge, and the loops of least travel are full of such edges. Here
every move has a part up and a part down, both at least 0, so that travel is linear in the coefficients and a joint at
rest is a bound; cost keeps one of the two parts at 0.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array, as_numbers
from reojax._internal.checks import numbers
from reojax.design.variables import Variable
from reojax.manoeuvres import Layout, check_layout, rectangle_corners
from reojax.path import Path
from reojax.robot import Robot, layout_of


class Loops(NamedTuple):
    """A family of closed loops within joint limits."""

    name: str
    variable: Variable
    """The coefficients with their bounds, to be named in a design problem."""
    path: Callable[[Array], Path]
    """The loop of coefficients (n,); it closes exactly, whatever they are."""
    travel: Callable[[Array], Array]
    """Joint travel [rad], smooth in the coefficients; that of `path` once `equality` holds and parts do not overlap."""
    equality: Callable[[Array], Array]
    """(p,) must be 0."""
    inequality: Callable[[Array], Array]
    """(q,) must not be positive; then the whole loop is within the joint limits."""
    random: Callable[[np.random.Generator, int], np.ndarray]
    """(m, n) coefficients of random loops within the limits."""


def rectangles(
    robot: Robot, *, layout: Layout | None = None, start: ArrayLike = 0.0, lead: bool = False, name: str = "loop"
) -> Loops:
    """Rectangles with an amplitude of its own for every joint: bend, twist, unbend, untwist (thesis figure 2.1).

    The centre joint of the layout makes the first and third edge, its distal joints the second and fourth, each with
    an amplitude of either sign; the manoeuvres A and B are those of equal twists.

    Args:
        robot: its limits are kept.
        layout: which joints bend and twist; default the robot's own. Folding is left out.
        start: number or (j,), where the loops begin and end [rad].
        lead: whether a straight edge may lead from `start` to the rectangle, and back.
        name: name of the coefficients.

    Raises:
        ValueError: for a start outside of the joint limits, a joint without limits, or no layout.
    """
    if not isinstance(lead, bool | np.bool_):
        raise ValueError(f"`lead` is {checks.shorten(lead)}; it must be True or False.")
    layout = layout_of(checks.instance("robot", robot, Robot, "`make_robot` makes")) if layout is None else layout
    check_layout(layout)
    if layout.joints != robot.joints:
        raise ValueError(f"`layout` is for {layout.joints} joints; {robot.name!r} has {robot.joints} joints.")
    edges = np.diff(rectangle_corners(layout), axis=0)
    if lead:
        away = np.eye(robot.joints)[None]
        moves = np.zeros((6, robot.joints, 3 + robot.joints))
        moves[1:5, :, :3], moves[:1, :, 3:], moves[5:, :, 3:] = edges, away, -away
        edges = moves
    return _of_moves("rectangle", robot, edges, start, name)


def polygons(robot: Robot, corners: int, *, start: ArrayLike = 0.0, name: str = "loop") -> Loops:
    """Closed polygons with `corners` free corners besides `start`.

    Args:
        robot: its limits are kept.
        corners: number of free corners, at least 2.
        start: number or (j,), where the loops begin and end [rad].
        name: name of the coefficients.

    Raises:
        ValueError: for too few corners, a start outside of the joint limits, or a joint without limits.
    """
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    checks.whole("corners", corners, 2, 10**4)
    moves = (corners + 1) * robot.joints
    edges = np.eye(moves).reshape(corners + 1, robot.joints, moves)
    return _of_moves(f"polygon of {corners} corners", robot, edges, start, name)


def _of_moves(kind: str, robot: Robot, edges: np.ndarray, start: ArrayLike, name: str) -> Loops:
    """Loops whose edges are `edges` (e, j, k) times k moves, each with a part up and a part down."""
    low, high, origin = limits_of(robot, start, name)
    count = edges.shape[2]
    # travel of a unit of each part; its largest useful size; corners as running sums of the edges
    price = np.tile(np.abs(edges).sum((0, 1)), 2)
    reach = np.einsum("ejk,j->k", np.abs(edges) > 0, high - low) / (np.abs(edges) > 0).sum((0, 1))
    corner = np.cumsum(edges, axis=0)
    open_end = np.abs(corner[-1]).max() > 0

    def corners(x: Array) -> Array:
        up, down = x[:count], x[count:]
        return jnp.asarray(corner, x.dtype) @ (up - down) + jnp.asarray(origin, x.dtype)[None]

    def path(x: Array) -> Path:
        first = jnp.asarray(origin, x.dtype)[None]
        return Path(jnp.concatenate([first, corners(x)[:-1], first]))

    def travel(x: Array) -> Array:
        return jnp.asarray(price, x.dtype) @ x

    def equality(x: Array) -> Array:
        return corners(x)[-1] - jnp.asarray(origin, x.dtype) if open_end else jnp.zeros(0, x.dtype)

    def inequality(x: Array) -> Array:
        inner = corners(x)[:-1]
        above, below = (jnp.asarray(limit, x.dtype)[None] for limit in (high, low))
        return jnp.concatenate([inner - above, below - inner]).reshape(-1)

    def random(rng: np.random.Generator, starts: int) -> np.ndarray:
        if open_end:
            points = rng.uniform(low, high, (starts, len(edges) - 1, robot.joints))
            ends = np.broadcast_to(origin, (starts, 1, robot.joints))
            moves = np.diff(np.concatenate([ends, points, ends], axis=1), axis=1).reshape(starts, count)
        else:  # shorten the moves of a loop that leaves the limits
            moves = rng.uniform(-1, 1, (starts, count)) * reach
            away = np.einsum("ejk,mk->mej", corner, moves)
            room = np.where(away > 0, high - origin, low - origin)
            share = np.where(away == 0, 1.0, room / np.where(away == 0, 1.0, away)).min((1, 2))
            moves *= np.minimum(1.0, share)[:, None]
        return np.concatenate([np.maximum(moves, 0), np.maximum(-moves, 0)], axis=1)

    variable = Variable(name, np.zeros(2 * count), np.tile(reach, 2), "rad")
    return Loops(kind, variable, path, travel, equality, inequality, random)


def limits_of(robot: Robot, start: ArrayLike, name: str = "loop") -> tuple[Float[np.ndarray, " j"], ...]:
    """Lower and upper limits, and the start as (j,), checked."""
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    if np.shape(robot.lower) != (robot.joints,):
        raise ValueError(f"`robot.lower` has shape {np.shape(robot.lower)}; of one robot it is ({robot.joints},).")
    if not isinstance(name, str):
        raise ValueError(f"`name` is {checks.shorten(name)}; it must be a string.")
    checks.on_host("robot", robot, "what makes loops")
    if not robot.joints:
        raise ValueError(f"{robot.name!r} has no joints; a loop moves some.")
    low, high = np.asarray(robot.lower, float), np.asarray(robot.upper, float)
    for k in np.flatnonzero(~(np.isfinite(low) & np.isfinite(high))):
        raise ValueError(f"joint {robot.joint_names[k]!r} has no limits; loops need finite `lower` and `upper`.")
    point = np.asarray(as_numbers("start", start))
    given: Any = np.broadcast_to(point, (robot.joints,)) if point.ndim == 0 else point
    origin = numbers("start", given, (robot.joints,))
    for k in np.flatnonzero((origin < low) | (origin > high)):
        raise ValueError(f"start[{k}] is {origin[k]:g} rad; that joint moves from {low[k]:g} to {high[k]:g}.")
    return low, high, origin

"""A table of motions over a grid of momenta: looked up on board when the release has been measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from reojax import so3
from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax._internal.precision import in_double
from reojax.motion.motor import Motor
from reojax.motion.trajectory import Trajectory
from reojax.robot import Robot
from reojax.steering.end import end_of
from reojax.steering.newton import EXACT_STEPS, solve
from reojax.steering.result import trajectory_through
from reojax.steering.righting import righting, task_of
from reojax.steering.search import in_lanes

_SAFETY = 2.0
"""Times the second differences that were seen, for those that were not."""
_LANES = 16


class RightingTable(NamedTuple):
    """Motions at the corners of a grid of momenta; between them the points of the splines are interpolated."""

    axes: tuple[np.ndarray, ...]
    """Three: momentum about each axis, inertial frame [kg m^2/s]."""
    points: Float[np.ndarray, "a b c p+1 j"]
    """Of the spline of each motion [rad]."""
    duration: Float[np.ndarray, ""]
    """Of all of them [s]."""
    converged: Bool[np.ndarray, "a b c"]
    """Whether the motion at each corner reaches the target within the limits."""
    miss: Float[np.ndarray, "a-1 b-1 c-1"]
    """Bound of the miss in each cell [rad]: from its value and slope at 27 places and the second differences between
    them, doubled. Honest, not proven: it supposes that slopes turn nowhere twice as sharply as they were seen to."""

    def at(self, momentum: ArrayLike) -> Float[np.ndarray, "p+1 j"]:
        """Points of the motion for a momentum within the grid. NumPy alone.

        Raises:
            ValueError: if the momentum lies outside the grid.
        """
        h = np.asarray(checks.numbers("momentum", momentum, (3,)))
        found = np.asarray(self.points)
        for k, axis in enumerate(self.axes):
            if not axis[0] <= h[k] <= axis[-1]:
                raise ValueError(f"momentum[{k}] is {h[k]:g}; the table goes from {axis[0]:g} to {axis[-1]:g}.")
            i = int(np.clip(np.searchsorted(axis, h[k], side="right") - 1, 0, len(axis) - 2))
            share = (h[k] - axis[i]) / (axis[i + 1] - axis[i])
            found = (1 - share) * found[i] + share * found[i + 1]
        return found

    def trajectory(self, momentum: ArrayLike) -> Trajectory:
        """The motion for a momentum within the grid."""
        return trajectory_through(self.at(momentum), float(self.duration))


@in_double
def righting_table(
    robot: Robot,
    target: ArrayLike,
    *,
    momenta: Sequence[ArrayLike],
    duration: float,
    start: ArrayLike | None = None,
    end: ArrayLike | None = None,
    motors: Motor | Sequence[Motor] | None = None,
    clearance: float | None = None,
    weights: ArrayLike | None = None,
    pieces: int | None = None,
    tolerance: float = 1e-6,
    max_steps: int = 40,
    seed: int = 0,
) -> RightingTable:
    """Motions for every corner of a grid of momenta, each from its neighbour's, so that what lies between is near them.

    Args:
        robot: the robot.
        target: (3, 3) orientation at the end.
        momenta: three increasing axes of two numbers or more: the grid [kg m^2/s].
        duration: of the motions [s].
        start: as for `righting`, like all that follow.
        end: see there.
        motors: see there.
        clearance: see there.
        weights: see there.
        pieces: see there.
        tolerance: angle to the target that counts as reached [rad].
        max_steps: most steps of the solver from each start.
        seed: of the random motions to start from.

    Raises:
        ValueError: naming the entry, its value and the rule; or if the motion of the middle is not found.
    """
    goal = checks.rotations("target", target)
    momenta = checks.listing("momenta", momenta, "three axes of a grid")
    if len(momenta) != 3:
        raise ValueError(f"`momenta` has {len(momenta)} axes; it must have 3, one for each component.")
    axes = tuple(np.asarray(checks.numbers(f"momenta[{k}]", axis, (-1,))) for k, axis in enumerate(momenta))
    for k, axis in enumerate(axes):
        if len(axis) < 2 or not (np.diff(axis) > 0).all():
            raise ValueError(f"momenta[{k}] is {axis.tolist()}; it must be two or more numbers that increase.")
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    seconds = checks.positive("duration", duration, "s")
    task, pieces = task_of(robot, grid.reshape(-1, 3), seconds, start, end, motors, clearance, weights, pieces)
    shape = grid.shape[:3]
    middle = tuple(n // 2 for n in shape)
    first = righting(robot, goal, momentum=grid[middle], duration=seconds, start=start, end=end, motors=motors,
                     clearance=clearance, weights=weights, pieces=pieces, tolerance=tolerance,
                     max_steps=max_steps, seed=seed)  # fmt: skip
    if not first.converged:
        raise ValueError(f"no motion was found at the middle of the grid, {grid[middle].tolist()} kg m^2/s.")
    points = np.zeros((*shape, pieces + 1, robot.joints))
    good = np.zeros(shape, bool)
    points[middle], good[middle] = first.points, True
    rings = np.abs(np.moveaxis(np.indices(shape), 0, -1) - middle).sum(-1)
    for ring in range(1, rings.max() + 1):
        here = [tuple(i) for i in np.argwhere(rings == ring)]
        guess = np.stack([_inward(points, good, i, middle) for i in here])
        h = np.stack([grid[i] for i in here])
        goals, durations = np.tile(goal, (len(here), 1, 1)), np.full(len(here), seconds)
        out = in_lanes(
            _LANES,
            lambda p, g, h, t: solve(task, pieces, max_steps, p, g, h, t, tolerance),
            (guess, goals, h, durations),
        )
        reached = out.reached(tolerance)
        for k, i in enumerate(here):
            points[i], good[i] = out.points[k], reached[k]
    for i in np.argwhere(~good):  # not found from its neighbours: by a search of its own
        at = tuple(i)
        own = righting(robot, goal, momentum=grid[at], duration=seconds, start=start, end=end, motors=motors,
                       clearance=clearance, weights=weights, pieces=pieces, tolerance=tolerance,
                       max_steps=max_steps, seed=seed, shorten=False)  # fmt: skip
        points[at], good[at] = own.points, bool(own.converged)
    miss = _bounds(robot, goal, axes, points, seconds)
    corner = np.ones_like(miss, bool)
    for shift in np.ndindex(2, 2, 2):
        corner &= good[tuple(slice(s, n - 1 + s) for s, n in zip(shift, shape, strict=True))]
    return RightingTable(axes, points, np.asarray(seconds), good, np.where(corner, miss, np.inf))


def _inward(points: np.ndarray, good: np.ndarray, at: tuple[int, ...], middle: tuple[int, ...]) -> np.ndarray:
    """Mean of the neighbours that lie nearer to the middle, those that were reached if there are any."""
    near = []
    for k in range(3):
        if at[k] != middle[k]:
            i = list(at)
            i[k] += int(np.sign(middle[k] - at[k]))
            near.append(tuple(i))
    chosen = [i for i in near if good[i]] or near
    return np.mean([points[i] for i in chosen], axis=0)


def _bounds(robot: Robot, goal: np.ndarray, axes, points: np.ndarray, duration: float) -> np.ndarray:
    """Bound of the miss of each cell."""
    places = np.stack(np.meshgrid(*[np.linspace(0, 1, 3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    bounds = np.zeros(tuple(len(axis) - 1 for axis in axes))
    known = jax.tree.map(lambda x: jnp.asarray(x, float), robot)
    for cell in np.ndindex(bounds.shape):
        corners = points[tuple(slice(i, i + 2) for i in cell)]
        low = np.array([axis[i] for axis, i in zip(axes, cell, strict=True)])
        size = np.array([axis[i + 1] - axis[i] for axis, i in zip(axes, cell, strict=True)])
        value, slope = jax.tree.map(np.asarray, _misses(known, corners, low, size, goal, duration, places))
        value, slope = value.reshape(3, 3, 3, 3), slope.reshape(3, 3, 3, 3, 3)  # slope[..., a, k] by share k
        second = np.stack([2 * np.abs(np.diff(slope, axis=k)).max((0, 1, 2)) for k in range(3)])  # [k, a, l]
        reach = 0.25  # every place of the cell is that near to one of the 27, along each axis
        most = np.linalg.norm(np.abs(value) + reach * np.abs(slope).sum(-1), axis=-1).max()
        bounds[cell] = most + 0.5 * _SAFETY * reach**2 * np.linalg.norm(second.sum((0, 2)))
    return bounds


@jax.jit
def _misses(robot, corners, low, size, goal, duration, places) -> tuple[Array, Array]:
    """Rotation vectors that are missed at the places (q, 3) of a cell, and their slopes by the place."""

    def miss(share: Array) -> tuple[Array, Array]:
        points = corners
        for k in range(3):
            points = (1 - share[k]) * points[0] + share[k] * points[1]
        end = end_of(robot, points, duration, low + share * size, EXACT_STEPS)[-1]
        found = so3.log(end @ goal.T)
        return found, found

    def both(share: Array) -> tuple[Array, Array]:
        slope, value = jax.jacfwd(miss, has_aux=True)(share)
        return value, slope

    asked = [jnp.asarray(x, float) for x in (corners, low, size, goal, duration, places)]
    corners, low, size, goal, duration, places = asked
    return jax.lax.map(both, places, batch_size=9)

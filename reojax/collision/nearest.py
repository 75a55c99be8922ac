"""Where along a path a robot comes nearest to itself: which parts, in which posture, and the two nearest points."""

from __future__ import annotations

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.precision import as_double
from reojax.collision.chains import geometry_of, structure_of, unit_axes
from reojax.collision.clearance import pair_name, without_pairs
from reojax.collision.path_clearance import path_clearance, posture_at
from reojax.collision.placement import pair_ends
from reojax.collision.segments import closest_parameters
from reojax.mechanics.input_checks import check_path, check_robot
from reojax.path import Path
from reojax.robot import Robot


class Nearest(NamedTuple):
    """The place along a path where the robot's parts are nearest to each other."""

    distance: float
    """Proven: no pair comes closer than this anywhere along the path [m]."""
    found: float
    """Clearance of the pair at the place [m]."""
    pair: int
    """Which of `robot.collision_pairs`."""
    name: str
    """Its two links by name."""
    links: tuple[int, int]
    """Its two links by number."""
    at: float
    """Where, from 0 to the number of edges."""
    theta: Float[np.ndarray, " j"]
    """Joint angles there [rad]."""
    points: Float[np.ndarray, "2 3"]
    """The nearest points of the two surfaces, base frame [m]; past each other where the parts overlap."""


def nearest_parts(robot: Robot, path: Path, *, tolerance: float = 1e-4) -> Nearest:
    """Find where along a path the robot's parts come nearest to each other; computed in double precision.

    Args:
        robot: the robot.
        path: the path in shape space, with numbers that can be read; of one waypoint for a posture.
        tolerance: as for `path_clearance`.

    Raises:
        ValueError: as `path_clearance`, and for a robot that has no pairs of shapes.
    """
    check_path(check_robot(robot), path)
    if not robot.collision_pairs:
        raise ValueError(without_pairs(robot))
    with jax.enable_x64(True):
        robot, path = as_double((robot, path))
        least = path_clearance(robot, path, tolerance=tolerance)
        theta = np.asarray(posture_at(path.waypoints, least.at), float)
        pair = int(least.pair)
        first, second = robot.collision_pairs[pair]
        return Nearest(
            distance=float(least.distance),
            found=float(least.found),
            pair=pair,
            name=pair_name(robot, pair),
            links=(robot.capsule_link[first], robot.capsule_link[second]),
            at=float(least.at),
            theta=theta,
            points=nearest_points(robot, theta, pair),
        )


def nearest_points(robot: Robot, theta: ArrayLike, pair: int) -> Float[np.ndarray, "2 3"]:
    """Points of a pair's two surfaces on the shortest line between their centre lines, base frame [m].

    Of centre lines that cross, the points where they do.
    """
    with jax.enable_x64(True):
        geometry = unit_axes(geometry_of(robot), np.dtype(float))
        ends = pair_ends(structure_of(robot), geometry, np.asarray(theta, float)[:, None])
        s, t = (float(share) for share in closest_parameters(*(end[:, pair, 0] for end in ends)))
        a0, a1, b0, b1 = (np.asarray(end)[:, pair, 0] for end in ends)
    # on the centre lines, and outwards from them by the radii along the line between
    inner = np.stack([a0 + s * (a1 - a0), b0 + t * (b1 - b0)])
    apart = inner[1] - inner[0]
    length = np.linalg.norm(apart)
    normal = apart / length if length > 0 else apart
    radius = np.asarray(robot.capsule_radius, float)[list(robot.collision_pairs[pair])]
    return inner + radius[:, None] * np.stack([normal, -normal])

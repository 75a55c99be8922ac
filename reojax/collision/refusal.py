"""Paths that must keep a clearance: refused where they do not, with the pair and the place."""

from __future__ import annotations

from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import is_concrete
from reojax.collision.clearance import pair_name
from reojax.collision.path_clearance import PathClearance, path_clearance
from reojax.path import Path
from reojax.robot import Robot


def require_clearance(robot: Robot, path: Path, clearance: ArrayLike) -> PathClearance:
    """Return the proven clearance of a path that keeps `clearance` [m] all along.

    Raises:
        ValueError: if it does not, naming the two links, how near they come, and where; or if the robot has no pairs,
            the clearance is no number from 0 up, or the numbers cannot be read: under `jit`, `vmap` or `grad`.
    """
    wanted = checks.number("clearance", clearance, unit="m", least=0.0)
    if not is_concrete((robot, path)):
        raise ValueError("`clearance` is asked for on traced numbers; call `path_clearance`, which takes them.")
    if not robot.collision_pairs:
        raise ValueError(
            f"`clearance` is {wanted:g} m, but {robot.name!r} has no pairs of shapes to keep apart: give it `capsules`."
        )
    least = path_clearance(robot, path)
    if not least.distance >= wanted:
        where = f"{pair_name(robot, int(least.pair))}, {float(least.at):.3f} edges along it"
        gap = float(least.found)
        how = f"overlap by {-gap:.6g} m" if gap < 0 else f"come within {max(float(least.distance), 0.0):.6g} m"
        raise ValueError(f"`clearance` is {wanted:g} m, which the path does not keep: parts {how}, between {where}.")
    return least

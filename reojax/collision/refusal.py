"""Paths and postures that must keep a clearance: refused where they do not, with the pair and the place."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import is_concrete
from reojax.collision.clearance import clearance as clearance_at, pair_name, without_pairs
from reojax.collision.path_clearance import PathClearance, path_clearance
from reojax.path import Path
from reojax.robot import Robot


def require_clearance(robot: Robot, path: Path, clearance: ArrayLike) -> PathClearance:
    """Return the proven clearance of a path that keeps `clearance` [m] all along.

    Raises:
        ValueError: if it does not, naming the two links, how near they come, and where; or if the robot has no pairs,
            the clearance is no number from 0 up, or the numbers cannot be read: under `jit`, `vmap` or `grad`.
    """
    if not is_concrete((robot, path)):
        raise ValueError("`clearance` is asked for on traced numbers; call `path_clearance`, which takes them.")
    wanted = _check_margin(robot, clearance)
    least = path_clearance(robot, path)
    if not least.distance >= wanted:
        where = f"{pair_name(robot, int(least.pair))}, {float(least.at):.3f} edges along it"
        gap = float(least.found)
        how = f"overlap by {-gap:.6g} m" if gap < 0 else f"come within {max(float(least.distance), 0.0):.6g} m"
        raise ValueError(f"`clearance` is {wanted:g} m, which the path does not keep: parts {how}, between {where}.")
    return least


def check_clearance(
    robot: Robot, margin: ArrayLike, postures: dict[str, np.ndarray]
) -> tuple[float, Float[np.ndarray, " p"]]:
    """Return the clearance asked for, if the robot has it at the postures that every path passes, and what it has.

    The latter is the least of each pair at these postures [m].

    Raises:
        ValueError: naming the pair, if the margin is no number from 0 up, the robot has no pairs, or a posture has not
            that much clearance or is in contact already.
    """
    wanted = _check_margin(robot, margin)
    have = [np.asarray(clearance_at(robot, theta), float) for theta in postures.values()]
    for name, here in zip(postures, have, strict=True):
        worst = int(here.argmin())
        pair = pair_name(robot, worst)
        if here[worst] < 0:
            raise ValueError(f"{name} is in contact: {pair} overlap by {-here[worst]:.6g} m.")
        if here[worst] < wanted:
            raise ValueError(
                f"`clearance` is {wanted:g} m, which {name} does not have: {pair} are {here[worst]:.6g} m apart."
            )
    return wanted, np.min(have, axis=0)


def _check_margin(robot: Robot, margin: ArrayLike) -> float:
    """The clearance asked for, of a robot that has pairs to keep apart."""
    wanted = checks.number("clearance", margin, unit="m", least=0.0)
    if not robot.collision_pairs:
        raise ValueError(f"`clearance` is {wanted:g} m, but {without_pairs(robot)}")
    return wanted

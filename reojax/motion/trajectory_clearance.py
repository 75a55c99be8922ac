"""Clearance along a motion in time, proven, though its joints go along curves.

The curve is a polynomial by pieces. Cut into short stretches, each stays near its chord: a polynomial lies between its
least and largest Bernstein coefficient, and so does its difference from the chord. A joint that is off by `d` moves no
point of a capsule by more than `d` times the lever that lengths along the chain allow, so the clearance of the polygon
of chords less this much is a bound for the curve. Stretches are made short until it is little.
"""

from __future__ import annotations

from math import comb
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float, Int

from reojax._internal import checks
from reojax._internal.arrays import Array, is_concrete
from reojax._internal.precision import as_double
from reojax.collision.chains import geometry_of, moved_per_angle, structure_of, unit_axes
from reojax.collision.clearance import clearance
from reojax.collision.path_clearance import path_clearance
from reojax.motion.trajectory import Trajectory
from reojax.path import Path
from reojax.robot import Robot

_FIRST, _MOST = 8, 1024
"""Stretches of a piece, to begin with and at most: a bound that is not as close as wanted by then is given as it is."""


class TrajectoryClearance(NamedTuple):
    """How clear a robot stays of itself during a motion."""

    distance: Float[Array, ""]
    """Proven: no pair comes closer than this at any time [m]; infinite for a robot without pairs."""
    pair: Int[Array, ""]
    """Which of `robot.collision_pairs` comes closest; -1 without pairs."""
    time: Float[Array, ""]
    """When [s]."""
    found: Float[Array, ""]
    """Clearance of that pair then [m]: the true least lies from `distance` to `found`."""


def trajectory_clearance(robot: Robot, trajectory: Trajectory, *, tolerance: float = 1e-4) -> TrajectoryClearance:
    """Least clearance during a whole motion, as a proven lower bound; `path_clearance` for joints that go along curves.

    Computed on the host, in double precision.

    Args:
        robot: the robot.
        trajectory: the motion, of numbers that can be read: not under `jit`.
        tolerance: how far `distance` may lie below the true least [m].

    Raises:
        ValueError: if the motion's joints do not match the robot's, something is not finite or traced, or `tolerance`
            is not positive.
    """
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    checks.instance("trajectory", trajectory, Trajectory, "`along` makes")
    near = checks.positive("tolerance", tolerance, "m")
    if trajectory.joints != robot.joints:
        raise ValueError(f"`trajectory` moves {trajectory.joints} joints; {robot.name!r} has {robot.joints}.")
    if not is_concrete((robot, trajectory)):
        raise ValueError("`trajectory_clearance` reads numbers; these are traced, under `jit`, `vmap` or `grad`.")
    length = np.diff(np.asarray(trajectory.breaks, float))
    powers = np.asarray(trajectory.coefficients, float)
    if not (np.isfinite(length).all() and np.isfinite(powers).all()):
        raise ValueError("`trajectory` has numbers that are not finite.")
    powers = powers * length[:, None, None] ** np.arange(powers.shape[1])[None, :, None]  # of the share of a piece
    with jax.enable_x64(True):
        robot = as_double(robot)
        geometry = unit_axes(geometry_of(robot), np.dtype(float))
        per_angle = np.asarray(moved_per_angle(structure_of(robot), geometry))
        begin, off = _stretches(powers, per_angle, near / 2)
        least = path_clearance(robot, Path(_corners(powers, begin)), tolerance=near / 2)
        if least.pair < 0:
            return TrajectoryClearance(least.distance, least.pair, least.at, least.found)
        time = _time_of(float(least.at), begin, length, np.asarray(trajectory.breaks, float))
        here = clearance(robot, np.asarray(trajectory.at(time).theta, float))[least.pair]
        return TrajectoryClearance(least.distance - off, least.pair, np.asarray(time), here)


def _stretches(
    powers: Float[np.ndarray, "p d j"], per_angle: Float[np.ndarray, "q j"], near: float
) -> tuple[list[Float[np.ndarray, " s"]], float]:
    """Where the stretches of each piece begin and end, as shares of it, and by how much chords mislead at most [m]."""
    begin, most = [], 0.0
    for piece in powers:
        # what a chord misses falls with the square of the number of stretches
        count = _FIRST
        while True:
            share = np.arange(count + 1) / count
            off = float((per_angle @ _off_chord(piece, share).T).max(initial=0.0))
            if off <= near or count >= _MOST:
                break
            count = min(_MOST, int(np.ceil(count * np.clip(1.05 * np.sqrt(off / near), 1.2, 64))))
        begin.append(share)
        most = max(most, off)
    return begin, most


def _off_chord(piece: Float[np.ndarray, "d j"], share: Float[np.ndarray, " s+1"]) -> Float[np.ndarray, "s j"]:
    """Bound on how far each joint is off the chord of each stretch of a piece [rad]."""
    # coefficients by the share of each stretch
    order = np.arange(len(piece))
    step = np.diff(share)
    choose = np.array([[comb(n, k) for n in order] for k in order], float)  # of the powers about another point
    back = np.maximum(order[None] - order[:, None], 0)
    moved = choose[None] * share[:-1, None, None] ** back[None]
    there = (moved @ piece) * step[:, None, None] ** order[None, :, None]
    # Bernstein's: a polynomial lies between the least and the largest of them, and so does its way off the chord
    bernstein = np.array([[comb(i, k) / comb(order[-1], k) for k in order] for i in order])
    points = bernstein @ there
    along = (order / max(order[-1], 1))[None, :, None]
    off = np.abs(points - points[:, :1] - along * (points[:, -1:] - points[:, :1])).max(1)
    return off + 16 * np.finfo(float).eps * np.abs(points).max(1)


def _corners(powers: Float[np.ndarray, "p d j"], begin: list[np.ndarray]) -> Float[np.ndarray, "v j"]:
    """Ends of all stretches, the last one repeated up to a power of two, so that few programs serve all motions."""
    points = np.concatenate(
        [
            (share[:, None, None] ** np.arange(len(piece))[None, :, None] * piece[None]).sum(1)
            for piece, share in zip(powers, begin, strict=True)
        ]
    )
    size = 1 << (len(points) - 1).bit_length()
    return np.concatenate([points, np.repeat(points[-1:], size - len(points), 0)])


def _time_of(at: float, begin: list[np.ndarray], length: np.ndarray, breaks: np.ndarray) -> float:
    """Time [s] of a place along the polygon of chords."""
    times = np.concatenate([t + share * d for share, d, t in zip(begin, length, breaks, strict=False)])
    return float(np.interp(at, np.arange(len(times)), times))

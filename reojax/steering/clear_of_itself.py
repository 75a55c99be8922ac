"""Corrections that keep a motion clear of the robot itself: each one goes no further than the clearance allows.

From the posture that is planned, which has the clearance, towards the one that a correction asks for, as far as that is
proven: a pair that is g further apart than it must be stays so until its joints have moved its capsules by g against
each other, which lengths along the chain bound (conservative advancement, as in `reojax.collision.path_clearance`).
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array, common_float
from reojax.collision.chains import geometry_of, moved_per_angle, structure_of, unit_axes
from reojax.collision.clearance import clearances, pair_name
from reojax.collision.refusal import check_clearance
from reojax.motion.trajectory import Trajectory
from reojax.motion.trajectory_clearance import trajectory_clearance
from reojax.robot import Robot

_STEPS = 8
"""Steps of the advancement: each leaves less than half of the way to where a pair is as near as it may come."""


class Keep(NamedTuple):
    """A clearance that corrections must keep."""

    margin: Float[Array, ""]
    """Least distance of the robot's parts [m]."""
    per_angle: Float[Array, "p j"]
    """How far each pair moves at most for each radian of each joint [m]."""
    proven: Float[Array, ""]
    """Clearance of the motion itself [m]."""


def keep_of(robot: Robot, trajectory: Trajectory, clearance: float) -> Keep:
    """Read the clearance, which the motion itself must have.

    Raises:
        ValueError: naming the pair and the time, if it has not; or the robot has no pairs, or the number makes no
            sense.
    """
    start = {"the start of the motion": np.asarray(trajectory.at(0.0).theta, float)}
    margin, _ = check_clearance(robot, clearance, start)
    least = trajectory_clearance(robot, trajectory)
    if not least.distance >= margin:
        raise ValueError(
            f"`clearance` is {margin:g} m, which the motion does not keep: {pair_name(robot, int(least.pair))} come "
            f"within {float(least.found):.6g} m at {float(least.time):.6g} s."
        )
    dtype = common_float(robot, trajectory)
    per_angle = moved_per_angle(structure_of(robot), unit_axes(geometry_of(robot), dtype))
    return Keep(jnp.asarray(margin, dtype), per_angle, jnp.asarray(least.distance, dtype))


def towards(robot: Robot, keep: Keep, planned: Float[Array, " j"], wanted: Float[Array, " j"]) -> Float[Array, " j"]:
    """As far from the planned posture towards the one that is wanted as is proven to keep the clearance [rad].

    From a share `s` of the way, the next one is `s + min over pairs of (distance - margin) / (moved by the whole way)`
    (conservative advancement: B. Mirtich, thesis, Berkeley 1996).
    """
    change = wanted - planned
    most = keep.per_angle @ jnp.abs(change)

    def advance(_: Array, share: Array) -> Array:
        room = clearances(robot, (planned + share * change)[None])[:, 0] - keep.margin
        free = jnp.where(most > 0, jnp.maximum(room, 0) / jnp.where(most > 0, most, 1), jnp.inf)
        return jnp.minimum(1, share + free.min())

    return planned + jax.lax.fori_loop(0, _STEPS, advance, jnp.zeros((), planned.dtype)) * change

"""What `Steering` is told, what it answers, and what it remembers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array, as_numbers
from reojax.robot import Robot

MEMORY = 64
"""Joint readings that are remembered."""


class Reading(NamedTuple):
    """What the sensors say at one time; NaN where they say nothing."""

    time: ArrayLike
    """Now: when the joints were read [s]."""
    theta: ArrayLike
    """(j,) joint angles [rad]."""
    rotation: ArrayLike
    """(3, 3) orientation of the base, the latest that has come."""
    taken: ArrayLike
    """When it was taken, not after `time` [s]."""


class References(NamedTuple):
    """What the joints are told, and what it is good for."""

    theta: Float[Array, " j"]
    """Joint angles to go to [rad]."""
    error: Float[Array, "3"]
    """Error of the orientation that is expected at the end if the joints kept to the plan, to first order in what they
    are told to change; inertial frame [rad]."""
    left: Float[Array, "3"]
    """What the change under way does not take back of it [rad]."""


class Believed(NamedTuple):
    """What `Steering` knows of the flight, in the inertial frame of its first motion."""

    robot: Robot
    """With the estimated parameters."""
    taken: Float[Array, ""]
    """When the last orientation was taken [s]."""
    rotation: Float[Array, "3 3"]
    """Orientation then."""
    momentum: Float[Array, "3"]
    """Angular momentum [kg m^2/s]."""
    drag: Float[Array, ""]
    """Of the wires [N m s/rad]."""
    values: Float[Array, " q"]
    """Of the parameters."""
    covariance: Float[Array, "7+q 7+q"]
    """Of all of these, in the frame of the motion under way."""


class SteeringState(NamedTuple):
    """All that `Steering` remembers."""

    time: Float[Array, ""]
    """Of the last reading [s]."""
    taken: Float[Array, ""]
    """Of the last orientation [s]."""
    rotation: Float[Array, "3 3"]
    """Estimated orientation then."""
    momentum: Float[Array, "3"]
    """Estimated angular momentum then, inertial frame [kg m^2/s]."""
    drag: Float[Array, ""]
    """Estimated drag [N m s/rad]."""
    values: Float[Array, " q"]
    """Estimated parameters, in the order in which they were given."""
    covariance: Float[Array, "7+q 7+q"]
    """Of orientation (inertial frame), momentum, drag and parameters."""
    past_time: Float[Array, " n"]
    """When joints were read, the latest last [s]."""
    past_offset: Float[Array, "n j"]
    """How far they were from the motion [rad]."""
    steer: Float[Array, "..."]
    """How the joints are to be changed: (n, j), a number for each bump and joint [rad]; (3,) of the linear law."""
    filtered: Float[Array, "..."]
    """The same behind the filter."""
    rate: Float[Array, "..."]
    """Its rate."""


def check_reading(robot: Robot, state: SteeringState, reading: Reading) -> Reading:
    """The reading as arrays, NaN where a sensor says nothing.

    Raises:
        ValueError: naming the field, if a shape is wrong, the time is not finite or not after the last one, the
            orientation is no rotation, or was taken later than it was read, before the last one, or too long ago.
    """
    checks.instance("reading", reading, Reading, "Reading(time, theta, rotation, taken)")
    time, theta, rotation, taken = (np.asarray(as_numbers(f, v)) for f, v in reading._asdict().items())
    joints = robot.joints
    shapes = {"time": ((), time), "theta": ((joints,), theta), "rotation": ((3, 3), rotation), "taken": ((), taken)}
    for entry, (shape, value) in shapes.items():
        if value.shape != shape:
            raise ValueError(f"reading.{entry} has shape {value.shape}; it must be {shape}.")
    if not np.isfinite(time):
        raise ValueError(f"reading.time is {time}; it must be finite.")
    last, last_taken, memory = (np.asarray(x) for x in (state.time, state.taken, state.past_time))
    if time <= last:
        raise ValueError(f"reading.time is {time:g} s, not after the last reading's {last:g} s: out of order.")
    if not np.isfinite(rotation).all():
        return Reading(time, theta, np.full((3, 3), np.nan), time)
    checks.rotations("reading.rotation", rotation)
    if not taken <= time:
        raise ValueError(f"reading.taken is {taken} s; an orientation is taken by the time it is read, {time:g} s.")
    if taken <= last_taken and taken != 0:
        raise ValueError(
            f"reading.taken is {taken:g} s, not after the last orientation's {last_taken:g} s: out of order."
        )
    if taken < memory[0]:
        raise ValueError(f"reading.taken is {taken:g} s, before the last {MEMORY} readings of the joints.")
    return Reading(time, theta, rotation, taken)

"""Points of a joint trajectory, of whatever tells one: a motion, a trajectory, a path or plan with durations."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.checks import positive
from reojax.motion.simulation import Motion
from reojax.motion.time_laws import Law
from reojax.motion.trajectory import Trajectory, along
from reojax.path import Path, polygon
from reojax.planning.free_paths_result import FreePaths
from reojax.planning.plan_file import SavedPlan, runs_of
from reojax.planning.result import Plan

LARGEST = 1_000_000
"""Largest number of points in a file."""
Movement = Motion | Trajectory | Path | Plan | FreePaths | SavedPlan
"""What tells a joint trajectory, the last four with durations."""


class Points(NamedTuple):
    """Points of a joint trajectory."""

    time: Float[np.ndarray, " m"]
    """[s], from 0, increasing."""
    theta: Float[np.ndarray, "m j"]
    """Joint angles [rad]."""
    theta_dot: Float[np.ndarray, "m j"]
    """Joint rates [rad/s]."""
    theta_ddot: Float[np.ndarray, "m j"]
    """Joint accelerations [rad/s^2]."""


def points_of(movement: Movement, *, durations: ArrayLike | None, law: Law | str, rate: float) -> Points:
    """The points of a motion, or of anything else about `rate` of them a second.

    Raises:
        ValueError: if durations are missing, or given to what has its own time, or do not fit the path; for plans of
            many targets; or for more points than a file may have.
    """
    if isinstance(movement, Motion | Trajectory):
        if durations is not None:
            raise ValueError(f"`durations` is given; a {type(movement).__name__} has its own.")
        if isinstance(movement, Trajectory):
            return sample(movement, rate)
        time, *state = (np.asarray(x, float) for x in movement[:4])
        onward = np.diff(time, prepend=-np.inf) > 0  # edges that take no time repeat a point
        return Points(time[onward], *(x[onward] for x in state))
    path = _path(movement)
    if durations is None:
        raise ValueError(f"`durations` is missing: a {type(movement).__name__} has no time; give seconds of each edge.")
    return sample(along(path, law, durations), rate)


def sample(trajectory: Trajectory, rate: float) -> Points:
    """Even points from the start to the end of a trajectory, about `rate` a second.

    Raises:
        ValueError: if `rate` is not positive, or that would be too many points.
    """
    import jax

    duration, rate = float(trajectory.duration), positive("rate", rate, unit="Hz")
    steps = duration * rate - 1e-9
    if steps > LARGEST - 1:
        raise ValueError(f"{duration:g} s at {rate:g} Hz are {steps:.0f} points; at most {LARGEST} are written.")
    time = np.linspace(0, duration, max(math.ceil(steps), 1) + 1)
    return Points(time, *(np.asarray(x, float) for x in jax.vmap(trajectory.at)(time)))


def _path(movement: Any) -> Path:
    """The joint path, all runs of it."""
    if isinstance(movement, Path):
        return movement
    if isinstance(movement, SavedPlan):
        return movement.path
    if np.ndim(movement.error):
        raise ValueError(f"these are {len(movement.error)} plans; choose one, as by `polygon(plans.waypoints[k])`.")
    if isinstance(movement, Plan):
        return polygon(movement.waypoints)
    return runs_of(movement.waypoints, int(movement.repeats))

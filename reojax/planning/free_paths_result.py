"""Free paths that were found: corners, where they end, and how the search for them ended in words."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from reojax.planning.answers import corners_as_value, no_violation, status_as_message, travel_as_cost
from reojax.planning.reach import Reach


class FreePaths(NamedTuple):
    """Polygons, one for each target; of `free_path` one, without the leading axis."""

    waypoints: Float[np.ndarray, "*m v j"]
    """Corners of the joint path of one run [rad], from `start` to `end`, for `polygon`."""
    rotation: Float[np.ndarray, "*m 3 3"]
    """Rotation of the base after all runs."""
    error: Float[np.ndarray, "*m"]
    """Angle left to the target [rad]."""
    travel: Float[np.ndarray, "*m"]
    """Sum over all joints of the angle each one moves through, in all runs [rad]."""
    repeats: Int[np.ndarray, "*m"]
    """How often the path is run."""
    converged: Bool[np.ndarray, "*m"]
    """Whether `error` is within the tolerance; the travel is then the least found, not proven to be the least."""
    status: Any
    """In words: converged; not found, which proves nothing; or unreachable in principle, and why. (m,) of many."""
    clearance: Any
    """Least distance of the robot's parts along the path, proven [m], (m,) of many; None if it was not asked for."""

    value = corners_as_value
    """The corners, under the name that all solvers' results have."""
    cost = travel_as_cost
    """Joint travel [rad]."""
    violation = no_violation
    """How far a joint passes its limits [rad]: 0, as no answer ever leaves its box."""
    message = status_as_message
    """How it ended: `status`, under the name that all solvers' results have."""

    def __str__(self) -> str:
        """Corners, runs, and how the path ends; of many paths how many are reached."""
        if np.ndim(self.error):
            return f"{len(self.error)} paths, {int(np.sum(self.converged))} of them reach their targets"
        runs = f"{self.repeats} runs" if self.repeats > 1 else "one run"
        figures = f"error {self.error:.1e} rad, joint travel {np.rad2deg(self.travel):.1f} deg"
        return f"path of {len(self.waypoints)} corners, {runs}: {figures}; {self.status}"


def outcome(error: float, beyond: float, kept: bool, tolerance: float, reach: Reach) -> str:
    """How the search for one path ended, in words.

    Args:
        error: angle left to the target [rad].
        beyond: angle of the target from what is possible in principle [rad].
        kept: whether the clearance is proven, or none was asked for.
        tolerance: angle that counts as reached [rad].
        reach: what is possible in principle, and why no more.
    """
    if not kept:
        return (
            "not found: the closest path does not keep the clearance, which proves nothing; more starts or corners, "
            "wider limits, or less clearance, may reach it"
        )
    if error <= tolerance:
        return "converged"
    if beyond > tolerance:
        return f"unreachable: {reach.explain()}; {np.rad2deg(beyond):.6g} deg are left at the least"
    return (
        f"not found: the closest path leaves {np.rad2deg(error):.6g} deg, which proves nothing; more repeats, corners "
        "or starts, or wider limits, may reach it"
    )

"""What `righting` finds: a motion, or one for each of many releases."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from reojax.motion.trajectory import Trajectory
from reojax.optimisation.status import describe
from reojax.steering.end import basis


class Righting(NamedTuple):
    """A motion for each release; of `righting` one, without the leading axis."""

    points: Float[np.ndarray, "*m p+1 j"]
    """Joint angles at equal times, between which the motion is the spline of least jerk [rad]."""
    duration: Float[np.ndarray, "*m"]
    """How long it takes [s]."""
    momentum: Float[np.ndarray, "*m 3"]
    """Angular momentum that it is made for [kg m^2/s]."""
    rotation: Float[np.ndarray, "*m 3 3"]
    """Orientation at the end, from the identity."""
    omega: Float[np.ndarray, "*m 3"]
    """Angular velocity of the base at the end, base frame: what the momentum leaves in that posture [rad/s]."""
    error: Float[np.ndarray, "*m"]
    """Angle left to the target [rad]."""
    beyond: Float[np.ndarray, "*m"]
    """How far a limit is passed at most: of joints [rad], motors [share of the supply] or clearance [m]; 0 if none."""
    margin: Float[np.ndarray, "*m"]
    """Least distance to the torque-speed lines, `1 - |voltage| / supply`; NaN without motors."""
    effort: Float[np.ndarray, "*m"]
    """Mean square of the weighted joint accelerations."""
    travel: Float[np.ndarray, "*m"]
    """Sum over the joints of the angle each one moves through [rad]."""
    converged: Bool[np.ndarray, "*m"]
    """Whether error and limits are within their tolerances; the effort is then the least found from the starts."""
    status: Int[np.ndarray, "*m"]
    """How it ended: `message` says it in words."""
    steps: Int[np.ndarray, "*m"]
    """Newton steps of the answer."""
    least_duration: Float[np.ndarray, "*m"]
    """Shortest duration that was found to do, where `duration` would not or none was given; else NaN [s]."""

    clearance: Float[np.ndarray, "*m"]
    """Distance that no collision pair comes nearer than anywhere along the motion, proven [m]; NaN if not asked for."""

    @property
    def value(self) -> Float[np.ndarray, "*m p+1 j"]:
        """The points, under the name that all solvers' results have."""
        return self.points

    @property
    def cost(self) -> Float[np.ndarray, "*m"]:
        """The effort."""
        return self.effort

    @property
    def violation(self) -> Float[np.ndarray, "*m"]:
        """How far a limit is passed at most, as `beyond`."""
        return self.beyond

    @property
    def message(self) -> str | list[str]:
        """How it ended, in words."""
        return describe(self.status)

    @property
    def trajectory(self) -> Trajectory:
        """The motion of one release, for `simulate`, `track` and `Steering`."""
        if self.points.ndim != 2:
            raise ValueError("`trajectory` is of one release; take one by `Righting(*(field[i] for field in many))`.")
        return trajectory_through(self.points, float(self.duration))


def trajectory_through(points: Float[np.ndarray, "p+1 j"], duration: float) -> Trajectory:
    """The spline of least jerk through points (p + 1, j) [rad] at equal times, at rest at both ends; duration in s."""
    own = basis(len(points) - 1, 1)
    pieces = len(own.coefficients)
    powers = (1 / duration) ** np.arange(6)
    coefficients = np.einsum("qkp,pj->qkj", own.coefficients, points) * powers[None, :, None]
    return Trajectory(duration * np.arange(pieces + 1) / pieces, coefficients)

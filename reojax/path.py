"""Paths in shape space: what the joints go through, without when (thesis 2.4: only the path matters)."""

from __future__ import annotations

import dataclasses

import jax
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array, as_numbers, is_concrete


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, eq=False)
class Path:
    """A path in shape space, made of straight edges between waypoints; built by `polygon`."""

    waypoints: Float[Array, "v j"]
    """Corners in order, joint angles [rad]."""

    @property
    def edges(self) -> int:
        """Number of straight edges, one less than the number of waypoints."""
        return self.waypoints.shape[0] - 1

    @property
    def joints(self) -> int:
        """Number of joint angles in a waypoint."""
        return self.waypoints.shape[1]


def polygon(waypoints: ArrayLike) -> Path:
    """Path of straight edges between `waypoints`, in order.

    Args:
        waypoints: (v, j) joint angles [rad], v >= 1. One waypoint alone is a path that stays put;
            a sampled curve may have thousands.

    Raises:
        ValueError: if the waypoints are not numbers, not of shape (v, j), or not finite.
    """
    points = as_numbers("waypoints", waypoints)
    if points.ndim != 2 or not points.shape[0]:
        raise ValueError(f"`waypoints` has shape {points.shape}; it must be (v, j) with at least one waypoint.")
    if is_concrete(points) and not np.isfinite(points).all():
        row, joint = np.argwhere(~np.isfinite(np.asarray(points)))[0]
        raise ValueError(f"waypoints[{row}, {joint}] is {points[row, joint]}; joint angles must be finite.")
    return Path(points)


def joint_travel(path: Path) -> Float[Array, ""]:
    """Sum over all joints of the angle each one moves through along the path [rad]."""
    return abs(path.waypoints[1:] - path.waypoints[:-1]).sum()

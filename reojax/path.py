"""Paths in shape space: what the joints go through, without when (thesis 2.4: only the path matters)."""

from __future__ import annotations

import dataclasses
from typing import Protocol

import jax
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array, as_numbers, is_concrete
from reojax._internal.checks import instance

_ROUNDING = 1e-9
"""How far beyond a limit counts as at it [rad]."""


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


class Limited(Protocol):
    """What has joint limits: a `Robot`."""

    name: str
    lower: Array
    """(j,) [rad]."""
    upper: Array
    """(j,) [rad]."""
    joint_names: tuple[str, ...]


def polygon(waypoints: ArrayLike, *, check_limits: Limited | None = None) -> Path:
    """Path of straight edges between `waypoints`, in order.

    Args:
        waypoints: (v, j) joint angles [rad], v >= 1. One waypoint alone is a path that stays put;
            a sampled curve may have thousands.
        check_limits: the robot whose joint limits the path must keep; default none is asked. Traced angles pass.

    Raises:
        ValueError: if the waypoints are not numbers, not of shape (v, j), or not finite, or are beyond the limits.
    """
    points = as_numbers("waypoints", waypoints)
    if points.ndim != 2 or not points.shape[0]:
        raise ValueError(f"`waypoints` has shape {points.shape}; it must be (v, j) with at least one waypoint.")
    if is_concrete(points) and not np.isfinite(points).all():
        row, joint = np.argwhere(~np.isfinite(np.asarray(points)))[0]
        raise ValueError(f"waypoints[{row}, {joint}] is {points[row, joint]}; joint angles must be finite.")
    if check_limits is not None:
        _check_limits(points, check_limits)
    return Path(points)


def _check_limits(points: Array, robot: Limited) -> None:
    if not all(hasattr(robot, field) for field in ("lower", "upper", "joint_names")):
        raise ValueError(f"`check_limits` is a {type(robot).__name__}; it must be a Robot.")
    if points.shape[1] != len(robot.joint_names):
        raise ValueError(f"`waypoints` move {points.shape[1]} joints; {robot.name!r} has {len(robot.joint_names)}.")
    if not is_concrete((points, robot.lower, robot.upper)):
        return
    theta, low, high = (np.asarray(array, float) for array in (points, robot.lower, robot.upper))
    beyond = (theta < low - _ROUNDING) | (theta > high + _ROUNDING)
    if beyond.any():
        row, joint = np.argwhere(beyond)[0]
        raise ValueError(
            f"waypoints[{row}, {joint}] ({robot.joint_names[joint]}) is {theta[row, joint]:.6g} rad; the limits of "
            f"{robot.name!r} are {low[joint]:.6g} to {high[joint]:.6g} rad."
        )


def joint_travel(path: Path) -> Float[Array, ""]:
    """Sum over all joints of the angle each one moves through along the path [rad].

    Raises:
        ValueError: if `path` is no Path.
    """
    instance("path", path, Path, "`polygon(waypoints)` makes")
    return abs(path.waypoints[1:] - path.waypoints[:-1]).sum()

"""Joint limits that a path exceeds, told by every command that takes a path."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from reojax.path import Path
    from reojax.robot import Robot

_ROUNDING = 1e-9
"""How far beyond a limit counts as at it [rad]."""


def joints_beyond_limits(robot: "Robot", paths: Iterable["Path"]) -> list[str]:
    """Names of the joints that one of the paths takes beyond their limits."""
    import numpy as np

    theta = np.concatenate([np.asarray(path.waypoints, float) for path in paths])
    beyond = (theta < np.asarray(robot.lower) - _ROUNDING) | (theta > np.asarray(robot.upper) + _ROUNDING)
    return [robot.joint_names[k] for k in np.flatnonzero(beyond.any(axis=0))]


def limits_text(robot: str, joints: list[str]) -> list[str]:
    """The line that says so, after an empty one; none where all is within."""
    return ["", f"beyond the joint limits of {robot}: {', '.join(joints)}"] if joints else []

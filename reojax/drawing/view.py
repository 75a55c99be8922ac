"""From where robots are looked at."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float

from reojax._internal import checks
from reojax.robot import Robot

Up = Literal["x", "y", "z"]


class View(NamedTuple):
    """Direction from which a picture is seen, from infinitely far away."""

    elevation: float = 20.0
    """Height of the eye above the plane across `up` [deg]."""
    azimuth: float = 62.0
    """Direction of the eye in that plane [deg]; for up = "y" from z towards x, for "z" from x towards y."""
    up: Up = "y"
    """Axis that points up on the page."""

    def camera(self) -> Float[np.ndarray, "3 3"]:
        """Rows: what points right, up and towards the eye on the page."""
        e, a = np.deg2rad(self.elevation), np.deg2rad(self.azimuth)
        up = "xyz".index(self.up)
        eye = np.roll([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], up - 2)
        right = np.cross(np.eye(3)[up], eye)
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(eye, right), eye])


def check_view(view: View) -> None:
    """Raise a ValueError for a view that is none."""
    if not isinstance(view, View) or view.up not in ("x", "y", "z"):
        raise ValueError(f"`view` is {view!r}; it must be a View whose `up` is x, y or z.")
    if not np.isfinite(view[:2]).all() or abs(view.elevation) >= 90:
        raise ValueError(f"`view` is {view}; angles must be finite, and the elevation between -90 and 90 degrees.")


def default_view(robot: Robot) -> View:
    """From the front: y up for planar robots and those laid out as the thesis's, z up for others, as robot files do."""
    checks.instance("robot", robot, Robot, "make_robot makes")
    axes = np.asarray(robot.axis, float)
    planar = len(axes) > 0 and bool((np.abs(axes[:, :2]) < 1e-9).all())
    return View(up="y" if robot.layout is not None or planar else "z")

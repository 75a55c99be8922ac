"""Where a robot comes nearest to itself: the posture with its two nearest points, and a line along the path."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from mpl_toolkits.mplot3d.axes3d import Axes3D

from reojax.collision.nearest import Nearest
from reojax.drawing.colours import INK
from reojax.drawing.view import View, default_view
from reojax.plot._arguments import check_arguments
from reojax.plot.robots import draw_robot, poses
from reojax.robot import Robot

_MARK = "#d4006a"


@check_arguments
def draw_nearest(axes: Axes3D, robot: Robot, nearest: Nearest, *, view: View | None = None) -> Axes3D:
    """Draw the robot where its parts are nearest to each other, translucent, the two nearest points joined by a line.

    Args:
        axes: 3-D axes.
        robot: the robot.
        nearest: what `nearest_parts` gives.
        view: from where to look; default from where the line between the two points is seen best.

    Raises:
        ValueError: if an argument is not what it must be.
    """
    look = _across(robot, nearest) if view is None else view
    draw_robot(axes, robot, nearest.theta, view=look, alpha=0.25)
    points = nearest.points + poses(robot, nearest.theta)[1][0]  # seen from the centre of mass
    axes.plot(*points.T, "o-", color=_MARK, markersize=4, linewidth=1.8, zorder=1000)
    axes.set_title(nearest_text(nearest), fontsize=10.5, color=INK)
    return axes


def _across(robot: Robot, nearest: Nearest) -> View:
    """The default view, turned about its upright until the line between the nearest points is seen longest."""
    front = default_view(robot)
    along = nearest.points[1] - nearest.points[0]
    turned = [front._replace(azimuth=front.azimuth + angle) for angle in range(-90, 91, 15)]
    return max(turned, key=lambda v: np.linalg.norm((v.camera() @ along)[:2]))


@check_arguments
def mark_nearest(axes: Axes, at: float) -> None:
    """Draw a line where the parts are nearest to each other, at the place `at` on the x of `axes`."""
    axes.axvline(at, color=_MARK, linewidth=1.4, linestyle=(0, (4, 2)), zorder=1.5)


def nearest_text(nearest: Nearest) -> str:
    """Least distance, the two parts, and the place, in two lines."""
    gap = 1e3 * nearest.found
    how = f"overlap by {-gap:.1f} mm" if gap < 0 else f"{np.floor(1e4 * nearest.distance) / 10:.1f} mm apart"
    return f"{nearest.name}:\n{how}, at {nearest.at:.2f} edges"

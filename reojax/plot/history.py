"""Orientation and joint angles along a path."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax.collision.nearest import nearest_parts
from reojax.drawing.colours import ANGLES, DASHES, INK, JOINTS
from reojax.mechanics.attitude import LEVEL, tilt_and_roll, zxz_without_jumps
from reojax.mechanics.holonomy import rotation_history
from reojax.path import Path
from reojax.plot._arguments import check_arguments
from reojax.plot._style import dress_path
from reojax.plot.nearest import draw_nearest, mark_nearest
from reojax.robot import Robot

_SAMPLES = 64
"""Samples per edge."""


_EULER = (("first, about z", "#009e73"), ("second, about x", "#cc79a7"), ("third, about z", "#56b4e9"))


@check_arguments
def draw_orientation(
    axes: Axes, rotations: Float[Array, "m 3 3"], *, edges: int, angles: Literal["tilt", "zxz"] = "tilt"
) -> Axes:
    """Draw the orientation of the base along a path, in degrees.

    Args:
        axes: flat axes; x counts the edges of the path.
        rotations: (m, 3, 3) equally spaced along the path, first to last.
        edges: number of edges of the path.
        angles: "tilt" for tilt about x, tilt about y and roll about z, `R = exp((tilt_x, tilt_y, 0)) Rz(roll)`;
            "zxz" for the ZXZ angles (a, b, c) of `R = Rz(a) Rx(b) Rz(c)`, counted on without jumps, and a + c.
            Where b is below 0.1 rad the axes are shaded: only b and a + c mean anything there, and c is carried over.

    Raises:
        ValueError: if the shape of `rotations` is another, or `angles` is neither.
    """
    history = np.asarray(rotations, float)
    if history.ndim != 3 or history.shape[1:] != (3, 3) or len(history) < 2:
        raise ValueError(f"`rotations` has shape {history.shape}; it must be (m, 3, 3), two or more.")
    checks.one_of("angles", angles, ("tilt", "zxz"))
    along = np.linspace(0, edges, len(history))
    told = tilt_and_roll(history) if angles == "tilt" else zxz_without_jumps(history)
    for (label, colour), values in zip(ANGLES if angles == "tilt" else _EULER, told.T, strict=True):
        axes.plot(along, np.rad2deg(values), color=colour, label=label, linewidth=2)
    if angles == "zxz":
        total = np.rad2deg(told[:, 0] + told[:, 2])
        axes.plot(along, total, color="#d55e00", label="first + third", linewidth=2, dashes=(5, 2))
        near = np.abs(told[:, 1]) < LEVEL
        axes.fill_between(along, 0, 1, where=near, transform=axes.get_xaxis_transform(), color="#eeeeee", zorder=0)
    axes.set_ylabel("base orientation [deg]", color=INK)
    dress_path(axes, edges)
    return axes


@check_arguments
def draw_joints(axes: Axes, robot: Robot, path: Path) -> Axes:
    """Draw the joint angles of a robot along a path, in degrees; x counts the path's edges.

    Args:
        axes: flat axes.
        robot: the robot, whose joints are named.
        path: the path in shape space.

    Raises:
        ValueError: if the path does not fit the robot.
    """
    if path.joints != robot.joints:
        raise ValueError(f"`path` has {path.joints} joint angles; {robot.name!r} has {robot.joints} joints.")
    corners = np.rad2deg(np.asarray(path.waypoints, float))
    for k, label in enumerate(robot.joint_names):
        dashes, colour = DASHES[k % len(DASHES)], JOINTS[k % len(JOINTS)]
        axes.plot(corners[:, k], color=colour, label=label, linewidth=2, dashes=dashes)
    axes.set_ylabel("joint angles [deg]", color=INK)
    dress_path(axes, path.edges)
    return axes


@check_arguments
def history_figure(
    robot: Robot,
    path: Path,
    *,
    title: str | None = None,
    edge_names: Sequence[str] | None = None,
    rotations: Float[Array, "m 3 3"] | None = None,
    angles: Literal["tilt", "zxz"] = "tilt",
    clearance: bool = False,
) -> Figure:
    """Draw how the base turns along a path, and what the joints do.

    Above, tilt about x and y and roll about z of the base: `R = exp((tilt_x, tilt_y, 0)) Rz(roll)`. These are
    the ZXZ angles (a, b, c) told without jumps: the tilt has length b and direction a, and the roll is a + c,
    counted on beyond a half turn. Or the ZXZ angles themselves, see `draw_orientation`. Below, the joint angles. Every
    edge of the path has the same width, as there is no time in it.

    Args:
        robot: the robot.
        path: the path in shape space, of one edge or more.
        title: first line of the title; default the robot's name.
        edge_names: a name for each edge.
        rotations: the `rotation_history` of the path, if it is known already.
        angles: "tilt" or "zxz", as in `draw_orientation`.
        clearance: whether to show where the robot comes nearest to itself, beside the curves.

    Raises:
        ValueError: if the path has no edge or does not fit the robot, or the names do not fit the path; or the robot
            has no pairs of shapes whose clearance could be shown.
    """
    if not path.edges:
        raise ValueError("`path` has one waypoint; a picture needs an edge.")
    if edge_names is not None and len(edge_names) != path.edges:
        raise ValueError(f"`edge_names` has {len(edge_names)} names; the path has {path.edges} edges.")
    history = rotation_history(robot, path, samples=_SAMPLES) if rotations is None else rotations
    near = nearest_parts(robot, path) if clearance else None
    figure = Figure(figsize=(7.2 if near is None else 11.0, 6.4), layout="constrained", facecolor="white")
    grid = figure.add_gridspec(2, 1 if near is None else 2, height_ratios=(1.15, 1))
    above = figure.add_subplot(grid[0, 0])
    below = figure.add_subplot(grid[1, 0], sharex=above)
    above.tick_params(labelbottom=False)
    draw_orientation(above, history, edges=path.edges, angles=angles)
    draw_joints(below, robot, path)
    if near is not None:
        place = figure.add_subplot(grid[:, 1], projection="3d")
        assert isinstance(place, Axes3D)
        draw_nearest(place, robot, near)
        for axes in (above, below):
            mark_nearest(axes, near.at)
    _name_edges(below, edge_names, path.edges)
    above.set_title(title or robot.name, loc="left", pad=48, fontsize=13, fontweight="bold", color=INK)
    end = np.rad2deg(tilt_and_roll(history)[-1])
    tilt = float(np.hypot(*end[:2]))
    result = f"net rotation: rolls {_signed_text(end[2])} about z, and the z axis tips by {tilt:.1f}°"
    above.annotate(result, (0, 1), (0, 30), "axes fraction", "offset points", fontsize=10.5, color=INK)
    return figure


def _name_edges(axes: Axes, names: Sequence[str] | None, edges: int) -> None:
    if names is not None:
        axes.set_xticks(np.arange(edges) + 0.5, names)
        axes.tick_params(axis="x", length=0)
    elif edges <= 40:
        axes.set_xticks(np.arange(edges + 1))
    axes.set_xlabel("along the path, edge by edge", color=INK)


def _signed_text(angle: float) -> str:
    text = f"{angle:+.1f}°".replace("-", "\u2212")
    return "0.0°" if text[1:] == "0.0°" else text

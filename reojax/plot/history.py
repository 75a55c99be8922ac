"""Orientation and joint angles along a path."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reojax._arrays import Array
from reojax._orientation import tilt_and_roll
from reojax.holonomy import rotation_history
from reojax.path import Path
from reojax.plot._style import ANGLES, DASHES, INK, JOINTS, dress
from reojax.robot import Robot

_SAMPLES = 64
"""Samples per edge."""


def history_figure(
    robot: Robot,
    path: Path,
    *,
    title: str | None = None,
    edge_names: Sequence[str] | None = None,
    rotations: Float[Array, "m 3 3"] | None = None,
) -> Figure:
    """Draw how the base turns along a path, and what the joints do.

    Above, tilt about x and y and roll about z of the base: `R = exp((tilt_x, tilt_y, 0)) Rz(roll)`. These are
    the ZXZ angles (a, b, c) told without jumps: the tilt has length b and direction a, and the roll is a + c,
    counted on beyond a half turn. Below, the joint angles. Every edge of the path has the same width, as
    there is no time in it.

    Args:
        robot: the robot.
        path: the path in shape space, of one edge or more.
        title: first line of the title; default the robot's name.
        edge_names: a name for each edge.
        rotations: the `rotation_history` of the path, if it is known already.

    Raises:
        ValueError: if the path has no edge or does not fit the robot, or the names do not fit the path.
    """
    if not path.edges:
        raise ValueError("`path` has one waypoint; a picture needs an edge.")
    if edge_names is not None and len(edge_names) != path.edges:
        raise ValueError(f"`edge_names` has {len(edge_names)} names; the path has {path.edges} edges.")
    history = rotation_history(robot, path, samples=_SAMPLES) if rotations is None else rotations
    angles = np.rad2deg(tilt_and_roll(history))
    corners = np.rad2deg(np.asarray(path.waypoints, float))
    figure = Figure(figsize=(7.2, 6.4), layout="constrained", facecolor="white")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.15, 1))
    along = np.linspace(0, path.edges, len(angles))
    for (label, colour), values in zip(ANGLES, angles.T, strict=True):
        above.plot(along, values, color=colour, label=label, linewidth=2)
    for k, label in enumerate(robot.joint_names):
        dashes = DASHES[k % len(DASHES)]
        colour = JOINTS[k % len(JOINTS)]
        below.plot(corners[:, k], color=colour, label=label, linewidth=2, dashes=dashes)
    above.set_ylabel("base orientation [deg]", color=INK)
    below.set_ylabel("joint angles [deg]", color=INK)
    for axes in (above, below):
        dress(axes, path.edges)
    _name_edges(below, edge_names, path.edges)
    above.set_title(title or robot.name, loc="left", pad=48, fontsize=13, fontweight="bold", color=INK)
    tilt = float(np.hypot(*angles[-1, :2]))
    result = f"net rotation: rolls {_signed(angles[-1, 2])} about z, and the z axis tips by {tilt:.1f}°"
    above.annotate(result, (0, 1), (0, 30), "axes fraction", "offset points", fontsize=10.5, color=INK)
    return figure


def _name_edges(axes: Axes, names: Sequence[str] | None, edges: int) -> None:
    if names is not None:
        axes.set_xticks(np.arange(edges) + 0.5, names)
        axes.tick_params(axis="x", length=0)
    elif edges <= 40:
        axes.set_xticks(np.arange(edges + 1))
    axes.set_xlabel("along the path, edge by edge", color=INK)


def _signed(angle: float) -> str:
    text = f"{angle:+.1f}°".replace("-", "\u2212")
    return "0.0°" if text[1:] == "0.0°" else text

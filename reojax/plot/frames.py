"""A robot on its way, in rows of frames."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from reojax._internal import checks
from reojax._internal.arrays import as_numbers
from reojax.drawing.colours import INK
from reojax.drawing.view import View
from reojax.mechanics.holonomy import rotation_history
from reojax.path import Path
from reojax.plot._arguments import check_arguments
from reojax.plot.robots import draw_axes, draw_robot, faces_at_pose
from reojax.robot import Robot


class Frames(NamedTuple):
    """Poses of a robot, one after the other."""

    theta: Float[np.ndarray, "m j"]
    """Joint angles [rad]."""
    rotation: Float[np.ndarray, "m 3 3"]
    """Rotation of the base, base components to inertial ones."""


@check_arguments
def frames_along(robot: Robot, path: Path, *, per_edge: int = 1) -> Frames:
    """Poses of a robot along a path at zero momentum: at every corner, and `per_edge - 1` between two corners.

    Args:
        robot: the robot.
        path: the path in shape space.
        per_edge: poses of each edge.

    Raises:
        ValueError: if the path does not fit the robot, or `per_edge` is not a positive integer.
    """
    rotation = np.asarray(rotation_history(robot, path, samples=per_edge), float)
    corners = np.asarray(path.waypoints, float)
    along = np.arange(len(rotation)) / per_edge
    knots = np.arange(len(corners))
    theta = np.stack([np.interp(along, knots, corners[:, k]) for k in range(path.joints)], axis=1)
    return Frames(theta, rotation)


@check_arguments
def draw_frames(
    axes: Sequence[Axes3D],
    robot: Robot,
    frames: Frames,
    *,
    titles: Sequence[str] | None = None,
    view: View | None = None,
) -> Sequence[Axes3D]:
    """Draw one frame in each of several 3-D axes, all to one scale, with the inertial directions in the first.

    Args:
        axes: as many 3-D axes as there are frames.
        robot: the robot.
        frames: its poses, such as `frames_along` gives.
        titles: a line above each frame.
        view: from where to look; default from the front.

    Raises:
        ValueError: if numbers of axes, frames and titles differ, or a pose does not fit the robot.
    """
    frames = check_frames(robot, frames)
    count = len(frames.theta)
    if len(axes) != count or (titles is not None and len(titles) != count):
        named = "" if titles is None else f" and {len(titles)} titles"
        raise ValueError(f"there are {len(axes)} axes{named} for {count} frames; each frame needs its own.")
    low, high = extent(robot, frames)
    for k, place in enumerate(axes):
        draw_robot(place, robot, frames.theta[k], frames.rotation[k], view=view)
        stage(place, low, high)
        if titles is not None:
            place.set_title(titles[k], fontsize=9, color=INK, pad=-4)
    directions(axes[0], low, high)
    return axes


@check_arguments
def frames_figure(
    robot: Robot,
    path: Path,
    *,
    per_edge: int = 1,
    title: str | None = None,
    titles: Sequence[str] | None = None,
    columns: int | None = None,
    view: View | None = None,
    frames: Frames | None = None,
) -> Figure:
    """Draw a robot at the corners of a path, and `per_edge - 1` times between two, as a row of 3-D frames.

    Args:
        robot: the robot.
        path: the path in shape space.
        per_edge: frames per edge.
        title: above all; default the robot's name.
        titles: a line above each frame; default where along the path, in edges.
        columns: frames in one row; default all.
        view: from where to look; default from the front.
        frames: the `frames_along` of the path with this `per_edge`, if they are known already.

    Raises:
        ValueError: if the path does not fit the robot, or numbers of frames and titles differ.
    """
    if frames is None:
        frames = frames_along(robot, path, per_edge=per_edge)
    count = len(frames.theta)
    if titles is None:
        titles = [f"edge {k / per_edge:g}" for k in range(count)] if count > 1 else [""]
    columns = count if columns is None else min(columns, count)
    rows = -(-count // columns)
    figure = Figure(figsize=(1.9 * columns, 1.9 * rows + 0.4), facecolor="white")
    top = 1 - 0.4 / (1.9 * rows + 0.4)
    axes = figure.subplots(rows, columns, squeeze=False, subplot_kw={"projection": "3d"}).ravel()
    figure.subplots_adjust(left=0.0, right=1.0, bottom=0.0, top=top - 0.03 / rows, wspace=0.0, hspace=0.12)
    for spare in axes[count:]:
        spare.set_axis_off()
    draw_frames(list(axes[:count]), robot, frames, titles=titles, view=view)
    figure.suptitle(title or robot.name, x=0.01, y=0.985, ha="left", fontsize=11, fontweight="bold", color=INK)
    return figure


def check_frames(robot: Robot, frames: Frames) -> Frames:
    """Poses as arrays of float64, or a ValueError if they do not fit the robot."""
    checks.instance("frames", frames, Frames, "`frames_along` makes")
    theta, rotation = (np.asarray(as_numbers(name, x), float) for name, x in zip(Frames._fields, frames, strict=True))
    if theta.ndim != 2 or theta.shape[1] != robot.joints or not len(theta) or not np.isfinite(theta).all():
        raise ValueError(f"`theta` has shape {theta.shape}; for {robot.name!r} it must be (m, {robot.joints}), finite.")
    if rotation.shape != (len(theta), 3, 3):
        raise ValueError(
            f"`rotation` has shape {rotation.shape}; for {len(theta)} poses it must be {len(theta), 3, 3}."
        )
    return Frames(theta, rotation)


def extent(robot: Robot, frames: Frames) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the box about all frames."""
    points = [faces_at_pose(robot, *pose)[0].reshape(-1, 3) for pose in zip(*frames, strict=True)]
    return np.min([p.min(0) for p in points], axis=0), np.max([p.max(0) for p in points], axis=0)


def stage(axes: Axes3D, low: np.ndarray, high: np.ndarray, zoom: float = 1.45) -> None:
    """Show the same space in every frame, without panes or ticks."""
    middle, half = (low + high) / 2, max(high - low) / 2
    for limit, centre in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), middle, strict=True):
        limit(centre - half, centre + half)
    axes.set_box_aspect((1, 1, 1), zoom=zoom)  # pyright: ignore[reportArgumentType]  (zoom is a float)
    axes.set_axis_off()


def directions(axes: Axes3D, low: np.ndarray, high: np.ndarray) -> None:
    """Draw the inertial directions in the lower left corner of the page; their length is the scale."""
    camera = View(axes.elev, axes.azim, "xyz"[axes._vertical_axis]).camera()  # pyright: ignore
    half = max(high - low) / 2
    decade = 10.0 ** np.floor(np.log10(0.3 * half))
    length = decade * max(step for step in (1, 2, 5) if step * decade <= 0.3 * half)
    draw_axes(axes, length, at=(low + high) / 2 + camera.T @ np.array([-0.8 * half, -0.85 * half, 0.0]))
    text = f"{1000 * length:g} mm" if length < 1 else f"{length:g} m"
    axes.text2D(0.06, 0.0, f"x, y, z: {text}", transform=axes.transAxes, fontsize=7, color=INK)

"""Films of a robot on its way, with time, title and curves: MP4 by ffmpeg, GIF everywhere."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Sequence
from pathlib import Path as File
from typing import cast

import numpy as np
from jaxtyping import Float
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.axes3d import Axes3D
from numpy.typing import ArrayLike
from tqdm import tqdm

from reojax._internal import checks
from reojax._internal.files import check_ending, replacing
from reojax._internal.progress import label
from reojax.drawing.colours import ANGLES, DASHES, INK, JOINTS, PALE
from reojax.drawing.view import View
from reojax.mechanics.attitude import tilt_and_roll
from reojax.path import Path
from reojax.plot._arguments import check_arguments
from reojax.plot.frames import Frames, check_frames, directions, extent, frames_along, stage
from reojax.plot.robots import draw_robot
from reojax.robot import Robot

ENDINGS = ("mp4", "gif")
"""Kinds of film, by the ending of the file's name."""
_SIZE = (9.6, 7.2)
"""Of a film, in hundreds of pixels."""
_HOLD = 1.0
"""How long the last pose stays [s]."""


@check_arguments
def animation(
    robot: Robot,
    path: Path,
    file: str | os.PathLike[str],
    *,
    frames: int = 60,
    seconds: float = 4.0,
    titles: Sequence[str] | None = None,
    title: str | None = None,
    view: View | None = None,
    progress: bool | str = False,
) -> None:
    """Write a film of a robot along a path at zero momentum, every edge equally long; whole or not at all.

    Args:
        robot: the robot.
        path: the path in shape space.
        file: where to, a name that ends in .mp4 (needs ffmpeg) or .gif; 960 x 720 pixels.
        frames: number of frames, about; every edge has equally many.
        seconds: how long the path takes in the film. The last frame stays for a second.
        titles: a name for each edge.
        title: headline; default the robot's name.
        view: from where to look; default from the front.
        progress: whether to show a bar on stderr, or what to write before it.

    Raises:
        ValueError: if the file cannot be written, ffmpeg is missing for .mp4, the path does not fit the robot, or a
            number is not positive.
    """
    target = check_animation(file)
    if not path.edges:
        raise ValueError("`path` has one waypoint; an animation needs an edge.")
    if titles is not None and len(titles) != path.edges:
        raise ValueError(f"`titles` has {len(titles)} names; the path has {path.edges} edges.")
    per_edge = -(-checks.whole("frames", frames) // path.edges)
    poses = frames_along(robot, path, per_edge=per_edge)
    names = None
    if titles is not None:
        names = [titles[min(k // per_edge, path.edges - 1)] for k in range(len(poses.theta))]
    clock = np.arange(len(poses.theta)) / per_edge
    _film(robot, poses, target, clock, f"of {path.edges} edges", seconds, names, title, view, progress)


def animate(
    robot: Robot,
    frames: Frames,
    file: str | os.PathLike[str],
    *,
    seconds: float = 4.0,
    time: ArrayLike | None = None,
    titles: Sequence[str] | None = None,
    title: str | None = None,
    view: View | None = None,
    progress: bool | str = False,
) -> None:
    """Write a film of a robot in given poses, equally spaced in time; whole or not at all.

    Args:
        robot: the robot.
        frames: its poses, such as `frames_along` or a simulation gives.
        file: where to, a name that ends in .mp4 (needs ffmpeg) or .gif; 960 x 720 pixels.
        seconds: from first to last pose in the film. The last one stays for a second.
        time: (m,) true times of the poses [s], to be told; default the share of the way.
        titles: a line above each frame.
        title: headline; default the robot's name.
        view: from where to look; default from the front.
        progress: whether to show a bar on stderr, or what to write before it.

    Raises:
        ValueError: if the file cannot be written, ffmpeg is missing for .mp4, a pose does not fit the robot, or a
            number is not positive.
    """
    target = check_animation(file)
    frames = check_frames(robot, frames)
    count = len(frames.theta)
    if titles is not None and len(titles) != count:
        raise ValueError(f"`titles` has {len(titles)} lines; there are {count} frames.")
    if time is None:
        _film(robot, frames, target, np.linspace(0, 100, count), "% of the way", seconds, titles, title, view, progress)
        return
    clock = checks.numbers("time", np.asarray(time), (count,))
    _film(robot, frames, target, clock, "s", seconds, titles, title, view, progress)


def check_animation(file: str | os.PathLike[str]) -> File:
    """Return `file` if a film can be written there now; for asking before a long computation.

    Raises:
        ValueError: for an ending that is not in `ENDINGS`, a path that cannot be written, or .mp4 without ffmpeg.
    """
    target = check_ending(file, "film", ENDINGS)
    if target.suffix.lower() == ".mp4" and shutil.which("ffmpeg") is None:
        raise ValueError(f"cannot write {str(file)!r}: .mp4 needs the program ffmpeg, which is missing; .gif does not.")
    return target


def _film(
    robot: Robot,
    frames: Frames,
    target: File,
    clock: Float[np.ndarray, " m"],
    unit: str,
    seconds: float,
    titles: Sequence[str] | None,
    title: str | None,
    view: View | None,
    progress: bool | str,
) -> None:
    """Draw frame after frame into one figure, a writer of matplotlib's takes each."""
    count = len(frames.theta)
    rate = max(1.0, (count - 1) / checks.positive("seconds", seconds, "s"))
    figure = Figure(figsize=_SIZE, dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    place = cast(Axes3D, figure.add_axes((0.1, 0.36, 0.8, 0.56), projection="3d"))
    figure.text(0.04, 0.95, title or robot.name, fontsize=17, fontweight="bold", color=INK, va="center")
    now = figure.text(0.96, 0.95, "", fontsize=14, color=INK, ha="right", va="center")
    line = figure.text(0.04, 0.905, "", fontsize=13, color=INK, va="center")
    cursors = _draw_curves(figure, robot, frames, clock, unit)
    low, high = extent(robot, frames)
    last = range(count - 1, count)
    order = [*range(count), *(k for k in last for _ in range(round(_HOLD * rate)))]
    gif = target.suffix.lower() == ".gif"
    writer = PillowWriter(fps=rate) if gif else FFMpegWriter(fps=rate, codec="h264", bitrate=-1)  # pyright: ignore
    beside = target.with_name(f".reojax-{secrets.token_hex(8)}{target.suffix.lower()}")
    try:
        with writer.saving(figure, str(beside), dpi=100):
            for k in tqdm(order, desc=label(progress) or target.name, unit=" frames", disable=not progress):
                place.clear()
                draw_robot(place, robot, frames.theta[k], frames.rotation[k], view=view)
                stage(place, low, high, zoom=1.75)
                directions(place, low, high)
                now.set_text(f"{clock[k]:.{_digits(clock)}f} {unit}")
                line.set_text("" if titles is None else titles[k])
                for cursor in cursors:
                    cursor.set_xdata([clock[k], clock[k]])
                writer.grab_frame()
        with replacing(target) as out:
            out.write(beside.read_bytes())
    finally:
        beside.unlink(missing_ok=True)


def _draw_curves(figure: Figure, robot: Robot, frames: Frames, clock: np.ndarray, unit: str) -> list[Line2D]:
    """Orientation and joint angles over the clock, each with a line that moves."""
    told = tilt_and_roll(frames.rotation)
    left, right = figure.add_axes((0.09, 0.09, 0.39, 0.2)), figure.add_axes((0.58, 0.09, 0.39, 0.2))
    for (name, colour), values in zip(ANGLES, told.T, strict=True):
        left.plot(clock, np.rad2deg(values), color=colour, label=name, linewidth=2)
    for k, name in enumerate(robot.joint_names):
        style = {"color": JOINTS[k % len(JOINTS)], "dashes": DASHES[k % len(DASHES)]}
        right.plot(clock, np.rad2deg(frames.theta[:, k]), label=name, linewidth=2, **style)
    cursors = []
    for axes, name, most in ((left, "base orientation [deg]", 3), (right, "joint angles [deg]", 6)):
        _dress_small(axes, name, unit, most)
        cursors.append(axes.axvline(clock[0], color=INK, linewidth=1.4))
    return cursors


def _dress_small(axes: Axes, name: str, unit: str, most: int) -> None:
    axes.set_title(name, fontsize=11, color=INK, loc="left", pad=22)
    axes.set_xlabel(_along(unit), fontsize=10, color=INK)
    axes.grid(axis="y", color=PALE, linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=9.5, colors=INK)
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(
        handles[:most], labels[:most], loc="lower left", bbox_to_anchor=(-0.02, 0.98), ncols=3, frameon=False,
        fontsize=9.5, handlelength=1.8, columnspacing=1.0, borderaxespad=0.2,
    )  # fmt: skip


def _along(unit: str) -> str:
    """What the clock counts."""
    return "time [s]" if unit == "s" else "along the path, edge by edge" if "edge" in unit else unit


def _digits(clock: np.ndarray) -> int:
    span = float(np.ptp(clock))
    return int(np.clip(2 - np.floor(np.log10(span)), 0, 4)) if span > 0 else 0

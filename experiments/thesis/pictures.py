"""The pictures of `thesis_figures.py`, from what the other parts computed."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import reojax
from reojax import plot, robots
from reojax.robots.prototype import END_INERTIA
from thesis.curvature import Errors, Map
from thesis.grids import FULL_BEND, FULL_TWIST, Grid

SAMPLES = 64
"""Poses along an edge of which frames, animations and histories are made."""
EDGES = ("bend", "twist", "unbend", "untwist")


def _whole(values: np.ndarray, unit: str = "") -> list[str]:
    return [f"{value:g}{unit}" for value in np.round(values, 6)]


def _title(figure: Figure, text: str) -> None:
    figure.suptitle(text, x=0.01, ha="left", fontsize=12, fontweight="bold")


def _angles(values: np.ndarray) -> list[list[str]]:
    return [[f"{round(value) + 0:d}°".replace("-", "−") for value in row] for row in values]


def _subfigures(figure: Figure, *shape: int, **ratios) -> np.ndarray:
    return np.asarray(figure.subfigures(*shape, **ratios))


def amplitudes(grid: Grid, *, name: str, figures: str, yaw: bool = False) -> Figure:
    """Figures 1.5, 2.7 and 2.10: poses after the manoeuvre, and the turn over the amplitudes."""
    own, robot = grid.own(), robots.prototype()
    main = "yaw" if yaw else "roll"

    def told(turn) -> tuple[np.ndarray, np.ndarray]:
        return tuple(np.rad2deg(x).T for x in ((turn.yaw, turn.tip_yaw) if yaw else (turn.roll, turn.tip)))

    figure = Figure(figsize=(12.5, 6.6), layout="constrained")
    left, right = _subfigures(figure, 1, 2, width_ratios=(1.25, 1))
    twist, bend = (np.rad2deg(values) for values in own.axes)
    poses = left.subplots()
    plot.draw_poses(
        poses,
        robot,
        np.swapaxes(own.turn.rotation, 0, 1),
        columns=_whole(twist),
        rows=_whole(bend),
        texts=_angles(told(own.turn)[0]),
        view=plot.View(elevation=55.0) if yaw else None,
    )
    poses.set(xlabel="twist of the distal joints [deg]", ylabel="bend of the centre joint [deg]")
    poses.set_title(f"after the manoeuvre, with the {main}", fontsize=10)
    twist, bend = (np.rad2deg(values) for values in grid.axes)
    panels = right.subplots(2, 1, sharex=True)
    for axes, values, label in zip(panels, told(grid.turn), (main, "off-axis"), strict=True):
        flat = values if label != "yaw" else -values
        plot.draw_map(axes, twist, bend, flat, label=f"{'−' if label == 'yaw' else ''}{label} [deg]")
        axes.set(ylabel="bend [deg]", yticks=np.rad2deg(own.axes[1]), xticks=np.rad2deg(own.axes[0]))
    panels[-1].set_xlabel("twist [deg]")
    _title(figure, f"Thesis {figures}: manoeuvre {name} at several amplitudes")
    return figure


def end_inertia(grid: Grid) -> Figure:
    """Figure 2.8: poses and turn over the inertia of the end links."""
    own, robot = grid.own(), robots.prototype()
    values = own.axes[0] * 1e6
    figure = Figure(figsize=(11, 6.4), layout="constrained")
    top, below = _subfigures(figure, 2, 1, height_ratios=(1, 1.7))
    poses = top.subplots()
    plot.draw_poses(
        poses,
        [robots.with_end_inertia(robot, inertia) for inertia in own.axes[0]],
        np.asarray(own.turn.rotation)[None],
        columns=_whole(values),
        rows=[""],
        texts=_angles(np.rad2deg(own.turn.roll)[None]),
    )
    poses.set_xlabel("end link inertia about the distal joint [kg mm²]")
    poses.set_title("after manoeuvre A at 270°/120°, with the roll", fontsize=10)
    fine, every = grid.axes[0] * 1e6, slice(None, None, grid.step)
    for axes, field, label in zip(below.subplots(1, 2), ("roll", "tip"), ("roll", "off-axis"), strict=True):
        turn = np.rad2deg(getattr(grid.turn, field))
        plot.draw_lines(axes, fine, turn[None], labels=["fine grid; dots: the thesis's"], points=every)
        axes.axvline(END_INERTIA * 1e6, color="0.6", linewidth=1, linestyle=":")
        axes.annotate("prototype", (END_INERTIA * 1e6, 0.04), (-4, 0), ("data", "axes fraction"), "offset points",
                      rotation=90, ha="right", color="0.4", fontsize=8.5)  # fmt: skip
        axes.set(xlabel="end link inertia [kg mm²]", ylabel=f"{label} [deg]", xticks=values)
    _title(figure, "Thesis figure 2.8: inertia of the end links")
    return figure


def motors(grid: Grid) -> Figure:
    """Figure 2.9: poses and turn over gear ratio and rotor inertia."""
    own = grid.own()
    shares = [f"1/{END_INERTIA / rotor:g}" for rotor in own.axes[1]]
    figure = Figure(figsize=(12.5, 6.6), layout="constrained")
    left, right = _subfigures(figure, 1, 2, width_ratios=(1.25, 1))
    poses = left.subplots()
    plot.draw_poses(
        poses,
        robots.prototype(),
        np.swapaxes(own.turn.rotation, 0, 1),
        columns=_whole(own.axes[0]),
        rows=shares,
        texts=_angles(np.rad2deg(own.turn.roll).T),
    )
    poses.set(xlabel="gear ratio", ylabel="rotor inertia / end link inertia")
    poses.set_title("after manoeuvre A at 270°/120°, with the roll", fontsize=10)
    ratio, place = grid.axes[0], np.arange(len(grid.axes[1])) / grid.step
    panels = right.subplots(2, 1, sharex=True)
    for axes, field, label in zip(panels, ("roll", "tip"), ("roll", "off-axis"), strict=True):
        plot.draw_map(axes, ratio, place, np.rad2deg(getattr(grid.turn, field)).T, label=f"{label} [deg]")
        axes.set_yticks(range(len(shares)), shares)
        axes.set(ylabel="rotor / end link", xticks=own.axes[0])
    panels[-1].set_xlabel("gear ratio")
    _title(figure, "Thesis figure 2.9: gear ratio and rotor inertia")
    return figure


def progress(path: reojax.Path, frames: plot.Frames, *, name: str, number: str) -> Figure:
    """Figures 2.5 and 2.6: the robot along the manoeuvre, two frames an edge."""
    names = ["start"]
    for edge in EDGES:
        names += [f"{edge}, half", f"{edge}, done"]
    title = f"Thesis figure {number}: manoeuvre {name} at 270°/120°"
    return plot.frames_figure(
        robots.prototype(), path, per_edge=2, titles=names, title=title, columns=5, frames=every(frames, SAMPLES // 2)
    )


def animation(frames: plot.Frames, file: Path, *, count: int) -> None:
    """Figures 2.5 and 2.6 as a GIF of about `count` frames."""
    step = max(len(frames.theta) // count, 1)
    chosen = every(frames, step)
    names = [EDGES[min(k * step // SAMPLES, len(EDGES) - 1)] for k in range(len(chosen.theta))]
    plot.animate(robots.prototype(), chosen, file, seconds=5.0, titles=names, progress=True)


def every(frames: plot.Frames, step: int) -> plot.Frames:
    """Return every `step`-th frame."""
    return plot.Frames(*(field[::step] for field in frames))


def history(path: reojax.Path, frames: plot.Frames) -> Figure:
    """Figure 1.9: orientation in ZXZ angles, and joint angles."""
    title = "Thesis figure 1.9: manoeuvre A in ZXZ angles"
    robot = robots.prototype()
    return plot.history_figure(robot, path, title=title, edge_names=EDGES, angles="zxz", rotations=frames.rotation)


def curvature(maps: Sequence[Map], *, name: str) -> Figure:
    """Curvature on the plane of a manoeuvre, frame by frame, with the loop drawn in."""
    largest = max(np.abs(m.form).max() for m in maps)
    step = next(step for step in (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0) if largest < 8 * step)
    half = int(np.ceil(largest / step - 0.5))
    levels = step * (np.arange(-half - 1, half + 1) + 0.5)  # zero in the middle of a band
    figure = Figure(figsize=(11.5, 3.0 * len(maps) + 0.6), layout="constrained")
    panels = figure.subplots(len(maps), 3, sharex=True, sharey=True, squeeze=False)
    loop = np.rad2deg(np.array([[0, 0], [0, FULL_BEND], [FULL_TWIST, FULL_BEND], [FULL_TWIST, 0], [0, 0]]))
    for row, m in zip(panels, maps, strict=True):
        for axes, component, label in zip(
            row, np.moveaxis(m.form, -1, 0), ("pitch, x", "yaw, y", "roll, z"), strict=True
        ):
            twist, bend = np.rad2deg(m.twist), np.rad2deg(m.bend)
            plot.draw_map(axes, twist, bend, component.T, label=None, diverging=True, levels=levels.tolist())
            plot.draw_loop(axes, loop)
            axes.set_title(f"{m.frame}: {label}", fontsize=10)
            axes.set(xticks=np.arange(0, 271, 67.5), yticks=np.arange(0, 121, 30))
        row[0].set_ylabel("bend [deg]")
    for axes in panels[-1]:
        axes.set_xlabel("twist [deg]")
    bar = figure.colorbar(panels[0, 0].collections[-2], ax=panels, shrink=0.8, pad=0.02)
    bar.set_ticks((step * np.arange(-half, half + 1)).tolist())
    bar.set_label("curvature F(bend, twist) [rad/rad²]")
    _title(figure, f"Curvature of the local connection on the plane of manoeuvre {name}")
    return figure


def predictions(errors: dict[str, Errors]) -> Figure:
    """How far the surface integral of the curvature is from the net rotation, over the size of the loop."""
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    for axes, (name, e) in zip(figure.subplots(1, len(errors), sharey=True), errors.items(), strict=True):
        lines = np.concatenate([e.angle[None], e.miss])
        labels = ["net rotation itself", *(f"error, {frame}" for frame in e.frames)]
        plot.draw_lines(axes, np.rad2deg(e.size * FULL_TWIST), np.rad2deg(lines), labels=labels)
        axes.set(
            xscale="log", yscale="log", title=f"manoeuvre {name}", xlabel="twist of the loop [deg], bend 4/9 of it"
        )
    figure.axes[0].set_ylabel("angle [deg]")
    _title(figure, "Net rotation against exp of the surface integral of the curvature")
    return figure

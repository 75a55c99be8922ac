"""Results over a grid of designs: contours, families of lines, and the robot itself at every point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax.drawing.colours import GREY, INK, PALE
from reojax.drawing.view import View
from reojax.plot._arguments import check_arguments
from reojax.plot.robots import draw_robot_flat, faces_at_pose
from reojax.robot import Robot

LINES = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", INK)
"""Colours of lines, in order (Okabe and Ito)."""
_MARKERS = "osD^vPX"


@check_arguments
def draw_map(
    axes: Axes,
    x: ArrayLike,
    y: ArrayLike,
    values: ArrayLike,
    *,
    label: str | None,
    diverging: bool = False,
    levels: int | Sequence[float] = 10,
) -> Axes:
    """Draw values over a grid as filled contours with a bar beside them.

    The filled contours are the last but one of `axes.collections`, for a bar of your own.

    Args:
        axes: flat axes.
        x: (c,) grid along x, in the units to be shown.
        y: (r,) grid along y.
        values: (r, c) values, finite.
        label: of the bar, with unit; None for no bar.
        diverging: values have a sign; colours are symmetric about zero.
        levels: number of contours, or the values on which they lie, for maps that are compared.

    Raises:
        ValueError: if the shapes do not go together, or a value is not finite.
    """
    columns, rows, z = (np.asarray(a, float) for a in (x, y, values))
    if columns.ndim != 1 or rows.ndim != 1 or z.shape != (rows.size, columns.size) or min(z.shape, default=0) < 2:
        raise ValueError(f"`values` has shape {z.shape}; x {columns.shape} and y {rows.shape} make it (rows, columns).")
    if not np.isfinite(z).all():
        raise ValueError("`values` must be finite everywhere.")
    if checks.rank(levels) == 0:
        levels = checks.whole("levels", levels, 1, 1000)
    else:
        on = checks.numbers("levels", levels, (-1,))
        if len(on) < 2 or not (np.diff(on) > 0).all():
            raise ValueError(f"`levels` is {checks.shorten(on)}; it must be two or more numbers that increase.")
        levels = on.tolist()
    style: dict[str, Any] = {"cmap": "cividis"}
    if diverging:
        size = max(np.abs(z if isinstance(levels, int) else np.array(levels)).max(), 1e-300)
        style = {"cmap": "PuOr", "vmin": -size, "vmax": size}
    if np.ptp(z) <= 1e-9 * max(np.abs(z).max(), 1.0):
        levels = np.array([-1.0, 1.0]) * max(np.abs(z).max(), 1.0)
    filled = axes.contourf(columns, rows, z, levels, **style)
    thin = axes.contour(columns, rows, z, filled.levels, colors=INK, linewidths=0.4, alpha=0.7)
    thin.set_linestyle("solid")
    if label is not None:
        bar = axes.figure.colorbar(filled, ax=axes, shrink=0.95, pad=0.03)
        bar.set_label(label, color=INK)
        bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]  (a spine)
    axes.tick_params(colors=INK, color=GREY)
    return axes


@check_arguments
def draw_loop(axes: Axes, corners: ArrayLike, *, label: str | None = None) -> Axes:
    """Draw a path in a plane of shape space over a map of it, with an arrow on every edge.

    Args:
        axes: flat axes.
        corners: (v, 2) in the units shown.
        label: a name, for a legend.

    Raises:
        ValueError: if the shape of `corners` is another.
    """
    points = np.asarray(corners, float)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2:
        raise ValueError(f"`corners` has shape {points.shape}; it must be (v, 2), two or more.")
    axes.plot(*points.T, color=INK, linewidth=1.6, label=label, clip_on=False)
    for start, end in zip(points, points[1:], strict=False):
        tail, head = start + 0.48 * (end - start), start + 0.56 * (end - start)
        arrow = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.6, "mutation_scale": 12}
        axes.annotate("", tuple(head), tuple(tail), arrowprops=arrow, annotation_clip=False)
    return axes


@check_arguments
def draw_lines(
    axes: Axes, x: ArrayLike, values: ArrayLike, *, labels: Sequence[str], points: Sequence[int] | slice | None = None
) -> Axes:
    """Draw a family of lines over one variable, told apart by colour and marker, with a legend.

    Args:
        axes: flat axes.
        x: (m,) variable.
        values: (k, m) one row for each line.
        labels: k names.
        points: which of the m values get a marker; default all.

    Raises:
        ValueError: if the shapes do not go together.
    """
    along, rows = np.asarray(x, float), np.asarray(values, float)
    if along.ndim != 1 or rows.shape != (len(labels), along.size):
        raise ValueError(f"`values` has shape {rows.shape}; {len(labels)} labels and x {along.shape} ask for another.")
    every = slice(None) if points is None else points
    for k, (row, label) in enumerate(zip(rows, labels, strict=True)):
        marked = np.arange(along.size)[every].tolist()
        colour = LINES[k % len(LINES)]
        style: dict[str, Any] = {"marker": _MARKERS[k % len(_MARKERS)], "markevery": marked, "markersize": 4.5}
        axes.plot(along, row, color=colour, label=label, linewidth=1.6, **style)
    axes.grid(color=PALE, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(GREY)
    axes.tick_params(colors=INK, color=GREY)
    axes.legend(frameon=False, fontsize=8.5, labelcolor=INK, handlelength=2.4)
    return axes


@check_arguments
def draw_poses(
    axes: Axes,
    robots: Robot | Sequence[Robot],
    rotations: Float[Array, "r c 3 3"],
    *,
    columns: Sequence[str],
    rows: Sequence[str],
    theta: ArrayLike | None = None,
    texts: Sequence[Sequence[str]] | None = None,
    view: View | None = None,
) -> Axes:
    """Draw robots on a grid, one turned by each rotation, as the thesis shows its sweeps (figures 2.7 to 2.10).

    Args:
        axes: flat axes; they get equal scales and one unit for each robot.
        robots: one robot for all, or r * c of them, row by row.
        rotations: (r, c, 3, 3) of the base; row 0 is at the bottom.
        columns: c labels below.
        rows: r labels at the left, the first at the bottom.
        theta: (j,) joint angles of all [rad]; default zeros.
        texts: r rows of c words below the robots.
        view: from where to look; default from the front.

    Raises:
        ValueError: if numbers of robots, rotations and labels differ, or a pose does not fit a robot.
    """
    turns = np.asarray(rotations, float)
    if turns.ndim != 4 or turns.shape != (len(rows), len(columns), 3, 3):
        raise ValueError(f"`rotations` has shape {turns.shape}; the labels make it {len(rows), len(columns), 3, 3}.")
    count = len(rows) * len(columns)
    each = [robots] * count if isinstance(robots, Robot) else checks.listing("robots", robots, "robots")
    each = [checks.instance(f"robots[{i}]", robot, Robot, "`make_robot` makes") for i, robot in enumerate(each)]
    if texts is not None and not (checks.rank(texts) == 2 and np.shape(texts) == (len(rows), len(columns))):
        raise ValueError(f"`texts` is {checks.shorten(texts)}; it must be {len(rows)} rows of {len(columns)} words.")
    if len(each) != count:
        raise ValueError(f"there are {len(each)} robots for {count} rotations.")
    view = View() if view is None else view
    pose = np.zeros(each[0].joints) if theta is None else theta
    seen = [
        faces_at_pose(r, pose, turn)[0] @ view.camera().T for r, turn in zip(each, turns.reshape(-1, 3, 3), strict=True)
    ]
    scale = 0.42 / max(np.abs(points[..., :2]).max() for points in seen)
    for k, (robot, turn) in enumerate(zip(each, turns.reshape(-1, 3, 3), strict=True)):
        row, column = divmod(k, len(columns))
        draw_robot_flat(axes, robot, pose, turn, at=(column, row), scale=scale, view=view)
        if texts is not None:
            axes.text(column, row - 0.47, texts[row][column], fontsize=7.5, color=INK, ha="center", va="center")
    axes.set_aspect("equal")
    axes.set_xlim(-0.55, len(columns) - 0.45)
    axes.set_ylim(-0.58, len(rows) - 0.45)
    axes.set_xticks(range(len(columns)), columns)
    axes.set_yticks(range(len(rows)), rows)
    axes.tick_params(length=0, colors=INK)
    for side in axes.spines.values():
        side.set_color(PALE)
    return axes

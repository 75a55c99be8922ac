"""A plan on its way: where the body's axes point, how far the target still is, and what the joints do."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from reojax import so3
from reojax._internal.arrays import Array
from reojax.collision.nearest import nearest_parts
from reojax.drawing.colours import AXES, GREY, INK, PALE
from reojax.drawing.view import View, default_view
from reojax.mechanics.holonomy import rotation_history
from reojax.path import polygon
from reojax.planning import FreePaths, Plan
from reojax.plot._style import dress_path
from reojax.plot.history import draw_joints
from reojax.plot.nearest import draw_nearest, mark_nearest
from reojax.robot import Robot

_SAMPLES = 24
"""Samples per edge."""
_NAMED = 12
"""Most manoeuvres that are named under the picture."""


def plan_figure(
    robot: Robot,
    plan: Plan | FreePaths,
    target: Float[Array, "3 3"],
    *,
    title: str | None = None,
    clearance: bool | None = None,
) -> Figure:
    """Draw a plan or a free closed path for one target.

    Left, the unit sphere in inertial directions with the track of the base's z axis, roll on the named robots; short
    lines show its axes x, y, z at the end, rings where the target wants them. Right, the angle left to the target and
    the joint angles along the path, every edge equally wide.

    Args:
        robot: the robot.
        plan: a plan for one target, of one manoeuvre or more, or a free path.
        target: (3, 3) the rotation it was made for.
        title: default the word, or "closed path".
        clearance: whether to show where the robot comes nearest to itself, the two nearest points joined by a line;
            default if the plan was asked for a clearance.

    Raises:
        ValueError: if the plan has no manoeuvre, or is for many targets; or the robot has no pairs of shapes whose
            clearance could be shown.
    """
    corners = np.asarray(plan.waypoints, float)
    if corners.ndim != 2:
        raise ValueError("`plan` is for many targets; draw one at a time.")
    path = polygon(corners)
    if not path.edges:
        raise ValueError("`plan` has no manoeuvre; a picture needs one.")
    wanted = np.asarray(target, float)
    history = np.asarray(rotation_history(robot, path, samples=_SAMPLES))
    cosine = 0.5 * (np.einsum("mij,ij->m", history, wanted) - 1)
    left = np.rad2deg(np.arccos(np.clip(cosine, -1, 1)))
    near = nearest_parts(robot, path) if (plan.clearance is not None if clearance is None else clearance) else None
    figure = Figure(figsize=(10.5, 5.2 if near is None else 7.6), layout="constrained", facecolor="white")
    grid = figure.add_gridspec(2, 2, width_ratios=(1, 1.25))
    sphere = figure.add_subplot(grid[:, 0] if near is None else grid[0, 0], projection="3d")
    assert isinstance(sphere, Axes3D)
    _draw_sphere(sphere, history, wanted, default_view(robot))
    above = figure.add_subplot(grid[0, 1])
    below = figure.add_subplot(grid[1, 1], sharex=above)
    above.plot(np.linspace(0, path.edges, len(left)), left, color="#d55e00", linewidth=2, label="angle left")
    above.set_ylabel("to the target [deg]", color=INK)
    dress_path(above, path.edges)
    above.set_ylim(0, None)
    draw_joints(below, robot, path)
    below.set_xlabel("along the path, edge by edge", color=INK)
    if near is not None:
        place = figure.add_subplot(grid[1, 0], projection="3d")
        assert isinstance(place, Axes3D)
        draw_nearest(place, robot, near)
        place.set_axis_off()
        for axes in (above, below):
            mark_nearest(axes, near.at)
    short = "closed path"
    if isinstance(plan, Plan):
        short = "-".join(plan.word) if len(plan.word) <= _NAMED else f"{len(plan.word)} loops"
        if len(plan.word) <= _NAMED:
            start = (path.edges - 4 * len(plan.word)) / 2  # the feet may fold first
            below.set_xticks(start + 4 * np.arange(len(plan.word)) + 2, [str(letter) for letter in plan.word])
            below.tick_params(axis="x", length=0)
            below.set_xlabel("manoeuvres", color=INK)
    figure.suptitle(title or f"{robot.name}: {short}", fontsize=13, fontweight="bold", color=INK)
    return figure


def _draw_sphere(axes: Axes3D, history: np.ndarray, wanted: np.ndarray, view: View) -> None:
    around, up = np.meshgrid(np.linspace(0, 2 * np.pi, 37), np.linspace(0, np.pi, 19))
    ball = np.cos(around) * np.sin(up), np.sin(around) * np.sin(up), np.cos(up)
    axes.plot_wireframe(*ball, color=PALE, linewidth=0.4)
    track = history[:, :, 2].T
    axes.plot(*track, color=GREY, linewidth=1.6, label="track of z")
    axes.plot(*track[:, :1], "o", color=GREY, markersize=4)
    for k, (name, colour) in enumerate(zip("xyz", AXES, strict=True)):
        end, goal = history[-1, :, k], wanted[:, k]
        axes.plot(*np.stack([0 * end, end], axis=1), color=colour, linewidth=2.2, label=f"{name} at the end")
        axes.plot(*goal[:, None], "o", color=colour, markersize=9, markerfacecolor="none", markeredgewidth=1.6)
    axes.set_box_aspect((1, 1, 1), zoom=1.25)  # pyright: ignore[reportArgumentType]  (zoom is a float)
    axes.set_proj_type("ortho")
    axes.view_init(elev=view.elevation, azim=view.azimuth, vertical_axis=view.up)
    axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    axes.set_axis_off()
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0.02), ncols=2, frameon=False, fontsize=9)
    vector = ", ".join(f"{x:.1f}" for x in np.rad2deg(np.asarray(so3.log(wanted)))).replace("-", "\N{MINUS SIGN}")
    axes.set_title(f"base axes; rings: the target,\nrotation vector ({vector})°", fontsize=10.5, color=INK)

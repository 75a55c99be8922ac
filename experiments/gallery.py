"""One picture of what all this is about: the prototype's half roll as a strip of poses above its curves.

    python experiments/gallery.py

Writes `turn.png`, the first picture of the documentation, and `turn.html`, the same motion to look at in a browser.
Expected: after bend, twist, unbend, untwist the joints are where they were, and the base has rolled by 185 degrees.
"""

from pathlib import Path
from typing import Any

import numpy as np
from common.script import options, run
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch

import reojax
from reojax import plot
from reojax.files import check_writable

TWIST, BEND = np.deg2rad(270.0), np.deg2rad(120.0)
EDGES = ("bend", "twist", "unbend", "untwist")
PER_EDGE = 2
SIZE, ABOVE = (12.6, 4.7), 0.365
"""Of the picture [inch], and the share of its height that the poses take."""
INK, ROLL = "#222222", "#d55e00"
CENTRED: dict[str, Any] = {"ha": "center", "va": "center"}
AXES = (("x", "#009e73"), ("y", "#cc79a7"))
"""The base's axes that show a roll, and their colours."""


def main(out: Path, *, quick: bool = False) -> dict:
    """Draw the strip, write the page, and return how far the base has rolled."""
    picture, page = plot.check_picture(out / "turn.png"), check_writable(out / "turn.html")
    robot = reojax.robots.prototype()
    path = reojax.manoeuvre_a(TWIST, BEND)
    history = np.asarray(reojax.rotation_history(robot, path, samples=64))
    figure, rolled = strip(robot, path, history)
    plot.save(figure, picture)
    reojax.view(
        robot,
        path,
        page,
        target=np.diag([-1.0, -1.0, 1.0]),
        title="A half roll of the prototype: manoeuvre A, 270°/120°",
    )
    print(f"the base rolls by {rolled:.2f} deg; wrote {picture} and {page}")
    return {"roll_deg": rolled}


def strip(robot: reojax.Robot, path: reojax.Path, history: np.ndarray) -> tuple[Figure, float]:
    """Poses above the curves of joints and roll, all over the path; and the roll at the end [deg]."""
    roll = np.rad2deg(np.unwrap(np.arctan2(history[:, 1, 0] - history[:, 0, 1], history[:, 0, 0] + history[:, 1, 1])))
    figure = Figure(figsize=SIZE, facecolor="white")
    above = figure.add_axes((0.065, 0.52, 0.925, ABOVE))
    below = figure.add_axes((0.065, 0.115, 0.925, 0.36))
    _poses(above, robot, path, history, roll)
    _curves(below, robot, path, roll)
    figure.text(0.012, 0.955, "A robot in free fall rolls over by moving its joints round a loop", fontsize=15,
                fontweight="bold", color=INK, va="center")  # fmt: skip
    return figure, float(roll[-1])


def _poses(axes: Axes, robot: reojax.Robot, path: reojax.Path, history: np.ndarray, roll: np.ndarray) -> None:
    """Robots in a row over the place of each along the path, with the base's axes x and y, and the roll."""
    camera = plot.View().camera()
    frames = plot.frames_along(robot, path, per_edge=PER_EDGE)
    step = (len(history) - 1) // (len(frames.theta) - 1)
    axes.set(xlim=(-0.25, 4.25), ylim=(-0.34, 0.28))
    axes.set_axis_off()
    inch = SIZE[0] * 0.925 / 4.5, SIZE[1] * ABOVE / 0.62  # a unit of each direction on the page
    scale = 2.05 * np.array([1.0, inch[0] / inch[1]])
    for k, (theta, rotation) in enumerate(zip(frames.theta, frames.rotation, strict=True)):
        at = np.array([k / PER_EDGE, 0.02])
        for column, (name, colour) in enumerate(AXES):
            seen = camera @ rotation[:, column]
            tip = at + 0.085 * scale * seen[:2]
            style: dict[str, Any] = {
                "arrowstyle": "-|>",
                "mutation_scale": 11,
                "linewidth": 2.2,
                "shrinkA": 0,
                "shrinkB": 0,
            }
            ends = tuple(at), tuple(tip)
            axes.add_patch(FancyArrowPatch(*ends, color=colour, zorder=3 if seen[2] > 0 else 1, **style))
            x, y = at + 1.18 * (tip - at)
            axes.text(x, y, name, color=colour, fontsize=11, fontweight="bold", **CENTRED)
        plot.draw_robot_flat(axes, robot, theta, rotation, at=(at[0], at[1]), scale=scale)
        axes.text(at[0], -0.3, f"{roll[k * step]:.0f}°", color=ROLL, fontsize=12, **CENTRED)
    axes.text(-0.24, -0.3, "roll", ha="right", va="center", fontsize=12, color=ROLL)


def _curves(axes: Axes, robot: reojax.Robot, path: reojax.Path, roll: np.ndarray) -> None:
    plot.draw_joints(axes, robot, path)
    axes.plot(np.linspace(0, path.edges, len(roll)), roll, color=ROLL, linewidth=3, label="roll of the base")
    axes.set_xlim(-0.25, 4.25)
    axes.set_xticks(np.arange(4) + 0.5, EDGES, fontsize=11)
    axes.set_ylabel("angles [deg]")
    for corner in range(5):
        axes.axvline(corner, color="#c5ccd1", linewidth=0.8, zorder=0)
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, 1.16), ncols=4, frameon=False, fontsize=10.5, borderaxespad=0)


if __name__ == "__main__":
    run(main, options(__doc__))

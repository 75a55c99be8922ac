"""One HTML file that shows a robot turning, opens from disk, and loads nothing from anywhere."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib import resources
from pathlib import Path as File
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.files import check_ending, replacing
from reojax.captures.comparison import Comparison
from reojax.drawing.colours import ANGLES, AXES, JOINTS
from reojax.drawing.view import View, default_view
from reojax.robot import Robot
from reojax.viewer import numbers
from reojax.viewer.clip import Clip, clip_of, clips_of_comparison, nearest_on_clock
from reojax.viewer.scene import clip_data, robot_data, shorten, table

_SCRIPTS = ("kinematics", "stage", "curves", "player")
"""The page's own scripts, in order."""


def view(
    robot: Robot,
    motion: Any,
    file: str | os.PathLike[str] = "turn.html",
    *,
    target: ArrayLike | None = None,
    beside: Any = None,
    beside_robot: Robot | None = None,
    ghost: Any = None,
    names: Sequence[str] | None = None,
    title: str | None = None,
    up: Literal["x", "y", "z"] | None = None,
    rows: Mapping[str, str] | None = None,
    certificate: bool | None = None,
    clearance: bool | None = None,
) -> File:
    """Write a page that shows a robot turning, for any browser; below 2 MB, whole or not at all.

    The page holds everything it needs: the robot's shapes (its capsules, or solids made of its inertia), the base's
    axes with the track of one of them on a sphere, the axes of the target, curves of orientation and joint angles that
    follow the slider, and the numbers. The centre of mass rests, as in free fall. Between samples joint angles are
    interpolated linearly and orientations along great circles. Keys: space plays, arrows step, home and end jump,
    + and - change the speed, r looks from where it started.

    Args:
        robot: the robot.
        motion: what it does: a `Path` or a `Plan` (the clock counts edges then, as there is no time in them), a
            `Trajectory` or what holds one (`Fastest`), anything that holds `time`, `theta` and `rotation` such as a
            `Motion`, or a `Comparison`, whose measured motion becomes the ghost of the simulated one.
        file: where to, a name that ends in .html.
        target: (3, 3) orientation of the base that is wanted, base components to inertial ones.
        beside: another motion, shown on the right on the same clock, which must be of the same kind.
        beside_robot: the robot that makes it; default the same.
        ghost: another motion of `robot`, shown translucent in the same place.
        names: what to call the motions, in the order motion, beside, ghost, as far as they are given.
        title: headline; default the robot's name.
        up: axis that points up; default y for robots laid out as the thesis's, z for others.
        rows: more numbers for the table, text by name.
        certificate: whether to measure how sure the turn of a path is (`certify`); default for up to 48 edges.
        clearance: whether to find where the parts of each robot come nearest to each other, as shown: told in the table
            and under the title, marked in the curves, the two nearest points joined by a line; default for a plan that
            was asked for a clearance.

    Returns:
        The file.

    Raises:
        ValueError: if the file cannot be written, a motion is none or another robot's, the clocks differ, the target
            is no rotation, or `clearance` is asked of a robot that has no pairs of shapes.
    """
    checks.instance("robot", robot, Robot, "make_robot makes")
    where = check_ending(file, "page", ("html", "htm"))
    wanted = None if target is None else checks.rotations("target", target, tolerance=1e-3)
    if up is not None:
        checks.one_of("up", up, ("x", "y", "z"))
    if title is not None and not isinstance(title, str):
        raise ValueError(f"`title` is {checks.shorten(title)}; it must be a string.")
    told = {} if rows is None else rows
    if not isinstance(told, Mapping) or not all(isinstance(text, str) for row in told.items() for text in row):
        raise ValueError(f"`rows` is {checks.shorten(rows)}; it must map names to texts.")
    other = robot if beside_robot is None else checks.instance("beside_robot", beside_robot, Robot, "make_robot makes")
    shown: list[tuple[str, Robot, Clip]] = []
    if isinstance(motion, Comparison):
        if ghost is not None:
            raise ValueError("`ghost` is the measured motion where `motion` is a Comparison; leave it out.")
        simulated, measured = clips_of_comparison(robot, motion)
        shown.append(("simulated", robot, simulated))
    else:
        measured = None if ghost is None else clip_of(robot, ghost, entry="ghost", certificate=certificate)
        shown.append(("motion", robot, clip_of(robot, motion, certificate=certificate)))
    if beside is not None:
        shown.append(("beside", other, clip_of(other, beside, entry="beside", certificate=certificate)))
    if measured is not None:
        shown.append(("measured" if isinstance(motion, Comparison) else "ghost", robot, measured))
    if len({clip.timed for _, _, clip in shown}) > 1:
        raise ValueError("a path has no time, so it cannot be shown on one clock with a motion that has: simulate it.")
    if getattr(motion, "clearance", None) is not None if clearance is None else clearance:
        shown = [(role, own, clip._replace(nearest=nearest_on_clock(own, clip))) for role, own, clip in shown]
    labels = _labels(names, [role for role, _, _ in shown])
    data = _data(shown, labels, wanted, View(up=up) if up else default_view(robot), dict(told))
    data["title"] = title or robot.name
    with replacing(where) as out:
        out.write(page(data).encode())
    return where


def page(data: Mapping[str, Any]) -> str:
    """The page's text. Names enter it as JSON that cannot end its script, and become text nodes."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"), ensure_ascii=True)
    for mark in "<>&":
        text = text.replace(mark, f"\\u{ord(mark):04x}")
    own = "\n".join(_asset(f"{name}.js") for name in _SCRIPTS)
    parts = {
        "TITLE": html.escape(str(data["title"])),
        "STYLE": _asset("page.css"),
        "LICENCE": _asset("three.LICENSE").strip(),
        "THREE": _asset("three.min.js"),
        "DATA": text,
        "SCRIPT": own,
    }
    first, *rest = _asset("page.html").split("{{")
    pieces = [piece.partition("}}") for piece in rest]
    return first + "".join(parts[name] + after for name, _, after in pieces)


def _data(
    shown: Sequence[tuple[str, Robot, Clip]],
    labels: Sequence[str],
    target: np.ndarray | None,
    look: View,
    more: dict[str, str],
) -> dict[str, Any]:
    robots = list(dict.fromkeys(robot for _, robot, _ in shown))
    columns = [numbers.rows(clip, target) for _, _, clip in shown]
    columns[0] |= {str(name): str(value) for name, value in more.items()}
    clips = [
        clip_data(clip, label, target)
        | {"robot": robots.index(robot), "ghost": role in ("ghost", "measured"), "role": role}
        for (role, robot, clip), label in zip(shown, labels, strict=True)
    ]
    notes = [note for _, _, clip in shown for note in clip.notes]
    return {
        "robots": [robot_data(robot) for robot in robots],
        "clips": clips,
        "table": table(columns),
        "timed": shown[0][2].timed,
        "target": None if target is None else target.tolist(),
        "up": look.up,
        "camera": look.camera().tolist(),
        "axis_colours": list(AXES),
        "joint_colours": list(JOINTS),
        "angle_names": [name for name, _ in ANGLES],
        "notes": list(dict.fromkeys(notes)),
    }


def _labels(names: Sequence[str] | None, roles: Sequence[str]) -> list[str]:
    if names is None:
        return list(roles)
    given = [names] if isinstance(names, str) else checks.listing("names", names, "texts")
    if len(given) != len(roles) or not all(isinstance(name, str) for name in given):
        raise ValueError(f"`names` is {checks.shorten(names)}; it must name {', '.join(roles)}, in this order.")
    return [shorten(name) for name in given]


@lru_cache
def _asset(name: str) -> str:
    return resources.files("reojax.viewer").joinpath("page", name).read_text("utf-8")

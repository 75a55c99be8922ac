"""The robot of a command: by name, or from a file."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from reojax.manoeuvres import Layout
    from reojax.robot import Robot

_ENDINGS = (".urdf", ".xml", ".mjcf", ".json")


def add_robot(parser: argparse.ArgumentParser, default: str | None = "prototype") -> None:
    """Declare `--robot`."""
    text = "robot: a name (a wrong one lists them), or a .urdf, .xml or .json file"
    parser.add_argument("--robot", default=default, metavar="NAME|FILE", help=f"{text} [%(default)s]")


def robot_of(name: str) -> "Robot":
    """The robot of that name, or in that file.

    Raises:
        ValueError: if there is no such robot, or the file cannot be read.
    """
    from reojax import robots

    if name in robots.NAMES or not is_file(name):
        return robots.by_name(name)
    from reojax.models.load import load_robot

    try:
        return load_robot(name)
    except ImportError as error:  # it says what to install
        raise ValueError(str(error)) from None


def layout_of(robot: "Robot") -> "Layout":
    """The robot's own layout, which manoeuvres need.

    Raises:
        ValueError: if it has none, saying what works without.
    """
    if robot.layout is None:
        raise ValueError(
            f"{robot.name!r} has no layout of its own, which manoeuvres need; "
            "`reojax plan --robot ... --save PLAN.json` finds a path for any robot, and --plan PLAN.json runs it."
        )
    return robot.layout


def is_file(name: str) -> bool:
    """Whether a text is meant as the path of a robot file."""
    return name.lower().endswith(_ENDINGS) or "/" in name or Path(name).is_file()

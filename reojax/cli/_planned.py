"""The options that plan a motion: a manoeuvre, a time law and durations; and the trajectory they make."""

import argparse
import math
from typing import TYPE_CHECKING

from reojax.cli._arguments import SHORTEST, degrees

if TYPE_CHECKING:
    from reojax.motion.trajectory import Trajectory
    from reojax.path import Path
    from reojax.robot import Robot


def add_plan(parser: argparse.ArgumentParser, *, manoeuvre: str | None) -> None:
    """Declare the options; `manoeuvre` is the default, None for no plan at all."""
    add = parser.add_argument
    parts = "a: the distal joints twist opposite ways; b: the same way" + (" [%(default)s]" if manoeuvre else "")
    add("--manoeuvre", choices=("a", "b"), default=manoeuvre, help=parts)
    add("--twist", type=degrees, default=270.0, metavar="DEG", help="twist of the distal joints [%(default)g]")
    add("--bend", type=degrees, default=120.0, metavar="DEG", help="bend of the centre joint [%(default)g]")
    add("--law", default="quintic", metavar="NAME", help="time law; a wrong name lists them [%(default)s]")
    add("--duration", type=_durations, metavar="S[,S...]", help="seconds of each edge, or one number for all")


def plan_motion(robot: "Robot", args: argparse.Namespace, path: "Path | None" = None) -> "Trajectory":
    """Trajectory of the joints that the options ask for, along `path` or their manoeuvre.

    Raises:
        ValueError: if the robot has no such manoeuvre, or law or durations are none.
    """
    import numpy as np

    from reojax.manoeuvres import manoeuvre_a, manoeuvre_b
    from reojax.motion.trajectory import along
    from reojax.robot import layout_of

    if args.duration is None:
        raise ValueError("--duration is missing: seconds for each edge, or one number for all.")
    if path is None:
        manoeuvre = {"a": manoeuvre_a, "b": manoeuvre_b}[args.manoeuvre]
        path = manoeuvre(np.deg2rad(args.twist), np.deg2rad(args.bend), layout_of(robot))
    durations = args.duration[0] if len(args.duration) == 1 else np.array(args.duration)
    return along(path, args.law, durations)


def _durations(text: str) -> list[float]:
    try:
        seconds = [float(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number, or several with commas between") from None
    if not all(math.isfinite(value) and value >= SHORTEST for value in seconds):
        raise argparse.ArgumentTypeError(f"{text!r} must be positive and finite, {SHORTEST:g} s or more")
    return seconds

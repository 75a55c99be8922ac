"""The options that plan a motion: a manoeuvre, a time law and durations; and the trajectory they make."""

import argparse
from typing import TYPE_CHECKING

from reojax.cli._arguments import LONGEST, SHORTEST, degrees

if TYPE_CHECKING:
    import numpy as np

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
    add_duration(parser)


def add_duration(parser: argparse.ArgumentParser) -> None:
    """Declare `--duration`."""
    text = "seconds of it all, which the edges share by the angle that their farthest joint goes; or of each edge"
    parser.add_argument("--duration", type=_durations, metavar="S[,S...]", help=text)


def durations_of(path: "Path", seconds: list[float]) -> "np.ndarray":
    """Seconds of each edge: as given, or by the angle that the farthest joint goes of one number for all.

    Raises:
        ValueError: if nothing moves, or there are too many or too few numbers.
    """
    import numpy as np

    if len(seconds) not in (1, path.edges):
        raise ValueError(f"argument --duration: {len(seconds)} numbers for {path.edges} edges; give one, or each.")
    angles = np.abs(np.diff(path.waypoints, axis=0)).max(axis=1)
    if not angles.sum() > 0:
        raise ValueError("nothing moves: every edge stays put.")
    return seconds[0] * angles / angles.sum() if len(seconds) == 1 else np.array(seconds)


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
        raise ValueError("--duration is missing: seconds of it all, or of each edge.")
    if path is None:
        manoeuvre = {"a": manoeuvre_a, "b": manoeuvre_b}[args.manoeuvre]
        path = manoeuvre(np.deg2rad(args.twist), np.deg2rad(args.bend), layout_of(robot))
    return along(path, args.law, durations_of(path, args.duration))


def _durations(text: str) -> list[float]:
    try:
        seconds = [float(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number, or several with commas between") from None
    if not all(SHORTEST <= value <= LONGEST for value in seconds):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a duration in seconds: it must be from {SHORTEST:g} to {LONGEST:g}"
        )
    return seconds

"""The options that plan a motion: a time law and durations along a path; and the trajectory they make."""

import argparse
from typing import TYPE_CHECKING

from reojax.cli._numbers import seconds as read_seconds

if TYPE_CHECKING:
    import numpy as np

    from reojax.motion.trajectory import Trajectory
    from reojax.path import Path


def add_timing(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "--law", default="quintic", metavar="NAME", help="time law; a wrong name lists them [%(default)s]"
    )
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


def plan_motion(path: "Path", args: argparse.Namespace) -> "Trajectory":
    """Trajectory of the joints along `path` that the options ask for.

    Raises:
        ValueError: if law or durations are none.
    """
    from reojax.motion.trajectory import along

    if args.duration is None:
        raise ValueError("--duration is missing: seconds of it all, or of each edge.")
    return along(path, args.law, durations_of(path, args.duration))


def _durations(text: str) -> list[float]:
    return [read_seconds(part) for part in text.split(",")]

"""What the subcommands share about staying clear of itself: lengths with units, the check of a path, how it is told."""

import argparse
from typing import TYPE_CHECKING, Any

from reojax.cli._numbers import length

if TYPE_CHECKING:
    from reojax.path import Path
    from reojax.robot import Robot


def add_clearance(parser: argparse.ArgumentParser, what: str) -> None:
    """Declare `--clearance`."""
    parser.add_argument(
        "--clearance", type=length, metavar="LENGTH", help=f"distance between the robot's parts, such as 5mm: {what}"
    )


def clearance_report(robot: "Robot", path: "Path", args: argparse.Namespace) -> dict[str, Any] | None:
    """The proven clearance along a path, and where it is least; None if it was not asked for.

    Raises:
        ValueError: for a robot that has no pairs of shapes.
    """
    if args.clearance is None:
        return None
    from reojax.collision.clearance import pair_name
    from reojax.collision.path_clearance import path_clearance

    if not robot.collision_pairs:
        raise ValueError(f"argument --clearance: {robot.name!r} has no pairs of shapes to keep apart.")
    found = path_clearance(robot, path)
    return {
        "asked_m": args.clearance,
        "proven_m": float(found.distance),
        "found_m": float(found.found),
        "pair": pair_name(robot, int(found.pair)),
        "at_edge": float(found.at),
        "kept": bool(found.distance >= args.clearance),
    }


def clearance_text(report: dict[str, Any]) -> list[str]:
    """The clearance in two lines."""
    least, asked = 1e3 * report["proven_m"], 1e3 * report["asked_m"]
    place = f"{report['pair']}, at {report['at_edge']:.3f} edges along the path"
    if report["kept"]:
        return ["", f"clear: {least:.3f} mm proven along the whole path; least between {place}"]
    what = f"parts overlap by {-1e3 * report['found_m']:.3f} mm" if report["found_m"] < 0 else f"{least:.3f} mm"
    return ["", f"NOT clear by {asked:g} mm: {what} between {place}"]

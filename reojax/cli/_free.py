"""What `reojax plan` adds for free paths: postures, joints and repeats as they are written at the command line."""

import argparse
import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

    from reojax.planning import FreePaths
    from reojax.robot import Robot

OPTIONS = {"start": "--from", "end": "--to", "joints": "--joints", "repeats": "--repeats", "corners": "--corners"}
"""What only a free path knows, by the name it has in the library."""


def add_free(parser: argparse.ArgumentParser) -> None:
    """Declare the options of free paths."""
    add = parser.add_argument
    form = "in degrees, one angle for each joint (0,30,-45) or by names (elbow=30,wrist=-45), the others at zero"
    add("--from", dest="start", metavar="POSTURE", help=f"posture before the path, {form}; a free path [zero]")
    add("--to", dest="end", metavar="POSTURE", help="posture after it, likewise; a free path [as before it]")
    add("--joints", metavar="NAME,...", help="joints that may move, by name or number; a free path [all]")
    add("--repeats", metavar="N", help="run one loop N times; `least` for the least N that is found; a free path [1]")
    add("--corners", type=int, metavar="N", help="free corners of a free path [8 for up to 4 joints, then fewer]")


def options_given(args: argparse.Namespace) -> list[str]:
    """The options that ask for a free path."""
    return [option for name, option in OPTIONS.items() if getattr(args, name) is not None]


def free(robot: "Robot", target: "np.ndarray", args: argparse.Namespace) -> "FreePaths":
    """The free path that the options ask for.

    Raises:
        ValueError: naming the option or entry that makes no sense.
    """
    import numpy as np

    from reojax.planning import free_path

    limits: dict[str, Any] = {}
    if args.twist_limit is not None or args.bend_limit is not None:
        twist, bend = args.twist_limit, args.bend_limit
        limits["twist_limit"] = np.deg2rad(270.0 if twist is None else twist)
        limits["bend_limit"] = np.deg2rad(120.0 if bend is None else bend)
    return free_path(
        robot,
        target,
        start=None if args.start is None else posture("--from", args.start, robot),
        end=None if args.end is None else posture("--to", args.end, robot),
        joints=None if args.joints is None else joints(args.joints),
        repeats=1 if args.repeats is None else repeats(args.repeats),
        corners=args.corners,
        clearance=args.clearance,
        progress=True,
        **limits,
    )


def posture(option: str, text: str, robot: "Robot") -> "np.ndarray":
    """Joint angles (j,) [rad] of a posture in degrees."""
    import numpy as np

    parts = [part.strip() for part in text.split(",")]
    if not any("=" in part for part in parts):
        if len(parts) != robot.joints:
            names = ", ".join(robot.joint_names)
            raise ValueError(
                f"argument {option}: {text!r} has {len(parts)} angles; "
                f"{robot.name!r} has {robot.joints} joints: {names}."
            )
        return np.deg2rad([_degrees(option, part) for part in parts])
    theta, named = np.zeros(robot.joints), set()
    for part in parts:
        name, equals, angle = part.partition("=")
        if not equals or name not in robot.joint_names:
            known = ", ".join(robot.joint_names)
            raise ValueError(f"argument {option}: {part!r} must be JOINT=DEGREES; the joints are {known}.")
        if name in named:
            raise ValueError(f"argument {option}: joint {name!r} is named twice.")
        named.add(name)
        theta[robot.joint_names.index(name)] = np.deg2rad(_degrees(option, angle))
    for k, (joint, driver) in enumerate(robot.couplings):
        if robot.joint_names[joint] not in named:
            theta[joint] = robot.coupling_ratio[k] * theta[driver] + robot.coupling_offset[k]
    return theta


def joints(text: str) -> list[int | str]:
    """Names and numbers of joints."""
    return [int(part) if part.strip().isdecimal() else part.strip() for part in text.split(",")]


def repeats(text: str) -> Any:
    """A whole number, or "least"."""
    if text == "least":
        return text
    if not text.isdecimal() or len(text) > 9:
        raise ValueError(f"argument --repeats: {text!r} must be a whole number, or `least`.")
    return int(text)


def _degrees(option: str, text: str) -> float:
    try:
        angle = float(text)
    except ValueError:
        angle = math.nan
    if not math.isfinite(angle):
        raise ValueError(f"argument {option}: {text!r} is not an angle in degrees.")
    return angle

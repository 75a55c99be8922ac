"""Write the joint trajectory of a manoeuvre as CSV or as a ROS 2 JointTrajectory (YAML)."""

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any

from reojax._internal.version import version
from reojax.cli._arguments import BadInput
from reojax.cli._clearance import add_clearance, clearance_report, clearance_text
from reojax.cli._limits import joints_beyond_limits, limits_text
from reojax.cli._manoeuvre import add_manoeuvre, config_of, robot_and_path
from reojax.cli._numbers import RATE, TIME, from_zero
from reojax.cli._planned import add_timing, plan_motion

if TYPE_CHECKING:
    from reojax.path import Path
    from reojax.robot import Robot


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `reojax export`."""
    add = parser.add_argument
    add("file", metavar="FILE", help="to write: .csv, or .yaml, .yml or .json for ROS 2")
    add_manoeuvre(parser)
    add_timing(parser)
    add("--rate", type=_rate, default=200.0, metavar="HZ", help="points per second, about [%(default)g]")
    add("--delay", type=_delay, default=0.0, metavar="S", help="time before the first point [%(default)g]")
    add_clearance(parser, "proven along the whole path, or nothing is written and exit 1")
    add("--torques", action="store_true", help="write the joint torques in free fall too")
    add("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> None:
    """Compute, write, and print what was written."""
    from reojax import session
    from reojax.files.trajectories import check_trajectory

    session.start()
    try:
        check_trajectory(args.file)
        robot, path = robot_and_path(args)
        clear = clearance_report(robot, path, args)
        if clear is not None and not clear["kept"]:
            print("\n".join(clearance_text(clear)[1:] + ["nothing is written"]), file=sys.stderr)
            sys.exit(1)
        report: dict[str, Any] = _write(robot, path, args) | {"clearance": clear}
    except ValueError as error:
        raise BadInput(f"reojax export: {error}") from error
    lines = [f"{report['points']} points in {report['duration_s']:.6g} s, written to {args.file}"]
    lines += limits_text(args.robot, report["joints_beyond_limits"])
    if clear is not None:
        lines += clearance_text(clear)
    print(json.dumps(report, indent=2, allow_nan=False) if args.json else "\n".join(lines))


def _write(robot: "Robot", path: "Path", args: argparse.Namespace) -> dict[str, Any]:
    import jax

    from reojax.files.points import sample
    from reojax.files.trajectories import write_trajectory
    from reojax.mechanics.dynamics import inverse_dynamics

    trajectory = plan_motion(path, args)
    points = sample(trajectory, args.rate)
    effort = None
    if args.torques:
        effort = jax.jit(jax.vmap(inverse_dynamics, (None, 0, 0, 0)))(robot, *points[1:])
    write_trajectory(args.file, robot, *points, effort, delay=args.delay)
    return {
        "command": "export",
        "version": version(),
        "config": {
            **config_of(args),
            "law": args.law,
            "rate_hz": args.rate,
            "delay_s": args.delay,
        },
        "points": len(points.time),
        "duration_s": float(points.time[-1]),
        "joints": list(robot.joint_names),
        "joints_beyond_limits": joints_beyond_limits(robot, [path]),
        "file": args.file,
    }


def _rate(text: str) -> float:
    value = from_zero(text, RATE)
    if not value:
        raise argparse.ArgumentTypeError(f"{text!r} must be positive")
    return value


def _delay(text: str) -> float:
    return from_zero(text, TIME)

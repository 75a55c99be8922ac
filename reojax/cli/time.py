"""Say how fast the motors can run a manoeuvre, and whether it fits into the drop tower's fall."""

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any

from reojax._internal.display_units import RPM
from reojax._internal.version import version
from reojax.cli._arguments import BadInput
from reojax.cli._clearance import add_clearance, clearance_report, clearance_text
from reojax.cli._limits import joints_beyond_limits, limits_text
from reojax.cli._manoeuvre import add_manoeuvre, config_of, edge_names, heading, robot_and_path
from reojax.cli._motors import add_motors, motor_of
from reojax.cli._picture import add_picture, check_picture

if TYPE_CHECKING:
    from reojax.motion.simulation import Motion
    from reojax.path import Path
    from reojax.robot import Robot


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `reojax time`."""
    add_manoeuvre(parser)
    add_motors(parser, law="quintic")
    add_clearance(parser, "proven along the whole path, or exit 1")
    parser.add_argument("--json", action="store_true", help="print one JSON object, with all digits")
    add_picture(parser, "the torque-speed picture")


def run(args: argparse.Namespace) -> None:
    """Compute, write the picture, and print."""
    from reojax import session
    from reojax.motion.time_laws import by_name

    session.start()
    try:
        by_name(args.law)
        robot, path = robot_and_path(args)
        check_picture(args)
        report, motion = _report(robot, path, args)
        report["clearance"] = clearance_report(robot, path, args)
        if args.out is not None and motion is not None:
            _draw(robot, motion, report, args)
    except ValueError as error:
        raise BadInput(f"reojax time: {error}") from error
    print(json.dumps(report, indent=2, allow_nan=False) if args.json else _text(report, args))
    if report["clearance"] is not None and not report["clearance"]["kept"]:
        sys.exit(1)


def _report(robot: "Robot", path: "Path", args: argparse.Namespace) -> tuple[dict[str, Any], "Motion | None"]:
    """Everything that is printed, as plain numbers, and the motion at the least durations."""
    import numpy as np

    from reojax.motion.least_time import AVAILABLE, FALL, minimum_time
    from reojax.motion.simulation import simulate

    motors = motor_of(robot, args)
    least = minimum_time(robot, path, motors, args.law)
    durations = np.asarray(least.durations)
    if not durations.sum() > 0:
        raise ValueError("nothing moves: every edge of the manoeuvre stays put.")
    motion = simulate(robot, path, args.law, durations=durations, motors=motors, samples=64)
    pieces = (len(motion.time) - 1) // path.edges
    edges = []
    for e, name in enumerate(edge_names(robot, path, args)):
        part, k = slice(e * pieces, (e + 1) * pieces + 1), int(least.joint[e])
        peak = {key: float(np.abs(np.asarray(getattr(motion, key))[part, k]).max()) for key in _PEAKS}
        moves = bool(durations[e] > 0)
        edges.append(
            {
                "edge": name,
                "duration_s": float(durations[e]),
                "joint": robot.joint_names[k] if moves else None,
                "place": float(least.place[e]) if moves else None,
                **{key: peak[field] if moves else 0.0 for field, key in _PEAKS.items()},
            }
        )
    total = float(durations.sum())
    report = {
        "command": "time",
        "version": version(),
        "config": {
            **config_of(args),
            "law": args.law,
            "supply_V": args.supply,
            "resistance_ohm": args.resistance,
            "torque_constant_Nm_A": args.torque_constant,
        },
        "edges": edges,
        "duration_s": total,
        "fall_s": FALL,
        "available_s": AVAILABLE,
        "fits": total <= AVAILABLE,
        "joints_beyond_limits": joints_beyond_limits(robot, [path]),
        "picture": args.out,
    }
    return report, motion


_TOLD = 24
"""Most edges that are printed one by one; JSON has all of them."""
_PEAKS = {
    "torque": "peak_joint_torque_Nm",
    "theta_dot": "peak_joint_rate_rad_s",
    "motor_speed": "peak_motor_speed_rad_s",
    "motor_torque": "peak_motor_torque_Nm",
    "current": "peak_current_A",
}


def _draw(robot: "Robot", motion: "Motion", report: dict[str, Any], args: argparse.Namespace) -> None:
    from reojax import plot

    title = f"{heading(args)}, {args.law}, {args.supply:g} V".replace(" deg", "°").replace(" -", " \u2212")
    runs = [(f"{1000 * report['duration_s']:.0f} ms in all", motion)]
    figure = plot.torque_speed_figure(motor_of(robot, args), runs, joint_names=robot.joint_names, title=title)
    plot.save(figure, args.out)


def _text(report: dict[str, Any], args: argparse.Namespace) -> str:
    lines = [
        f"{heading(args)}, {args.law}, {args.supply:g} V",
        "",
        "  edge       least time  set by     at    torque     joint rate   motor speed   current",
    ]
    for edge in report["edges"][:_TOLD]:
        if edge["joint"] is None:
            lines.append(f"  {edge['edge']:<9}{0.0:>9.1f} ms  nothing moves")
            continue
        lines.append(
            f"  {edge['edge']:<9}{1000 * edge['duration_s']:>9.1f} ms  {edge['joint']:<8}{edge['place']:>5.0%}"
            f"{edge['peak_joint_torque_Nm']:>8.3f} N m{edge['peak_joint_rate_rad_s']:>8.1f} rad/s"
            f"{edge['peak_motor_speed_rad_s'] * RPM:>8.0f} rpm{edge['peak_current_A']:>8.2f} A"
        )
    if len(report["edges"]) > _TOLD:
        lines.append(f"  ... and {len(report['edges']) - _TOLD} more")
    verdict = "fits into" if report["fits"] else "does not fit into"
    lines += [
        f"  {'in all':<9}{1000 * report['duration_s']:>9.1f} ms",
        "",
        f"It {verdict} the fall of 2 m, {1000 * report['fall_s']:.0f} ms less 20 ms after the release: "
        f"{1000 * report['available_s']:.0f} ms.",
        "Peaks are those of the joint that sets the time; at: share of the edge where it does.",
    ]
    lines += limits_text(args.robot, report["joints_beyond_limits"])
    if report["clearance"] is not None:
        lines += clearance_text(report["clearance"])
    if report["picture"] is not None:
        lines += ["", f"picture in {report['picture']}"]
    return "\n".join(lines)

"""Run a manoeuvre; print how far the robot turns, and how sure that is; with `--duration`, what it takes."""

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any

from reojax._internal.version import version
from reojax.cli._arguments import BadInput
from reojax.cli._clearance import add_clearance, clearance_report, clearance_text
from reojax.cli._limits import joints_beyond_limits, limits_text
from reojax.cli._manoeuvre import add_manoeuvre, config_of, edge_names, heading, robot_and_path
from reojax.cli._motion import LAW, check_law, motion_of, motion_report, motion_text
from reojax.cli._motors import add_motors, momentum
from reojax.cli._page import add_page, check_page, write_page
from reojax.cli._picture import add_picture, check_picture
from reojax.cli._planned import add_duration

if TYPE_CHECKING:
    from reojax.motion.simulation import Motion
    from reojax.path import Path
    from reojax.robot import Robot


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `reojax simulate`."""
    add_manoeuvre(parser)
    add_motors(parser, law=None)
    add = parser.add_argument
    add_duration(parser)
    spin = "angular momentum at the release [kg m^2/s], with --duration [0,0,0]"
    add("--momentum", type=momentum, metavar="X,Y,Z", help=spin)
    add_clearance(parser, "proven along the whole path, or exit 1")
    add("--json", action="store_true", help="print one JSON object, with all digits")
    add_picture(parser, "orientation and joint angles")
    add_page(parser, "the turn")


def run(args: argparse.Namespace) -> None:
    """Compute, write the picture, and print."""
    from reojax import session

    session.start()
    try:
        robot, path = robot_and_path(args)
        check_law(args)
        check_picture(args)
        check_page(args)
        motion = motion_of(robot, path, args)
        report, history = _report(robot, path, args)
        report["clearance"] = clearance_report(robot, path, args)
        if motion is not None:
            report["motion"] = motion_report(robot, motion, args)
        if args.out is not None:
            _draw(robot, path, history, motion, args)
        write_page(args, robot, path if motion is None else motion, title=_title(args))
    except ValueError as error:
        raise BadInput(f"reojax simulate: {error}") from error
    print(json.dumps(report, indent=2, allow_nan=False) if args.json else _text(report, args))
    if report["clearance"] is not None and not report["clearance"]["kept"]:
        sys.exit(1)


def _title(args: argparse.Namespace) -> str:
    return heading(args).replace(" deg", "°").replace(" -", " \u2212")


def _draw(robot: "Robot", path: "Path", history: Any, motion: "Motion | None", args: argparse.Namespace) -> None:
    from reojax import plot

    title = _title(args)
    if motion is None:
        figure = plot.history_figure(
            robot,
            path,
            title=title,
            edge_names=edge_names(robot, path, args),
            rotations=history,
            clearance=args.clearance is not None,
        )
    else:
        figure = plot.motion_figure(robot, motion, title=f"{title}, {args.law or LAW}")
    plot.save(figure, args.out)


def _report(robot: "Robot", path: "Path", args: argparse.Namespace) -> tuple[dict[str, Any], Any]:
    """Everything that is printed, as plain numbers, and the history of rotations."""
    from functools import partial

    import jax
    import numpy as np

    from reojax._internal.kept import Program
    from reojax.mechanics.attitude import tilt_and_roll
    from reojax.mechanics.certificate import DEFAULT_SAMPLES
    from reojax.mechanics.holonomy import DEFAULT_STEPS, refinement
    from reojax.session import LEAST_COMPILE

    finer = refinement(float(np.abs(np.diff(path.waypoints, axis=0)).max()))
    steps, samples = finer * DEFAULT_STEPS, finer * DEFAULT_SAMPLES
    # one program to compile; the robot is constant in it
    compute = Program(partial(_figures, robot, steps, samples), compiler_options=LEAST_COMPILE)
    certificate, history, rotation, *parts = jax.tree.map(np.asarray, compute(path))
    vector, euler, angle, quaternion = parts
    roll = tilt_and_roll(history)[-1, 2]
    report = {
        "command": "simulate",
        "version": version(),
        "config": {
            **config_of(args),
            "steps_per_edge": steps,
            "samples_per_edge": samples,
        },
        "rotation_matrix": rotation.tolist(),
        "quaternion_wxyz": quaternion.tolist(),
        "rotation_vector_deg": np.rad2deg(vector).tolist(),
        "rotation_vector_rad": vector.tolist(),
        "euler_zxz_deg": np.rad2deg(euler).tolist(),
        "euler_zxz_rad": euler.tolist(),
        "angle_deg": float(np.rad2deg(angle)),
        "angle_rad": float(angle),
        "roll_along_path_deg": float(np.rad2deg(roll)),
        "roll_along_path_rad": float(roll),
        "certificate": {
            "momentum_relative": float(certificate.momentum),
            "orthogonality": float(certificate.orthogonality),
            "halving_rad": float(certificate.halving),
            "endpoint_rad": float(certificate.endpoint),
        },
        "joints_beyond_limits": joints_beyond_limits(robot, [path]),
        "picture": args.out,
        "page": args.html,
    }
    return report, history


def _figures(robot: "Robot", steps: int, samples: int, path: "Path") -> tuple[Any, ...]:
    """Certificate, history of rotations, the net rotation, and what it is as a vector, angles and a quaternion."""
    from reojax import so3
    from reojax.mechanics.certificate import certify_rotation

    certificate, rotation, history = certify_rotation(robot, path, steps=steps, samples=samples)
    read = (so3.log, so3.to_euler_zxz, so3.angle, so3.to_quaternion)
    return certificate, history, rotation, *(function(rotation) for function in read)


def _text(report: dict[str, Any], args: argparse.Namespace) -> str:
    lines = [
        heading(args),
        "",
        "net rotation of the base",
        _row("rotation vector", ["x", "y", "z"], report["rotation_vector_deg"], "deg"),
        _row("ZXZ angles", ["z", "x'", "z''"], report["euler_zxz_deg"], "deg"),
        _row("quaternion", ["w", "x", "y", "z"], report["quaternion_wxyz"]),
        _row("angle", [""], [report["angle_deg"]], "deg"),
        _row("roll along path", ["z"], [report["roll_along_path_deg"]], "deg, half turns counted"),
        "",
        "certificate",
    ]
    figures = report["certificate"]
    for label, key, unit, meaning in (
        (
            "momentum",
            "momentum_relative",
            "",
            "largest along the path, as a share of what the links exchange",
        ),
        ("orthogonality", "orthogonality", "", "largest entry of R'R - 1"),
        ("halving the step", "halving_rad", "rad", "change of the net rotation"),
        ("endpoint", "endpoint_rad", "rad", "distance from where the measured motion ends"),
    ):
        lines.append(f"  {label:<19}{figures[key]:>9.1e} {unit:<5}{meaning}")
    lines += limits_text(args.robot, report["joints_beyond_limits"])
    if report["clearance"] is not None:
        lines += clearance_text(report["clearance"])
    if "motion" in report:
        lines += motion_text(report["motion"])
    if report["picture"] is not None:
        lines += ["", f"picture in {report['picture']}"]
    if report["page"] is not None:
        lines += ["", f"page in {report['page']}"]
    return "\n".join(lines)


def _row(label: str, names: list[str], values: list[float], unit: str = "") -> str:
    rounded = (round(value, 6) + 0.0 for value in values)  # no -0
    cells = (f"{name:<4}{value:>11.6f}" for name, value in zip(names, rounded, strict=True))
    return f"  {label:<17}{'  '.join(cells)}  {unit}".rstrip()

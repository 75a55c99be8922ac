"""Run a manoeuvre and report how far the robot turns, and how sure that is.

The net rotation is that of the base, from its frame at the start. The certificate is `reojax.certificate`'s.
"""

import argparse
import json
from typing import TYPE_CHECKING, Any

from reojax.cli._arguments import BadInput, degrees

if TYPE_CHECKING:
    from reojax.manoeuvres import Layout
    from reojax.path import Path
    from reojax.robot import Robot

_RESOLVED = 270.0
"""Largest change of a joint angle on an edge for which the default numbers of steps and samples are meant [deg]."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `reojax simulate`."""
    add = parser.add_argument
    add("--manoeuvre", choices=("a", "b"), default="a", help="a: twist opposite ways; b: twist the same way [%(default)s]")
    add("--twist", type=degrees, default=270.0, metavar="DEG", help="twist of the distal joints [%(default)g]")
    add("--bend", type=degrees, default=120.0, metavar="DEG", help="bend of the centre joint [%(default)g]")
    add("--robot", default="prototype", metavar="NAME", help="robot by name; a wrong one lists them [%(default)s]")
    add("--json", action="store_true", help="print one JSON object, with all digits")
    add("--out", metavar="FIGURE", help="write a picture of orientation and joint angles (.png, .pdf, .svg)")


def run(args: argparse.Namespace) -> None:
    """Compute, write the picture, and print."""
    from reojax import _session, robots

    _session.start()
    try:
        robot = robots.by_name(args.robot)
        path = _path(robot, args)
        if args.out is not None:
            from reojax import plot

            plot.check_picture(args.out)
        report = _report(robot, path, args)
        if args.out is not None:
            figure = plot.history_figure(robot, path, title=_heading(args), edge_names=_edge_names(robot))
            plot.save(figure, args.out)
    except ValueError as error:
        raise BadInput(f"reojax simulate: {error}") from error
    print(json.dumps(report, indent=2, allow_nan=False) if args.json else _text(report, args))


def _layout(robot: "Robot") -> "Layout":
    from reojax.manoeuvres import FOUR_BODY, SIX_BODY

    layouts = {layout.joints: layout for layout in (FOUR_BODY, SIX_BODY)}
    if robot.joints not in layouts:
        raise ValueError(
            f"{robot.name!r} has {robot.joints} joints; the manoeuvres are laid out for "
            f"{' or '.join(map(str, layouts))} joints."
        )
    return layouts[robot.joints]


def _path(robot: "Robot", args: argparse.Namespace) -> "Path":
    import numpy as np

    from reojax.manoeuvres import manoeuvre_a, manoeuvre_b

    manoeuvre = {"a": manoeuvre_a, "b": manoeuvre_b}[args.manoeuvre]
    return manoeuvre(np.deg2rad(args.twist), np.deg2rad(args.bend), _layout(robot))


def _edge_names(robot: "Robot") -> tuple[str, ...]:
    loop = ("bend", "twist", "unbend", "untwist")
    return loop if _layout(robot).fold is None else ("fold", *loop, "unfold")


def _heading(args: argparse.Namespace) -> str:
    return f"manoeuvre {args.manoeuvre.upper()} on {args.robot}: twist {args.twist:g} deg, bend {args.bend:g} deg"


def _report(robot: "Robot", path: "Path", args: argparse.Namespace) -> dict[str, Any]:
    """Everything that is printed, as plain numbers."""
    import jax
    import numpy as np

    from reojax import so3
    from reojax._orientation import tilt_and_roll
    from reojax.certificate import DEFAULT_SAMPLES, certified_rotation
    from reojax.cli import version
    from reojax.holonomy import DEFAULT_STEPS

    longest = np.rad2deg(np.abs(np.diff(path.waypoints, axis=0)).max())
    finer = max(1, int(np.ceil(longest / _RESOLVED - 1e-9)))
    steps, samples = finer * DEFAULT_STEPS, finer * DEFAULT_SAMPLES

    @jax.jit
    def compute(path: "Path") -> tuple[Any, ...]:  # one program to compile; the robot is constant in it
        certificate, rotation, history = certified_rotation(robot, path, steps=steps, samples=samples)
        parts = (so3.log(rotation), so3.to_euler_zxz(rotation), so3.angle(rotation), so3.to_quaternion(rotation))
        return certificate, rotation, history, parts

    certificate, rotation, history, parts = jax.tree.map(np.asarray, compute(path))
    vector, euler, angle, quaternion = parts
    roll = tilt_and_roll(history)[-1, 2]
    beyond = (path.waypoints < robot.lower - 1e-9) | (path.waypoints > robot.upper + 1e-9)
    return {
        "command": "simulate",
        "version": version(),
        "config": {
            "robot": args.robot,
            "manoeuvre": args.manoeuvre,
            "twist_deg": args.twist,
            "bend_deg": args.bend,
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
        "joints_beyond_limits": [name for name, out in zip(robot.joint_names, beyond.any(0), strict=True) if out],
        "picture": args.out,
    }


def _text(report: dict[str, Any], args: argparse.Namespace) -> str:
    def row(label: str, names: str, values: list[float], unit: str) -> str:
        cells = (f"{name:>3} {value:11.6f}" for name, value in zip(names.split(), values, strict=True))
        return f"  {label:<18}{' '.join(cells)}  {unit}".rstrip()

    check = report["certificate"]
    lines = [
        _heading(args),
        "",
        "net rotation",
        row("rotation vector", "x y z", report["rotation_vector_deg"], "deg"),
        row("ZXZ angles", "z x' z\"", report["euler_zxz_deg"], "deg"),
        row("quaternion", "w x y z", report["quaternion_wxyz"], ""),
        row("angle", "-", [report["angle_deg"]], "deg"),
        row("roll along path", "z", [report["roll_along_path_deg"]], "deg, counted beyond half turns"),
        "",
        "certificate",
        f"  momentum          {check['momentum_relative']:8.1e}      largest along the path, relative to what the links exchange",
        f"  orthogonality     {check['orthogonality']:8.1e}      largest entry of R'R - 1",
        f"  halving the step  {check['halving_rad']:8.1e} rad  change of the net rotation",
        f"  endpoint          {check['endpoint_rad']:8.1e} rad  from the end of the motion whose momentum was measured",
    ]
    if report["joints_beyond_limits"]:
        lines += ["", f"beyond the joint limits of {args.robot}: {', '.join(report['joints_beyond_limits'])}"]
    if report["picture"] is not None:
        lines += ["", f"picture in {report['picture']}"]
    return "\n".join(lines)

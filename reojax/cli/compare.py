"""Compare a captured motion (a CSV file) with the simulated one: RMS errors and a picture."""

import argparse
import json
import math
from typing import TYPE_CHECKING, Any

from reojax._internal.version import version
from reojax.cli._arguments import BadInput
from reojax.cli._limits import joints_beyond_limits, limits_text
from reojax.cli._manoeuvre import add_amplitudes, path_of
from reojax.cli._numbers import TIME, number
from reojax.cli._page import add_page, check_page, write_page
from reojax.cli._picture import add_picture, check_picture
from reojax.cli._planned import add_timing, plan_motion
from reojax.cli._robot import add_robot, robot_of

if TYPE_CHECKING:
    from reojax.captures.calibration import Calibration
    from reojax.captures.capture import Capture
    from reojax.captures.comparison import Comparison, Sampled
    from reojax.path import Path
    from reojax.robot import Robot


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `reojax compare`."""
    add = parser.add_argument
    add("capture", metavar="CAPTURE.csv", help="time, joint angles and/or orientation of link 1; see docs/captures.md")
    add_robot(parser)
    add_amplitudes(parser, default=None)
    add_timing(parser)
    add("--angles", choices=("deg", "rad"), help="unit of angles whose header does not say it")
    add("--offset", type=_offset, metavar="S", help="time of the capture at which the motion starts [fitted]")
    fitted = "fit these numbers of the robot to the capture first, such as end_inertia,rotor_inertia or com[0,2]"
    add("--calibrate", metavar="NAMES", help=fitted)
    add("--json", action="store_true", help="print one JSON object, with all digits")
    add_picture(parser, "measured and simulated angles")
    add_page(parser, "the simulated motion with the measured one as its ghost")


def run(args: argparse.Namespace) -> None:
    """Read, compute, write the picture, and print."""
    from reojax import session
    from reojax.captures.capture import read_capture

    session.start()
    try:
        check_picture(args)
        check_page(args)
        robot = robot_of(args.robot)
        capture = read_capture(args.capture, robot, angle_unit=args.angles)
        report, robot, comparison = _report(robot, capture, args)
        if args.out is not None:
            _draw(robot, comparison, args)
        write_page(args, robot, comparison, title=f"{args.capture} on {args.robot}")
    except ValueError as error:
        raise BadInput(f"reojax compare: {error}") from error
    print(json.dumps(report, indent=2, allow_nan=False) if args.json else _text(report))


def _draw(robot: "Robot", comparison: "Comparison", args: argparse.Namespace) -> None:
    from reojax import plot

    title = f"{args.capture} on {args.robot}"
    plot.save(plot.comparison_figure(robot, comparison, title=title), args.out)


def _report(
    robot: "Robot", capture: "Capture", args: argparse.Namespace
) -> tuple[dict[str, Any], "Robot", "Comparison"]:
    import numpy as np

    from reojax.captures.calibration import calibrate
    from reojax.captures.comparison import compare

    fit = None
    if args.calibrate is not None:
        fit = calibrate(robot, capture, _names(args.calibrate))
        robot = fit.robot
    path = None if args.manoeuvre is None else path_of(robot, args)
    motion, source = (None, "the measured joint angles") if path is None else _motion(robot, path, args)
    comparison = compare(robot, capture, motion, offset=args.offset)
    seen = np.flatnonzero(capture.seen_rotation)
    last = int(seen[-1]) if seen.size else len(capture.time) - 1
    report = {
        "command": "compare",
        "version": version(),
        "config": {"capture": args.capture, "robot": args.robot, "simulated_from": source},
        "frames": len(capture.time),
        "frames_with_orientation": int(seen.size),
        "frames_with_all_joints": int(capture.seen_theta.all(axis=1).sum()) if capture.theta is not None else 0,
        "rate_hz": float(1 / np.median(np.diff(capture.time))),
        "longest_gap_s": float(np.diff(capture.time).max()),
        "duration_s": float(np.ptp(capture.time)),
        "ignored_columns": list(capture.ignored),
        "offset_s": comparison.offset,
        "offset_found": comparison.offset_found,
        "joints": list(robot.joint_names),
        "joints_beyond_limits": [] if path is None else joints_beyond_limits(robot, [path]),
        "rms_theta_rad": _numbers(comparison.theta_rms),
        "rms_zxz_rad": _numbers(comparison.zxz_rms),
        "rms_tilt_roll_rad": _numbers(comparison.tilt_roll_rms),
        "rms_angle_rad": _numbers([comparison.angle_rms])[0],
        "hint": comparison.hint,
        "last_tilt_roll_measured_rad": _numbers(comparison.measured_tilt_roll[last]),
        "last_tilt_roll_simulated_rad": _numbers(comparison.simulated_tilt_roll[last]),
        "calibration": None if fit is None else _calibration(fit),
        "picture": args.out,
        "page": args.html,
    }
    return report, robot, comparison


def _motion(robot: "Robot", path: "Path", args: argparse.Namespace) -> tuple["Sampled", str]:
    """The planned motion, and its name."""
    import jax
    import numpy as np

    from reojax.captures.comparison import Sampled
    from reojax.motion.release import released

    trajectory = plan_motion(path, args)
    motion = released(robot, trajectory, samples=64)
    theta = jax.vmap(trajectory.at)(motion.time).theta
    name = f"manoeuvre {args.manoeuvre.upper()}, twist {args.twist:g} deg, bend {args.bend:g} deg, {args.law}"
    return Sampled(*(np.asarray(x, float) for x in (motion.time, theta, motion.rotation))), name


def _names(text: str) -> list[str]:
    """Split at commas outside of brackets."""
    names, depth = [""], 0
    for mark in text:
        depth += (mark == "[") - (mark == "]")
        if mark == "," and depth == 0:
            names.append("")
        else:
            names[-1] += mark
    return [name.strip() for name in names]


def _numbers(values: Any) -> list[float | None]:
    return [float(value) if math.isfinite(value) else None for value in values]


def _calibration(fit: "Calibration") -> dict[str, Any]:
    return {
        "parameters": list(fit.names),
        "units": list(fit.units),
        "start": _numbers(fit.start),
        "values": _numbers(fit.values),
        "std": _numbers(fit.std),
        "offset_s": fit.offset,
        "offset_std_s": _numbers([fit.offset_std])[0],
        "rms_before_rad": fit.rms_before,
        "rms_rad": fit.rms,
        "joint_noise_rad": fit.joint_noise,
        "condition": _numbers([fit.condition])[0],
        "identifiable": list(fit.identifiable),
        "converged": fit.converged,
        "warning": fit.warning,
    }


def _text(report: dict[str, Any]) -> str:
    r = report
    lines = [
        f"{r['config']['capture']} on {r['config']['robot']}, simulated from {r['config']['simulated_from']}",
        "",
        f"  frames           {r['frames']}, {r['frames_with_all_joints']} with all joints, "
        f"{r['frames_with_orientation']} with orientation",
        f"  rate             {r['rate_hz']:.4g} Hz, longest gap {r['longest_gap_s'] * 1e3:.3g} ms, "
        f"{r['duration_s']:.4g} s in all",
        f"  offset           {r['offset_s'] * 1e3:.4g} ms" + ("" if r["offset_found"] else ", not found by the fit"),
    ]
    if r["ignored_columns"]:
        lines.append(f"  ignored columns  {', '.join(r['ignored_columns'])}")
    lines += ["", "RMS of measured less simulated"]
    lines += _rows(r["joints"], r["rms_theta_rad"])
    lines += _rows(["ZXZ first", "ZXZ second", "ZXZ third"], r["rms_zxz_rad"])
    lines += _rows(["tilt about x", "tilt about y", "roll about z"], r["rms_tilt_roll_rad"])
    lines += _rows(["angle"], [r["rms_angle_rad"]])
    measured, simulated = r["last_tilt_roll_measured_rad"][2], r["last_tilt_roll_simulated_rad"][2]
    if measured is not None:
        turned = f"measured {math.degrees(measured):.2f} deg, simulated {math.degrees(simulated):.2f} deg"
        lines += ["", f"roll at the end: {turned}"]
    lines += limits_text(r["config"]["robot"], r["joints_beyond_limits"])
    if r["hint"]:
        lines += ["", f"hint: {r['hint']}"]
    if r["calibration"] is not None:
        lines += ["", *_fit_text(r["calibration"])]
    if r["picture"] is not None:
        lines += ["", f"picture in {r['picture']}"]
    if r["page"] is not None:
        lines += ["", f"page in {r['page']}"]
    return "\n".join(lines)


def _rows(names: list[str], values: list[float | None]) -> list[str]:
    pairs = zip(names, values, strict=True)
    return [f"  {name:<16}{x:9.4f} rad {math.degrees(x):9.3f} deg" for name, x in pairs if x is not None]


def _fit_text(fit: dict[str, Any]) -> list[str]:
    lines = [f"calibration{'' if fit['converged'] else ', NOT converged'}"]
    for name, unit, start, value, std in zip(
        *(fit[key] for key in ("parameters", "units", "start", "values", "std")), strict=True
    ):
        spread = "unknown" if std is None else f"{std:.2g}"
        lines.append(f"  {name:<16}{value:.6g} +- {spread} {unit} (was {start:.6g})".rstrip())
    lines.append(f"  angle RMS       {fit['rms_before_rad']:.4f} rad before, {fit['rms_rad']:.4f} after")
    if fit["warning"]:
        lines.append(f"  careful: {fit['warning']}")
    return lines


def _offset(text: str) -> float:
    return number(text, TIME)

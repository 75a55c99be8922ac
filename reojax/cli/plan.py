"""Find manoeuvres, or a closed path, that end on a target orientation; exit status 1 if it is not reached."""

import argparse
import json
from typing import TYPE_CHECKING, Any

from reojax._internal.version import version
from reojax.cli._arguments import BadInput
from reojax.cli._clearance import add_clearance
from reojax.cli._free import add_free, free, options_given
from reojax.cli._numbers import degrees, whole
from reojax.cli._page import add_page, check_page, write_page
from reojax.cli._picture import add_picture, check_picture
from reojax.cli._robot import add_robot, robot_of

if TYPE_CHECKING:
    import numpy as np

    from reojax.planning import FreePaths, Plan
    from reojax.robot import Robot

_KINDS = {"rotvec": 3, "zxz": 3, "quat": 4}
_TOLD = 24
"""Most manoeuvres that are printed one by one; JSON and CSV have all of them."""
_FRAMES = 120
_LARGEST_MATRIX = 2**16
"""Largest file that a target is read from [bytes]."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `reojax plan`."""
    add = parser.add_argument
    forms = "'rotvec X Y Z' or 'zxz A B C' in degrees, 'quat W X Y Z', or 'matrix FILE' with three rows of three"
    add("--target", required=True, nargs="+", metavar="TARGET", help=f"rotation of the base: {forms}")
    add_robot(parser)
    add("--twist-limit", type=degrees, metavar="DEG", help="of the distal joints [270]")
    add("--bend-limit", type=degrees, metavar="DEG", help="of the centre joint [120]")
    add("--max-manoeuvres", type=whole, default=5, metavar="N", help="manoeuvres allowed [%(default)d]")
    parts = "count: fewest manoeuvres; travel: least joint travel [%(default)s]"
    add("--objective", choices=("count", "travel"), default="count", help=parts)
    words = "manoeuvres: A and B; rectangles: each distal joint its own amplitude; free: one path of little joint"
    words += " travel, whatever --max-manoeuvres and --objective say [manoeuvres, free for a robot without a layout]"
    add("--vocabulary", choices=("manoeuvres", "rectangles", "free"), help=words)
    add_free(parser)
    add_clearance(parser, "kept and proven along the whole path")
    add("--save", metavar="PLAN.json", help="write robot, path, target and certificate, for `reojax simulate --plan`")
    add("--json", action="store_true", help="print one JSON object, with all digits")
    add_picture(parser, "the orientation on its way")
    add("--animate", metavar="FILM", help="draw the robot on its way to an .mp4 (needs ffmpeg) or a .gif")
    add_page(parser, "the robot on its way")
    add("--csv", metavar="FILE", help="write the corners of the joint path, in degrees, to a .csv")


def run(args: argparse.Namespace) -> None:
    """Compute, write the files, and print."""
    from reojax import session

    session.start()
    args.target = " ".join(args.target)
    try:
        target = read_target(args.target)
        robot = robot_of(args.robot)
        _choose(robot, args)
        _check_files(args)
        check_page(args)
        plan = _plan(robot, target, args)
        _write_files(robot, plan, target, args)
    except ValueError as error:
        raise BadInput(f"reojax plan: {error}") from error
    report = _report(robot, plan, target, args)
    print(json.dumps(report, indent=2, allow_nan=False) if args.json else _text(report))
    if not plan.converged:
        raise SystemExit(1)


def read_target(text: str) -> "np.ndarray":
    """Rotation (3, 3) of a target as it is written at the command line.

    Raises:
        ValueError: saying what is wrong with it.
    """
    import numpy as np

    from reojax import so3
    from reojax._internal import checks
    from reojax._internal.kept import Program
    from reojax.session import LEAST_COMPILE

    kind, *rest = text.split(None, 1)[:2] or [""]
    words = rest[0] if rest else ""
    if kind == "matrix":
        return checks.rotations("target", _read_matrix(words.strip()), (3, 3))
    if kind not in _KINDS:
        names = ", ".join(map(repr, (*_KINDS, "matrix")))
        raise ValueError(f"the target {text!r} must begin with one of {names}.")
    try:
        numbers = np.array([float(word) for word in words.replace(",", " ").split()])
    except ValueError:
        raise ValueError(f"the target {text!r} has something that is not a number.") from None
    if numbers.size != _KINDS[kind] or not np.isfinite(numbers).all():
        raise ValueError(f"the target {text!r} has {numbers.size} numbers; {kind} takes {_KINDS[kind]} finite ones.")
    if kind == "quat":
        length = float(np.linalg.norm(numbers))
        if abs(length - 1) > 1e-3:
            raise ValueError(f"the target {text!r} is no rotation: its length is {length:.6g}, not 1.")
        return np.asarray(Program(so3.from_quaternion, compiler_options=LEAST_COMPILE)(numbers))
    rotation = {"rotvec": so3.exp, "zxz": so3.from_euler_zxz}[kind]
    return np.asarray(Program(rotation, compiler_options=LEAST_COMPILE)(np.deg2rad(numbers)))


def _read_matrix(name: str) -> "np.ndarray":
    import numpy as np

    from reojax._internal.checks import shorten
    from reojax._internal.files import read_text

    text = read_text(name, _LARGEST_MATRIX)
    try:
        numbers = [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        raise ValueError(f"the target file {shorten(name)} has something that is not a number.") from None
    if len(numbers) != 9:
        raise ValueError(f"the target file {shorten(name)} has {len(numbers)} numbers; a rotation matrix has nine.")
    return np.array(numbers).reshape(3, 3)


def _choose(robot: "Robot", args: argparse.Namespace) -> None:
    """Decide what the plan is made of, where that is not said."""
    given = options_given(args)
    if args.vocabulary is None:
        args.vocabulary = "free" if robot.layout is None or given else "manoeuvres"
    if args.vocabulary != "free" and given:
        raise ValueError(f"argument {given[0]}: it is for free paths, not for {args.vocabulary}.")


def _check_files(args: argparse.Namespace) -> None:
    from reojax._internal.files import check_ending, check_writable

    check_picture(args)
    if args.animate is not None:
        from reojax import plot

        plot.check_animation(args.animate)
    if args.save is not None:
        check_ending(args.save, "plan", ("json",))
    if args.csv is not None:
        if not args.csv.endswith(".csv"):
            raise ValueError(f"cannot write {args.csv!r}: the name of a table ends in .csv.")
        check_writable(args.csv)


def _plan(robot: "Robot", target: "np.ndarray", args: argparse.Namespace) -> "Plan | FreePaths":
    import numpy as np

    if args.vocabulary == "free":
        return free(robot, target, args)
    from reojax.planning import plan

    twist_limit, bend_limit = (
        float(np.deg2rad(default if limit is None else limit))
        for limit, default in ((args.twist_limit, 270.0), (args.bend_limit, 120.0))
    )
    return plan(
        robot,
        target,
        twist_limit=twist_limit,
        bend_limit=bend_limit,
        max_manoeuvres=args.max_manoeuvres,
        objective=args.objective,
        vocabulary=args.vocabulary,
        clearance=args.clearance,
    )


def _write_files(robot: "Robot", plan: "Plan | FreePaths", target: "np.ndarray", args: argparse.Namespace) -> None:
    import numpy as np

    from reojax._internal.files import replacing

    if args.csv is not None:
        rows = [",".join(f"{name} [deg]" for name in robot.joint_names)]
        rows += [",".join(f"{angle:.12g}" for angle in corner) for corner in np.rad2deg(plan.waypoints)]
        with replacing(args.csv) as file:
            file.write(("\n".join(rows) + "\n").encode())
    if args.save is not None:
        from reojax.planning.plan_file import save_plan

        save_plan(plan, args.save, robot=robot, target=target)
    if not plan.travel:  # nothing moves, so there is nothing to draw
        return
    if args.out is not None:
        from reojax import plot

        plot.save(plot.plan_figure(robot, plan, target), args.out)
    write_page(args, robot, plan, title=f"Plan for {args.target} on {args.robot}", target=target)
    if args.animate is not None:
        from reojax import plot
        from reojax.path import polygon

        path = polygon(plan.waypoints)
        plot.animation(robot, path, args.animate, frames=_FRAMES, seconds=0.4 * min(path.edges, 60))


def _report(robot: "Robot", plan: "Plan | FreePaths", target: "np.ndarray", args: argparse.Namespace) -> dict[str, Any]:
    import numpy as np

    from reojax.planning import Plan

    drawn = plan.travel > 0
    loops = (plan.word, plan.twist, plan.bend, plan.last_twist) if isinstance(plan, Plan) else ((), (), (), ())
    parts = zip(loops[0], *map(np.rad2deg, loops[1:]), strict=True)
    return {
        "command": "plan",
        "version": version(),
        "config": {
            "robot": args.robot,
            "target": args.target,
            "twist_limit_deg": args.twist_limit,
            "bend_limit_deg": args.bend_limit,
            "max_manoeuvres": args.max_manoeuvres,
            "objective": args.objective,
            "vocabulary": args.vocabulary,
            "corners": args.corners,
            "clearance_m": args.clearance,
        },
        "joints": list(robot.joint_names),
        "target_matrix": target.tolist(),
        "manoeuvres": [
            {"name": name, "twist_deg": float(t), "bend_deg": float(b), "last_twist_deg": float(last)}
            for name, t, b, last in parts
        ],
        "waypoints_rad": plan.waypoints.tolist(),
        "repeats": int(getattr(plan, "repeats", 1)),
        "rotation_matrix": plan.rotation.tolist(),
        "error_rad": float(plan.error),
        "error_deg": float(np.rad2deg(plan.error)),
        "travel_deg": float(np.rad2deg(plan.travel)),
        "converged": bool(plan.converged),
        "status": str(plan.status),
        "clearance_m": None if plan.clearance is None else float(plan.clearance),
        "picture": args.out if drawn else None,
        "animation": args.animate if drawn else None,
        "page": args.html if drawn else None,
        "csv": args.csv,
        "plan": args.save,
    }


def _text(report: dict[str, Any]) -> str:
    title = f"{report['config']['target']} on {report['config']['robot']}"
    free = report["config"]["vocabulary"] == "free"
    if free and report["travel_deg"]:
        runs = f", to be run {report['repeats']} times" if report["repeats"] > 1 else ""
        lines = [f"Path for {title}{runs}", "", *_corners(report)]
    elif report["manoeuvres"]:
        lines = [f"Plan for {title}: {len(report['manoeuvres'])} manoeuvres", "", *_loops(report["manoeuvres"])]
    else:
        lines = [f"Plan for {title}: 0 manoeuvres", "", "nothing to do"]
    lines += ["", f"joint travel {report['travel_deg']:.1f} deg"]
    error = f"{report['error_rad']:.1e} rad"
    if report["converged"]:
        lines.append(f"reached, to {error}")
    else:
        what = "path" if free else "plan"
        lines.append(f"NOT reached: {report['error_deg']:.4f} deg ({error}) are left; this is the closest {what}")
        lines.append(report["status"])
    if report["clearance_m"] is not None:
        lines.append(f"clearance {1e3 * report['clearance_m']:.3f} mm, proven along the whole path")
    files = ("picture", "animation", "page", "csv", "plan")
    lines += [f"{what} in {report[what]}" for what in files if report[what] is not None]
    return "\n".join(lines)


def _loops(loops: list[dict[str, Any]]) -> list[str]:
    lines = [f"{'':>6}  {'twist [deg]':>12}{'bend [deg]':>12}{'last twist [deg]':>18}"]
    for loop in loops[:_TOLD]:
        cells = (loop["twist_deg"], loop["bend_deg"], loop["last_twist_deg"])
        first, second, third = (round(cell, 6) + 0.0 for cell in cells)
        lines.append(f"{loop['name']:>6}  {first:12.6f}{second:12.6f}{third:18.6f}")
    if len(loops) > _TOLD:
        lines.append(f"{'...':>6}  and {len(loops) - _TOLD} more; --json and --csv have them")
    return lines


def _corners(report: dict[str, Any]) -> list[str]:
    import numpy as np

    lines = [f"{'corner':>6}  " + "".join(f"{name + ' [deg]':>16}" for name in report["joints"])]
    for number, corner in enumerate(np.rad2deg(report["waypoints_rad"]).round(6) + 0.0):
        lines.append(f"{number:6}  " + "".join(f"{angle:16.6f}" for angle in corner))
    return lines

"""Show a turn in a browser: a manoeuvre or a plan as one HTML file, or the robot live with sliders (`--live`)."""

import argparse
import sys
from pathlib import Path as File
from typing import TYPE_CHECKING, Any

from reojax.cli._arguments import BadInput
from reojax.cli._clearance import add_clearance, clearance_report, clearance_text
from reojax.cli._limits import joints_beyond_limits, limits_text
from reojax.cli._manoeuvre import add_manoeuvre, heading, path_of
from reojax.cli._numbers import seconds
from reojax.cli._robot import robot_of

if TYPE_CHECKING:
    from reojax.path import Path
    from reojax.robot import Robot
    from reojax.viewer.live import Live

_HOUR = 3600


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `reojax view`."""
    add = parser.add_argument
    text = "what `reojax plan --save` wrote or --json printed; --plan means the same"
    add("plan", nargs="?", default=argparse.SUPPRESS, metavar="PLAN.json", help=text)
    add_manoeuvre(parser)
    add("--duration", type=seconds, metavar="S", help="run it in this time, by a quintic law")
    add("--beside", metavar="PLAN.json", help="another plan for the same robot, shown beside it")
    add_clearance(parser, "proven along the whole path and marked where it is least, or exit 1")
    add("--title", metavar="TEXT", help="headline of the page")
    add("--out", metavar="PAGE.html", help="where to write the page [turn.html]")
    add(
        "--live",
        action="store_true",
        help="serve sliders for the joints on this machine only, until ctrl-c; needs viser",
    )
    add("--port", type=int, default=8080, metavar="N", help="where --live serves, or the next free one [%(default)d]")


def run(args: argparse.Namespace) -> None:
    """Write the page and say where it is, or serve until interrupted."""
    from reojax import session
    from reojax._internal.files import check_ending

    session.start()
    try:
        if args.live:
            if args.out is not None or args.plan is not None or args.beside is not None:
                raise ValueError("argument --live: it shows the robot alone, without PLAN.json, --beside or --out")
            if args.clearance is not None:
                raise ValueError("argument --clearance: --live has no path to look along")
            _serve(robot_of(args.robot), args.port)
            return
        out = args.out or "turn.html"
        check_ending(out, "page", ("html", "htm"))
        written, note, kept = _write(args, out)
    except ValueError as error:
        raise BadInput(f"reojax view: {error}") from error
    print(f"page in {written} ({written.stat().st_size / 1e3:.0f} kB); open it in a browser, it needs no network")
    if note:
        print("\n".join(note))
    if not kept:
        sys.exit(1)


def _write(args: argparse.Namespace, out: str) -> tuple[File, list[str], bool]:
    """Write the page; return where it is, limits exceeded and the clearance in lines, and whether that is kept."""
    import numpy as np

    from reojax.motion.simulation import simulate
    from reojax.viewer import view

    plan = None if args.plan is None else read_plan(args.plan)
    name = args.robot if plan is None else plan["config"]["robot"]
    robot = robot_of(args.robot) if plan is None else _robot(plan)
    shown: list[Any] = [path_of(robot, args) if plan is None else _path(robot, plan, str(args.plan))]
    names = [_title(args) if plan is None else str(plan["config"].get("target", args.plan))]
    if args.beside is not None:
        other = read_plan(args.beside)
        if other["config"]["robot"] != name:
            raise ValueError(f"{args.beside!r} is a plan for {other['config']['robot']!r}, not for {name!r}.")
        shown.append(_path(robot, other, args.beside))
        names.append(str(other["config"].get("target", args.beside)))
    note = limits_text(name, joints_beyond_limits(robot, shown))
    found = [clearance_report(robot, path, args) for path in shown]
    note += [line for report in found if report is not None for line in clearance_text(report)]
    if args.duration is not None:
        for k, path in enumerate(shown):
            angles = np.abs(np.diff(path.waypoints, axis=0)).max(axis=1)
            if not angles.sum() > 0:
                raise ValueError("argument --duration: nothing moves, so nothing takes time")
            kept = np.concatenate([[True], angles > 0])
            moving = type(path)(np.asarray(path.waypoints)[kept])
            angles = angles[angles > 0]
            shown[k] = simulate(robot, moving, durations=args.duration * angles / angles.sum())
    written = view(
        robot,
        shown[0],
        out,
        target=None if plan is None else np.asarray(plan["target_matrix"], float),
        beside=shown[1] if len(shown) > 1 else None,
        names=names,
        clearance=args.clearance is not None,
        title=args.title or names[0] if plan is None else args.title or f"Plan for {names[0]} on {name}",
    )
    return written, note, all(report is None or report["kept"] for report in found)


def _title(args: argparse.Namespace) -> str:
    return heading(args).replace(" deg", "°").replace(" -", " \N{MINUS SIGN}")


def read_plan(name: str) -> dict[str, Any]:
    """What `reojax plan --save` wrote, or --json printed to a file.

    Raises:
        ValueError: if it cannot be read, or is something else.
    """
    from reojax._internal.json_files import read_object

    report = read_object(name)
    if report.get("format") == "reojax plan":
        from reojax.planning.plan_file import load_plan

        saved = load_plan(name)
        return {
            "config": {"robot": saved.robot.name},
            "robot": saved.robot,
            "waypoints_rad": saved.path.waypoints,
            "target_matrix": saved.rotation if saved.target is None else saved.target,
        }
    keys = ("config", "waypoints_rad", "target_matrix")
    if any(key not in report for key in keys):
        raise ValueError(
            f"{name!r} is not a plan: it must have {', '.join(keys)}, as `reojax plan --json` prints them."
        )
    if not isinstance(report["config"], dict) or not isinstance(report["config"].get("robot"), str):
        raise ValueError(f"{name!r} is not a plan: its config must name the robot.")
    return report


def _robot(plan: dict[str, Any]) -> "Robot":
    return plan["robot"] if "robot" in plan else robot_of(plan["config"]["robot"])


def _path(robot: "Robot", plan: dict[str, Any], name: str) -> "Path":
    from reojax._internal import checks
    from reojax.path import polygon

    return polygon(checks.numbers(f"{name}: waypoints_rad", plan["waypoints_rad"], (-1, robot.joints)))


def _serve(robot: "Robot", port: int) -> None:
    import time
    import webbrowser

    from reojax.viewer.live import serve

    live: Live = serve(robot, port=port)
    try:
        where = f"http://{live.server.get_host()}:{live.server.get_port()}"
        opened = webbrowser.open(where)
        print(f"{where}{'' if opened else ': no browser was found here; open this address in one'}", flush=True)
        while True:
            time.sleep(_HOUR)
    finally:
        live.stop()

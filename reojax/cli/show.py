"""Tell what a robot or a file holds: links, joints, limits, motors, shapes, what was merged, and a self-check."""

import argparse
import json
from typing import TYPE_CHECKING, Any

from reojax._internal.version import version
from reojax.cli._arguments import BadInput

if TYPE_CHECKING:
    from reojax.planning.plan_file import SavedPlan
    from reojax.robot import Robot


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `reojax show`."""
    add = parser.add_argument
    add(
        "robot",
        metavar="NAME|FILE",
        help="robot: a name (a wrong one lists them), or a .urdf, .xml or .json file, also a plan",
    )
    add("--base", metavar="LINK", help="link to be the base [the file's root]")
    add("--lock", action="append", default=[], metavar="JOINT=X", help="hold a joint there [deg, or m]; many times")
    add("--gear", action="append", default=[], metavar="JOINT=N", help="rotor turns per joint turn; many times")
    add("--rotor", action="append", default=[], metavar="JOINT=J", help="rotor inertia [kg m^2]; many times")
    add("--repair", action="store_true", help="change inertias that no body has to the nearest possible ones")
    add("--no-shapes", action="store_true", help="leave collision shapes out")
    add("--save", metavar="FILE", help="write the robot as it is shown to a .json, which --robot takes everywhere")
    add("--json", action="store_true", help="print one JSON object, with all digits")


def run(args: argparse.Namespace) -> None:
    """Load, check, save, and print."""
    from reojax import session

    session.start()
    try:
        plan = _plan(args.robot)
        robot = _robot(args) if plan is None else plan.robot
        if args.save is not None:
            from reojax.models.json_file import save_robot

            save_robot(robot, args.save)
        report = _report(robot, args) | ({} if plan is None else {"plan": _plan_report(plan)})
        report["clearance"] = _clearance(robot, plan)
    except ValueError as error:
        raise BadInput(f"reojax show: {error}") from error
    print(json.dumps(report, indent=2, allow_nan=False) if args.json else _text(robot, report))


def _plan(name: str) -> "SavedPlan | None":
    """The plan that a file holds, if it holds one."""
    from pathlib import Path

    from reojax._internal.json_files import read_object
    from reojax.planning.plan_file import FORMAT, load_plan

    if Path(name).suffix.lower() != ".json" or read_object(name).get("format") != FORMAT:
        return None
    return load_plan(name)


def _plan_report(plan: "SavedPlan") -> dict[str, Any]:
    import numpy as np

    from reojax import so3

    def vector(rotation: "np.ndarray") -> list[float]:
        return np.rad2deg(np.asarray(so3.log(rotation))).tolist()

    clearance = None if plan.clearance is None or not np.isfinite(plan.clearance) else float(plan.clearance)
    return {
        "corners": len(plan.waypoints),
        "runs": int(plan.repeats),
        "manoeuvres": [name for name, *_ in plan.manoeuvres],
        "travel_deg": float(np.rad2deg(plan.travel)),
        "target_rotation_vector_deg": None if plan.target is None else vector(plan.target),
        "rotation_vector_deg": vector(plan.rotation),
        "error_rad": float(plan.error),
        "converged": plan.converged,
        "status": plan.status,
        "clearance_m": clearance,
        "certificate": None
        if plan.certificate is None
        else {k: float(v) for k, v in plan.certificate._asdict().items()},
        "planned_by": plan.reojax,
    }


def _clearance(robot: "Robot", plan: "SavedPlan | None") -> dict[str, Any] | None:
    """Where the parts are nearest to each other: along a plan, or with all joints at zero; None without pairs."""
    import numpy as np

    from reojax.collision.nearest import nearest_parts
    from reojax.path import polygon

    if not robot.collision_pairs:
        return None
    found = nearest_parts(robot, polygon(np.zeros((1, robot.joints))) if plan is None else plan.path)
    return {
        "of": "robot" if plan is None else "plan",
        "proven_m": found.distance,
        "found_m": found.found,
        "pair": found.name,
        "at_edge": found.at,
        "theta_rad": found.theta.tolist(),
        "nearest_points_m": found.points.tolist(),
    }


def _robot(args: argparse.Namespace) -> "Robot":
    from reojax.cli._robot import is_file, robot_of
    from reojax.models.load import load_robot

    changes = bool(args.base or args.lock or args.gear or args.rotor or args.repair or args.no_shapes)
    if not is_file(args.robot) or not changes:
        if changes:
            raise ValueError("--base, --lock, --gear, --rotor, --repair and --no-shapes are for files.")
        return robot_of(args.robot)
    try:
        return load_robot(
            args.robot,
            base=args.base,
            lock=_lock_positions(args),
            gear_ratio=_numbers("--gear", args.gear),
            rotor_inertia=_numbers("--rotor", args.rotor),
            repair=args.repair,
            shapes=not args.no_shapes,
        )
    except ImportError as error:
        raise ValueError(str(error)) from None


def _lock_positions(args: argparse.Namespace) -> dict[str, float]:
    """Positions in the file's units: degrees become radians where the joint turns."""
    import math

    from reojax.models.load import joint_kinds

    given = _numbers("--lock", args.lock)
    kinds = joint_kinds(args.robot, args.base) if given else {}
    return {name: value if kinds.get(name) == "prismatic" else math.radians(value) for name, value in given.items()}


def _numbers(option: str, pairs: list[str]) -> dict[str, float]:
    found = {}
    for pair in pairs:
        name, _, text = pair.rpartition("=")
        try:
            found[name] = float(text)
        except ValueError:
            name = ""
        if not name:
            raise ValueError(f"argument {option}: {pair[:100]!r} must be a joint's name, = and a number.")
    return found


def _report(robot: "Robot", args: argparse.Namespace) -> dict[str, Any]:
    from reojax.models.json_file import to_json

    return {
        "command": "show",
        "version": version(),
        "config": {"robot": args.robot},
        "total_mass_kg": float(robot.mass.sum()),
        "robot": to_json(robot),
        "self_check": _self_check(robot),
        "saved": args.save,
    }


def _self_check(robot: "Robot") -> dict[str, Any]:
    """Momentum at postures within the limits, against an independent sum over the links."""
    import dataclasses

    import jax
    import numpy as np

    from reojax._internal.definiteness import energy_matrix
    from reojax.mechanics.momentum import momentum_matrices
    from reojax.session import compile_quickly

    compile_quickly()
    rng = np.random.default_rng(0)
    fields = {field.name: getattr(robot, field.name) for field in dataclasses.fields(robot)}
    fields["axis"] = fields["axis"] / np.linalg.norm(fields["axis"], axis=1, keepdims=True)
    matrices = jax.jit(momentum_matrices)
    apart, left, least, symmetric = 0.0, 0.0, np.inf, 0.0
    for _ in range(4):
        theta = rng.uniform(np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi))
        A, B = (np.asarray(part) for part in matrices(robot, theta))
        whole = energy_matrix(fields, theta)
        size = np.abs(A).max()
        apart = max(apart, np.abs(A - whole[:3, :3]).max() / size, np.abs(B + whole[:3, 3:]).max(initial=0) / size)
        turning = np.linalg.solve(A, B)
        moving = np.vstack([turning, np.eye(robot.joints)])
        exchanged = np.abs(whole[:3]) @ np.abs(moving)
        left = max(left, (np.abs(whole[:3] @ moving) / np.maximum(exchanged, 1e-300)).max(initial=0))
        symmetric = max(symmetric, np.abs(A - A.T).max() / size)
        scale = 1 / np.sqrt(np.diag(whole))
        least = min(least, np.linalg.eigvalsh(whole * scale[:, None] * scale)[0])
    return {
        "momentum_relative": float(left),
        "matrices_relative": float(apart),
        "asymmetry_relative": float(symmetric),
        "least_energy": float(least),
        "passed": bool(left < 1e-9 and apart < 1e-9 and symmetric < 1e-9 and least > 0),
    }


def _text(robot: "Robot", report: dict[str, Any]) -> str:
    check = report["self_check"]
    lines = [str(robot), "", f"momentum self-check: {'passed' if check['passed'] else 'FAILED'}"]
    for label, key, meaning in (
        ("momentum", "momentum_relative", "left at omega = A^-1 B theta', as a share of what the links exchange"),
        ("A and B", "matrices_relative", "apart from an independent sum over the links"),
        ("symmetry", "asymmetry_relative", "of A"),
        ("energy", "least_energy", "least kinetic energy of a motion, scaled; positive means that it can be solved"),
    ):
        lines.append(f"  {label:<10}{check[key]:>9.1e}  {meaning}")
    if "plan" in report:
        lines += ["", *_plan_text(report["plan"])]
    if report["clearance"] is None:
        lines += ["", "clearance: none, as there are no pairs of shapes to keep apart"]
    else:
        lines += ["", _clearance_text(report["clearance"])]
    if report["saved"] is not None:
        lines += ["", f"robot in {report['saved']}"]
    return "\n".join(lines)


def _clearance_text(found: dict[str, Any]) -> str:
    gap = 1e3 * found["found_m"]
    how = f"parts overlap by {-gap:.3f} mm" if gap < 0 else f"{1e3 * found['proven_m']:.3f} mm"
    place = "joints at zero" if found["of"] == "robot" else f"{found['at_edge']:.3f} edges along the plan"
    points = " and ".join("(" + ", ".join(f"{1e3 * x:.1f}" for x in point) + ")" for point in found["nearest_points_m"])
    return f"clearance: least {how}, between {found['pair']}, {place}; nearest points {points} mm, base frame"


def _plan_text(plan: dict[str, Any]) -> list[str]:
    runs = f", run {plan['runs']} times" if plan["runs"] > 1 else ""
    word = f" of {''.join(plan['manoeuvres'][:24])}" if plan["manoeuvres"] else ""
    turn = lambda vector: "({:.6g}, {:.6g}, {:.6g}) deg".format(*(round(x, 9) + 0.0 for x in vector))
    lines = [f"plan{word}: {plan['corners']} corners{runs}, {plan['travel_deg']:.1f} deg of joint travel"]
    if plan["target_rotation_vector_deg"] is not None:
        lines.append(f"  target     rotation vector {turn(plan['target_rotation_vector_deg'])}")
    lines.append(f"  base turns rotation vector {turn(plan['rotation_vector_deg'])}")
    lines.append(f"  status     {plan['status']}, {plan['error_rad']:.1e} rad off")
    if plan["clearance_m"] is not None:
        lines.append(f"  clearance  {1000 * plan['clearance_m']:.4g} mm, proven")
    if plan["certificate"] is not None:
        figures = plan["certificate"]
        lines.append(f"  momentum   {figures['momentum']:.1e} at most, as a share of what the links exchange")
    return lines

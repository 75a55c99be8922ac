"""Which loop rolls the thesis's robot by exactly 180 degrees with least joint travel, and what do feet and gears trade?

    python experiments/design_opt.py                # under a minute on 2 quiet cores, compilation included
    python experiments/design_opt.py --target 120 --quick
    python experiments/design_opt.py --clearance 5mm             # nothing touches, proven; and the motors keep up
    python experiments/design_opt.py --robot satellite_arm --axis z --target 90 --clearance 10mm --motors 39,1.4

First the prototype as it is, within 270/120: the best rectangle, polygon and smooth loop (spline) whose whole net
rotation is the target, off-axis part included, each from 64 starts. Pinocchio replays the answers; derivatives are
compared with differences. Then amplitudes, end link inertia and gear ratio together: least travel of manoeuvre A with
the roll equal to the target (its small off-axis part left free, as in the thesis), over the end link inertia and over
the gear ratio, the other one as in the thesis or chosen freely.

Expected: a polygon with free corners beats the rectangle by about 15 %, both reach the target to 1e-8; rectangles that
start in the straight posture cannot, and need a short lead. Gears that couple more need less travel, so the free ratio
ends at its bound; past about 100 kg mm^2 heavier feet gain no more (thesis figure 2.8).

With `--clearance` the loops keep it, and end link inertia, gear ratio and amplitudes are chosen again with clearance
and motors as conditions. With `--robot`, a name or a file, the same question of any robot: its best polygon, and what
ends and gears between half and twice as they are would change.
"""

from pathlib import Path
from typing import Any

import numpy as np
from common.motors import motors_of
from common.script import length, options, run
from common.tables import gradient_error, least_travel, summary, table
from design_opt_parts import any_robot, constrained
from design_opt_parts.manoeuvre_a import INERTIA, RATIO, joint_travel, manoeuvre_problem
from matplotlib.figure import Figure

import reojax
from reojax import design, plot, so3
from reojax.files import check_writable, write_json
from reojax.robots import prototype

LOWER, UPPER = np.transpose([INERTIA, RATIO])
"""End link inertia [kg mm^2] and gear ratio."""
THESIS = np.array([70.0, 24.0])
ROTOR = 0.1
"""Rotor inertia of the prototype [kg mm^2]."""
SAMPLES = 48
INK = ("#0072b2", "#d55e00")


def main(
    out: Path,
    *,
    quick: bool = False,
    target: float = 180.0,
    axis: str = "z",
    clearance: float | None = None,
    robot: str = "prototype",
    motors: tuple[float, float] | None = None,
) -> dict:
    """Print loops and trade-offs, write `design_opt` as .json, .png and .html (a page to look at)."""
    if not 0 < target < 360:
        raise ValueError(f"`--target` is {target:g}; it must be a turn between 0 and 360 degrees.")
    if clearance is not None and not 0 <= clearance < 10:
        raise ValueError(f"`--clearance` is {clearance:g} m; it must be a distance from 0 to 10 m.")
    picture, record = plot.check_picture(out / "design_opt.png"), check_writable(out / "design_opt.json")
    page = check_writable(out / "design_opt.html")
    if robot != "prototype" or axis != "z" or motors is not None:
        asked = any_robot.robot_of(robot)
        vector = np.deg2rad(target) * np.eye(3)["xyz".index(axis)]
        case = any_robot.case_of(asked, vector, clearance, None if motors is None else motors_of(asked, *motors))
        return _any(case, f"{target:g} deg about {axis}", record, page, quick=quick)
    loops = best_loops(np.deg2rad(target), quick=quick, clearance=clearance)
    curves = trade_off(np.deg2rad(target), points=5 if quick else 13)

    print(f"\nPrototype turned by {target:g} deg of roll, all three components, least joint travel within 270/120\n")
    rows = ("starts", "starts_converged", "starts_at_best", "travel_deg", "residual_rad", "slope", "miss_off_axis_rad",
            "replay_rad", "gradient_error", *(("clearance_mm",) if clearance is not None else ()))  # fmt: skip
    table(["", *(loop["loop"] for loop in loops)], [[row, *(loop[row] for loop in loops)] for row in rows], width=26)
    print("\nManoeuvre A, roll as wanted: least travel [deg] over one parameter, the other as in the thesis, or free\n")
    for name, curve in curves.items():
        table([name, "thesis", "free", "free at"], [
            [f"{x:g}", *("missed" if not ok else travel for ok, travel in zip(oks, travels, strict=True)), other]
            for x, oks, travels, other in zip(
                curve["values"], curve["converged"], curve["travel_deg"], curve["other"], strict=True
            )
        ])  # fmt: skip
        print()
    answer = {
        "target_deg": target,
        "converged": all(loop["best_converged"] for loop in loops),
        "loops": loops,
        "trade_off": curves,
    }
    if clearance is not None:
        answer["constrained"] = choices = constrained.choices(np.deg2rad(target), clearance, quick=quick)
        print(
            "Amplitudes, end link inertia and gear ratio of manoeuvre A by gradients, under more and more conditions\n"
        )
        columns = [key for key in choices[0] if key not in ("case", "status", "waypoints", "certificate")]
        table(["", *columns], [[row["case"], *(_plain(row[key]) for key in columns)] for row in choices], width=16)
        answer["converged"] &= all(row["converged"] for row in choices)
    plot.save(_picture(loops, curves, target), picture)
    write_json(record, answer)
    _show(loops, target, page)
    print(f"wrote {picture}, {record} and {page}")
    return answer


def _any(case: any_robot.Case, turn: str, record: Path, page: Path, *, quick: bool) -> dict:
    """The question for a robot of any kind."""
    rows, own = any_robot.solve(case, quick=quick)
    print(f"\n{case.robot.name} turned by {turn}, all three components: least joint travel\n")
    columns = ["converged", "starts", "travel_deg", "ends", "gears", *(["time_s"] if case.motors else [])]
    proofs = ["clearance_m", "pinocchio_rad", "holds"]
    table(["", *columns, *proofs], [
        [row["case"], *(row[key] for key in columns), *(_plain(row["certificate"][key]) for key in proofs)]
        for row in rows
    ])  # fmt: skip
    answer = {"turn": turn, "converged": all(row["certificate"]["holds"] for row in rows), "choices": rows, "own": own}
    write_json(record, answer)
    target = np.asarray(so3.exp(case.target))
    reojax.view(case.robot, reojax.polygon(np.deg2rad(own["waypoints_deg"])), page, target=target)
    print(f"wrote {record} and {page}")
    return answer


def _plain(value: object) -> object:
    return "yes" if value is True else "no" if value is False else value


def _show(loops: list[dict[str, Any]], target: float, page: Path) -> None:
    """The polygon beside manoeuvre A on the prototype as it is, as a page for a browser."""
    polygon = next(loop for loop in loops if "polygon" in loop["loop"])
    reojax.view(
        prototype(),
        reojax.polygon(np.deg2rad(polygon["waypoints_deg"])),
        page,
        beside=reojax.manoeuvre_a(np.deg2rad(270.0), np.deg2rad(120.0)),
        target=reojax.so3.exp(np.array([0.0, 0.0, np.deg2rad(target)])),
        names=[f"{polygon['loop']}, {polygon['travel_deg']:.0f}° of travel", "manoeuvre A, 270°/120°"],
        title=f"The prototype turns by {target:g}° of roll: least joint travel",
    )


def best_loops(roll: float, *, quick: bool, clearance: float | None = None) -> list[dict[str, Any]]:
    """Best loop of each family, with its figures; with a clearance [m] there is no spline, which takes long."""
    robot, target = prototype(), np.array([0.0, 0.0, roll])
    families = [(design.polygons(robot, 3 if quick else 5), 4)]
    if not quick:
        families.insert(0, (design.rectangles(robot, lead=True), 4))
    if not quick and clearance is None:
        families.append((design.spline_loops(robot, 8, samples=SAMPLES), 1))
    apart = [] if clearance is None else [design.clear_by(clearance)]
    answers = []
    for loop, steps in families:
        problem = least_travel(robot, loop, steps=steps, inequality=apart)
        starts = 16 if quick else 64
        found = problem.solve(starts, seed=1, hold={"target": target}, progress=loop.name, max_steps=100)
        answers.append(summary(problem, loop, found, target, steps=steps))
        least = problem.outcome(found.value[found.best]).clearance.distance if apart else np.nan
        answers[-1] |= {"clearance_mm": 1e3 * float(least)} if apart else {}
    corners = [np.deg2rad(answer["waypoints_deg"]) for answer in answers]
    for answer, error in zip(answers, gradient_error(robot, corners, steps=4), strict=True):
        answer["gradient_error"] = error
    return answers


def trade_off(roll: float, *, points: int) -> dict[str, dict[str, Any]]:
    """Least travel over the end link inertia, and over the gear ratio, with the other one as in the thesis or free."""
    names = ("end inertia [kg mm^2]", "gear ratio")
    problem = manoeuvre_problem(roll, joint_travel)
    grids = [np.unique(np.append(np.linspace(LOWER[k], UPPER[k], points), THESIS[k])) for k in (0, 1)]
    # one problem a row: the parameter on the axis, the other one as in the thesis or free (NaN)
    held = []
    for k, grid in enumerate(grids):
        for value in grid:
            for other in (THESIS[1 - k], np.nan):
                held.append((value, other) if k == 0 else (other, value))
    inertia, ratio = np.transpose(held)
    middle = 0.5 * (LOWER + UPPER) * [1e-6, 1]
    starts = [[*np.deg2rad(loop), *middle] for loop in ([200.0, 80.0], [260.0, 110.0], [120.0, 115.0])]
    found = problem.solve_each(
        {"inertia": 1e-6 * inertia, "ratio": ratio}, starts, max_steps=100, progress="trade-off"
    ).pick()
    travel, converged = np.rad2deg(found.cost), found.converged
    other = found.value[:, 2:] * [1e6, 1]
    curves, place = {}, 0
    for k, grid in enumerate(grids):
        part = slice(place, place + 2 * len(grid))
        place += 2 * len(grid)
        curves[names[k]] = {
            "values": grid.tolist(),
            "converged": converged[part].reshape(-1, 2).tolist(),
            "travel_deg": travel[part].reshape(-1, 2).tolist(),
            "other": other[part].reshape(-1, 2, 2)[:, 1, 1 - k].tolist(),
        }
    return curves


def _picture(loops: list[dict[str, Any]], curves: dict[str, dict[str, Any]], target: float) -> Figure:
    figure = Figure(figsize=(11, 7.2), layout="constrained", facecolor="white")
    grid, wide = figure.add_gridspec(2, 6), 6 // len(loops)
    for i, loop in enumerate(loops):
        axes = figure.add_subplot(grid[0, wide * i : wide * (i + 1)])
        axes.set_ylim(-300, 340)
        corners = np.array(loop["waypoints_deg"])
        along = np.concatenate([[0], np.cumsum(np.abs(np.diff(corners, axis=0)).sum(1))])
        for name, angle, colour, line in zip(
            ("twist 1", "bend", "twist 2"), corners.T, ("#0072b2", "#e69f00", "#7f3c8d"), ("-", "--", "-."), strict=True
        ):
            axes.plot(along, angle, line, color=colour, label=name, linewidth=1.8)
        axes.set(xlabel="joint travel [deg]", title=f"{loop['loop']}: {loop['travel_deg']:.0f}°")
        axes.grid(axis="y", color="#dddddd")
        axes.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("joint angle [deg]")
    figure.axes[0].legend(frameon=False, ncols=3, loc="upper left", fontsize=8)
    for i, ((name, curve), mark) in enumerate(zip(curves.items(), THESIS, strict=True)):
        axes = figure.add_subplot(grid[1, 3 * i : 3 * (i + 1)])
        x, travel = np.array(curve["values"]), np.array(curve["travel_deg"])
        travel = np.where(curve["converged"], travel, np.nan)
        reflected = name == "gear ratio"
        other = "end inertia" if reflected else "gear ratio"
        for column, label in enumerate((f"{other} of the thesis", f"{other} free")):
            axes.plot(x, travel[:, column], "o-", color=INK[column], label=label, markersize=4)
        at = int(np.flatnonzero(x == mark)[0])
        axes.plot(mark, travel[at, 0], "*", color="black", markersize=15, label="the thesis's choice", zorder=5)
        axes.set(xlabel=name.replace("^2", "²"), title=f"Manoeuvre A to {target:g}° of roll")
        if reflected:
            top = axes.secondary_xaxis(
                "top", functions=(lambda n: ROTOR * n**2, lambda i: np.sqrt(np.maximum(i, 0) / ROTOR))
            )
            top.set_xticks([0.1, 10, 50, 100, 150, 200])
            top.set_xlabel("reflected rotor inertia, ratio² × 0.1 kg mm² [kg mm²]")
            axes.set_title("")
        axes.grid(color="#dddddd")
        axes.legend(frameon=False)
        axes.spines[["right"]].set_visible(False)
        axes.set_xlim(0, None)
        axes.set_ylabel("least joint travel [deg]")
    return figure


def _line(text: str) -> tuple[float, float]:
    """Torque and speed, of `39,1.4`."""
    torque, speed = map(float, text.split(","))
    return torque, speed


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--target", type=float, default=180.0, help="turn to reach [deg] (default: 180)")
    parser.add_argument("--axis", choices=("x", "y", "z"), default="z", help="axis of the turn (default: z, the roll)")
    parser.add_argument(
        "--clearance", type=length, metavar="LENGTH", help="what the robot's parts keep apart, such as 5mm"
    )
    parser.add_argument("--robot", default="prototype", help="a robot's name, or a file (default: prototype)")
    parser.add_argument(
        "--motors", type=_line, metavar="TORQUE,SPEED", help="each joint's at standstill [N m] and without load [rad/s]"
    )
    run(main, parser)

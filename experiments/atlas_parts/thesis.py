"""Question 2: the thesis's robot against the thesis, once it may not touch itself: turns, shares of SO(3), records."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pure_pitch
from common.markdown import table
from common.proof import prove
from common.tables import least_travel
from design_opt import best_loops
from matplotlib.figure import Figure
from so3_share import random_targets, shares_reached

import reojax
from atlas_parts.store import Row, Store
from atlas_parts.subjects import Subject
from reojax import RE_MAX_17, design, plot, robots, so3

CLEARANCE = 0.005
LIMITS = {"twist_limit": np.deg2rad(270), "bend_limit": np.deg2rad(120)}
A = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
HALF = np.diag([-1.0, -1.0, 1.0])
"""Half a turn of roll."""
ROBOT = robots.prototype()


def jobs(subjects: list[Subject], store: Store, quick: bool) -> list[tuple[str, Callable[[], Row]]]:
    """Rows of this question; they are about the prototype alone."""
    if not any(subject.name == "prototype" for subject in subjects):
        return []
    if quick:
        return [("manoeuvres", manoeuvres)]
    return [
        ("share", lambda: share(1000)),
        ("manoeuvres", manoeuvres),
        ("least travel, without", lambda: half_turn(None)),
        ("least travel, 5 mm", lambda: half_turn(CLEARANCE)),
        ("least time from A", lambda: fastest(A)),
        ("least time from least travel",
         lambda: fastest(reojax.polygon(np.array(store.rows["thesis/least travel, 5 mm"]["waypoints"])))),
        ("least time from A, 5 mm", lambda: fastest(A, HALF, CLEARANCE)),
        ("least time, A's rotation", lambda: fastest(A, np.asarray(reojax.net_rotation(ROBOT, A)))),
        ("design records", design_records),
        ("pitch record", pitch_record),
    ]  # fmt: skip


def share(count: int) -> Row:
    """Share of uniformly random targets reached with at most n manoeuvres, with clearance and without."""
    targets = random_targets(count)
    shares = {name: shares_reached(targets, 6, margin) for name, margin in (("without", None), ("5 mm", CLEARANCE))}
    return {"targets": count, **shares}


def half_turn(margin: float | None) -> Row:
    """Half a turn of roll in least travel, the best of many starts."""
    best, travels = None, []
    for seed in range(4):
        found = reojax.free_path(ROBOT, HALF, **LIMITS, starts=24, seed=seed, clearance=margin)
        travels.append(float(np.rad2deg(found.travel)) if found.converged else None)
        if found.converged and (best is None or found.travel < best.travel):
            best = found
    assert best is not None
    return {
        "starts": 4 * 24,
        "travel_deg": float(np.rad2deg(best.travel)),
        "by_seed_deg": travels,
        "waypoints": best.waypoints.tolist(),
        "certificate": prove(ROBOT, best.waypoints, 1, HALF, -np.inf if margin is None else margin),
    }


def fastest(near: reojax.Path, target: np.ndarray = HALF, margin: float | None = None) -> Row:
    """The fastest motion that is found from a loop, and the clearance that it is proven to have all the time."""
    found = reojax.fastest_loop(ROBOT, target, RE_MAX_17, near, clearance=margin)
    return {
        "duration_s": float(found.duration),
        "converged": bool(found.converged),
        "error_rad": float(found.error),
        "clearance_m": float(reojax.trajectory_clearance(ROBOT, found.trajectory).distance),
    }


def record(name: str, path: reojax.Path, figure: str) -> Row:
    """Clearance of a path that a page names."""
    found = reojax.path_clearance(ROBOT, path)
    pair = [ROBOT.link_names[ROBOT.capsule_link[c]] for c in ROBOT.collision_pairs[int(found.pair)]]
    return {"record": name, "figure": figure, "clearance_m": float(found.distance), "pair": pair}


def manoeuvres() -> Row:
    """The manoeuvres of the thesis at full amplitude, both ways."""
    rows = []
    for name, loop in (("A", reojax.manoeuvre_a), ("B", reojax.manoeuvre_b)):
        for twist in (270.0, -270.0):
            path = loop(np.deg2rad(twist), np.deg2rad(120))
            angle = np.rad2deg(so3.angle(reojax.net_rotation(ROBOT, path)))
            rows.append(record(f"{name}, {twist:g}/120", path, f"{angle:.0f} deg of rotation"))
    return {"records": rows}


def design_records() -> Row:
    """The main job's loops."""
    rows = []
    for loop in best_loops(np.pi, quick=False):
        path = reojax.polygon(np.deg2rad(loop["waypoints_deg"]))
        rows.append(record(f"half turn of roll, {loop['loop']}", path, f"{loop['travel_deg']:.1f} deg"))
    return {"records": rows}


def pitch_record() -> Row:
    """The quarter turn of pitch, as it is and with the clearance."""
    loop, rows = design.polygons(ROBOT, pure_pitch.CORNERS), []
    for name, conditions in (("", []), (", 5 mm", [design.clear_by(CLEARANCE)])):
        problem = least_travel(ROBOT, loop, inequality=conditions)
        found = problem.solve(64 if not name else 32, hold={"target": pure_pitch.TARGET}, max_steps=100)
        best = problem.outcome(found.value[found.best])
        travel = float(np.rad2deg(found.cost[found.best]))
        rows.append(record(f"quarter turn of pitch{name}", best.path, f"{travel:.1f} deg"))
        rows[-1]["converged"] = int(found.converged.sum())
    return {"records": rows}


def show(rows: dict[str, Row], out: Path) -> None:
    """Print the tables, draw the shares."""
    if "share" in rows:
        print(f"\nshare of {rows['share']['targets']} random targets reached with at most n manoeuvres [%]\n")
        print(table(["", *(f"n = {n}" for n in range(1, 7))], [
            [name, *(f"{100 * value:.1f}" for value in rows["share"][name])] for name in ("without", "5 mm")
        ]))  # fmt: skip
        plot.save(_picture(rows["share"]), out / "atlas_share.png")
    records: list[dict[str, Any]] = [r for row in rows.values() for r in row.get("records", ())]
    print("\nrecords, and how clear of itself the robot stays\n")
    cells = [[r["record"], r["figure"], f"{1e3 * r['clearance_m']:.1f}", " and ".join(r["pair"])] for r in records]
    for name, row in rows.items():
        if "duration_s" in row:
            kind = "converged" if row["converged"] else "not converged"
            cells.append([name, f"{1e3 * row['duration_s']:.0f} ms, {kind}", f"{1e3 * row['clearance_m']:.1f}", ""])
        if "travel_deg" in row:
            apart = 1e3 * row["certificate"]["clearance_m"]
            cells.append([name, f"{row['travel_deg']:.1f} deg, {row['starts']} starts", f"{apart:.1f}", ""])
    print(table(["record", "figure", "least clearance [mm]", "between"], cells))


def _picture(row: Row) -> Figure:
    """Shares by number of manoeuvres, with the clearance and without."""
    figure = Figure(figsize=(6.2, 3.4), layout="constrained", facecolor="white")
    axes = figure.subplots()
    for k, (name, label, colour) in enumerate(
        (("without", "may touch itself", "#999999"), ("5 mm", "5 mm clear, proven", "#0072b2"))
    ):
        value = 100 * np.array(row[name])
        bars = axes.bar(np.arange(1, 7) + 0.4 * (k - 0.5), value, 0.38, color=colour, label=label)
        axes.bar_label(
            bars, [f"{v:.0f}" if 10 <= v < 99 or v == 100 else f"{v:.1f}" for v in value], fontsize=9, padding=2
        )
    axes.set(xlabel="at most so many manoeuvres", ylabel="random targets reached [%]", ylim=(0, 112))
    axes.legend(frameon=False, loc="upper left")
    axes.spines[["top", "right"]].set_visible(False)
    return figure

"""Question 1: what turns a robot about roll, pitch and yaw, how far one loop goes, and what a turn costs."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from common.markdown import table
from common.proof import prove

import reojax
from atlas_parts import animations
from atlas_parts.clear_turns import Effort, Turns, boxed_turns, clear_turns, free_turns, held_turns
from atlas_parts.store import Row, Store
from atlas_parts.subjects import USUAL_AXES, Subject
from reojax import so3

AXES = tuple(USUAL_AXES)

ANGLES = (180, 90)
"""Turns about each axis [deg]."""
FEW = 5
"""Up to so many joints a search is cheap, and thorough."""
THOROUGH, USUAL, QUICK = Effort(starts=4, steps=80), Effort(starts=2, steps=40), Effort(starts=1, steps=25)
HELD = Effort(starts=4, steps=60)
LAWS = ("quintic", "trapezoid")
_HELD = ", all pairs"
"""What the keys of rows end with that are found with all pairs of shapes held apart."""
_LOST = "not found: no loop about this axis was found that keeps the clearance"


def turns(subject: Subject, *, quick: bool = False) -> Row:
    """One robot's row: rank at rest, and per axis the farthest loop and the turns with their certificates."""
    effort = QUICK if quick else THOROUGH if subject.robot.joints <= FEW else USUAL
    rank = reojax.controllable_directions(subject.robot, subject.start)
    axes = [next(iter(subject.axes))] if quick else subject.axes
    wanted = [(axis, angle) for axis in axes for angle in (ANGLES[1:] if quick else ANGLES)]
    targets = np.array([np.asarray(so3.exp(np.deg2rad(angle) * subject.axes[axis])) for axis, angle in wanted])
    if subject.robot.joints <= FEW and not quick:
        touching = free_turns(subject, targets, effort)
        found = clear_turns(subject, targets, effort, touching)
    else:
        found, touching = boxed_turns(subject, targets, effort, most=1 if quick else None)
    alone = Turns(*(part.copy() for part in found))
    for answers in (touching, found):
        _double(answers, wanted)
    row: dict[str, Any] = {
        "joints": subject.robot.joints,
        "rank": int(rank.rank),
        "axes": rank.axes.tolist(),
        "clearance_m": subject.clearance,
        "pairs": len(subject.robot.collision_pairs),
        "turns": {f"{axis} {angle}": _turn(subject, found, touching, targets, k, LAWS[:1] if quick else LAWS)
                  for k, (axis, angle) in enumerate(wanted)},
    }  # fmt: skip
    row["most"] = {axis: _most(axis, alone, wanted) for axis in axes}
    row["farthest"] = {axis: found.farthest[wanted.index((axis, ANGLES[-1]))].tolist() for axis in axes}
    return row


def held(subject: Subject, row: Row) -> Row:
    """Quarter turns that a robot's row has not, with all pairs held apart; half turns are two of them."""
    quarter = ANGLES[-1]
    axes = [axis for axis in AXES if _is_missing(row["turns"][f"{axis} {quarter}"])]
    wanted = [(axis, angle) for axis in axes for angle in (quarter, 2 * quarter)]
    targets = np.array([np.asarray(so3.exp(np.deg2rad(angle) * subject.axes[axis])) for axis, angle in wanted])
    found = held_turns(subject, targets[::2], HELD)
    both = Turns(*(np.repeat(part, 2, axis=0) for part in found))
    both.reached[1::2] = False
    _double(both, wanted)
    turned = {
        f"{axis} {angle}": _turn(subject, both, both, targets, k) | {"free": row["turns"][f"{axis} {angle}"]["free"]}
        for k, (axis, angle) in enumerate(wanted)
    }
    alone = [(axis, quarter) for axis in axes]
    most = {axis: _most(axis, found, alone) for axis in axes}
    return {"turns": turned, "most": most, "farthest": dict(zip(axes, found.farthest.tolist(), strict=True))}


def _is_missing(turn: Row) -> bool:
    """Whether a turn was not found, though it may be there."""
    return not turn["reached"] and not turn["status"].startswith("unreachable")


def answers(rows: dict[str, Row]) -> dict[str, Row]:
    """Rows of this question by robot, each with what was found with all pairs held apart."""
    merged = {}
    for name, row in rows.items():
        if name.endswith(_HELD):
            continue
        more = rows.get(f"{name}{_HELD}", {"turns": {}, "most": {}, "cpu_s": 0.0})
        merged[name] = row | {
            "turns": row["turns"] | {turn: found for turn, found in more["turns"].items() if found["reached"]},
            "most": {axis: max(angle, more["most"].get(axis, 0.0)) for axis, angle in row["most"].items()},
            "cpu_s": row["cpu_s"] + more["cpu_s"],
        }
    return merged


def _double(found: Turns, wanted: list[tuple[str, int]]) -> None:
    """Take the quarter turn's loop twice as often for the half turn where that is less travel; changes `found`."""
    for k, (axis, angle) in enumerate(wanted):
        if (axis, angle // 2) not in wanted:
            continue
        half = wanted.index((axis, angle // 2))
        if found.reached[half] and not (found.reached[k] and found.travel[k] <= 2 * found.travel[half]):
            found.waypoints[k], found.reached[k], found.status[k] = found.waypoints[half], True, found.status[half]
            found.runs[k], found.travel[k] = 2 * found.runs[half], 2 * found.travel[half]


def _turn(
    subject: Subject, found: Turns, without: Turns, targets: np.ndarray, k: int, laws: Sequence[str] = LAWS
) -> Row:
    """Cost and certificate of one turn; without a clearance it is given for what it would cost."""
    row: dict[str, Any] = {
        "reached": bool(found.reached[k]),
        "status": _LOST if not found.reached[k] and found.status[k] == "converged" else str(found.status[k]),
        "free": {
            "reached": bool(without.reached[k]),
            "runs": int(without.runs[k]),
            "travel_deg": float(np.rad2deg(without.travel[k])) if without.reached[k] else None,
        },
    }
    if not found.reached[k]:
        return row
    path, runs = found.waypoints[k], int(found.runs[k])
    seconds, law = least_time(subject, path, laws)
    return row | {
        "runs": runs,
        "travel_deg": float(np.rad2deg(found.travel[k])),
        "time_s": runs * seconds,
        "law": law,
        "waypoints": path.tolist(),
        "certificate": prove(subject.robot, path, runs, targets[k], subject.clearance),
    }


def least_time(subject: Subject, path: np.ndarray, laws: Sequence[str] = LAWS) -> tuple[float, str]:
    """Least time of one run [s] by the faster of the laws, each edge from rest to rest."""
    loop = reojax.polygon(path)
    return min((float(reojax.minimum_time(subject.robot, loop, subject.motors, law).duration), law) for law in laws)


def _most(axis: str, found: Turns, wanted: list[tuple[str, int]]) -> float:
    """How far one loop turns the base about an axis [deg]; 180 where one loop makes the half turn, and so any turn."""
    mine = [k for k, (name, _) in enumerate(wanted) if name == axis]
    each = [wanted[k][1] / int(found.runs[k]) for k in mine if found.reached[k]]
    return float(max([*each, *np.rad2deg(found.most[mine])]))


def jobs(subjects: list[Subject], store: Store, quick: bool) -> Iterator[tuple[str, Callable[[], Row]]]:
    """A row for each robot, and one more for what it has not."""
    for subject in subjects:
        yield subject.name, lambda subject=subject: turns(subject, quick=quick)
        row = store.rows.get(f"turns/{subject.name}", {"turns": {}})
        if not quick and any(map(_is_missing, row["turns"].values())):
            yield f"{subject.name}{_HELD}", lambda subject=subject, row=row: held(subject, row)


def show(rows: dict[str, Row], out: Path) -> None:
    """Print the tables, draw the picture, and write a page for a browser for each robot."""
    rows = answers(rows)
    columns = ["robot", "joints", "rank", "kept clear [mm]", *(f"one loop, {axis} [deg]" for axis in AXES), "CPU s"]
    print(table(columns, [
        [name, row["joints"], row["rank"], f"{1e3 * row['clearance_m']:.1f}",
         *(f"{row['most'][axis]:.3g}" if axis in row["most"] else "" for axis in AXES), f"{row['cpu_s']:.0f}"]
        for name, row in rows.items()
    ]))  # fmt: skip
    for angle in ANGLES[::-1]:
        cells = {name: [_cell(row["turns"].get(f"{axis} {angle}")) for axis in AXES] for name, row in rows.items()}
        print(f"\n{angle} degrees: runs, joint travel [deg] (without clearance), least time [s]\n")
        print(table(["robot", *AXES], [[name, *row] for name, row in cells.items()]))
    print()
    certificates = [
        turn["certificate"] for row in rows.values() for turn in row["turns"].values() if "certificate" in turn
    ]
    for figure in ("momentum", "miss_rad", "pinocchio_rad", "beyond_limits_rad"):
        values = [c[figure] for c in certificates if c[figure] is not None]
        print(f"{figure}: largest of {len(values)} {max(values, default=0.0):.1e}")
    print(f"certificates that hold: {sum(c['holds'] for c in certificates)} of {len(certificates)}\n")
    for name, row in rows.items():
        animations.write(name, row, out / "atlas")


def _cell(turn: Row | None) -> str:
    if turn is None:
        return ""
    without = turn["free"]
    many = f", {without['runs']} runs" if without["runs"] > 1 else ""
    free = f"({without['travel_deg']:.0f}{many})" if without["reached"] else "(not found)"
    if turn["status"].startswith("unreachable"):
        return "cannot"
    if not turn["reached"]:
        return f"not found {free}"
    runs = f"{turn['runs']} runs, " if turn["runs"] > 1 else ""
    return f"{runs}{turn['travel_deg']:.0f} {free}, {turn['time_s']:.2g} s"

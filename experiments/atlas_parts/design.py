"""Question 3: end link inertia and gear ratio that gradients choose when clearance and motors are conditions.

Of the prototype for half a turn of roll by manoeuvre A, whose amplitudes are chosen too; and of three robots with gears
for a quarter turn about the axis that costs them least, by polygons, whose corners are chosen too.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from common.markdown import table
from design_opt_parts import any_robot, constrained

from atlas_parts.store import Row, Store
from atlas_parts.subjects import Subject
from reojax.motion.least_time import AVAILABLE

CLEARANCE = 0.005
QUARTER = {"prototype": "roll", "six_body": "roll", "satellite_arm": "yaw"}
"""The axis of each robot's quarter turn."""
MANOEUVRE = "half turn of roll"
_COLUMNS = ("twist_deg", "bend_deg", "inertia_kg_mm2", "ratio", "travel_deg", "time_ms", "clearance_mm", "off_axis_deg")


def jobs(subjects: list[Subject], store: Store, quick: bool) -> list[tuple[str, Callable[[], Row]]]:
    """A row for manoeuvre A on the prototype, and one for each robot's polygons."""
    if quick:
        return []
    half = [(MANOEUVRE, lambda: {"cases": constrained.choices(np.pi, CLEARANCE)})]
    return (half if any(subject.name == "prototype" for subject in subjects) else []) + [
        (f"{subject.name}, {QUARTER[subject.name]} 90", lambda subject=subject: polygons(subject))
        for subject in subjects
        if subject.name in QUARTER
    ]


def polygons(subject: Subject) -> Row:
    """What is chosen for a robot's quarter turn."""
    vector = 0.5 * np.pi * subject.axes[QUARTER[subject.name]]
    case = any_robot.case_of(subject.robot, vector, subject.clearance, subject.motors, subject.start)
    rows, _ = any_robot.solve(case)
    return {"clearance_m": subject.clearance, "cases": rows}


def show(rows: dict[str, Row], out: Path) -> None:
    """Print the choices."""
    if MANOEUVRE in rows:
        print(f"\n{MANOEUVRE} by manoeuvre A; the fall leaves {1e3 * AVAILABLE:.0f} ms\n")
        print(table(["", *(column.replace("_", " ") for column in _COLUMNS), "converged", "certificate"], [
            [case["case"], *(f"{case[column]:.4g}" for column in _COLUMNS), *_verdicts(case)]
            for case in rows[MANOEUVRE]["cases"]
        ]))  # fmt: skip
    print("\nquarter turns by polygons: ends and gears over those of the robot as it is\n")
    columns = ["robot", "", "ends", "gears", "travel [deg]", "time [s]", "clearance [mm]", "converged", "certificate"]
    print(table(columns, [
        [name, case["case"], f"{case['ends']:.3g}", f"{case['gears']:.3g}", f"{case['travel_deg']:.1f}",
         f"{case['time_s']:.3g}", f"{1e3 * (case['certificate']['clearance_m'] or 0):.1f}", *_verdicts(case)]
        for name, row in rows.items() if name != MANOEUVRE for case in row["cases"]
    ]))  # fmt: skip


def _verdicts(case: Row) -> list[str]:
    """How it ended, or how many starts converged, and whether the certificate holds."""
    ended = case["status"].partition(":")[0]
    many = f"{case['converged']} of {case['starts']}, best {ended}" if "starts" in case else ended
    return [many, "holds" if case["certificate"]["holds"] else "fails"]

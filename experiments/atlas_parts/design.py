"""Question 3: end link inertia and gear ratio that gradients choose when clearance and motors are conditions."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from common.markdown import table
from design_opt_parts import constrained

from atlas_parts.store import Row, Store
from atlas_parts.subjects import Subject
from reojax.motion.least_time import AVAILABLE

CLEARANCE = 0.005
_COLUMNS = ("twist_deg", "bend_deg", "inertia_kg_mm2", "ratio", "travel_deg", "time_ms", "clearance_mm", "off_axis_deg")


def jobs(subjects: list[Subject], store: Store, quick: bool) -> list[tuple[str, Callable[[], Row]]]:
    """One row, about the prototype."""
    if quick or not any(subject.name == "prototype" for subject in subjects):
        return []
    return [("half turn of roll", lambda: {"cases": constrained.choices(np.pi, CLEARANCE)})]


def show(rows: dict[str, Row], out: Path) -> None:
    """Print the choices."""
    for name, row in rows.items():
        print(f"\n{name} by manoeuvre A; the fall leaves {1e3 * AVAILABLE:.0f} ms\n")
        print(table(["", *(column.replace("_", " ") for column in _COLUMNS), "converged"], [
            [case["case"], *(f"{case[column]:.4g}" for column in _COLUMNS), "yes" if case["converged"] else "no"]
            for case in row["cases"]
        ]))  # fmt: skip

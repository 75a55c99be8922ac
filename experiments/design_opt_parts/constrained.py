"""End link inertia and gear ratio that gradients choose once the robot must not touch itself and its motors must do it.

Manoeuvre A rolls the prototype by the target. Amplitudes, end link inertia and gear ratio are chosen together, by two
aims: least joint travel, and least time. The conditions are taken up one after the other: a proven clearance along the
whole motion; every edge by a quintic from rest to rest within what an RE-max 17 at 12 V can do behind the gears chosen;
all edges within the time of the drop tower's fall.
"""

from typing import Any

import numpy as np
from common.proof import prove

import reojax
from design_opt_parts.in_time import SLOPE, in_time, least_time, times_of, total
from design_opt_parts.manoeuvre_a import joint_travel, manoeuvre_problem
from reojax import RE_MAX_17, design, so3
from reojax.motion.least_time import AVAILABLE

_EDGES = 4
"""Edges of manoeuvre A."""
_STARTS = [[*np.deg2rad(loop), 1e-6 * inertia, ratio, *[0.4] * _EDGES]
           for loop, inertia, ratio in (([200, 80], 100, 24), ([260, 110], 70, 16), ([240, 100], 130, 36))]  # fmt: skip


def choices(roll: float, clearance: float, *, quick: bool = False) -> list[dict[str, Any]]:
    """What gradients choose, by aim and conditions; clearance in m."""
    apart, needs = design.clear_by(clearance), in_time(RE_MAX_17, AVAILABLE)
    in_the_fall = lambda outcome: total(outcome) - 1
    near = f"{1e3 * clearance:g} mm"
    cases = [
        ("least travel", joint_travel, []),
        (f"least travel, {near}", joint_travel, [apart]),
        (f"least travel, {near}, within the fall", joint_travel, [apart, needs, in_the_fall]),
        (f"least time, {near}", total, [apart, needs]),
    ]
    rows = []
    for name, aim, conditions in cases[-1:] if quick else cases:
        rows.append(_row(name, aim, conditions, roll, clearance if conditions else -np.inf))
    return rows


def _row(name: str, aim: Any, conditions: list[Any], roll: float, margin: float) -> dict[str, Any]:
    problem = manoeuvre_problem(roll, aim, conditions, [times_of(_EDGES)])
    held = {} if len(conditions) > 1 else {"times": [1.0] * _EDGES}  # no condition has to do with them
    found = problem.solve(np.array(_STARTS), hold=held, max_steps=60, slope_tolerance=SLOPE, progress=name)
    best = problem.outcome(found.value[found.best])
    values = {key: float(best.values[key]) for key in ("twist", "bend", "inertia", "ratio")}
    turned = np.asarray(reojax.net_rotation(best.robot, best.path, steps=16))
    off = np.asarray(so3.log(turned @ np.asarray(so3.exp(np.array([0, 0, -roll])))))
    return {
        "case": name,
        "converged": bool(found.converged[found.best]),
        "status": found.message[found.best],
        "twist_deg": float(np.rad2deg(values["twist"])),
        "bend_deg": float(np.rad2deg(values["bend"])),
        "inertia_kg_mm2": 1e6 * values["inertia"],
        "ratio": values["ratio"],
        "travel_deg": float(np.rad2deg(joint_travel(best))),
        "time_ms": 1e3 * float(least_time(best, RE_MAX_17).duration),
        "clearance_mm": 1e3 * float(best.clearance.distance),
        "off_axis_deg": float(np.rad2deg(np.linalg.norm(off))),
        "waypoints": np.asarray(best.path.waypoints).tolist(),
        "certificate": prove(best.robot, np.asarray(best.path.waypoints), 1, turned, margin),
    }

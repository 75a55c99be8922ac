"""End link inertia and gear ratio that gradients choose once the robot must not touch itself and its motors must do it.

Manoeuvre A rolls the prototype by the target. Amplitudes, end link inertia and gear ratio are chosen together, by two
aims: least joint travel, and least time. The conditions are taken up one after the other: a proven clearance along the
whole motion; every edge by a quintic from rest to rest within what an RE-max 17 at 12 V can do behind the gears chosen;
all edges within the time of the drop tower's fall.
"""

from typing import Any

import numpy as np

import reojax
from reojax import RE_MAX_17, design, so3
from reojax.design import Outcome, Problem, Variable
from reojax.motion.least_time import AVAILABLE
from reojax.robots import prototype, with_end_inertia, with_gear_ratio

INERTIA, RATIO = (10.0, 190.0), (1.0, 48.0)
"""End link inertia [kg mm^2] and gear ratio."""
_STARTS = [[*np.deg2rad(loop), 1e-6 * inertia, ratio]
           for loop, inertia, ratio in (([200, 80], 100, 24), ([260, 110], 70, 16), ([240, 100], 130, 36))]  # fmt: skip


def duration(outcome: Outcome) -> Any:
    """Least time of the motion by quintics with RE-max 17 behind the gears of the design [s]."""
    motors = RE_MAX_17._replace(gear_ratio=outcome.values["ratio"], rotor_inertia=outcome.robot.rotor_inertia[0])
    return reojax.minimum_time(outcome.robot, outcome.path, motors, "quintic", samples=64).duration


def _travel(outcome: Outcome) -> Any:
    return 4 * outcome.values["twist"] + 2 * outcome.values["bend"]


def choices(roll: float, clearance: float, *, quick: bool = False) -> list[dict[str, Any]]:
    """What gradients choose, by aim and conditions; clearance in m."""
    in_time = lambda outcome: duration(outcome) / AVAILABLE - 1
    apart = design.clear_by(clearance)
    cases = [
        ("least travel", _travel, []),
        (f"least travel, {1e3 * clearance:g} mm", _travel, [apart]),
        (f"least travel, {1e3 * clearance:g} mm, within the fall", _travel, [apart, in_time]),
        (f"least time, {1e3 * clearance:g} mm", duration, [apart]),
    ]
    return [_row(name, aim, conditions, roll) for name, aim, conditions in (cases[-1:] if quick else cases)]


def _row(name: str, aim: Any, conditions: list[Any], roll: float) -> dict[str, Any]:
    problem = Problem(
        lambda values: (
            with_gear_ratio(with_end_inertia(prototype(), values["inertia"]), values["ratio"]),
            reojax.manoeuvre_a(values["twist"], values["bend"]),
        ),
        [
            Variable("twist", 0, 270, "deg"),
            Variable("bend", 0, 120, "deg"),
            Variable("inertia", *INERTIA, "kg mm^2"),
            Variable("ratio", *RATIO),
        ],
        objective=aim,
        equality=[design.turned_about([0, 0, 1], roll)],
        inequality=conditions,
    )
    found = problem.solve(np.array(_STARTS), max_steps=60, slope_tolerance=1e-4, progress=name)
    best = problem.outcome(found.value[found.best])
    values = {key: float(value) for key, value in best.values.items()}
    turned = np.asarray(reojax.net_rotation(best.robot, best.path, steps=16))
    off = np.asarray(so3.log(turned @ np.asarray(so3.exp(np.array([0, 0, -roll])))))
    return {
        "case": name,
        "converged": bool(found.converged[found.best]),
        "twist_deg": float(np.rad2deg(values["twist"])),
        "bend_deg": float(np.rad2deg(values["bend"])),
        "inertia_kg_mm2": 1e6 * values["inertia"],
        "ratio": values["ratio"],
        "travel_deg": float(np.rad2deg(_travel(best))),
        "time_ms": 1e3 * float(duration(best)),
        "clearance_mm": 1e3 * float(best.clearance.distance),
        "off_axis_deg": float(np.rad2deg(np.linalg.norm(off))),
    }

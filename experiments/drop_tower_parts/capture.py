"""Section of the drop tower: measured against simulated angles, on the synthetic capture."""

from pathlib import Path
from typing import Any

import jax
import numpy as np
import synthetic_capture

import reojax
from reojax import plot, robots
from reojax.captures.comparison import Sampled

SHIPPED = Path(__file__).parents[2] / "docs" / "synthetic_capture.csv"


def section(out: Path, *, quick: bool) -> dict[str, Any]:
    """Compare the shipped synthetic capture with the plan and its own joints, and (not when quick) calibrate to it."""
    robot = robots.prototype()
    capture = reojax.read_capture(SHIPPED, robot)
    path = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
    plan = reojax.along(path, "quintic", np.array(synthetic_capture.DURATIONS))
    ideal = reojax.released(robot, plan, samples=64)
    theta = jax.vmap(plan.at)(ideal.time).theta
    planned = reojax.compare(robot, capture, Sampled(*map(np.asarray, (ideal.time, theta, ideal.rotation))))
    own = reojax.compare(robot, capture)
    plot.save(
        plot.comparison_figure(robot, planned, title="Synthetic capture and plan"), out / "drop_tower_capture.png"
    )
    last = np.flatnonzero(capture.seen_rotation)[-20:]
    roll = float(np.median(planned.measured_tilt_roll[last, 2]))
    rate = 1 / float(np.median(np.diff(capture.time)))
    rows = [
        ("capture rate [Hz]", "300", f"{rate:.0f} (synthetic)"),
        ("roll at the end of A [rad]", "+3.35 (measured)", f"{planned.simulated_tilt_roll[-1, 2]:+.2f}"),
        ("roll at the end of A, synthetic capture [rad]", "", f"{roll:+.2f}"),
        ("synthetic, against plan: RMS of ZXZ angles [rad]", "0.24, 0.21, 0.14 (measured)", _listed(planned.zxz_rms)),
        ("synthetic, against its joints: RMS of ZXZ [rad]", "", _listed(own.zxz_rms)),
    ]
    result = {"rows": rows, "zxz_rms_plan_rad": planned.zxz_rms, "zxz_rms_joints_rad": own.zxz_rms}
    return result if quick else result | _calibrated(robot, capture, rows)


def _calibrated(robot: reojax.Robot, capture: reojax.Capture, rows: list[tuple[str, str, str]]) -> dict[str, Any]:
    fit = reojax.calibrate(robot, capture, ("end_inertia", "rotor_inertia"))
    after = reojax.compare(fit.robot, capture)
    rows.append(("the same after calibration [rad]", "", _listed(after.zxz_rms)))
    true = (synthetic_capture.END_INERTIA, synthetic_capture.ROTOR_INERTIA)
    for name, real, value, std in zip(fit.names, true, fit.values, fit.std, strict=True):
        found = f"{value * 1e6:.4g} +- {std * 1e6:.2g}, true {real * 1e6:.4g}"
        rows.append((f"calibrated {name} [kg mm^2]", "", found))
    return {
        "zxz_rms_calibrated_rad": after.zxz_rms,
        "found": fit.values,
        "std": fit.std,
        "converged": bool(fit.converged),
    }


def _listed(values: np.ndarray) -> str:
    return ", ".join(f"{x:.3f}" for x in values)

"""Section of the drop tower: do controlled joints lag, and is the end orientation right all the same?"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np

import reojax
from reojax import plot, robots
from reojax.captures.alignment import interpolate
from reojax.mechanics.attitude import tilt_and_roll, zxz_beside, zxz_without_jumps
from reojax.motion.pid import FEEDFORWARD_BANDWIDTH, PID_BANDWIDTH, Tracking, gains, track
from reojax.motion.release import released

FRICTION = 1e-4  # N m on the rotor; chosen, some 10 mA of no-load current
SETTLE = 0.2  # s after the planned end
SOFT = 40.0  # rad/s, chosen: joints that lag as much as one sees
DURATIONS = (0.12, 0.19, 0.12, 0.19)  # s, of the four edges: 0.62 s, 1.3 ms more than the fall leaves
CONTROLLERS = {"PID": (False, PID_BANDWIDTH), "PID + torques": (True, FEEDFORWARD_BANDWIDTH)}
CASES = {"soft PID": (False, SOFT)} | CONTROLLERS
WORTH = 1.02  # the least bandwidth whose error is within this factor of the best is taken


def motors() -> reojax.Motor:
    """The thesis's motors, with friction."""
    return reojax.RE_MAX_17._replace(friction=FRICTION)


def plans(durations: Sequence[float] = DURATIONS) -> dict[str, reojax.Trajectory]:
    """The two manoeuvres at 270/120."""
    paths = {"A": reojax.manoeuvre_a, "B": reojax.manoeuvre_b}
    return {
        name: reojax.along(path(np.deg2rad(270), np.deg2rad(120)), "quintic", np.asarray(durations))
        for name, path in paths.items()
    }


def tune(robot: reojax.Robot, bandwidths: np.ndarray, durations: Sequence[float]) -> dict[str, np.ndarray]:
    """RMS error of the joints over A and B for each bandwidth, by controller [rad]."""
    found = {}
    for name, (forward, _) in CONTROLLERS.items():
        squares = []
        for trajectory in plans(durations).values():

            def error(p: Any, trajectory: Any = trajectory, forward: bool = forward) -> Any:
                done = track(robot, trajectory, motors(), gains(robot, p), feedforward=forward, settle=SETTLE)
                return ((done.theta - done.planned) ** 2).mean()

            squares.append(jax.vmap(error)(bandwidths))
        found[name] = np.sqrt(np.mean(squares, axis=0))
    return found


def best(bandwidths: np.ndarray, lag: np.ndarray) -> float:
    """The least bandwidth that is about as good as the best."""
    return float(bandwidths[np.argmax(lag <= WORTH * lag.min())])


def zxz_rms(tracking: Tracking, planned: np.ndarray) -> np.ndarray:
    """RMS differences of the three ZXZ angles between the planned and the tracked motion [rad]."""
    reference = zxz_without_jumps(planned)
    return np.sqrt(((zxz_beside(np.asarray(tracking.rotation), reference) - reference) ** 2).mean(axis=0))


def section(out: Path, *, quick: bool, durations: Sequence[float] = DURATIONS) -> dict[str, Any]:
    """Track A and B, draw, and (not when quick) tune the controllers anew; the rows for the table and all numbers."""
    robot = robots.prototype()
    result: dict[str, Any] = {"durations_s": list(durations), "cases": [], "rows": []}
    for manoeuvre, trajectory in plans(durations).items():
        ideal = released(robot, trajectory, samples=64)
        for name, (forward, bandwidth) in CASES.items():
            done = track(robot, trajectory, motors(), gains(robot, bandwidth), feedforward=forward, settle=SETTLE)
            done = jax.tree.map(np.asarray, done)
            planned = interpolate(np.asarray(ideal.time), np.asarray(ideal.rotation))(done.time)
            rms = zxz_rms(done, planned)
            apart = tilt_and_roll(done.rotation) - tilt_and_roll(planned)
            last = done.rotation[-1].T @ planned[-1]
            error = np.abs(done.theta - done.planned)
            past = np.maximum(done.theta - robot.upper, robot.lower - done.theta).max()
            result["cases"].append(
                {
                    "manoeuvre": manoeuvre,
                    "controller": name,
                    "bandwidth_rad_s": bandwidth,
                    "zxz_rms_rad": rms,
                    "tilt_roll_rms_rad": np.sqrt((apart**2).mean(axis=0)),
                    "joint_rms_rad": np.sqrt((error**2).mean(axis=0)),
                    "largest_lag_rad": float(error.max()),
                    "beyond_limits_rad": max(0.0, float(past)),
                    "end_orientation_error_rad": float(np.arccos(np.clip((np.trace(last) - 1) / 2, -1, 1))),
                    "saturated_share": float(done.saturated.mean()),
                }
            )
            result["rows"] += _rows(result["cases"][-1])
            if manoeuvre == "A" and name == "soft PID":
                figure = plot.tracking_figure(
                    robot, done, planned, title="Manoeuvre A at 270°/120° under soft PID control"
                )
                plot.save(figure, out / "drop_tower_tracking.png")
    if not quick:
        result["tuning"] = _tuned(robot, out, durations)
    return result


def _tuned(robot: reojax.Robot, out: Path, durations: Sequence[float]) -> dict[str, Any]:
    """Tune both controllers anew, and draw how much the bandwidth matters."""
    grid = np.geomspace(25, 400, 13)
    lag = tune(robot, grid, durations)
    chosen = {name: bandwidth for name, (_, bandwidth) in CONTROLLERS.items()}
    plot.save(plot.bandwidth_figure(grid, lag, chosen), out / "drop_tower_tuning.png")
    tuned = {name: best(grid, values) for name, values in lag.items()}
    return {"bandwidth_rad_s": grid, "joint_rms_rad": lag, "best_rad_s": tuned}


def _rows(case: dict[str, Any]) -> list[tuple[str, str, str]]:
    """What, what the thesis says, what reojax gets."""
    where = f"{case['manoeuvre']}, {case['controller']}"
    measured = "0.24, 0.21, 0.14 (measured)" if case["manoeuvre"] == "A" else ""
    angles = ", ".join(f"{x:.2f}" for x in case["zxz_rms_rad"])
    return [
        (f"{where}: RMS of ZXZ angles [rad]", measured, angles),
        (f"{where}: largest lag of a joint [rad]", "joints lag", f"{case['largest_lag_rad']:.2f}"),
        (f"{where}: a joint goes beyond its limits by [rad]", "", f"{case['beyond_limits_rad']:.2f}"),
        (f"{where}: end orientation off by [rad]", "right", f"{case['end_orientation_error_rad']:.4f}"),
    ]

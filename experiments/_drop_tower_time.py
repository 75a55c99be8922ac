"""Section of the drop tower: how fast can the motors run A, and thesis figure 3.2."""

from pathlib import Path
from typing import Any

import numpy as np

import reojax
from reojax import RE_MAX_17, plot, robots, so3
from reojax.minimum_time import AVAILABLE, minimum_time

STEPS = (0.110, 0.100, 0.090, 0.080)  # s; thesis figure 3.2, first step of the centre joint
EFFICIENT = 1.1  # chosen: at most a tenth longer than the least time is efficient use


def section(out: Path, *, quick: bool) -> dict[str, Any]:
    """Figure 3.2 on the prototype and on a rotor with no load, and least times of A and of a half turn."""
    robot, rows, result = robots.prototype(), [], {}
    bend = reojax.polygon(np.array([[0, 0, 0], [0, 2 * np.pi / 3, 0]]))
    alone = reojax.make_robot(
        mass=[1.0, 1e-9], com=np.zeros((2, 3)), inertia=[np.eye(3), 1e-12 * np.eye(3)], axis=[(1, 0, 0)],
        anchor=[(0, 0, 0)], rotor_inertia=[1e-7], gear_ratio=[24.0], joint_names=["rotor alone"], name="rotor",
    )  # fmt: skip
    turn = reojax.polygon([[0.0], [2 * np.pi / 3]])
    for name, body, path, joint in (("prototype", robot, bend, 1), ("rotor alone", alone, turn, 0)):
        verdicts, least = _figure(out, name, body, path, joint)
        result[name] = {"least_s": least, "verdicts": dict(zip(map(str, STEPS), verdicts, strict=True))}
        said = "90 efficient, 80 over-used"
        rows.append((f"figure 3.2, {name}: least time of step 1 [ms]", "between 80 and 90", f"{1e3 * least:.1f}"))
        rows.append((f"figure 3.2, {name}: 110, 100, 90, 80 ms", said, ", ".join(verdicts)))
    path = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
    times = {
        f"A, rectangle, {law}": float(minimum_time(robot, path, RE_MAX_17, law).duration)
        for law in ("quintic", "trapezoid")
    }
    if not quick:
        kept = reojax.net_rotation(robot, path)
        half = so3.exp(np.array([0.0, 0.0, np.pi]))
        found = {
            "A, rectangle, free laws": reojax.free_law(robot, path, RE_MAX_17, progress="free laws"),
            "A, edges overlapped": reojax.overlap(robot, path, RE_MAX_17, progress="overlapped"),
            "A's rotation by a free path": reojax.fastest_loop(robot, kept, RE_MAX_17, path, progress="free path"),
            "half turn by a free path": reojax.fastest_loop(robot, half, RE_MAX_17, path, progress="half turn"),
        }
        for name, motion in found.items():
            times[name] = float(motion.duration)
            figures = {"error_rad": float(motion.error), "beyond_limits_rad": float(motion.beyond)}
            result[name] = figures | {"converged": bool(motion.converged)}
    for name, seconds in times.items():
        fits = "fits" if seconds <= AVAILABLE else "does not fit"
        rows.append((f"least time: {name} [ms]", f"{1e3 * AVAILABLE:.0f} in the fall", f"{1e3 * seconds:.0f}, {fits}"))
    return result | {"least_times_s": times, "rows": rows}


def _figure(out: Path, name: str, robot: reojax.Robot, path: reojax.Path, joint: int) -> tuple[list[str], float]:
    """Draw figure 3.2 for a robot; return the verdicts and the least time [s]."""
    least = float(minimum_time(robot, path, RE_MAX_17).duration)
    verdicts = [_verdict(seconds, least) for seconds in STEPS]
    runs = []
    for seconds, verdict in zip(STEPS, verdicts, strict=True):
        motion = reojax.simulate(robot, path, durations=seconds, motors=RE_MAX_17, samples=64)
        runs.append((f"{1e3 * seconds:.0f} ms: {verdict}", motion))
    title = f"Centre joint, 0 to 120°, quintic, 12 V: {name}"
    figure = plot.torque_speed_figure(RE_MAX_17, runs, joint_names=robot.joint_names, joints=[joint], title=title)
    plot.save(figure, out / f"drop_tower_figure_3_2_{name.replace(' ', '_')}.png")
    return verdicts, least


def _verdict(seconds: float, least: float) -> str:
    if seconds < least:
        return "over-used"
    return "efficient" if seconds <= EFFICIENT * least else "under-used"

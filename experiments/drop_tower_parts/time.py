"""Section of the drop tower: how fast can the motors run A, and thesis figure 3.2."""

from pathlib import Path
from typing import Any

import numpy as np

import reojax
from reojax import RE_MAX_17, plot, robots, so3
from reojax.motion.least_time import AVAILABLE, minimum_time

STEPS = (0.110, 0.100, 0.090, 0.080)  # s; thesis figure 3.2, first step of the centre joint
EFFICIENT = 1.1  # chosen: at most a tenth longer than the least time is efficient use


def section(out: Path, *, quick: bool) -> dict[str, Any]:
    """Figure 3.2 on the prototype and on a rotor with no load, and least times of A and of a half turn."""
    robot, rows, result = robots.prototype(), [], {}
    path = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
    for name, body in (("prototype", robot), ("rotor alone", loaded(0.0))):
        verdicts, least = _figure(out, name, body, path)
        result[name] = {"least_s": least, "verdicts": dict(zip(map(str, STEPS), verdicts, strict=True))}
        said = "90 efficient, 80 over-used"
        rows.append((f"figure 3.2, {name}: least time of step 1 [ms]", "between 80 and 90", f"{1e3 * least:.1f}"))
        rows.append((f"figure 3.2, {name}: 110, 100, 90, 80 ms", said, ", ".join(verdicts)))
    load = _load(robot, path)
    result["load"] = load
    felt = f"{1e6 * load['straight']:.0f}, {1e6 * load['bent']:.0f}"
    rows.append(("figure 3.2, prototype: inertia it moves, straight, bent [kg mm^2]", "", felt))
    rows.append(("figure 3.2: inertia that it may move in 90 ms [kg mm^2]", "", f"{1e6 * load['for_90_ms']:.1f}"))
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


def loaded(inertia: float) -> reojax.Robot:
    """A robot whose centre joint moves that inertia and its rotor, against links too heavy to give way."""
    heavy, nothing = np.eye(3), 1e-12 * np.eye(3)
    return robots.prototype().replace(
        mass=np.array([1.0, 1.0, 1e-9, 1e-9]),
        com=np.zeros((4, 3)),
        anchor=np.zeros((3, 3)),
        inertia=np.stack([heavy, heavy, nothing + inertia * np.eye(3), nothing]),
    )


def first_step(robot: reojax.Robot, path: reojax.Path) -> float:
    """Least time of the centre joint's first step by a quintic [s]."""
    return float(minimum_time(robot, path, RE_MAX_17).durations[0])


def _load(robot: reojax.Robot, path: reojax.Path) -> dict[str, float]:
    """Inertia that the centre joint moves, its own rotor left out, and the one for which the step takes 90 ms."""
    from scipy.optimize import brentq

    own = float(robot.rotor_inertia[1] * robot.gear_ratio[1] ** 2)
    felt = [float(reojax.joint_inertia(robot, shape)[1, 1]) - own for shape in path.waypoints[:2]]
    most, _ = brentq(lambda inertia: first_step(loaded(inertia), path) - STEPS[2], 0.0, 1e-4, full_output=True)
    return {"straight": felt[0], "bent": felt[1], "for_90_ms": float(most)}


def _figure(out: Path, name: str, robot: reojax.Robot, path: reojax.Path) -> tuple[list[str], float]:
    """Draw figure 3.2 for a robot; return the verdicts and the least time [s]."""
    least = first_step(robot, path)
    verdicts = [_verdict(seconds, least) for seconds in STEPS]
    runs = []
    for seconds, verdict in zip(STEPS, verdicts, strict=True):
        step = reojax.polygon(path.waypoints[:2])
        motion = reojax.simulate(robot, step, durations=seconds, motors=RE_MAX_17, samples=64)
        runs.append((f"{1e3 * seconds:.0f} ms: {verdict}", motion))
    title = f"Centre joint, 0 to 120°, quintic, 12 V: {name}"
    figure = plot.torque_speed_figure(RE_MAX_17, runs, joint_names=robot.joint_names, joints=[1], title=title)
    plot.save(figure, out / f"drop_tower_figure_3_2_{name.replace(' ', '_')}.png")
    return verdicts, least


def _verdict(seconds: float, least: float) -> str:
    if seconds < least:
        return "over-used"
    return "efficient" if seconds <= EFFICIENT * least else "under-used"

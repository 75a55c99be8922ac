"""How well does feedback within the motion take back what an imperfect release does, in the same fall?

    python experiments/steering.py            # 5 minutes of processor time; goes on where it was stopped
    python experiments/steering.py --quick    # 16 releases, the first of the cases

Manoeuvre A at 270/120 on the prototype in 0.62 s. The release leaves an angular momentum of 0.05 rad/s about each axis
(one standard deviation, as `drop_tower.py` has it) and wires that drag. The orientation is read at 500 Hz with 1 degree
of noise about each axis, 10 ms late; joints follow through a servo of 2 ms and encoders of 512 counts. Joint limits are
one radian wider than the manoeuvre's amplitudes. "Everything wrong": inertias off by 10 % too, a tenth of the readings
dropped. "Slow": joints turn no faster than the motors do at 12 V without load, of which the manoeuvre alone asks 98 %.
Three ways: the motion as planned; the gains' law of the controller alone (`reojax.steering.onboard`); and `Steering`,
which estimates the links' inertias too where everything is wrong.

Expected: open loop ends 4 degrees off in the median, `Steering` 0.2 (0.4 at the 95th percentile), with all that is
wrong 0.5 (2.3; 4 with slow joints).
"""

import time
from pathlib import Path
from typing import Any

import jax
import numpy as np
from common.script import options, run
from steering_parts.flight import Sensors, Wrong, fly, many
from steering_parts.gains_law import GainsLaw

import reojax
from reojax import robots, so3
from reojax.files import check_writable, write_json
from reojax.motion.motor import no_load_speed
from reojax.steering.law import SteeringLaw

DURATIONS = np.array([0.12, 0.19, 0.12, 0.19])
SPIN, DRAG = 0.05, 2e-7  # rad/s about each axis, N m s/rad: one standard deviation
INERTIA = 0.1
CHUNK = 100


def main(out: Path, *, quick: bool = False) -> dict:
    """Run, print the table, write `steering.json` to `out`, and return the numbers."""
    file = check_writable(out / "steering.json")
    releases = 16 if quick else 1000
    robot = robots.prototype()
    plan = reojax.along(reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120)), "quintic", DURATIONS)
    goal = np.asarray(reojax.simulate(robot, plan).rotation[-1])
    spread = SPIN * np.diag(np.asarray(reojax.momentum_matrices(robot, np.zeros(3)).A))
    rng = np.random.default_rng(0)
    momentum, drag = rng.normal(size=(releases, 3)) * spread, np.abs(rng.normal(size=releases)) * DRAG
    inertia = INERTIA * rng.normal(size=(releases, robot.links))
    ways = _laws(robot, plan, spread, quick)
    sensors = Sensors(np.deg2rad(1), 5, 1, 0.0, 2 * np.pi / 512 / 24, 2e-3)
    slow = sensors._replace(speed=float(no_load_speed(reojax.RE_MAX_17)) / reojax.RE_MAX_17.gear_ratio)
    programs = {
        (law, seen.speed): _program(robot, plan, law, seen) for law in ways.values() for seen in (sensors, slow)
    }
    rows = []
    print("end error [deg]: median, 95th percentile, largest; largest change of a joint [deg]")
    every = ("open loop", "gains", "Steering")
    cases = (
        ("release", 0.0, 0.0, np.inf, every),
        ("release, slow", 0.0, 0.0, slow.speed, every[2:]),
        ("everything wrong", 1.0, 0.1, np.inf, every),
        ("all wrong, slow", 1.0, 0.1, slow.speed, every[2:]),
    )
    for case, scale, dropped, fastest, tried in cases[:1] if quick else cases:
        wrong = Wrong(momentum, drag, scale * inertia)
        for way in tried:
            law = ways["Steering, inertias too" if scale and way == "Steering" else way]
            seen = np.asarray(float(way != "open loop")), np.asarray(dropped)
            end, change, estimate = _flights(out / "steering_parts", (case, way), programs[law, fastest], seen, wrong)
            error = np.rad2deg(np.asarray(jax.vmap(lambda r: so3.angle(goal.T @ r))(end)))
            row = {"case": case, "way": way, "median_deg": float(np.median(error))}
            row |= {"percentile_95_deg": float(np.quantile(error, 0.95)), "largest_deg": float(error.max())}
            row["largest_change_deg"] = float(np.rad2deg(change.max())) if way != "open loop" else 0.0
            if way == "Steering":
                off = (estimate[0] - momentum) / spread
                row["momentum_off_in_deviations"] = float(np.sqrt((off**2).mean()))
                if scale:
                    row["inertia_off"] = float(np.sqrt(((estimate[2] - np.exp(inertia)) ** 2).mean()))
            rows.append(row)
            print(
                f"{case:17} {way:10} {row['median_deg']:6.2f} {row['percentile_95_deg']:6.2f} "
                f"{row['largest_deg']:6.2f} {row['largest_change_deg']:7.1f}",
                flush=True,
            )
    speed = {} if quick else _speed(ways["Steering"], robot)
    if speed:
        print("processor time [ms]: " + ", ".join(f"{name} {1e3 * value:.2f}" for name, value in speed.items()))
    result = {"releases": releases, "rows": rows, "processor_s": speed}
    write_json(file, result)
    return result


def _laws(robot: reojax.Robot, plan: reojax.Trajectory, spread: np.ndarray, quick: bool) -> dict[str, Any]:
    free = robot.replace(lower=robot.lower - 1, upper=robot.upper + 1)
    known = {"momentum_std": spread, "drag_std": DRAG, "noise": np.deg2rad(1), "largest": 1.0}
    scales = [f"inertia_scale[{link}]" for link in range(robot.links)]
    simple = GainsLaw(free, plan, settle=0.1, left=1.0)
    ways: dict[str, Any] = {
        "open loop": simple,
        "gains": simple,
        "Steering": reojax.Steering(free, plan, **known),
    }
    if not quick:
        ways["Steering, inertias too"] = reojax.Steering(
            free, plan, **known, parameters=scales, parameters_std=[INERTIA] * robot.links
        )
    return ways


def _program(robot: reojax.Robot, plan: reojax.Trajectory, law: Any, sensors: Sensors) -> Any:
    """Many falls under one law, compiled once: whether it steers and what share of readings is dropped are asked."""
    key = jax.random.key(0)

    def one(number, wrong, steered, dropped):
        seen = sensors._replace(dropped=dropped)
        return fly(robot, plan, law, seen, jax.random.fold_in(key, number), wrong, steered)

    return jax.jit(jax.vmap(one, (0, 0, None, None)))


def _flights(folder: Path, names: tuple[str, str], program: Any, seen: tuple, wrong: Wrong) -> Any:
    """All falls of one row, in pieces that are kept: a run that was stopped goes on."""
    numbers = np.arange(len(wrong.drag))

    def piece(first: int) -> Any:
        take = slice(first, first + CHUNK)
        draws = numbers[take], jax.tree.map(lambda x: x[take], wrong)
        return many(lambda k, w: program(k, w, *seen), draws, chunk=CHUNK)

    folder.mkdir(parents=True, exist_ok=True)
    parts = []
    for first in range(0, len(numbers), CHUNK):
        size = len(numbers[first : first + CHUNK])
        file = folder / f"{names[0]}-{names[1]}-{first}-{size}.npz".replace(" ", "_")
        if not file.exists():
            end, change, (momentum, drag, values) = piece(first)
            np.savez(file, end=end, change=change, momentum=momentum, drag=drag, values=values)
        with np.load(file) as kept:
            parts.append((kept["end"], kept["change"], (kept["momentum"], kept["drag"], kept["values"])))
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)


def _speed(law: SteeringLaw, robot: reojax.Robot) -> dict[str, float]:
    """Processor time of one update, and of the gains of a four-edge path, warm."""
    state, path = law.start(), reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
    reading = reojax.Reading(2e-3, np.zeros(robot.joints), np.eye(3), 1e-3)
    found = {}
    for name, call in (
        ("step", lambda: law.step(state, reading)),
        ("update", lambda: law.update(state, reading)),
        ("gains", lambda: reojax.correction_gains(robot, path)),
    ):
        jax.block_until_ready(call())
        begin = time.process_time()
        for _ in range(100):
            jax.block_until_ready(call())
        found[name] = (time.process_time() - begin) / 100
    return found


if __name__ == "__main__":
    run(main, options(__doc__))

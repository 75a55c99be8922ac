"""How well does feedback within the motion take back what an imperfect release does, in the same fall?

    python experiments/steering.py            # some minutes
    python experiments/steering.py --quick    # fewer releases

Manoeuvre A at 270/120 on the prototype in 0.62 s. The release leaves an angular momentum of 0.05 rad/s about each axis
(one standard deviation, as `drop_tower.py` has it) and wires that drag. The orientation is read at 500 Hz with 1 degree
of noise about each axis, 10 ms late; joints follow through a servo of 2 ms and encoders of 512 counts. Joint limits are
one radian wider than the manoeuvre's amplitudes. "Everything wrong": inertias off by 10 % too, a tenth of the readings
dropped.
"""

import time
from pathlib import Path

import jax
import numpy as np
from common.script import options, run
from steering_parts.flight import Sensors, Wrong, fly, many

import reojax
from reojax import robots, so3
from reojax.files import check_writable, write_json

DURATIONS = np.array([0.12, 0.19, 0.12, 0.19])
SPIN, DRAG = 0.05, 2e-7  # rad/s about each axis, N m s/rad: one standard deviation
INERTIA = 0.1


def main(out: Path, *, quick: bool = False) -> dict:
    """Run, print the table, write `steering.json` to `out`, and return the numbers."""
    file = check_writable(out / "steering.json")
    releases = 16 if quick else 1000
    robot = robots.prototype()
    plan = reojax.along(reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120)), "quintic", DURATIONS)
    spread = SPIN * np.diag(np.asarray(reojax.momentum_matrices(robot, np.zeros(3)).A))
    free = robot.replace(lower=robot.lower - 1, upper=robot.upper + 1)
    law = reojax.Steering(free, plan, momentum_std=spread, drag_std=DRAG, noise=np.deg2rad(1))
    goal = np.asarray(reojax.simulate(robot, plan).rotation[-1])
    rng = np.random.default_rng(0)
    momentum, drag = rng.normal(size=(releases, 3)) * spread, np.abs(rng.normal(size=releases)) * DRAG
    inertia = INERTIA * rng.normal(size=(releases, robot.links))
    numbers, key = np.arange(releases), jax.random.key(0)
    sensors = Sensors(np.deg2rad(1), 5, 1, 0.0, 2 * np.pi / 512 / 24, 2e-3)
    rows = []
    print("end error [deg]: median, 95th percentile, largest; largest change of a joint [deg]")
    for case, scale, seen in (("release", 0.0, sensors), ("everything wrong", 1.0, sensors._replace(dropped=0.1))):
        flights = jax.jit(
            jax.vmap(
                lambda steered, k, w, seen=seen: fly(robot, plan, law, seen, jax.random.fold_in(key, k), w, steered),
                (None, 0, 0),
            )
        )
        wrong = Wrong(momentum, drag, scale * inertia)
        for name, steered in (("open loop", 0.0), ("Steering", 1.0)):
            end, change, estimate = many(lambda k, w, s=steered, f=flights: f(s, k, w), (numbers, wrong))
            error = np.rad2deg(np.asarray(jax.vmap(lambda r: so3.angle(goal.T @ r))(end)))
            row = {"case": case, "way": name, "median_deg": float(np.median(error))}
            row |= {"percentile_95_deg": float(np.quantile(error, 0.95)), "largest_deg": float(error.max())}
            row["largest_change_deg"] = float(np.rad2deg(change.max())) if steered else 0.0
            off = (estimate[0] - momentum) / spread
            row["momentum_off_in_deviations"] = float(np.sqrt((off**2).mean()))
            rows.append(row)
            print(
                f"{case:17} {name:10} {row['median_deg']:6.2f} {row['percentile_95_deg']:6.2f} "
                f"{row['largest_deg']:6.2f} {row['largest_change_deg']:7.1f}",
                flush=True,
            )
    speed = _speed(law, robot)
    print(
        f"one update: {1e3 * speed['update_s']:.2f} ms of processor time; gains of A: {1e3 * speed['gains_s']:.2f} ms"
    )
    result = {"releases": releases, "rows": rows, **speed}
    write_json(file, result)
    return result


def _speed(law, robot: reojax.Robot) -> dict[str, float]:
    """Processor time of one update, and of the gains of a four-edge path, warm."""
    state, path = law.start(), reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
    reading = reojax.Reading(2e-3, np.zeros(robot.joints), np.eye(3), 1e-3)
    found = {}
    for name, call in (
        ("update_s", lambda: law.step(state, reading)),
        ("gains_s", lambda: reojax.correction_gains(robot, path)),
    ):
        jax.block_until_ready(call())
        begin = time.process_time()
        for _ in range(100):
            jax.block_until_ready(call())
        found[name] = (time.process_time() - begin) / 100
    return found


if __name__ == "__main__":
    run(main, options(__doc__))

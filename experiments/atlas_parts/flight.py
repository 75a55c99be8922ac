"""Question 5: how well would a real robot do it, in open loop and with `Steering`?

The turn of question 1 that goes farthest in one run, by quintic edges a quarter slower than the motors allow. Wrong are
the inertia of every link (5 %), the angular momentum at release (0.05 rad/s of the resting robot about each axis), and
the readings of the orientation: 1 degree of noise about each axis, 500 Hz, 10 ms late. Joints follow through a servo of
2 ms and encoders. Joint limits are the robot's own. Motions of more than `LONGEST` are left out.
"""

from collections.abc import Callable
from pathlib import Path

import jax
import numpy as np
from common.markdown import table
from steering_parts.flight import Sensors, Wrong, fly, many

import reojax
from atlas_parts.store import Row, Store
from atlas_parts.subjects import Subject
from atlas_parts.turns import answers
from reojax import design, so3

INERTIA, SPIN, RELEASES = 0.05, 0.05, 64
LONGEST = 4.0
"""Longest motion that is flown [s]."""
SLOWER = 1.25
SENSORS = Sensors(np.deg2rad(1), 5, 1, 0.0, 2 * np.pi / 512 / 24, 2e-3)


def jobs(subjects: list[Subject], store: Store, quick: bool) -> list[tuple[str, Callable[[], Row]]]:
    """A row for each robot whose turn is short enough."""
    turned = {} if quick else answers(store.under("turns"))
    return [
        (s.name, lambda s=s, name=name: flight(s, name, turned[s.name]["turns"][name], RELEASES))
        for s in subjects
        if s.name in turned and (name := _turn(turned[s.name]))
    ]


def _turn(row: Row) -> str | None:
    """The turn that goes farthest in one run, of those that are short enough."""
    able = {
        name: float(name.split()[1]) / turn["runs"]
        for name, turn in row["turns"].items()
        if turn["reached"] and SLOWER * turn["time_s"] / turn["runs"] <= LONGEST
    }
    return max(able, key=lambda name: able[name]) if row["rank"] == 3 and able else None


def flight(subject: Subject, name: str, turn: Row, releases: int) -> Row:
    """End errors of so many releases."""
    robot, path = subject.robot, reojax.polygon(np.array(turn["waypoints"]))
    moves = np.abs(np.diff(path.waypoints, axis=0)).max(1) > 1e-9
    path = reojax.polygon(np.concatenate([path.waypoints[:1], np.asarray(path.waypoints[1:])[moves]]))
    durations = SLOWER * np.asarray(reojax.minimum_time(robot, path, subject.motors, "quintic").durations)
    plan = reojax.along(path, "quintic", durations)
    inertia = np.asarray(reojax.momentum_matrices(robot, subject.start).A)
    spread = SPIN * np.diag(inertia)
    law = reojax.Steering(robot, plan, momentum_std=spread, noise=SENSORS.noise)
    goal = np.asarray(reojax.net_rotation(robot, path, steps=16))
    rng = np.random.default_rng(0)
    momentum = rng.normal(size=(releases, 3)) * spread
    scale = INERTIA * rng.normal(size=(releases, robot.links))
    wrong = Wrong(momentum, np.zeros(releases), scale)
    key, numbers = jax.random.key(0), np.arange(releases)
    flights = jax.jit(
        jax.vmap(lambda way, k, w: fly(robot, plan, law, SENSORS, jax.random.fold_in(key, k), w, way), (None, 0, 0))
    )
    row: Row = {
        "turn": name,
        "runs": turn["runs"],
        "duration_s": float(durations.sum()),
        "releases": releases,
        "inertias_alone_deg": np.rad2deg(
            design.spread(robot, path, {"inertia": INERTIA}, draws=2, steps=16).deviation
        ).tolist(),
    }
    for way, steered in (("open loop", 0.0), ("Steering", 1.0)):
        end, change, _ = many(lambda k, w, s=steered: flights(s, k, w), (numbers, wrong))
        error = np.rad2deg([np.asarray(so3.angle(goal.T @ rotation)) for rotation in end])
        row[way] = {"median_deg": float(np.median(error)), "percentile_95_deg": float(np.quantile(error, 0.95)),
                    "largest_change_deg": float(np.rad2deg(change.max())) if steered else 0.0}  # fmt: skip
    return row


def show(rows: dict[str, Row], out: Path) -> None:
    """Print the table."""
    columns = ["robot", "turn", "s", "5 % of inertia alone, rms [deg]", "open loop [deg]", "Steering [deg]",
               "largest change of a joint [deg]"]  # fmt: skip
    print(f"\nend errors, median / 95th percentile of {max((r['releases'] for r in rows.values()), default=0)}\n")
    print(table(columns, [
        [name, row["turn"] + (f", one of {row['runs']} runs" if row["runs"] > 1 else ""), f"{row['duration_s']:.2f}",
         f"{np.linalg.norm(row['inertias_alone_deg']):.2f}",
         *(f"{row[way]['median_deg']:.2f} / {row[way]['percentile_95_deg']:.2f}" for way in ("open loop", "Steering")),
         f"{row['Steering']['largest_change_deg']:.0f}"]
        for name, row in rows.items()
    ]))  # fmt: skip

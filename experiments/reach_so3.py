"""Can the robot take any orientation, with how many manoeuvres, and how fast is a plan found?

    python experiments/reach_so3.py            # some minutes on 2 cores
    python experiments/reach_so3.py --quick    # fewer targets, of the prototype alone

Uniformly random targets (Haar), twist within 270 degrees and bend within 120: the prototype, the prototype with
unequal end links and with a centre of mass out of the bending plane, and the six-body robot. Every plan is replayed
by another integrator on momenta summed link by link, a few by Pinocchio and SciPy. Then the prototype with twist and
bend within 20 degrees, and up to 2000 loops: quarter turns about roll, pitch and yaw, and random targets.
Expected: practically every target reached to 1e-8 rad, with at most 5 manoeuvres of A and B, or hundreds of small
loops (docs/planning.md has a run's figures).
"""

import time
from collections.abc import Sequence
from functools import partial
from itertools import groupby
from pathlib import Path

import numpy as np
from common.replay import apart, pinocchio, replay
from common.script import options, run
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots
from reojax.files import check_writable, write_json

LIMITS = {"twist_limit": np.deg2rad(270), "bend_limit": np.deg2rad(120), "max_manoeuvres": 5}
SMALL = {"twist_limit": np.deg2rad(20), "bend_limit": np.deg2rad(20), "max_manoeuvres": 2000}
ENOUGH = 1e-8
"""Error [rad] that counts as reached when replayed."""


def unequal_ends() -> reojax.Robot:
    """The prototype with its last link 1.3 times as heavy, inertia included."""
    robot = robots.prototype()
    mass, inertia = np.array(robot.mass), np.array(robot.inertia)
    mass[-1] *= 1.3
    inertia[-1] *= 1.3
    return robot.replace(mass=mass, inertia=inertia)


def out_of_plane() -> reojax.Robot:
    """The prototype with the centre of mass of its first link moved by (6, -3, 2) mm."""
    robot = robots.prototype()
    com = np.array(robot.com)
    com[0] += [6e-3, -3e-3, 2e-3]
    return robot.replace(com=com)


def reach(name: str, robot: reojax.Robot, count: int, seed: int, checked: int) -> dict:
    """Plan for random targets and replay; everything measured, as plain numbers."""
    targets = Rotation.from_quat(np.random.default_rng(seed).normal(size=(count, 4))).as_matrix()
    find = partial(reojax.plan_many, robot, **LIMITS)
    find(targets[: min(count, 512)])  # compile, and tabulate the robot's loops
    start = time.perf_counter()
    plan = find(targets, progress=True)
    seconds = time.perf_counter() - start
    error = apart(replay(robot, plan.waypoints, progress="replay"), targets)
    other = []
    for m in range(checked):
        try:
            other.append(apart(pinocchio(robot, plan.waypoints[m])[None], targets[m : m + 1])[0])
        except ImportError:  # the extra `oracle` is not installed
            break
    return {
        "robot": name,
        "targets": count,
        "reached": int(plan.converged.sum()),
        "replayed_within": int((error <= ENOUGH).sum()),
        "largest_error_rad": float(plan.error.max()),
        "largest_replayed_error_rad": float(error.max()),
        "largest_error_by_pinocchio_rad": float(max(other)) if other else None,
        "replayed_by_pinocchio": len(other),
        "manoeuvres": np.bincount(plan.manoeuvres, minlength=LIMITS["max_manoeuvres"] + 1).tolist(),
        "travel_deg_by_manoeuvres": [
            float(np.rad2deg(np.median(plan.travel[plan.manoeuvres == k]))) if (plan.manoeuvres == k).any() else None
            for k in range(LIMITS["max_manoeuvres"] + 1)
        ],
        "travel_deg": np.rad2deg(np.quantile(plan.travel, [0.05, 0.5, 0.95, 1.0])).tolist(),
        "targets_per_second": count / seconds,
    }


def small_loops(count: int) -> dict:
    """Quarter turns about each axis and `count` random targets within small limits; everything measured."""
    robot = robots.prototype()
    quarters = dict(zip(("pitch", "yaw", "roll"), np.eye(3) * np.pi / 2, strict=True))
    random = Rotation.from_quat(np.random.default_rng(0).normal(size=(count, 4))).as_rotvec()
    targets = Rotation.from_rotvec([*quarters.values(), *random]).as_matrix()
    find = partial(reojax.plan_many, robot, **SMALL)
    find(targets)  # compile, and tabulate the robot's loops
    start = time.perf_counter()
    plan = find(targets)
    seconds = time.perf_counter() - start
    error = apart(replay(robot, plan.waypoints), targets)
    names = [*(f"quarter turn, {name}" for name in quarters), *(f"random {m + 1}" for m in range(count))]
    rows = [
        {
            "target": name,
            "loops": int(plan.manoeuvres[m]),
            "word": _grouped(plan.word[m]),
            "travel_deg": float(np.rad2deg(plan.travel[m])),
            "error_rad": float(plan.error[m]),
            "replayed_error_rad": float(error[m]),
        }
        for m, name in enumerate(names)
    ]
    return {"targets": rows, "seconds": seconds, "reached": int((plan.converged & (error <= ENOUGH)).sum())}


def _grouped(word: Sequence[str]) -> str:
    """The word with equal neighbours counted: A^30 B^12."""
    runs = groupby(name for name in word if name)
    return " ".join(f"{name}^{len(list(run))}" for name, run in runs)


def main(out: Path, *, quick: bool = False) -> dict:
    """Plan, replay, print the table, write `reach_so3.json` and `reach_so3.png` to `out`, and return the numbers."""
    table, picture = check_writable(out / "reach_so3.json"), check_writable(out / "reach_so3.png")
    sizes = (48, 0, 0, 0) if quick else (10_000, 1_000, 1_000, 1_000)
    checked = 1 if quick else 5
    makers = {
        "prototype": robots.prototype,
        "unequal ends": unequal_ends,
        "centre of mass out of plane": out_of_plane,
        "six_body": robots.six_body,
    }
    rows = []
    for seed, ((name, make), size) in enumerate(zip(makers.items(), sizes, strict=True)):
        if size:
            rows.append(reach(name, make(), size, seed, checked))
            write_json(table, {"rows": rows})
    print(f"{'robot':30}{'targets':>8}{'reached':>8}{'replayed to':>12}{'Pinocchio':>11}  manoeuvres 1 2 3 4 5  "
          f"{'travel median, most':>20}{'per second':>12}")  # fmt: skip
    for row in rows:
        by = row["largest_error_by_pinocchio_rad"]
        counts = " ".join(map(str, row["manoeuvres"][1:]))
        print(
            f"{row['robot']:30}{row['targets']:8}{row['reached']:8}{row['largest_replayed_error_rad']:12.1e}"
            f"{'-' if by is None else f'{by:.1e}':>11}  {counts:21}"
            f"{row['travel_deg'][1]:9.0f}, {row['travel_deg'][3]:.0f} deg{row['targets_per_second']:12.0f}"
        )
    small = small_loops(1 if quick else 20)
    print(f"\ntwist and bend within 20 degrees, up to {SMALL['max_manoeuvres']} loops: {small['reached']} of "
          f"{len(small['targets'])} reached, in {small['seconds']:.1f} s")  # fmt: skip
    print(f"{'target':22}{'loops':>6}{'travel [deg]':>14}{'error':>9}{'replayed to':>13}  word")
    for row in small["targets"]:
        print(f"{row['target']:22}{row['loops']:6}{row['travel_deg']:14.0f}{row['error_rad']:9.1e}"
              f"{row['replayed_error_rad']:13.1e}  {row['word']}")  # fmt: skip
    whole = all(map(_whole, rows)) and small["reached"] == len(small["targets"])
    answer = {"rows": rows, "small_loops": small, "converged": whole}
    write_json(table, answer)
    draw(rows).savefig(picture, dpi=130)
    return answer


def _whole(row: dict) -> bool:
    return row["reached"] == row["targets"] and row["replayed_within"] == row["targets"]


def draw(rows: list[dict]) -> Figure:
    """How many manoeuvres, and how far the joints move."""
    figure = Figure(figsize=(9.5, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    colours = ("#0072b2", "#e69f00", "#56b4e9", "#7f3c8d")
    width = 0.8 / len(rows)
    for k, row in enumerate(rows):
        counts = np.arange(1, len(row["manoeuvres"]))
        place = counts + (k - (len(rows) - 1) / 2) * width
        share = 100 * np.array(row["manoeuvres"][1:]) / row["targets"]
        label = f"{row['robot']} ({row['targets']})"
        left.bar(place, share, width, color=colours[k], label=label)
        low, middle, high = row["travel_deg"][:3]
        right.errorbar([k], [middle], [[middle - low], [high - middle]], fmt="o", color=colours[k], capsize=5)
    left.set(xlabel="manoeuvres needed", ylabel="random targets [%]", title="How many manoeuvres")
    left.margins(y=0.4)  # room for the legend
    left.legend(fontsize=8, frameon=False, loc="upper left")
    right.set_xticks(range(len(rows)), [row["robot"].replace(" out of", "\nout of") for row in rows], fontsize=8)
    right.set(ylabel="joint travel [deg]", title="Joint travel: median, 5 % to 95 %", ylim=(0, None))
    right.margins(x=0.2)
    return figure


if __name__ == "__main__":
    run(main, options(__doc__))

"""Which orientations does `plan` reach on robots that are hard to turn?

    python experiments/hard_robots.py            # 5 minutes on 2 cores
    python experiments/hard_robots.py --quick    # two robots, 4 targets each

Eight random variants of the prototype: axes tilted by up to 10 degrees; masses, inertias and lengths unequal by up to 9
times; rotors on either side. Uniformly random targets (Haar): 60 each within 270/120 degrees and up to 6 manoeuvres, 6
each within 60/40 degrees and up to 200 loops. The plans that reach their targets are replayed by another integrator.
Expected: replayed within 1e-8 rad (docs/planning.md has a run's figures).
"""

import time
from pathlib import Path
from typing import Any

import numpy as np
from common.replay import apart, replay
from common.script import options, run
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots
from reojax.files import check_writable, write_json

WIDE = {"twist_limit": np.deg2rad(270), "bend_limit": np.deg2rad(120), "max_manoeuvres": 6}
NARROW = {"twist_limit": np.deg2rad(60), "bend_limit": np.deg2rad(40), "max_manoeuvres": 200}


def hard_robot(seed: int) -> reojax.Robot:
    """The prototype with numbers and axes changed at random, without joint limits."""
    rng, start = np.random.default_rng([23, seed]), robots.prototype()

    def uneven(count: int) -> np.ndarray:
        return 3.0 ** rng.uniform(-1, 1, count)

    size, direction = rng.uniform(0, 1, (3, 1)), rng.normal(size=(3, 3))
    tilt = Rotation.from_rotvec(np.deg2rad(10) * size * direction / np.linalg.norm(direction, axis=1, keepdims=True))
    length = uneven(4)
    return start.replace(
        mass=start.mass * uneven(4),
        inertia=start.inertia * uneven(4)[:, None, None],
        com=start.com * length[:, None],
        anchor=start.anchor * length[:3, None],
        axis=np.einsum("kab,kb->ka", tilt.as_matrix(), start.axis),
        rotor_on=tuple(str(side) for side in rng.choice(["parent", "child"], 3)),
        lower=np.full(3, -np.inf),
        upper=np.full(3, np.inf),
        name=f"hard {seed}",
    )


def row(robot: reojax.Robot, targets: np.ndarray, limits: dict[str, Any]) -> dict[str, Any]:
    """Plans for all targets: how many are reached, with how many loops, and how far off the others end."""
    begun = time.process_time()
    found = reojax.plan_many(robot, targets, **limits)
    seconds = time.process_time() - begun
    replayed = apart(replay(robot, found.waypoints[found.converged]), targets[found.converged])
    return {
        "robot": robot.name,
        "targets": len(targets),
        "reached": int(found.converged.sum()),
        "loops": [int(n) for n in found.manoeuvres],
        "left_rad": [float(e) for e in found.error[~found.converged]],
        "replayed_rad": float(replayed.max(initial=0.0)),
        "cpu_s": seconds,
    }


def main(out: Path, *, quick: bool = False) -> dict:
    """Plan, print the tables, write `hard_robots.json` to `out`, and return the numbers."""
    table = check_writable(out / "hard_robots.json")
    answer: dict[str, Any] = {"wide": [], "narrow": []}
    for seed in range(2 if quick else 8):
        robot = hard_robot(seed)
        for name, limits, count in (("wide", WIDE, 4 if quick else 60), ("narrow", NARROW, 6)):
            if quick and name == "narrow":
                continue
            targets = Rotation.from_quat(np.random.default_rng([7, seed]).normal(size=(count, 4))).as_matrix()
            found = row(robot, targets, limits)
            answer[name].append(found)
            left = ", ".join(f"{e:.3g}" for e in sorted(found["left_rad"]))
            print(
                f"{robot.name} {name}: {found['reached']} of {count} reached, up to {max(found['loops'])} loops, "
                f"{found['cpu_s']:.1f} s; left [rad]: {left or 'nothing'}",
                flush=True,
            )
            write_json(table, answer)
    answer["converged"] = all(found["replayed_rad"] < 1e-8 for found in answer["wide"] + answer["narrow"])
    write_json(table, answer)
    return answer


if __name__ == "__main__":
    run(main, options(__doc__))

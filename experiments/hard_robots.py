"""Which orientations does `plan` reach on robots that are hard to turn?

    python experiments/hard_robots.py                # 5 minutes on 2 cores
    python experiments/hard_robots.py --part others  # four robots that nothing was tuned on
    python experiments/hard_robots.py --quick        # two robots, 4 targets each

Eight random variants of the prototype: axes tilted by up to 10 degrees; masses, inertias and lengths unequal by up to 9
times; rotors on either side. Uniformly random targets (Haar): 60 each within 270/120 degrees and up to 6 manoeuvres, 6
each within 60/40 degrees and up to 200 loops. `others` are four more, with 30 such targets and 30 that are known to be
within reach, as random words of one to six manoeuvres end there; whatever is missed is looked for by a crude search of
its own, 4000 random words of six of which the best are polished by SciPy. The plans that reach their targets are
replayed by another integrator. Expected: replayed within 1e-8 rad (docs/planning.md has a run's figures).
"""

import time
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from common.replay import apart, replay
from common.script import options, run
from scipy.optimize import least_squares
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


def words(robot: reojax.Robot, count: int, seed: int) -> np.ndarray:
    """Rotations (count, 3, 3) after random words of one to six manoeuvres within the wide limits."""
    rng = np.random.default_rng([11, seed])
    found = []
    for number in rng.integers(1, 7, count):
        turned = np.eye(3)
        for _ in range(number):
            make = reojax.manoeuvre_a if rng.random() < 0.5 else reojax.manoeuvre_b
            twist, bend = rng.uniform(-1, 1, 2) * [WIDE["twist_limit"], WIDE["bend_limit"]]
            turned = turned @ np.asarray(reojax.net_rotation(robot, make(twist, bend)))
        found.append(turned)
    return np.stack(found)


def crude(robot: reojax.Robot, targets: np.ndarray, seed: int) -> list[float]:
    """Least angle to each target [rad] of random words of six manoeuvres, the 12 nearest of them polished."""
    limits = np.tile([WIDE["twist_limit"], WIDE["bend_limit"]], 6)

    def end(x: jax.Array, last: jax.Array) -> jax.Array:
        return word_rotation(robot, x, last)

    many, slope = jax.jit(jax.vmap(end)), jax.jit(jax.jacfwd(end))
    one = jax.jit(end)
    rng, answer = np.random.default_rng([13, seed]), []
    x = np.where(rng.random((4000, 12)) < 0.5, np.sign(rng.normal(size=(4000, 12))), rng.uniform(-1, 1, (4000, 12)))
    last = np.where(rng.random((4000, 6)) < 0.5, -1.0, 1.0)  # how the last distal joint goes: A or B
    ends = np.asarray(many(x * limits, last))
    for target in targets:
        near = np.argsort(-np.einsum("nab,ab->n", ends, target))[:12]
        least = np.pi
        for k in near:
            found = least_squares(
                lambda x, k=k, target=target: np.ravel(one(x, last[k]) - target),
                x[k] * limits * 0.999,
                lambda x, k=k: np.asarray(slope(x, last[k])).reshape(9, -1),  # pyright: ignore[reportArgumentType]
                bounds=(-limits, limits),
            )
            least = min(least, float(apart(np.asarray(one(found.x, last[k]))[None], target[None])[0]))
        answer.append(least)
    return answer


def word_rotation(robot: reojax.Robot, x: jax.Array, last: jax.Array) -> jax.Array:
    """Rotation after six manoeuvres of amplitudes x (12,), the last distal joint going `last` (6,) times the first."""
    corners = np.array([[0, 0, 0], [0, 1, 0], [1, 1, 1], [1, 0, 1], [0, 0, 0.0]])
    turned = jnp.eye(3)
    for k in range(6):
        scale = jnp.stack([x[2 * k], x[2 * k + 1], last[k] * x[2 * k]])
        turned = turned @ reojax.net_rotation(robot, reojax.polygon(corners * scale[None]))
    return turned


def others(out: Path) -> dict:
    """Robots that nothing was tuned on; print a table and return its numbers."""
    table = check_writable(out / "hard_robots_others.json")
    answer: dict[str, Any] = {"known": [], "random": []}
    for seed in range(8, 12):
        robot = hard_robot(seed)
        random = Rotation.from_quat(np.random.default_rng([7, seed]).normal(size=(30, 4))).as_matrix()
        for name, targets in (("known", words(robot, 30, seed)), ("random", random)):
            found = row(robot, targets, WIDE)
            missed = found.pop("missed")
            found["crude_rad"] = crude(robot, targets[missed], seed) if len(missed) else []
            answer[name].append(found)
            loops = [found["loops"][k] for k in missed]
            print(
                f"{robot.name} {name}: {found['reached']} of 30 reached, {found['cpu_s']:.1f} s; missed "
                f"{[f'{e:.3g}' for e in found['left_rad']]} rad with {loops} manoeuvres, by the crude search "
                f"{[f'{e:.3g}' for e in found['crude_rad']]}",
                flush=True,
            )
            write_json(table, answer)
    rows = answer["known"] + answer["random"]
    answer["converged"] = all(found["replayed_rad"] < 1e-8 for found in rows)
    write_json(table, answer)
    return answer


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
        "missed": [int(k) for k in np.flatnonzero(~found.converged)],
        "left_rad": [float(e) for e in found.error[~found.converged]],
        "replayed_rad": float(replayed.max(initial=0.0)),
        "cpu_s": seconds,
    }


def main(out: Path, *, part: str = "eight", quick: bool = False) -> dict:
    """Plan, print the tables, write `hard_robots.json` to `out`, and return the numbers."""
    if part == "others":
        return others(out)
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
    parser = options(__doc__)
    parser.add_argument("--part", choices=("eight", "others"), default="eight", help="which robots")
    run(main, parser)

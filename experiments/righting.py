"""How surely, how fast and how exactly does `righting` turn a falling robot that already spins?

    python experiments/righting.py            # goes on where it was stopped; hours for all 500 of the quadruped
    python experiments/righting.py --releases 60 --cases quadruped
    python experiments/righting.py --quick    # the prototype alone, without motors, few releases

Random releases: any orientation (Haar), momenta that turn the straight robot by up to half a turn in the fall of
0.62 s, about any axis. The prototype has to end in a given orientation, the quadruped with its feet down, facing
anywhere. Both have their motors: the prototype's RE-max 17 at 12 V, the quadruped's brushless ones (chosen numbers,
see `MOTORS`).
What keeps the others from it is asked by relaxing one limit at a time: the same releases without motors, in twice the
time with the same momentum, with joint limits half as wide again; and in the least time that is found for the motors.
The answers are replayed by MuJoCo's full dynamics where MuJoCo is installed (`righting_parts/dynamics.py`).
"""

import importlib.util
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from common.script import options, run
from scipy.spatial.transform import Rotation
from scipy.special import ndtr

import reojax
from reojax import robots, so3
from reojax.files import check_writable, write_json

FALL = 0.62
MOTORS = {
    "prototype": reojax.RE_MAX_17,
    # Solo12: 9:1 belts, 24 V; 300 rpm/V is k = 0.0318 V s/rad, and 0.25 ohm with it some 2.7 N m at the joint at 9.4 A
    "quadruped": reojax.Motor(
        supply=24.0, resistance=0.25, torque_constant=0.0318, rotor_inertia=4e-6, gear_ratio=9.0, efficiency=0.95,
        efficiency_back=0.95,
    ),
}  # fmt: skip
CHUNK = 10
PIECES = 12
"""Of the quadruped's splines: up to four and a half rounds of its legs."""


class Case(NamedTuple):
    """What is asked of one robot."""

    robot: str
    motors: reojax.Motor | None
    fall: float | None
    """Duration [s]; None: the least that is found."""
    pieces: int | None
    """Of the spline."""
    starts: int
    about: tuple[float, float, float] | None = None
    """Axis of the base about which the end is free."""
    wider: float = 1.0
    """Factor of the joint limits."""
    max_steps: int = 40


CASES = {
    "prototype": Case("prototype", MOTORS["prototype"], FALL, None, 6),
    "prototype without motors": Case("prototype", None, FALL, None, 24),
    "prototype in its least time": Case("prototype", MOTORS["prototype"], None, None, 6),
    "quadruped": Case("quadruped", MOTORS["quadruped"], FALL, PIECES, 6, (0.0, 0.0, 1.0)),
    "quadruped without motors": Case("quadruped", None, FALL, PIECES, 6, (0.0, 0.0, 1.0)),
    "quadruped in twice the time": Case("quadruped", MOTORS["quadruped"], 2 * FALL, PIECES, 6, (0.0, 0.0, 1.0)),
    "quadruped with wider limits": Case("quadruped", MOTORS["quadruped"], FALL, PIECES, 6, (0.0, 0.0, 1.0), 1.5),
    "quadruped in its least time": Case("quadruped", MOTORS["quadruped"], None, PIECES, 6, (0.0, 0.0, 1.0)),
}


def main(out: Path, *, quick: bool = False, releases: int = 500, cases: Sequence[str] = tuple(CASES)) -> dict:
    """Run, print the table, write `righting.json` to `out`, and return the numbers."""
    if releases < 1:
        raise ValueError(f"--releases is {releases}; it must be 1 or more.")
    file = check_writable(out / "righting.json")
    if quick:
        releases, cases = 4, ["prototype without motors"]
    result = {}
    for name in cases:
        result[name] = _releases(out / "righting_parts", name, releases, file, result)
        print(name, result[name], flush=True)
    write_json(file, result)
    return result


def _releases(folder: Path, name: str, releases: int, file: Path, before: dict) -> dict:
    """All releases of one robot, ten at a time; what is done is kept, and the table is written anew after each ten."""
    case = CASES[name]
    robot = robots.by_name(case.robot)
    robot = robot.replace(lower=case.wider * robot.lower, upper=case.wider * robot.upper)
    rng = np.random.default_rng(0)
    inertia = np.asarray(reojax.momentum_matrices(robot, np.zeros(robot.joints)).A)
    draws = rng.normal(size=(releases, 8))  # fewer releases are the first of more
    axis, size = draws[:, :3], ndtr(draws[:, 7:]) * np.pi
    turn = size * axis / np.linalg.norm(axis, axis=1, keepdims=True)
    released = Rotation.from_quat(draws[:, 3:7]).inv()  # upright, seen from where it is let go
    targets = released.as_matrix()
    folder.mkdir(parents=True, exist_ok=True)
    rows: list[np.ndarray] = []
    row = {}
    for first in range(0, releases, CHUNK):
        part = folder / f"{name}-{first}-{min(CHUNK, releases - first)}.npy".replace(" ", "_")
        if not part.exists():
            take = range(first, min(first + CHUNK, releases))
            np.save(part, [_one(robot, case, targets[k], turn[k] / FALL @ inertia) for k in take])
        rows.append(np.load(part))
        row = _summary(np.concatenate(rows))
        write_json(file, before | {name: row})
    return row


def _one(robot: reojax.Robot, case: Case, target: np.ndarray, momentum: np.ndarray) -> tuple[float, ...]:
    """Reached, error, margin, travel, processor time, angle of the replay, angle asked for, duration."""
    begin = time.process_time()
    options = {"momentum": momentum, "duration": case.fall, "motors": case.motors, "pieces": case.pieces}
    options |= {"starts": case.starts, "shorten": False, "about": case.about, "max_steps": case.max_steps}
    found = reojax.righting(robot, target, **options)
    seconds = time.process_time() - begin
    replayed = np.nan
    if found.converged and importlib.util.find_spec("mujoco"):
        from righting_parts.dynamics import replay

        replayed = float(so3.angle(jnp.asarray(replay(robot, found).T @ found.rotation)))
    inertia = np.asarray(reojax.momentum_matrices(robot, np.zeros(robot.joints)).A)
    drifted = Rotation.from_rotvec(np.linalg.solve(inertia, momentum) * (case.fall or FALL)).as_matrix()
    between = drifted.T @ target  # with its feet down, what counts is how far off the drift leaves its up
    asked = float(so3.angle(jnp.asarray(between)) if case.about is None else np.arccos(np.clip(between[2, 2], -1, 1)))
    known = (found.converged, found.error, found.margin, found.travel)
    return *(float(x) for x in known), seconds, replayed, asked, float(found.duration)


def _summary(rows: np.ndarray) -> dict:
    good = rows[:, 0] == 1
    reached = rows[good]
    some = len(reached) > 0
    driven = some and bool(np.isfinite(reached[:, 2]).all())
    by_angle = {}
    for low, high in ((0, 45), (45, 90), (90, 135), (135, 180)):
        inside = (np.rad2deg(rows[:, 6]) >= low) & (np.rad2deg(rows[:, 6]) < high + (high == 180))
        by_angle[f"{low} to {high} deg"] = f"{int((inside & good).sum())} of {int(inside.sum())}"
    return {
        "releases": len(rows),
        "reached": int(good.sum()),
        "largest_error_rad": float(reached[:, 1].max()) if some else None,
        "motor_margin_median": float(np.median(reached[:, 2])) if driven else None,
        "motor_margin_least": float(reached[:, 2].min()) if driven else None,
        "duration_s_median": float(np.median(reached[:, 7])) if some else None,
        "duration_s_percentiles_10_90": np.quantile(reached[:, 7], [0.1, 0.9]).tolist() if some else None,
        "travel_median_rad": float(np.median(reached[:, 3])) if some else None,
        "processor_s_median": float(np.median(rows[:, 4])),
        "processor_s_percentile_95": float(np.quantile(rows[:, 4], 0.95)),
        "replayed": int(np.isfinite(rows[:, 5]).sum()),
        "replay_largest_rad": float(np.nanmax(rows[:, 5])) if np.isfinite(rows[:, 5]).any() else None,
        "reached_by_angle_asked": by_angle,
    }


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--releases", type=int, default=500, help="how many of each case (default 500)")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES), help="which cases (default: all)")
    run(main, parser)

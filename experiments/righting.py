"""How surely, how fast and how exactly does `righting` turn a falling robot that already spins?

    python experiments/righting.py            # many minutes
    python experiments/righting.py --quick    # the prototype alone, few releases

Random targets (Haar for the prototype; for the quadruped, whose legs turn it less, within 0.5 rad of where it would
drift) and momenta up to half a turn in the fall of 0.62 s. The answers are integrated again, by MuJoCo's momentum
matrices where MuJoCo is installed.
"""

import importlib.util
import time
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from common.script import options, run
from scipy.spatial.transform import Rotation

import reojax
from reojax import interop, robots, so3
from reojax.files import check_writable, write_json

FALL = 0.62


def main(out: Path, *, quick: bool = False) -> dict:
    """Run, print the table, write `righting.json` to `out`, and return the numbers."""
    file = check_writable(out / "righting.json")
    sizes = {"prototype": 10} if quick else {"prototype": 200, "quadruped": 24}
    result = {}
    for name, releases in sizes.items():
        result[name] = _releases(robots.by_name(name), releases, near=name == "quadruped")
        print(name, result[name], flush=True)
        write_json(file, result)
    return result


def _releases(robot: reojax.Robot, releases: int, *, near: bool) -> dict:
    rng = np.random.default_rng(0)
    inertia = np.asarray(reojax.momentum_matrices(robot, np.zeros(robot.joints)).A)
    axis = rng.normal(size=(releases, 3))
    turn = rng.uniform(0, np.pi, (releases, 1)) * axis / np.linalg.norm(axis, axis=1, keepdims=True)
    momenta = turn / FALL @ inertia
    target = Rotation.from_quat(rng.normal(size=(releases, 4)))
    if near:
        aside = rng.normal(size=(releases, 3))
        aside *= rng.uniform(0, 0.5, (releases, 1)) / np.linalg.norm(aside, axis=1, keepdims=True)
        target = Rotation.from_rotvec(turn) * Rotation.from_rotvec(aside)
    reojax.righting(robot, target[0].as_matrix(), momentum=momenta[0], duration=FALL)
    found, seconds = [], []
    for goal, momentum in zip(target.as_matrix(), momenta, strict=True):
        begin = time.process_time()
        found.append(reojax.righting(robot, goal, momentum=momentum, duration=FALL))
        seconds.append(time.process_time() - begin)
    good = [one for one in found if one.converged]
    replayed = [_replayed(robot, one) for one in good[:10]] if importlib.util.find_spec("mujoco") else []
    return {
        "releases": releases,
        "reached": len(good),
        "largest_error_rad": float(max((one.error for one in good), default=np.nan)),
        "travel_median_rad": float(np.median([one.travel for one in good])) if good else None,
        "processor_s_median": float(np.median(seconds)),
        "processor_s_percentile_95": float(np.quantile(seconds, 0.95)),
        "replayed": len(replayed),
        "replay_largest_rad": float(max(replayed)) if replayed else None,
    }


def _replayed(robot: reojax.Robot, found: reojax.Righting, steps: int = 500) -> float:
    """Angle to the answer's end by MuJoCo's momentum matrices and the midpoint rule."""
    foreign, trajectory = interop.mujoco_model(robot), found.trajectory
    rotation, eye, h = np.eye(3), np.eye(3), FALL / steps
    for k in range(steps):
        state = trajectory.at((k + 0.5) * h)
        matrix = interop.mujoco_momentum(foreign, np.asarray(state.theta), np.zeros(3), eye)
        inertia, coupling, _ = interop.split(matrix, eye)
        own = coupling @ np.asarray(state.theta_dot)
        half = rotation @ _turn(h / 2 * np.linalg.solve(inertia, own + rotation.T @ found.momentum))
        rotation = rotation @ _turn(h * np.linalg.solve(inertia, own + half.T @ found.momentum))
    return float(so3.angle(jnp.asarray(rotation.T @ found.rotation)))


def _turn(vector: np.ndarray) -> np.ndarray:
    return Rotation.from_rotvec(vector).as_matrix()


if __name__ == "__main__":
    run(main, options(__doc__))

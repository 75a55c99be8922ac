"""Turns of 30 degrees about each axis of public robots within joint limits, from the rest posture of their file."""

import time
import warnings
from typing import Any

import numpy as np
from common.replay import pinocchio, replay
from scipy.spatial.transform import Rotation

import reojax
from any_robot_parts.files import folder_of

ROBOTS = {
    "SPART 7-joint arm": ("spartpy", "urdf/floating_7dof_manipulator.urdf"),
    "UR5": ("example-robot-data", "ur_description/urdf/ur5_robot.urdf"),
    "Panda": ("example-robot-data", "panda_description/urdf/panda.urdf"),
    "Ant": ("gymnasium", "envs/mujoco/assets/ant.xml"),
    "Solo12": ("example-robot-data", "solo_description/robots/solo12.urdf"),
    "Laikago": ("example-robot-data", "laikago_description/urdf/laikago.urdf"),
    "ANYmal C": ("example-robot-data", "anymal_c_simple_description/urdf/anymal.urdf"),
    "Gymnasium humanoid": ("gymnasium", "envs/mujoco/assets/humanoid.xml"),
    "dm_control humanoid": ("dm_control", "suite/humanoid.xml"),
    "G1, 29 joints": ("example-robot-data", "g1_description/urdf/g1_29dof_rev_1_0.urdf"),
    "Talos, reduced": ("example-robot-data", "talos_data/robots/talos_reduced.urdf"),
    "iCub": ("icub-models", "robots/iCubGazeboV2_5/model.urdf"),
}
"""Name: package and file. Space arms, arms on a small base, quadrupeds, humanoids."""

_TURN = np.deg2rad(30)


def turning(quick: bool) -> dict[str, Any]:
    """A row for each robot: joints, and over the three axes travel, runs, errors and processor seconds."""
    chosen = list(ROBOTS.items())[: 1 if quick else None]
    rows = [_row(name, *place, turns=1 if quick else 3) for name, place in chosen]
    return {"rows": rows, "converged": all(row["reached"] == (1 if quick else 3) for row in rows)}


def _row(name: str, package: str, file: str, turns: int = 3) -> dict[str, Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        robot = reojax.load_robot(folder_of(package) / file, shapes=False)
    start = np.clip(np.zeros(robot.joints), robot.lower, robot.upper)
    found, seconds = [], []
    for axis in np.eye(3)[:turns]:
        target = Rotation.from_rotvec(_TURN * axis).as_matrix()
        begun = time.process_time()
        path = reojax.free_path(robot, target, start=start, repeats="least")
        seconds.append(time.process_time() - begun)
        assert ((path.waypoints >= robot.lower - 1e-9) & (path.waypoints <= robot.upper + 1e-9)).all()
        found.append((path, *_left(robot, path, target)))
    paths, errors, oracles = zip(*found, strict=True)
    row = {
        "robot": name,
        "joints": robot.joints,
        "reached": int(sum(path.converged for path in paths)),
        "runs x, y, z": ", ".join(str(path.repeats) for path in paths),
        "travel x, y, z [deg]": ", ".join(f"{np.rad2deg(path.travel):.0f}" for path in paths),
        "largest error [rad]": f"{max(path.error for path in paths):.1e}",
        "replayed [rad]": f"{max(errors):.1e}, {oracles[0]}",
        "first [CPU s]": round(seconds[0], 1),
        "next two [CPU s]": ", ".join(f"{second:.1f}" for second in seconds[1:]),
    }
    print(row, flush=True)
    return row


def _left(robot: reojax.Robot, path: reojax.FreePaths, target: np.ndarray) -> tuple[float, str]:
    """Angle to the target after a replay [rad], and by what; Pinocchio refuses links that are lighter than a rotor."""
    try:
        once, oracle = pinocchio(robot, path.waypoints), "Pinocchio"
    except RuntimeError:
        once, oracle = replay(robot, path.waypoints[None])[0], "momentum summed link by link"
    return Rotation.from_matrix(np.linalg.matrix_power(once, int(path.repeats)).T @ target).magnitude(), oracle

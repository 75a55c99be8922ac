"""What shows that a row is right: momentum, a replay by Pinocchio, joint limits, clearance along the whole path."""

import importlib.util
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import reojax
from common.replay import pinocchio

MOMENTUM, MISS, LIMIT = 1e-8, 1e-7, 1e-9
"""Largest momentum (a share), angle to the target [rad], and angle beyond a limit [rad] of a row that counts."""


def prove(
    robot: reojax.Robot, waypoints: np.ndarray, runs: int, target: np.ndarray, clearance: float
) -> dict[str, Any]:
    """Certificate of a closed path that is run so many times: its figures, and `holds`, whether all are as they must.

    `pinocchio_rad` is the angle to the target after a replay by Pinocchio's momentum matrices and SciPy's DOP853; None
    where Pinocchio is not installed or refuses the robot (a link lighter than its rotor). `clearance_m` is a proven
    lower bound along the whole path, None for a robot without pairs.
    """
    path = reojax.polygon(waypoints)
    certificate = reojax.certify(robot, path)
    once = np.asarray(reojax.net_rotation(robot, path, steps=16))
    beyond = np.maximum(waypoints - np.asarray(robot.upper), np.asarray(robot.lower) - waypoints).max()
    apart = reojax.path_clearance(robot, path).distance if robot.collision_pairs else np.inf
    found = {
        "momentum": float(certificate.momentum),
        "miss_rad": _left(once, runs, target),
        "pinocchio_rad": _replay(robot, waypoints, runs, target),
        "clearance_m": float(apart) if np.isfinite(apart) else None,
        "beyond_limits_rad": max(float(beyond), 0.0),
    }
    return found | {"holds": holds(found, clearance)}


def holds(found: dict[str, Any], clearance: float) -> bool:
    """Whether a certificate's figures are within what a row needs; what was not measured does not count against it."""
    replayed, apart = found["pinocchio_rad"], found["clearance_m"]
    return bool(
        found["momentum"] <= MOMENTUM
        and found["miss_rad"] <= MISS
        and found["beyond_limits_rad"] <= LIMIT
        and (replayed is None or replayed <= MISS)
        and (apart is None or apart >= clearance)
    )


def _left(once: np.ndarray, runs: int, target: np.ndarray) -> float:
    return float(Rotation.from_matrix(np.linalg.matrix_power(once, runs).T @ target).magnitude())


def _replay(robot: reojax.Robot, waypoints: np.ndarray, runs: int, target: np.ndarray) -> float | None:
    if importlib.util.find_spec("pinocchio") is None:
        return None
    try:
        return _left(pinocchio(robot, waypoints), runs, target)
    except RuntimeError:
        return None

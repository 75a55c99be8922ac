"""Uniformly random targets (Haar) on a satellite with an arm and on a quadruped: runs and travel of their paths."""

import time
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots

ROBOTS = {"satellite_arm": robots.satellite_arm, "quadruped": robots.quadruped}

_FINER = 16
"""Steps per edge of the replay, twice the planner's finest."""


def random_targets(quick: bool) -> dict[str, Any]:
    """A row for each robot: how many of 200 are reached, with how many runs and how much travel, and seconds."""
    chosen = list(ROBOTS.items())[: 1 if quick else None]
    rows = [_row(name, make(), 1 if quick else 200) for name, make in chosen]
    return {"rows": rows, "converged": all(row["reached"] == row["targets"] for row in rows)}


def _row(name: str, robot: reojax.Robot, count: int) -> dict[str, Any]:
    targets = Rotation.from_quat(np.random.default_rng(0).normal(size=(count, 4))).as_matrix()
    begun = time.process_time()
    found = reojax.free_paths(robot, targets, repeats="least", progress=True)
    seconds = time.process_time() - begun
    runs, travel = found.repeats, np.rad2deg(found.travel)
    replayed = [
        Rotation.from_matrix(np.linalg.matrix_power(_turn(robot, path), int(n)).T @ target).magnitude()
        for path, n, target in zip(found.waypoints, runs, targets, strict=True)
    ]
    return {
        "robot": name,
        "targets": count,
        "reached": int(found.converged.sum()),
        "runs: one / two / more": " / ".join(
            str(int(n)) for n in ((runs == 1).sum(), (runs == 2).sum(), (runs > 2).sum())
        ),
        "most runs": int(runs.max()),
        "travel, median / most [deg]": f"{np.median(travel):.0f} / {travel.max():.0f}",
        "largest error [rad]": f"{found.error[found.converged].max(initial=0.0):.1e}",
        "by finer steps [rad]": f"{np.max(np.array(replayed)[found.converged], initial=0.0):.1e}",
        "CPU s": round(seconds, 1),
    }


def _turn(robot: reojax.Robot, waypoints: np.ndarray) -> np.ndarray:
    return np.asarray(reojax.net_rotation(robot, reojax.polygon(waypoints), steps=_FINER))

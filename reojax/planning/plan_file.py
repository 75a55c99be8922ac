"""A plan as a JSON file: the robot, its path, what it was for, and the evidence that it does that."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.files import check_ending, write_json
from reojax._internal.json_files import entries, read_object
from reojax._internal.precision import as_double
from reojax._internal.version import version
from reojax.mechanics.certificate import Certificate, certify
from reojax.models.json_file import from_json, to_json
from reojax.path import Path, polygon
from reojax.planning import quaternions
from reojax.planning.checks import a_robot
from reojax.planning.free_paths_result import FreePaths
from reojax.planning.repeats import MOST_REPEATS
from reojax.planning.result import Plan
from reojax.robot import Robot

FORMAT, VERSION = "reojax plan", 1

_MOST_CORNERS = 1_000_000
_REQUIRED = (
    "format", "version", "reojax", "robot", "target", "waypoints", "repeats", "rotation", "error", "travel",
    "converged", "status", "certificate",
)  # fmt: skip
_OPTIONAL = ("manoeuvres", "clearance")
_TOLD = 1e-6
"""How far a file's rotation and error may contradict each other [rad]: digits that somebody has cut off."""


class SavedPlan(NamedTuple):
    """A plan as it was saved."""

    robot: Robot
    """The robot it is for."""
    waypoints: Float[np.ndarray, "v j"]
    """Corners of the joint path of one run [rad]."""
    repeats: int
    """How often the path is run."""
    target: Float[np.ndarray, "3 3"] | None
    """Rotation that was asked for; None where it was not told."""
    rotation: Float[np.ndarray, "3 3"]
    """Rotation of the base after all runs."""
    error: float
    """Angle left to the target [rad]."""
    travel: float
    """Joint travel of all runs [rad]."""
    converged: bool
    """Whether the target was reached within the tolerance of the plan."""
    status: str
    """How the search ended, in words."""
    manoeuvres: tuple[tuple[str, float, float, float], ...]
    """Letter, twist, bend and last twist [rad] of each manoeuvre; empty for a free path."""
    certificate: Certificate | None
    """Evidence of one run, as `certify` gives it; None for a path that stays put."""
    clearance: float | None
    """Proven least distance along the path [m]; None where it was not asked for, infinite without parts that could
    meet."""
    reojax: str
    """Version that planned it."""

    @property
    def path(self) -> Path:
        """The joint path of all runs."""
        return runs_of(self.waypoints, self.repeats)


def runs_of(waypoints: Float[np.ndarray, "v j"], repeats: int) -> Path:
    """The joint path of `repeats` runs of a closed polygon.

    Raises:
        ValueError: if that would have too many corners.
    """
    if repeats * len(waypoints) > _MOST_CORNERS:
        raise ValueError(f"{repeats} runs of {len(waypoints)} corners are too many for one path.")
    return polygon(np.concatenate([waypoints[:1], np.tile(waypoints[1:], (repeats, 1))]))


def save_plan(
    plan: Plan | FreePaths, path: str | os.PathLike[str], *, robot: Robot, target: ArrayLike | None = None
) -> None:
    """Write one plan or free path as JSON, with the robot and a certificate that is computed now.

    `load_plan` reads it back, and so do `reojax show`, `simulate`, `time`, `export` and `view`. The file is written
    whole or not at all.

    Args:
        plan: of `plan`, `replan` or `free_path`.
        path: to write, ending in .json.
        robot: the robot it was made for.
        target: (3, 3) rotation it was made for; default not told.

    Raises:
        ValueError: if the plan is none or one of many, does not fit the robot, or the path cannot be written.
    """
    a_robot(robot)
    if not isinstance(plan, Plan | FreePaths):
        raise ValueError(f"`plan` is a {type(plan).__name__}; it must be what `plan` or `free_path` returns.")
    waypoints = np.asarray(plan.waypoints, float)
    if waypoints.ndim != 2:
        raise ValueError("`plan` holds many plans; save them one by one.")
    if waypoints.shape[1] != robot.joints:
        raise ValueError(f"`plan` moves {waypoints.shape[1]} joints; {robot.name!r} has {robot.joints}.")
    if target is not None:
        target = checks.rotations("target", target, (3, 3))
    file = check_ending(path, "plan", ("json",))
    repeats = plan.repeats if isinstance(plan, FreePaths) else 1
    data: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "reojax": version(),
        "robot": to_json(robot),
        "target": target,
        "waypoints": waypoints,
        "repeats": int(repeats),
        "rotation": plan.rotation,
        "error": float(plan.error),
        "travel": float(plan.travel),
        "converged": bool(plan.converged),
        "status": str(plan.status),
        "certificate": _certificate(robot, waypoints),
    }
    if isinstance(plan, Plan):
        rows = zip(plan.word, plan.twist, plan.bend, plan.last_twist, strict=True)
        data["manoeuvres"] = [
            {"name": str(name), "twist": float(twist), "bend": float(bend), "last_twist": float(last)}
            for name, twist, bend, last in rows
        ]
    if plan.clearance is not None:
        data["clearance"] = {"distance": float(plan.clearance) if np.isfinite(plan.clearance) else None}
    write_json(file, data)


def _certificate(robot: Robot, waypoints: np.ndarray) -> dict[str, float] | None:
    if not np.abs(np.diff(waypoints, axis=0)).any():
        return None
    with jax.enable_x64(True):
        robot = as_double(robot)
        found = certify(robot, polygon(waypoints))
        return {name: float(value) for name, value in found._asdict().items()}


def load_plan(path: str | os.PathLike[str]) -> SavedPlan:
    """Read a plan that `save_plan` or `reojax plan --save` wrote to the file `path`.

    Raises:
        ValueError: naming the file and the entry that is missing, wrong, or contradicts another.
    """
    try:
        return _from_json(read_object(path))
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith("cannot read") else f"cannot read {str(path)!r}: {text}") from None


def _from_json(data: dict[str, Any]) -> SavedPlan:
    if data.get("format") != FORMAT:
        raise ValueError(f"it is no plan: its format is {checks.shorten(data.get('format'))}, not {FORMAT!r}.")
    top = entries("the plan", data, _REQUIRED, _OPTIONAL)
    if top["version"] != VERSION or isinstance(top["version"], bool):
        raise ValueError(f"the plan has version {checks.shorten(top['version'])}; this reojax reads version {VERSION}.")
    robot = from_json(top["robot"])
    waypoints = checks.numbers("waypoints", top["waypoints"] or np.zeros((0, robot.joints)), (-1, robot.joints))
    if not 1 <= len(waypoints) <= _MOST_CORNERS:
        raise ValueError(f"waypoints has {len(waypoints)} corners; a path has from 1 to {_MOST_CORNERS}.")
    repeats = checks.whole("repeats", top["repeats"], 1, MOST_REPEATS)
    if repeats > 1 and not np.array_equal(waypoints[0], waypoints[-1]):
        raise ValueError("repeats is more than 1, but the path does not end where it starts.")
    target = None if top["target"] is None else checks.rotations("target", top["target"])
    rotation = checks.rotations("rotation", top["rotation"])
    error = checks.number("error", top["error"], least=0)
    travel = checks.number("travel", top["travel"], least=0)
    if target is not None:
        p, q = (quaternions.from_matrices(matrix[None]) for matrix in (rotation, target))
        left = float(quaternions.angles(quaternions.product(quaternions.inverse(p), q))[0])
        if abs(left - error) > _TOLD:
            raise ValueError(f"error is {error:.6g}, but the rotation is {left:.6g} rad from the target.")
    moved = float(repeats * np.abs(np.diff(waypoints, axis=0)).sum())
    if abs(moved - travel) > _TOLD * (1 + moved):
        raise ValueError(f"travel is {travel:.6g}, but the joints move through {moved:.6g} rad.")
    if not isinstance(top["converged"], bool):
        raise ValueError(f"converged is {checks.shorten(top['converged'])}; it must be true or false.")
    manoeuvres = checks.listing("manoeuvres", top.get("manoeuvres", ()), "manoeuvres")
    clearance = None
    if "clearance" in top:
        distance = entries("clearance", top["clearance"], ("distance",))["distance"]
        clearance = np.inf if distance is None else checks.number("clearance.distance", distance)
    return SavedPlan(
        robot=robot,
        waypoints=waypoints,
        repeats=repeats,
        target=target,
        rotation=rotation,
        error=error,
        travel=travel,
        converged=top["converged"],
        status=_text("status", top["status"]),
        manoeuvres=tuple(_manoeuvre(k, row) for k, row in enumerate(manoeuvres)),
        certificate=_read_certificate(top["certificate"]),
        clearance=clearance,
        reojax=_text("reojax", top["reojax"]),
    )


def _text(entry: str, value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{entry} is {checks.shorten(value)}; it must be text.")
    return value


def _manoeuvre(k: int, row: Any) -> tuple[str, float, float, float]:
    keys = ("name", "twist", "bend", "last_twist")
    fields = entries(f"manoeuvres[{k}]", row, keys)
    twist, bend, last = (checks.number(f"manoeuvres[{k}].{key}", fields[key]) for key in keys[1:])
    return _text(f"manoeuvres[{k}].name", fields["name"]), twist, bend, last


def _read_certificate(value: Any) -> Certificate | None:
    if value is None:
        return None
    row = entries("certificate", value, Certificate._fields)
    return Certificate(*(np.asarray(checks.number(f"certificate.{key}", row[key], least=0)) for key in row))

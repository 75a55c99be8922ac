"""The door of the mechanics: a robot, its motion, a path, a number of steps."""

from __future__ import annotations

import warnings
from typing import Any

import jax.numpy as jnp
import numpy as np

from reojax._internal import checks
from reojax._internal.arrays import as_numbers, cast, common_float, is_concrete
from reojax.path import Path
from reojax.robot import Robot

MOST_STEPS = 2**20
"""Per edge; more is a mistake, or memory that no machine has."""
RESOLVED = 1.2
"""Largest change of a joint angle in one step for which net rotations keep their promise [rad]."""


def check_robot(robot: Robot) -> Robot:
    """Return the robot if the mechanics can read it: one design, in numbers that JAX computes with."""
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    n, j = robot.links, robot.joints
    shapes = {
        "mass": (n,),
        "com": (n, 3),
        "inertia": (n, 3, 3),
        "axis": (j, 3),
        "anchor": (j, 3),
        "rotor_inertia": (j,),
        "gear_ratio": (j,),
    }
    for field, expected in shapes.items():
        _check_array(f"robot.{field}", getattr(robot, field), expected)
    return robot


def check_path(robot: Robot, path: Path) -> Path:
    """Return the path if it is one path of this robot."""
    checks.instance("path", path, Path, "`polygon(waypoints)` makes")
    shape = np.shape(path.waypoints)
    if len(shape) != 2:
        more = "; for a stack of paths use jax.vmap" if len(shape) > 2 else ""
        raise ValueError(f"`path.waypoints` has shape {shape}; of one path it must be (v, {robot.joints}){more}.")
    if path.joints != robot.joints:
        raise ValueError(
            f"`path` has waypoints of {path.joints} joint angles; {robot.name!r} has {robot.joints} joints."
        )
    _check_array("path.waypoints", path.waypoints, shape)
    return path


def _check_array(entry: str, value: Any, expected: tuple[int, ...]) -> None:
    shape, dtype = np.shape(value), value.dtype if hasattr(value, "dtype") else jnp.result_type(value)
    if shape != expected:
        more = "; for a stack of robots use jax.vmap" if shape[1:] == expected else ""
        raise ValueError(f"`{entry}` has shape {shape}; of one robot of this tree it must be {expected}{more}.")
    if not (jnp.issubdtype(dtype, jnp.integer) or dtype in (np.float32, np.float64)):
        raise ValueError(f"`{entry}` has dtype {dtype}; it must be float32, float64 or integers.")


def check_motion(robot: Robot, **motion: Any) -> Any:
    """Return the robot and the motion's vectors as arrays of one dtype, or raise a `ValueError`."""
    check_robot(robot)
    for entry, value in motion.items():
        expected = (3,) if entry in ("omega", "momentum") else (robot.joints,)
        vector = motion[entry] = as_numbers(entry, value)
        if vector.shape != expected:
            robot_size = f"{robot.name!r} ({robot.joints} joints)"
            raise ValueError(f"`{entry}` has shape {vector.shape}; for {robot_size} it must be {expected}.")
        _check_array(entry, vector, expected)
        if is_concrete(vector) and not np.isfinite(vector).all():
            raise ValueError(f"`{entry}` is {np.asarray(vector).tolist()}; it must be finite.")
    everything = (robot, *motion.values())
    return cast(everything, common_float(everything))


def check_steps(entry: str, value: Any, least: int = 1) -> int:
    """Return a number of steps or samples per edge."""
    return checks.whole(entry, value, least, MOST_STEPS)


def warn_if_unresolved(path: Path, steps: int, entry: str) -> None:
    """Warn, at the line that calls the public function, where an edge is too long for its steps; not while tracing."""
    if path.edges and path.joints and is_concrete(path.waypoints):
        longest = float(np.abs(np.diff(np.asarray(path.waypoints, float), axis=0)).max())
        if longest > RESOLVED * steps:
            warnings.warn(
                f"an edge of the path turns a joint by {longest:.4g} rad ({np.rad2deg(longest):.4g} degrees) in "
                f"{steps} steps; beyond {RESOLVED} rad a step the result may be wrong. Angles are in radians; if these "
                f"are, give `{entry}` of {int(np.ceil(longest / RESOLVED))} or more, and measure the error with "
                "`reojax.certify`.",
                UserWarning,
                stacklevel=3,
            )

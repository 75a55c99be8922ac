"""The door of planning: targets, limits and choices checked, or a `ValueError`."""

from collections.abc import Hashable
from typing import Any

import jax
import numpy as np
from numpy.typing import ArrayLike

from reojax._internal.arrays import as_numbers, is_concrete
from reojax.manoeuvres import Layout, check_layout
from reojax.robot import Robot, layout_of

OBJECTIVES = ("count", "travel")
_ORTHOGONAL = 1e-6
"""Largest entry of `R^T R - 1` that rounding explains."""


def rotations(entry: str, value: ArrayLike, shape: tuple[int, ...]) -> np.ndarray:
    """Return rotations of shape (3, 3) or (m, 3, 3) in float64.

    Raises:
        ValueError: if they are not numbers, or not rotations; the text says by how much.
    """
    array = as_numbers(entry, value)
    if not is_concrete(array):
        raise ValueError(f"`{entry}` is traced; planning runs on the host, outside of jit, vmap and grad.")
    array = np.asarray(array, float)
    if array.ndim != len(shape) or array.shape[-2:] != (3, 3) or not array.size:
        text = str(shape).replace("-1", "m")
        raise ValueError(f"`{entry}` has shape {array.shape}; it must be {text}, at least one rotation.")
    for index, matrix in enumerate(array.reshape(-1, 3, 3)):
        name = f"`{entry}`" if array.ndim == 2 else f"{entry}[{index}]"
        if not np.isfinite(matrix).all():
            raise ValueError(f"{name} has an entry {matrix[~np.isfinite(matrix)][0]}; a rotation is finite.")
        away = np.abs(matrix.T @ matrix - np.eye(3)).max()
        if away > _ORTHOGONAL:
            raise ValueError(
                f"{name} is no rotation: an entry of R^T R - 1 is {away:.3g} in size; "
                f"rounding explains {_ORTHOGONAL:g} at most."
            )
        if np.linalg.det(matrix) < 0:
            raise ValueError(f"{name} is no rotation: its determinant is {np.linalg.det(matrix):.6g}, a reflection.")
    return array


def positive(entry: str, value: Any, unit: str = "rad") -> float:
    """Return one positive finite number."""
    number = np.asarray(as_numbers(entry, value))
    if number.shape or not np.isfinite(number) or number <= 0:
        raise ValueError(f"`{entry}` is {value!r}; it must be one positive number, in {unit}.")
    return float(number)


def whole(entry: str, value: Any, least: int = 1) -> int:
    """Return one integer, at least `least`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        rule = "a positive integer" if least == 1 else f"an integer, at least {least}"
        raise ValueError(f"`{entry}` is {value!r}; it must be {rule}.")
    return int(value)


def one_of(entry: str, value: Any, choices: tuple[str, ...]) -> str:
    """Return a name that is among `choices`."""
    if value not in choices:
        raise ValueError(f"`{entry}` is {value!r}; it must be one of {', '.join(map(repr, choices))}.")
    return value


def key_of(robot: Robot) -> Hashable:
    """Return what a robot is, down to the last bit, as a key to keep things under."""
    leaves, structure = jax.tree.flatten(robot)
    return structure, *(np.asarray(leaf).tobytes() for leaf in leaves)


def robot_and_layout(robot: Any, layout: Layout | None) -> Layout:
    """Return the layout, by default the robot's own."""
    if not isinstance(robot, Robot):
        raise ValueError(f"`robot` is a {type(robot).__name__}; it must be a Robot, such as `make_robot` makes.")
    if not is_concrete(robot):
        raise ValueError("`robot` is traced; planning runs on the host, outside of jit, vmap and grad.")
    if layout is None:
        layout = layout_of(robot)
    check_layout(layout)
    if layout.joints != robot.joints:
        raise ValueError(f"`layout` is for {layout.joints} joints; {robot.name!r} has {robot.joints}.")
    return layout

"""Errors of a robot's numbers: where they come from, and the robot that has them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax.robot import Robot

RELATIVE = ("mass", "inertia", "rotor_inertia", "gear_ratio")
"""Fields whose tolerances are relative, one error for every link or joint."""
ABSOLUTE = ("com", "anchor", "axis")
"""Fields whose tolerances are in m (com, anchor: three components each) or rad (axis: two tilts each)."""


class Sources(NamedTuple):
    """Independent errors; hashable."""

    name: tuple[str, ...]
    """As `inertia[2]`, `com[0].y`, `axis[1].tilt1`."""
    deviation: tuple[float, ...]
    """Their standard deviations."""
    tolerances: tuple[tuple[str, tuple[float, ...]], ...]
    """By field, one for every link or joint."""


def sources_of(robot: Robot, tolerances: Mapping[str, ArrayLike]) -> Sources:
    """Return the errors that `tolerances` speak of, see `spread`.

    Raises:
        ValueError: for an unknown field, a negative tolerance, or the wrong number of them.
    """
    names, deviations, fields = [], [], []
    checks.mapping("tolerances", tolerances, "names of fields to standard deviations")
    for field, given in tolerances.items():
        if field not in RELATIVE + ABSOLUTE:
            known = ", ".join(RELATIVE + ABSOLUTE)
            near = checks.did_you_mean(field, RELATIVE + ABSOLUTE)
            raise ValueError(f"there are no tolerances for {checks.shorten(field)}; they are for {known}.{near}")
        count = len(getattr(robot, field))
        entry, one = f"tolerances[{field!r}]", checks.rank(given) == 0
        values = np.broadcast_to(checks.numbers(entry, given, () if one else (count,)), (count,))
        checks.refuse(entry, values, values < 0, "it must not be negative")
        fields.append((field, tuple(values.tolist())))
        parts = {"com": (".x", ".y", ".z"), "anchor": (".x", ".y", ".z"), "axis": (".tilt1", ".tilt2")}.get(
            field, ("",)
        )
        for i, value in enumerate(values):
            names += [f"{field}[{i}]{part}" for part in parts]
            deviations += [float(value)] * len(parts)
    if not names:
        raise ValueError("`tolerances` is empty; it must name at least one field.")
    return Sources(tuple(names), tuple(deviations), tuple(fields))


def perturb(robot: Robot, sources: Sources, errors: Float[Array, " k"]) -> Robot:
    """The robot with errors given in standard deviations. Its links stay possible rigid bodies at any errors.

    Relative errors are factors exp(deviation * error). An error of a mass takes the link's inertia with it.
    """
    place = 0
    changed = {}
    moved = errors * jnp.asarray(sources.deviation, errors.dtype)

    def value(field: str) -> Array:
        return changed.get(field, getattr(robot, field))

    for field, values in sources.tolerances:
        width = {"com": 3, "anchor": 3, "axis": 2}.get(field, 1)
        # this field's errors, one row for each link or joint
        part = moved[place : place + width * len(values)].reshape(len(values), width)
        place += width * len(values)
        factor = jnp.exp(part[:, 0])
        if field in ("com", "anchor"):
            changed[field] = value(field) + part
        elif field == "axis":
            changed[field] = _tilt(value(field), part)
        elif field == "inertia":
            changed[field] = value(field) * factor[:, None, None]
        else:
            changed[field] = value(field) * factor
        if field == "mass":
            changed["inertia"] = value("inertia") * factor[:, None, None]
    return robot.replace(**changed)


def across(axis: Array) -> Array:
    """Two unit vectors (2, 3) across a unit vector, at right angles to each other."""
    smallest = jnp.eye(3, dtype=axis.dtype)[jnp.argmin(jnp.abs(axis))]
    first = jnp.cross(jnp.asarray(axis), smallest)
    first = first / jnp.sqrt(first @ first)
    return jnp.stack([first, jnp.cross(jnp.asarray(axis), first)])


def _tilt(axes: Array, tilts: Array) -> Array:
    rows = []
    for axis, tilt in zip(axes, tilts, strict=True):
        unit = axis / jnp.sqrt(axis @ axis)
        turned = unit + tilt @ across(unit)
        rows.append(turned / jnp.sqrt(turned @ turned))
    return jnp.stack(rows)

"""Numbers of a robot that can be fitted, by name: how each one is read from a robot and put into it."""

import re
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from reojax._internal.arrays import Array
from reojax._internal.checks import did_you_mean, shorten
from reojax.robot import Robot
from reojax.robots.edits import with_end_inertia

UNITS = {
    "mass": "kg",
    "com": "m",
    "inertia": "kg m^2",
    "anchor": "m",
    "rotor_inertia": "kg m^2",
    "gear_ratio": "",
}
"""Fields of a robot that can be fitted, and their units."""
_ENTRY = re.compile(r"^(\w+)\[(\d+(?:,\d+)*)\]$")
Put = Callable[[Robot, Array], Robot]


class Parameter(NamedTuple):
    """A number of a robot to be fitted."""

    name: str
    start: float
    """Value to begin with."""
    put: Put
    """Returns the robot with another value, which may be traced."""
    unit: str = ""
    scale: float = 1.0
    """A change that matters, for steps and for judging what is known."""
    positive: bool = False
    """Whether it has to stay positive."""


def parameter(robot: Robot, name: str) -> Parameter:
    """Return the parameter of a name: "end_inertia", "rotor_inertia", "gear_ratio" or an entry, "com[0,2]".

    "inertia_scale[1]" is a factor of all of link 1's inertia, 1 at the start.

    Raises:
        ValueError: saying what there is, for any other name.
    """
    text = name.replace(" ", "")
    if text == "end_inertia":
        return _end_inertia(robot)
    if text in ("rotor_inertia", "gear_ratio"):
        return _common(robot, text)
    match = _ENTRY.match(text)
    if match is not None and match[1] == "inertia_scale":
        return _inertia_scale(robot, text, match[2])
    if match is None or match[1] not in UNITS:
        fields = ", ".join(UNITS)
        raise ValueError(
            f"there is no parameter {shorten(name)}; there are end_inertia, rotor_inertia, gear_ratio, "
            f"inertia_scale[0] and entries such as "
            f"mass[1] or com[0,2] of the fields {fields}." + did_you_mean(text, ("end_inertia", *UNITS))
        )
    return _entry(robot, text, match[1], tuple(int(index) for index in match[2].split(",")))


def _end_inertia(robot: Robot) -> Parameter:
    if robot.links != 4:
        raise ValueError(f"end_inertia is defined for the four-link robot; {robot.name!r} has {robot.links} links.")
    axis = robot.axis[0] / np.linalg.norm(robot.axis[0])
    lever = robot.com[0] - robot.anchor[0]
    start = axis @ robot.inertia[0] @ axis + robot.mass[0] * (lever @ lever - (lever @ axis) ** 2)
    return Parameter("end_inertia", float(start), with_end_inertia, "kg m^2", float(start), True)


def _common(robot: Robot, field: str) -> Parameter:
    """One number for all joints."""
    values = np.asarray(getattr(robot, field))
    if not values.size or not (values == values[0]).all():
        raise ValueError(f"the joints of {robot.name!r} differ in {field}; fit {field}[0] and so on one by one.")
    start = float(values[0])
    return Parameter(field, start, _set_all(field), UNITS[field], abs(start) or 1.0, start > 0)


@lru_cache(maxsize=256)
def _set_all(field: str) -> Put:
    """One function per field, so that what is compiled for it is found again."""
    return lambda robot, value: robot.replace(**{field: jnp.broadcast_to(value, (robot.joints,))})


def _entry(robot: Robot, name: str, field: str, index: tuple[int, ...]) -> Parameter:
    values = np.asarray(getattr(robot, field))
    if len(index) != values.ndim or any(i >= size for i, size in zip(index, values.shape, strict=True)):
        raise ValueError(f"there is no {name} on {robot.name!r}; {field} has shape {values.shape}.")
    start = float(values[index])
    size = float(np.abs(values).max())
    diagonal = field == "inertia" and index[1] == index[2]
    positive = start > 0 and (field in ("mass", "rotor_inertia") or diagonal)
    return Parameter(name, start, _set_entry(field, index), UNITS[field], size or 1.0, positive)


def _inertia_scale(robot: Robot, name: str, index: str) -> Parameter:
    if not index.isdigit() or int(index) >= robot.links:
        raise ValueError(f"there is no {name} on {robot.name!r}, which has {robot.links} links; say inertia_scale[0].")
    return Parameter(name, 1.0, _scale_inertia(int(index)), "", 0.1, True)


@lru_cache(maxsize=256)
def _scale_inertia(link: int) -> Put:
    return lambda robot, value: robot.replace(inertia=jnp.asarray(robot.inertia).at[link].multiply(value))


@lru_cache(maxsize=256)
def _set_entry(field: str, index: tuple[int, ...]) -> Put:
    places = {index, (index[0], *index[:0:-1])} if field == "inertia" else {index}

    def put(robot: Robot, value: Array) -> Robot:
        array = jnp.asarray(getattr(robot, field))
        for place in sorted(places):
            array = array.at[place].set(value)
        return robot.replace(**{field: array})

    return put


def resolve(robot: Robot, parameters: object) -> tuple[Parameter, ...]:
    """Return the parameters of a list of names and `Parameter`s.

    Raises:
        ValueError: for an empty list, a name twice, or one that is not known.
    """
    if isinstance(parameters, str | Parameter):
        parameters = (parameters,)
    try:
        listed = list(parameters)  # pyright: ignore[reportArgumentType]
    except TypeError as error:
        raise ValueError(f"`parameters` is {shorten(parameters)}; it must be a list of names.") from error
    found = tuple(p if isinstance(p, Parameter) else parameter(robot, str(p)) for p in listed)
    names = [p.name for p in found]
    if not names or len(set(names)) != len(names):
        raise ValueError(f"`parameters` are {names}; at least one is needed, and none twice.")
    return found

"""Solid parts with mass, and how several make one link. Plain NumPy; one frame for all parts of a link."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class Solid(NamedTuple):
    """A rigid part."""

    mass: float
    """Mass [kg]."""
    com: np.ndarray
    """(3,) centre of mass [m]."""
    inertia: np.ndarray
    """(3, 3) about the centre of mass [kg m^2]."""


def cylinder(mass: float, radius: float, length: float, *, centre: Sequence[float], along: Sequence[float]) -> Solid:
    """Uniform solid cylinder whose axis is the unit vector `along`."""
    axial, transverse = mass * radius**2 / 2, mass * (3 * radius**2 + length**2) / 12
    return Solid(mass, np.array(centre, float), transverse * np.eye(3) + (axial - transverse) * np.outer(along, along))


def cube(mass: float, side: float, *, centre: Sequence[float]) -> Solid:
    """Uniform solid cube; its inertia is the same about every axis."""
    return Solid(mass, np.array(centre, float), mass * side**2 / 6 * np.eye(3))


def join(*solids: Solid) -> Solid:
    """Weld parts into one (parallel axis theorem)."""
    mass = sum(part.mass for part in solids)
    com = sum((part.mass * part.com for part in solids), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in solids:
        lever = part.com - com
        inertia += part.inertia + part.mass * (lever @ lever * np.eye(3) - np.outer(lever, lever))
    return Solid(mass, com, inertia)


def half_turn_y(solid: Solid) -> Solid:
    """Turn a part by half a turn about the y axis through the origin."""
    turn = np.diag([-1.0, 1.0, -1.0])
    return Solid(solid.mass, turn @ solid.com, turn @ solid.inertia @ turn)

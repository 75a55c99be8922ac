"""The units in which people read angles and small inertias: only the command line and pictures use them."""

from math import pi

RPM = 30 / pi
"""Turns per minute in one rad/s."""
_SHOWN = {"rad": ("deg", 180 / pi), "kg m^2": ("kg mm^2", 1e6)}


def display_unit(unit: str) -> tuple[str, float]:
    """Return the unit that is shown for a unit inside, and the factor from one to the other."""
    return _SHOWN.get(unit, (unit, 1.0))

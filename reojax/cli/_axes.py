"""Axes of a sweep at the command line: `twist=0:270:109`, `gear=1,12,24`, in degrees and kg mm^2."""

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from reojax._internal.display_units import display_unit
from reojax.cli._numbers import LARGEST_ANGLE, number

if TYPE_CHECKING:
    import numpy as np

MOST = 10**8
"""Most values on one axis."""


class Range(NamedTuple):
    """Unit inside of an axis, and the range of its values in the shown unit."""

    unit: str
    least: float
    most: float


AXES = {
    "twist": Range("rad", -LARGEST_ANGLE, LARGEST_ANGLE),
    "bend": Range("rad", -LARGEST_ANGLE, LARGEST_ANGLE),
    "end_inertia": Range("kg m^2", 1e-9, 1e12),
    "gear": Range("", -1e9, 1e9),
    "rotor_inertia": Range("kg m^2", 0.0, 1e12),
}
"""Axes by name."""


class Axis(NamedTuple):
    """One axis as it was given: a count of equal steps, or values. Nothing is built yet, as it may be large."""

    name: str
    ends: tuple[float, float]
    size: int
    listed: tuple[float, ...] | None

    def values(self) -> "np.ndarray":
        """Values in units inside."""
        import numpy as np

        given = np.linspace(*self.ends, self.size) if self.listed is None else np.array(self.listed)
        return given / display_unit(AXES[self.name].unit)[1]


def axis(text: str) -> Axis:
    """Read `name=start:stop:count` or `name=value,value,...` (an argparse type)."""
    name, equals, rest = text.partition("=")
    if not equals:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form NAME=START:STOP:COUNT or NAME=VALUE,VALUE,...")
    if name not in AXES:
        raise argparse.ArgumentTypeError(f"there is no axis {name!r}; the axes are {', '.join(AXES)}")
    if ":" not in rest:
        listed = tuple(_number(name, part) for part in rest.split(","))
        return Axis(name, (listed[0], listed[-1]), len(listed), listed)
    parts = rest.split(":")
    if len(parts) != 3:
        raise argparse.ArgumentTypeError(f"{text!r}: a range is START:STOP:COUNT")
    start, stop = _number(name, parts[0]), _number(name, parts[1])
    try:
        count = int(parts[2])
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: the count {parts[2]!r} is not a whole number") from None
    if not 1 <= count <= MOST:
        raise argparse.ArgumentTypeError(f"{text!r}: the count must be from 1 to {MOST}")
    if count == 1 and start != stop:
        raise argparse.ArgumentTypeError(f"{text!r}: one value cannot reach from {start:g} to {stop:g}")
    return Axis(name, (start, stop), count, None)


def check_names(axes: Sequence[Axis]) -> None:
    """Refuse an axis that is given twice.

    Raises:
        ValueError: naming it.
    """
    names = [axis.name for axis in axes]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"axis {name!r} is given twice.")


def _number(name: str, text: str) -> float:
    unit, least, most = AXES[name]
    try:
        value = number(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"axis {name!r}: {error}") from None
    if not least <= value <= most:
        raise argparse.ArgumentTypeError(
            f"axis {name!r}: {text!r} is not between {least:g} and {most:g} {display_unit(unit)[0]}".rstrip()
        )
    return value

"""Named robots. Every number of theirs has its source beside it, or the word "chosen"."""

from collections.abc import Callable

from reojax._internal import checks
from reojax.robot import Robot
from reojax.robots.astronaut import astronaut as astronaut
from reojax.robots.edits import (
    with_capsules as with_capsules,
    with_end_inertia as with_end_inertia,
    with_gear_ratio as with_gear_ratio,
    with_limits as with_limits,
    with_rotor_inertia as with_rotor_inertia,
)
from reojax.robots.locking import with_joint_locked as with_joint_locked
from reojax.robots.planar import planar as planar
from reojax.robots.prototype import prototype as prototype
from reojax.robots.quadruped import quadruped as quadruped
from reojax.robots.satellite_arm import satellite_arm as satellite_arm
from reojax.robots.six_body import six_body as six_body
from reojax.robots.two_cylinder_cat import two_cylinder_cat as two_cylinder_cat

_BUILDERS: dict[str, Callable[[], Robot]] = {
    "prototype": prototype,
    "six_body": six_body,
    "planar2": lambda: planar(2),
    "planar3": lambda: planar(3),
    "planar4": lambda: planar(4),
    "two_cylinder_cat": lambda: two_cylinder_cat(0.25),  # about half a turn at a bend of 60 degrees
    "satellite_arm": satellite_arm,
    "quadruped": quadruped,
    "astronaut": astronaut,
}

NAMES = tuple(_BUILDERS)
"""The names that `by_name` knows."""


def by_name(name: str) -> Robot:
    """Build a robot by its name, for command lines.

    Raises:
        ValueError: if `name` is not one of `NAMES`.
    """
    if not isinstance(name, str) or name not in _BUILDERS:
        known = ", ".join(NAMES)
        raise ValueError(
            f"there is no robot named {checks.shorten(name)}; the names are {known}.{checks.did_you_mean(name, NAMES)}"
        )
    return _BUILDERS[name]()

"""The shapes that links are taken to have: capsules, and spheres, which are capsules without length."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import ArrayLike


class Capsule(NamedTuple):
    """All points within `radius` of the straight line from `start` to `end`; a sphere where they are equal."""

    link: int | str
    """Link that carries it, by number or name; of a robot's own capsules, the number."""
    start: ArrayLike
    """(3,) in the link's own frame [m]."""
    end: ArrayLike
    """(3,) likewise [m]."""
    radius: ArrayLike
    """Radius, positive [m]."""

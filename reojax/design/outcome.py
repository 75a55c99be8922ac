"""What a design does, and how its quantities are told: measures, functions of an outcome."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax.collision.path_clearance import PathClearance, path_clearance
from reojax.mechanics.holonomy import net_rotation
from reojax.path import Path
from reojax.robot import Robot


class Outcome:
    """What a design does; its quantities are computed when they are asked for."""

    def __init__(self, values: dict[str, Array], robot: Robot, path: Path, steps: int) -> None:
        """Keep the parts; `Problem.outcome` calls this."""
        self.values, self.robot, self.path, self.steps = values, robot, path, steps

    @cached_property
    def rotation(self) -> Float[Array, "3 3"]:
        """Net rotation of the base after the loop."""
        return net_rotation(self.robot, self.path, steps=self.steps)

    @cached_property
    def clearance(self) -> PathClearance:
        """Least clearance along the whole loop, proven."""
        return path_clearance(self.robot, self.path)


Measure = Callable[[Outcome], Any]
"""A quantity of a design: a scalar, or a vector (k,), traced by JAX. Any function of an `Outcome` will do: it reads
`.values` (by name, SI), `.robot`, `.path`, `.rotation` and `.clearance`."""

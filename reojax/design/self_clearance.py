"""The condition that a robot stays clear of itself along its whole loop, as an inequality that can be tightened."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
import numpy as np

from reojax._internal.arrays import Array
from reojax.collision.clearance import without_pairs
from reojax.collision.constraint import clearance_shortfall
from reojax.optimisation.functions import BLOCK
from reojax.optimisation.optimise import Solution, choose_best
from reojax.optimisation.status import Status

_BETWEEN = 2.0
"""Clearance kept in hand for what lies between samples: for leaving the chord, and for normals that turn."""
TIGHTENED = 3
"""How often at most the condition is tightened where the proof of an answer falls short of it."""


@dataclasses.dataclass(frozen=True)
class ClearBy:
    """A measure, see `reojax.design.clear_by`, which makes it."""

    margin: float
    """Least distance between any two parts of the robot [m]."""
    samples: int | None = None
    """Per edge; None for 256 along the whole loop."""
    spare: float | Array = 0.0
    """Asked for on top, where a proof fell short of the margin [m]; may be traced."""

    def __call__(self, outcome: Any) -> jax.Array:
        """What is missing to the margin, for an inequality.

        Raises:
            ValueError: for a robot without pairs of shapes, on which it would ask for nothing.
        """
        if not outcome.robot.collision_pairs:
            raise ValueError(f"`clear_by` asks for {self.margin:g} m, but {without_pairs(outcome.robot)}")
        wanted = self.margin + self.spare
        return clearance_shortfall(
            outcome.robot, outcome.path.waypoints, wanted, samples=self.samples, between=_BETWEEN
        )

    def tighter(self, share: float | Array) -> ClearBy:
        """The same with `share`, see `share_of`, of a fiftieth of the margin and a tenth of a mm more in hand."""
        return dataclasses.replace(self, spare=(0.02 * abs(self.margin) + 1e-4) * share)


def share_of(level: int) -> float:
    """How much more is asked for at a level: nothing at 0, some at 1, and three times as much at each further one."""
    return 3.0 ** (level - 1) if level else 0.0


def solve_proven(
    x: np.ndarray,
    run: Callable[[np.ndarray, np.ndarray, np.ndarray], Solution],
    kept: Callable[[np.ndarray], np.ndarray],
) -> Solution:
    """Solve, prove the clearance of all answers that have converged, and mend those that fall short.

    These are solved again, each from where it is, with more asked for; one that still falls short has not converged.

    Args:
        x: the starts (m, n).
        run: solves from points (m, n) those of the starts with numbers (m,), tightened by shares (m,), see `share_of`.
        kept: which of some points (r, n) are proven to keep the clearance.
    """
    every = np.arange(len(x))

    def tightened(x: np.ndarray, rows: np.ndarray, level: int) -> Solution:
        """A whole block of rows at least, for one program serves all levels; those that fill it up end at once."""
        block = every[: max(len(rows), BLOCK)]
        fill = np.minimum(block, len(rows) - 1)
        found = run(x[fill], rows[fill], np.where(block < len(rows), share_of(level), np.nan))
        fields = {name: value[: len(rows)] for name, value in found._asdict().items() if name != "best"}
        return Solution(**fields, best=0)

    found = tightened(x, every, 0)
    fields = {name: np.array(value) for name, value in found._asdict().items() if name != "best"}
    short = np.flatnonzero(found.converged)
    for level in range(1, TIGHTENED + 2):
        short = short[~kept(fields["value"][short])] if len(short) else short
        if not len(short):
            break
        if level > TIGHTENED:
            fields["converged"][short], fields["status"][short] = False, Status.NOT_FOUND
            break
        again, before = tightened(fields["value"][short], short, level), fields["steps"][short]
        for name, value in fields.items():
            value[short] = getattr(again, name)
        fields["steps"][short] += before
        short = short[fields["converged"][short]]
    best = choose_best(*(fields[name] for name in ("cost", "residual", "converged")))
    return Solution(**fields, best=int(best))

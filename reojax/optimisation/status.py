"""How a solver ended: one enumeration for every solver of the library, with a text that a person can read."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np


class Status(IntEnum):
    """Why a solver stopped. Results hold it as an integer, or an array of them, so that they stay arrays throughout.

    `Status(code).text` says it in words, and `describe` does so for a whole array.
    """

    CONVERGED = 0
    OUT_OF_STEPS = 1
    STALLED = 2
    NOT_FINITE = 3
    INFEASIBLE = 4
    NOT_FOUND = 5
    UNREACHABLE = 6
    SATURATED = 7

    @property
    def text(self) -> str:
        """What it means, in words."""
        return _TEXTS[self]


_TEXTS = {
    Status.CONVERGED: "converged",
    Status.OUT_OF_STEPS: "out of steps: it was still getting better; allow more",
    Status.STALLED: "stalled: no step improves it, though the tolerances are not met (rounding, a kink, a plateau)",
    Status.NOT_FINITE: "not finite: a function or a derivative is NaN or infinite at the start",
    Status.INFEASIBLE: "infeasible: near here the constraints cannot all be met; this is where they are violated least",
    Status.NOT_FOUND: "not found: the search ended without an answer within the tolerance, which proves nothing",
    Status.UNREACHABLE: "unreachable: no answer exists within the limits given",
    Status.SATURATED: "saturated: what was asked for is more than the motors can give at times",
}


def describe(status: Any) -> str | list[str]:
    """Return the text of one status, or the texts of an array (m,) of them.

    Raises:
        ValueError: for a number that is no status.
    """
    codes = np.asarray(status)
    if codes.ndim:
        return [Status(int(code)).text for code in codes.ravel()]
    return Status(int(codes)).text


@property
def residual_by_another_name(result: Any) -> Any:
    """Another name for `residual`, one that all solvers' results have: a property for classes that have it."""
    return result.residual


@property
def converged_by_status(result: Any) -> Any:
    """Whether it converged: a property for classes of results that have a `status`."""
    return result.status == Status.CONVERGED


@property
def message_of_status(result: Any) -> Any:
    """How it ended, in words; of many a list: a property for classes of results that have a `status`."""
    return describe(result.status)

"""The words that answers of planning share with all solvers' results, and how one of many answers is taken out."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float

Answer = TypeVar("Answer", bound=tuple)


@property
def corners_as_value(answer: Any) -> Float[np.ndarray, "*m v j"]:
    """The corners, under the name that all solvers' results have."""
    return answer.waypoints


@property
def travel_as_cost(answer: Any) -> Float[np.ndarray, "*m"]:
    """Joint travel [rad]."""
    return answer.travel


@property
def no_violation(answer: Any) -> Float[np.ndarray, "*m"]:
    """How far a joint passes its limits [rad]: 0, as no answer ever leaves its box."""
    return np.zeros_like(answer.error)


@property
def status_as_message(answer: Any) -> Any:
    """How it ended: `status`, under the name that all solvers' results have."""
    return answer.status


def first_of(many: Answer) -> Answer:
    """Return the one answer of many."""
    fields = {name: None if field is None else field[0] for name, field in many._asdict().items()}  # pyright: ignore
    return type(many)(**fields | {"status": str(fields["status"])})

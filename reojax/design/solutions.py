"""Answers of many problems from many starts each, and which of them are best."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from reojax.optimisation.optimise import Solution, choose_best
from reojax.optimisation.status import describe, residual_by_another_name


class Solutions(NamedTuple):
    """Answers of k problems from s starts each; fields as those of `Solution`."""

    value: Float[np.ndarray, "k s n"]
    cost: Float[np.ndarray, "k s"]
    residual: Float[np.ndarray, "k s"]
    slope: Float[np.ndarray, "k s"]
    steps: Int[np.ndarray, "k s"]
    converged: Bool[np.ndarray, "k s"]
    status: Int[np.ndarray, "k s"]
    best: Int[np.ndarray, " k"]
    """Which start is best for each problem: of least cost among the converged, else of least residual."""

    violation = residual_by_another_name
    """Largest violation of a constraint, under the names that all solvers' results have."""
    error = residual_by_another_name
    """The same."""

    @property
    def message(self) -> list[list[str]]:
        """Why each start of each problem ended, in words."""
        return [list(describe(row)) for row in self.status]

    def __str__(self) -> str:
        """How many problems have an answer."""
        problems, starts = self.converged.shape
        return (
            f"{problems} problems from {starts} starts each, {int(self.converged.any(1).sum())} of them with an answer"
        )

    def pick(self) -> Solution:
        """The best answer of each problem, the problems in front."""
        rows = np.arange(len(self.best)), self.best
        fields = {name: value[rows] for name, value in self._asdict().items() if name != "best"}
        best = choose_best(*(fields[name] for name in ("cost", "residual", "converged")))
        return Solution(**fields, best=int(best))

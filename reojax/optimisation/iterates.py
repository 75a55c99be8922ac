"""What sequential quadratic programming goes on with: the scaled problem, and all starts on their way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from reojax.optimisation.functions import Derivatives, Programs, Values
from reojax.optimisation.merit import largest_violation, stationarity
from reojax.optimisation.status import Status

RUNNING = -1
"""Status of a start that goes on."""
_LEAST_SCALE = 1e-2
"""Rows that look flat at the start are not blown up by more than this."""


class ScaledProblem(NamedTuple):
    """The functions, and what the variables of each start may be, in scaled variables."""

    programs: Programs
    lower: Float[np.ndarray, "m n"]
    upper: Float[np.ndarray, "m n"]
    scale: Float[np.ndarray, " n"]
    precision: float
    """Rounding of the functions, relative."""
    tolerance: float
    """For the constraints, in the user's own units."""
    slope_tolerance: float
    max_steps: int

    def values(self, x: np.ndarray, owner: np.ndarray) -> Values:
        """At scaled points."""
        return self.programs.values(x * self.scale, owner)

    def derivatives(self, x: np.ndarray, owner: np.ndarray) -> tuple[Values, Derivatives]:
        """By the scaled variables; zero by those that are held, whatever the functions say."""
        values, slopes = self.programs.derivatives(x * self.scale, owner)
        free = (self.upper > self.lower)[owner]
        gradient = np.where(free, slopes.gradient * self.scale, 0.0)
        return values, Derivatives(gradient, np.where(free[:, None], slopes.jacobian * self.scale, 0.0))


@dataclass
class Iterates:
    """All starts on their way, one a row. Scaled: `cost` by `cost_scale`, constraint rows by `row_scale`."""

    x: Float[np.ndarray, "m n"]
    """Where each is."""
    f: Float[np.ndarray, " m"]
    c: Float[np.ndarray, "m q"]
    gradient: Float[np.ndarray, "m n"]
    jacobian: Float[np.ndarray, "m q n"]
    cost_scale: Float[np.ndarray, " m"]
    row_scale: Float[np.ndarray, "m q"]
    hessian: Float[np.ndarray, "m n n"]
    """B."""
    fresh: Bool[np.ndarray, " m"]
    """Whether B has not yet been measured."""
    damping: Float[np.ndarray, " m"]
    """What B is a multiple of when it begins again after a failed step."""
    multipliers: Float[np.ndarray, "m q"]
    """Of the constraints, from the last program that could meet them."""
    penalty: Float[np.ndarray, "m q"]
    restoring: Bool[np.ndarray, " m"]
    """Whether the last program could not, so that the step restores feasibility."""
    step: Float[np.ndarray, "m n"]
    reduction: Float[np.ndarray, " m"]
    """Change of the merit that the program predicts, not positive."""
    rounding: Float[np.ndarray, " m"]
    """Of the merit."""
    here: Float[np.ndarray, " m"]
    """The merit at x."""
    trial: Float[np.ndarray, "m n"]
    """The point to differentiate next."""
    chosen: Bool[np.ndarray, " m"]
    """Whether the trial point is taken wherever the functions are finite."""
    slope: Float[np.ndarray, " m"]
    """Stationarity at x."""
    steps: Int[np.ndarray, " m"]
    stalled_steps: Int[np.ndarray, " m"]
    arrived: Bool[np.ndarray, " m"]
    """Whether both tolerances were met at x when it was reached."""
    restarts: Int[np.ndarray, " m"]
    nearest: list[tuple[float, np.ndarray, float, np.ndarray] | None]
    """Least violation where a start was moved aside, with x, f and c there."""
    status: Int[np.ndarray, " m"]
    equalities: int

    @property
    def cost(self) -> Float[np.ndarray, " m"]:
        """In the user's units."""
        return self.f * self.cost_scale

    @property
    def violation(self) -> Float[np.ndarray, " m"]:
        """Largest of each start, in the user's units."""
        return largest_violation(self.c * self.row_scale, self.equalities)


def begin(problem: ScaledProblem, x: np.ndarray, values: Values, slopes: Derivatives) -> Iterates:
    """Before the first step. Scales are the largest derivatives."""
    m, n = x.shape
    finite = all_finite(values, *slopes)
    steepest = np.abs(np.where(finite[:, None], slopes.gradient, 0.0)).max(1)
    cost_scale = np.where(steepest > 0, steepest, 1.0)
    steepest = np.abs(np.where(finite[:, None, None], slopes.jacobian, 0.0)).max(2)
    row_scale = np.where(steepest > 0, np.maximum(steepest, _LEAST_SCALE), 1.0)
    q = row_scale.shape[1]
    return Iterates(
        x=x.copy(),
        f=np.full(m, np.inf),
        c=np.zeros((m, q)),
        gradient=np.zeros((m, n)),
        jacobian=np.zeros((m, q, n)),
        cost_scale=cost_scale,
        row_scale=row_scale,
        hessian=np.tile(np.eye(n), (m, 1, 1)),
        fresh=np.ones(m, bool),
        damping=np.ones(m),
        multipliers=np.zeros((m, q)),
        penalty=np.zeros((m, q)),
        restoring=np.zeros(m, bool),
        step=np.zeros((m, n)),
        reduction=np.zeros(m),
        rounding=np.zeros(m),
        here=np.full(m, np.inf),
        trial=x.copy(),
        chosen=np.ones(m, bool),
        slope=np.full(m, np.inf),
        steps=np.zeros(m, int),
        stalled_steps=np.zeros(m, int),
        arrived=np.zeros(m, bool),
        restarts=np.zeros(m, int),
        nearest=[None] * m,
        status=np.where(finite, RUNNING, Status.NOT_FINITE),
        equalities=problem.programs.equalities,
    )


def all_finite(values: Values, gradient: np.ndarray, jacobian: np.ndarray) -> Bool[np.ndarray, " r"]:
    """Whether everything is finite at each of r points."""
    parts = (values.cost[:, None], values.rows, gradient, jacobian.reshape(len(gradient), -1))
    return np.asarray(np.stack([np.isfinite(part).all(1) for part in parts]).all(0))


def lagrangian_gradient(run: Iterates, who: np.ndarray) -> Float[np.ndarray, "r n"]:
    """Gradient of cost and constraints by their multipliers, at x."""
    return run.gradient[who] + (run.multipliers[who][:, None] @ run.jacobian[who])[:, 0]


def stationarity_of(problem: ScaledProblem, run: Iterates, who: np.ndarray) -> Float[np.ndarray, " r"]:
    """How far each start is from a stationary point, by its multipliers."""
    gradient, slack = lagrangian_gradient(run, who), -run.c[who, run.equalities :]
    box = problem.lower[who], problem.upper[who]
    return stationarity(run.x[who], gradient, run.multipliers[who, run.equalities :], slack, *box)


def within_tolerances(problem: ScaledProblem, run: Iterates, who: np.ndarray) -> Bool[np.ndarray, " r"]:
    """Whether both tolerances are met at x."""
    worst = largest_violation(run.c[who] * run.row_scale[who], run.equalities)
    return (worst <= problem.tolerance) & (run.slope[who] <= problem.slope_tolerance)

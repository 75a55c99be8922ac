"""Constrained minimisation from many starts at once, or of many problems at once."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike
from tqdm import tqdm

from reojax._internal import checks
from reojax._internal.precision import warn_user
from reojax._internal.progress import label
from reojax.optimisation.arguments import Box, check_starts, check_tolerances
from reojax.optimisation.functions import Function, Functions, Given, Programs
from reojax.optimisation.iterates import Iterates, ScaledProblem
from reojax.optimisation.sqp import minimise
from reojax.optimisation.status import Status, describe, residual_by_another_name

_LEAST_SINGLE = 1e-6
"""Smallest tolerance that single precision can meet, for constraints of about 1."""


class Limits(NamedTuple):
    """When a start ends, and what is shown meanwhile: arguments of `optimise`."""

    tolerance: float
    slope_tolerance: float
    max_steps: int
    progress: bool | str


class Solution(NamedTuple):
    """Where the starts ended; all fields but `best` have the starts in front."""

    value: Float[np.ndarray, "m n"]
    """The points, within the bounds."""
    cost: Float[np.ndarray, " m"]
    """Their costs; infinite where the functions are not finite at the start."""
    residual: Float[np.ndarray, " m"]
    """Largest violation of a constraint, in the units of `equality` and `inequality`."""
    slope: Float[np.ndarray, " m"]
    """Stationarity: largest component of the Lagrangian's gradient, by variables in units of their ranges and relative
    to the cost's own largest component at the start; components that press against a bound do not count. 0 at an
    optimum."""
    steps: Int[np.ndarray, " m"]
    """Steps taken: quadratic programs solved, each at a point with new derivatives."""
    converged: Bool[np.ndarray, " m"]
    """Whether `residual` and `slope` are within their tolerances."""
    best: int
    """Least cost among the converged, else least residual. Of no meaning when every start has a problem of its own."""
    status: Int[np.ndarray, " m"]
    """Why each start ended, a `reojax.optimisation.status.Status`; `message` says it in words."""

    violation = residual_by_another_name
    """Largest violation of a constraint, under the names that all solvers' results have."""
    error = residual_by_another_name
    """The same."""

    @property
    def message(self) -> list[str]:
        """Why each start ended, in words."""
        return list(describe(self.status))

    def __str__(self) -> str:
        """How many starts have converged, and the best."""
        best, count = self.best, len(self.converged)
        figures = f"cost {self.cost[best]:.6g}, violation {self.residual[best]:.1e}, slope {self.slope[best]:.1e}"
        return f"{int(self.converged.sum())} of {count} converged; the best: {figures}; {self.message[best]}"


def optimise(
    cost: Function,
    starts: ArrayLike,
    *,
    lower: ArrayLike,
    upper: ArrayLike,
    equality: Function | Sequence[Function] | None = None,
    inequality: Function | Sequence[Function] | None = None,
    data: Any = None,
    scale: ArrayLike | None = None,
    tolerance: float = 1e-8,
    slope_tolerance: float = 1e-6,
    max_steps: int = 200,
    progress: bool | str = False,
) -> Solution:
    """Minimise `cost(x)` with `equality(x) = 0`, `inequality(x) <= 0`, `lower <= x <= upper`, from every start.

    Sequential quadratic programming, see `reojax.optimisation.sqp`: values and exact first derivatives of all running
    starts come from compiled programs in blocks, the quadratic programs are solved on the host in double precision.
    Functions are written for one point in JAX. They are compiled once for the same function objects, shapes and dtypes:
    define functions outside of loops, and pass what changes as `data`. Local: an answer is the least cost near its
    start, so give many starts and look at `converged`. It never raises once it has begun; a start where something is
    not finite ends with `converged` False and does not touch the others, and no start's answer depends on others.

    Args:
        cost: x (n,) to a scalar; with `data`, (x, the start's data) to a scalar. So for the other functions.
        starts: (n,), taken as one start, or (m, n), within the bounds.
        lower: number, (n,) or (m, n), may be -inf; equal to `upper` for a variable that is held.
        upper: number, (n,) or (m, n), may be inf.
        equality: to (p,), must be 0; default none. Several functions are differentiated apart, each its own way.
        inequality: to (q,), must be at most 0; default none; or several.
        data: pytree of arrays with the starts in front: start i solves the problem of `data[i]`.
        scale: number or (n,), typical sizes of change; default `upper - lower`, or 1 where that is infinite or zero.
        tolerance: largest violation of a constraint, in its units. Something near 1e-5 in float32.
        slope_tolerance: largest slope, see `Solution`.
        max_steps: most steps of a start.
        progress: whether to show a bar on stderr, or what to write before it.

    Raises:
        ValueError: naming the argument, its value and the rule, for bounds the wrong way round, a start outside,
            wrong shapes, a cost that is not a real scalar or constraints that are not real vectors.
    """
    check_starts(starts, lower, upper, scale, data)
    takes = ("x",) if data is None else ("x", "data")
    checks.function("cost", cost, *takes)
    both = _several("equality", equality, takes), _several("inequality", inequality, takes)
    functions = Functions(cost, *both, data is not None)
    limits = Limits(tolerance, slope_tolerance, max_steps, progress)
    return _run(functions, starts, (lower, upper, scale), Given(data, None), limits)


def optimise_together(
    function: Function,
    starts: ArrayLike,
    *,
    lower: ArrayLike,
    upper: ArrayLike,
    data: Any = None,
    shared: Any = None,
    scale: ArrayLike | None = None,
    tolerance: float = 1e-8,
    slope_tolerance: float = 1e-6,
    max_steps: int = 200,
    progress: bool | str = False,
) -> Solution:
    """As `optimise`, of one `function` to (cost, equality, inequality), for these share most of their work.

    It takes x (n,), the start's data, and `shared`, a pytree of arrays that is the same for all starts. What is
    compiled is kept for all functions that are equal: a frozen dataclass with a `__call__` will do.
    """
    functions = Functions(None, (), (), True, function)
    limits = Limits(tolerance, slope_tolerance, max_steps, progress)
    return _run(functions, starts, (lower, upper, scale), Given(data, shared), limits)


def _run(
    functions: Functions, starts: ArrayLike, bounds: tuple[Any, Any, Any], given: Given, limits: Limits
) -> Solution:
    """Check starts, bounds (least, largest, scale) and limits; compile; run all starts to their ends."""
    x, box = check_starts(starts, *bounds, given.data)
    check_tolerances(tolerance=limits.tolerance, slope_tolerance=limits.slope_tolerance)
    checks.whole("max_steps", limits.max_steps)
    if x.dtype == np.float32 and limits.tolerance < _LEAST_SINGLE:
        warn_user(
            f"`tolerance` is {limits.tolerance:g}, which single precision, JAX's default, seldom meets: switch double "
            'precision on by jax.config.update("jax_enable_x64", True) before anything is computed, or ask for 1e-5.'
        )
    problem = ScaledProblem(
        programs=Programs(functions, x, *given),
        lower=box.lower / box.scale,
        upper=box.upper / box.scale,
        scale=box.scale,
        precision=float(np.finfo(x.dtype).eps),
        tolerance=float(limits.tolerance),
        slope_tolerance=float(limits.slope_tolerance),
        max_steps=int(limits.max_steps),
    )
    hidden = not limits.progress
    with tqdm(total=len(x), desc=label(limits.progress), unit="start", file=sys.stderr, disable=hidden) as bar:
        ended = minimise(problem, x / box.scale, lambda count: bar.update(count - bar.n))
    return _solution(ended, box, x.dtype)


def choose_best(
    cost: Float[np.ndarray, "*k m"], residual: Float[np.ndarray, "*k m"], converged: Bool[np.ndarray, "*k m"]
) -> Int[np.ndarray, "*k"]:
    """Of m answers the number of the one of least cost among the converged, else of least residual."""
    least = np.where(converged, cost, np.inf).argmin(-1)
    return np.where(converged.any(-1), least, residual.argmin(-1))


def _several(
    entry: str, functions: Function | Sequence[Function] | None, takes: tuple[str, ...]
) -> tuple[Function, ...]:
    if functions is None:
        return ()
    listed = [functions] if callable(functions) else checks.listing(entry, functions, "functions")
    return tuple(checks.function(f"{entry}[{i}]", function, *takes) for i, function in enumerate(listed))


def _solution(ended: Iterates, box: Box, dtype: np.dtype) -> Solution:
    begun = ended.status != Status.NOT_FINITE
    cost, residual, slope = (
        np.where(begun, a, np.inf).astype(dtype) for a in (ended.cost, ended.violation, ended.slope)
    )
    converged = ended.status == Status.CONVERGED
    return Solution(
        value=np.clip((ended.x * box.scale).astype(dtype), box.lower, box.upper),
        cost=cost,
        residual=residual,
        slope=slope,
        steps=ended.steps,
        converged=converged,
        best=int(choose_best(cost, residual, converged)),
        status=ended.status,
    )

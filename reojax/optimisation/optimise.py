"""Constrained minimisation from many starts at once, or of many problems at once."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike
from tqdm import tqdm

from reojax._internal import checks
from reojax._internal.arrays import Array, as_numbers, common_float
from reojax.optimisation.sqp import (
    CONVERGED,
    NOT_FINITE,
    RUNNING,
    Iterate,
    Subproblem,
    Values,
    advance,
    begin,
    residual,
)

Function = Callable[..., Any]
_CHUNK = 10
"""Steps between two looks from outside: for progress, for Ctrl-C, and for stopping when all are done."""


class Solution(NamedTuple):
    """Where the starts ended; all fields but `best` have the starts in front."""

    value: Float[np.ndarray, "m n"]
    """The points, within the bounds."""
    cost: Float[np.ndarray, " m"]
    """Their costs; infinite where the functions are not finite at the start."""
    residual: Float[np.ndarray, " m"]
    """Largest violation of a constraint, in the units of `equality` and `inequality`."""
    slope: Float[np.ndarray, " m"]
    """Largest component of the Lagrangian's gradient, by variables in units of their ranges and relative to the
    cost's own largest component at the start; components that press against a bound do not count. 0 at an optimum."""
    steps: Int[np.ndarray, " m"]
    """Steps taken, each with one gradient and 12 evaluations of all functions."""
    converged: Bool[np.ndarray, " m"]
    """Whether `residual` and `slope` are within their tolerances."""
    best: int
    """Least cost among the converged, else least residual. Of no meaning when every start has a problem of its own."""


def optimise(
    cost: Function,
    starts: ArrayLike,
    *,
    lower: ArrayLike,
    upper: ArrayLike,
    equality: Function | None = None,
    inequality: Function | None = None,
    data: Any = None,
    scale: ArrayLike | None = None,
    tolerance: float = 1e-8,
    slope_tolerance: float = 1e-6,
    max_steps: int = 200,
    progress: str | None = None,
) -> Solution:
    """Minimise `cost(x)` with `equality(x) = 0`, `inequality(x) <= 0`, `lower <= x <= upper`, from every start.

    Sequential quadratic programming (`_steps.py`), all starts side by side in one program. Functions are written for
    one point in JAX; they are differentiated here, once. The program is compiled once for the same function objects,
    shapes and dtypes: define functions outside of loops, and pass what changes as `data`. Local: an answer is the
    least cost near its start, so give many starts and look at `converged`. It never raises once it has begun; a start
    where something is not finite ends with `converged` False and does not touch the others.

    Args:
        cost: x (n,) to a scalar; with `data`, (x, the start's data) to a scalar. So for the other functions.
        starts: (n,), taken as one start, or (m, n), within the bounds.
        lower: number or (n,), may be -inf; equal to `upper` for a variable that is held.
        upper: number or (n,), may be inf.
        equality: to (p,), must be 0; default none.
        inequality: to (q,), must be at most 0; default none.
        data: pytree of arrays with the starts in front: start i solves the problem of `data[i]`.
        scale: number or (n,), typical sizes of change; default `upper - lower`, or 1 where that is infinite.
        tolerance: largest violation of a constraint, in its units. Something near 1e-5 in float32.
        slope_tolerance: largest slope, see `Solution`.
        max_steps: most steps of a start.
        progress: what to write before a bar on stderr; default no bar.

    Raises:
        ValueError: naming the argument, its value and the rule, for bounds the wrong way round, a start outside,
            wrong shapes, a cost that is not a scalar or constraints that are not vectors.
    """
    x, bounds = check_starts(starts, lower, upper, scale, data)
    for entry, number in (("tolerance", tolerance), ("slope_tolerance", slope_tolerance)):
        if not np.isfinite(number) or number <= 0:
            raise ValueError(f"`{entry}` is {number!r}; it must be a positive number.")
    checks.whole("max_steps", max_steps)
    functions = _Functions(cost, equality, inequality, data is not None)
    data = jax.tree.map(jnp.asarray, data)
    _check_functions(functions, x, data)
    limits = {"tolerance": tolerance, "slope_tolerance": slope_tolerance}
    fixed = _Fixed(**bounds, **{name: np.asarray(limit, x.dtype) for name, limit in limits.items()})
    state = _begin(functions, x, data, fixed)
    for steps in _rounds(max_steps, progress):
        state = _advance(functions, state, data, fixed, steps)
        if not (np.asarray(state.status) == RUNNING).any():
            break
    return _solution(state, fixed)


class _Functions(NamedTuple):
    """What is compiled; hashable, as the key under which JAX keeps the program."""

    cost: Function
    equality: Function | None
    inequality: Function | None
    with_data: bool

    def call(self, function: Function | None, x: Array, data: Any) -> Array:
        if function is None:
            return jnp.zeros(0, x.dtype)
        return jnp.asarray(function(x, data) if self.with_data else function(x), x.dtype)

    def values(self, x: Array, data: Any) -> Values:
        return Values(*(self.call(function, x, data) for function in self[:3]))

    def derivatives(self, x: Array, data: Any) -> tuple[Values, Values]:
        pairs = [_with_gradient(lambda x, f=function: self.call(f, x, data), x) for function in self[:3]]
        return Values(*(value for value, _ in pairs)), Values(*(gradient for _, gradient in pairs))


def _with_gradient(function: Function, x: Array) -> tuple[Array, Array]:
    """Value and gradient (last axis) by the mode that needs fewer passes."""
    shape = jax.eval_shape(function, x).shape
    rows = int(np.prod(shape))
    if not rows:
        return jnp.zeros(shape, x.dtype), jnp.zeros((*shape, x.shape[0]), x.dtype)
    mode = jax.jacfwd if x.shape[0] < rows else jax.jacrev
    gradient, value = mode(lambda x: (function(x),) * 2, has_aux=True)(x)
    return value, gradient


def _problem(functions: _Functions, data: Any, fixed: "_Fixed") -> Subproblem:
    size = fixed.size

    def differentiate(x: Array) -> tuple[Values, Values]:
        values, slopes = functions.derivatives(x * size, data)
        return values, jax.tree.map(lambda slope: slope * jnp.broadcast_to(size, slope.shape), slopes)

    return Subproblem(
        evaluate=lambda x: functions.values(x * size, data),
        differentiate=differentiate,
        lower=fixed.lower / size,
        upper=fixed.upper / size,
        tolerance=fixed.tolerance,
        slope_tolerance=fixed.slope_tolerance,
    )


class _Fixed(NamedTuple):
    """What all starts share."""

    lower: Any
    upper: Any
    size: Any
    tolerance: Any
    slope_tolerance: Any


@partial(jax.jit, static_argnums=0)
def _begin(functions: _Functions, x: Array, data: Any, fixed: _Fixed) -> Iterate:
    return jax.vmap(lambda x, data: begin(_problem(functions, data, fixed), x / fixed.size))(x, data)


@partial(jax.jit, static_argnums=0)
def _advance(functions: _Functions, state: Iterate, data: Any, fixed: _Fixed, steps: Array) -> Iterate:
    def step(state: Iterate) -> Iterate:
        return jax.vmap(lambda state, data: advance(_problem(functions, data, fixed), state))(state, data)

    def going(carry: tuple[Array, Iterate]) -> Array:
        return (carry[0] < steps) & (carry[1].status == RUNNING).any()

    return jax.lax.while_loop(going, lambda carry: (carry[0] + 1, step(carry[1])), (jnp.zeros_like(steps), state))[1]


def _rounds(max_steps: int, progress: str | None) -> Iterator[np.int32]:
    """How many steps to take next, with a bar if it has a name."""
    done = 0
    with tqdm(total=max_steps, desc=progress, unit="step", file=sys.stderr, disable=progress is None) as bar:
        while done < max_steps:
            now = min(_CHUNK, max_steps - done)
            yield np.int32(now)
            done += now
            bar.update(now)


def _solution(state: Iterate, fixed: _Fixed) -> Solution:
    x = np.clip(np.asarray(state.x * fixed.size[None]), fixed.lower[None], fixed.upper[None])

    begun = np.asarray(state.status) != NOT_FINITE
    cost, miss, slope = (
        np.where(begun, np.asarray(array), np.inf) for array in (state.now.cost, residual(state.now), state.slope)
    )
    converged = np.asarray(state.status) == CONVERGED
    best = np.argmin(np.where(converged, cost, np.inf)) if converged.any() else np.argmin(miss)
    return Solution(x, cost, miss, slope, np.asarray(state.steps), converged, int(best))


def check_starts(starts: Any, lower: Any, upper: Any, scale: Any, data: Any) -> tuple[Array, dict[str, np.ndarray]]:
    """Starts as (m, n), and bounds and sizes as (n,)."""
    x = np.asarray(as_numbers("starts", starts))
    x = x[None] if x.ndim == 1 else x
    if x.ndim != 2 or not x.size:
        raise ValueError(f"`starts` has shape {x.shape}; it must be (n,) or (m, n), with at least one of each.")
    dtype = common_float(x)
    n = x.shape[1]

    def per_variable(entry: str, value: Any) -> np.ndarray:
        array = np.asarray(as_numbers(entry, value), dtype)
        if array.shape not in ((), (n,)):
            raise ValueError(f"`{entry}` has shape {array.shape}; it must be one number or ({n},).")
        return np.broadcast_to(array, (n,))

    x, low, high = np.asarray(x, dtype), per_variable("lower", lower), per_variable("upper", upper)
    for k in np.flatnonzero(~(low <= high)):
        raise ValueError(f"lower[{k}] is {low[k]:g} and upper[{k}] is {high[k]:g}; bounds must be numbers in order.")
    for i, k in np.argwhere(~((low <= x) & (x <= high) & np.isfinite(x))):
        raise ValueError(f"starts[{i}, {k}] is {x[i, k]:g}; it must be from {low[k]:g} to {high[k]:g}, and finite.")
    width = np.where(np.isfinite(high - low) & (high > low), high - low, 1.0)
    size = width if scale is None else per_variable("scale", scale)
    for k in np.flatnonzero(~((size > 0) & np.isfinite(size))):
        raise ValueError(f"scale[{k}] is {size[k]:g}; it must be positive and finite.")
    for leaf in jax.tree.leaves(data):
        if np.shape(leaf)[:1] != (len(x),):
            raise ValueError(
                f"`data` has an array of shape {np.shape(leaf)}; with {len(x)} starts, {len(x)} come first."
            )
    return jnp.asarray(x), {"lower": low, "upper": high, "size": size}


def _check_functions(functions: _Functions, x: Array, data: Any) -> None:
    one = jax.eval_shape(lambda x, data: functions.values(x[0], jax.tree.map(lambda leaf: leaf[0], data)), x, data)
    for entry, got, rank, rule in (
        ("cost", one.cost, 0, "a scalar"),
        ("equality", one.vanish, 1, "a vector (p,)"),
        ("inequality", one.below, 1, "a vector (q,)"),
    ):
        if got.ndim != rank:
            raise ValueError(f"`{entry}` returns an array of shape {got.shape}; it must return {rule}.")

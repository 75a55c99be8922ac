"""One start of a constrained minimisation: sequential quadratic programming with an exact penalty.

Scaled so that variables range over about 1 and gradients are about 1 at the start. A step from x solves

    minimise  g.d + d.B d / 2 + price * violation of (c + J d)    within bounds and |d| <= radius,

with exact first derivatives and B a damped BFGS estimate of the Lagrangian's Hessian (M. J. D. Powell, Numerical
Analysis, Dundee 1977, 144-157). Because the price is finite the program always has an answer. The step is shortened
along the line x + a d, and then along the arc x + a d + a^2 e whose bend e takes back what the constraints' curvature
has added (D. Q. Mayne, E. Polak, Math. Programming Study 16, 45-61, 1982): of all these points the one of least
`cost + price * violation` is taken. Without the arc, steps along strongly curved constraints (the net rotation of
a loop is one) become short.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from reojax._internal.arrays import Array
from reojax._internal.linalg import factor, solve_factored
from reojax.optimisation.interior_point import Quadratic, solve_quadratic

LENGTHS = np.array([1.0, 0.5, 0.25, 0.1, 0.03, 0.004])
"""Fractions of a step that are tried, on the line and on the arc."""
_FIRST_RADIUS, _LARGEST_RADIUS, _LEAST_RADIUS = 0.5, 2.0, 1e-9
_STILL, _PATIENCE = 1e-9, 12
"""Steps shorter than this, so many in a row, end a start; the price can rise to its largest meanwhile."""
_FIRST_PRICE, _HEMMED_PRICE, _LARGEST_PRICE = 100.0, 300.0, 1e5
RUNNING, CONVERGED, STALLED, NOT_FINITE = range(4)


class Values(NamedTuple):
    """Cost and constraints of a point."""

    cost: Array
    vanish: Array
    """Must be 0."""
    below: Array
    """Must not be positive."""


class Subproblem(NamedTuple):
    """The functions of a problem at its data, and its bounds, in the scaled variables."""

    evaluate: Callable[[Array], Values]
    differentiate: Callable[[Array], tuple[Values, Values]]
    """Values and their gradients by the variables (last axis)."""
    lower: Array
    upper: Array
    tolerance: Array
    """For the constraints in the user's own units."""
    slope_tolerance: Array


class Iterate(NamedTuple):
    """A start on its way: where it was last differentiated, and where it goes next."""

    x: Array
    now: Values
    slopes: Values
    ahead: Array
    """The point to differentiate next."""
    multipliers: Array
    """Of the program that led there, all rows."""
    scale: Values
    """What cost and constraints are divided by."""
    curvature: Array
    fresh: Array
    """Whether the curvature has not yet been measured."""
    price: Array
    radius: Array
    slope: Array
    steps: Array
    still: Array
    """Steps since one that went anywhere."""
    status: Array


def begin(problem: Subproblem, x: Array) -> Iterate:
    """Return the state before the first step; nothing is evaluated yet."""
    n, dtype = x.shape[0], x.dtype
    shape = jax.eval_shape(problem.evaluate, x)
    now = jax.tree.map(lambda value: jnp.zeros(value.shape, dtype), shape)
    slopes = jax.tree.map(lambda value: jnp.zeros((*value.shape, n), dtype), shape)
    return Iterate(
        x=x,
        now=now,
        slopes=slopes,
        ahead=x,
        multipliers=jnp.zeros(now.vanish.size + now.below.size, dtype),
        scale=jax.tree.map(jnp.ones_like, now),
        curvature=jnp.eye(n, dtype=dtype),
        fresh=jnp.asarray(True),
        price=jnp.asarray(_FIRST_PRICE, dtype),
        radius=jnp.asarray(_FIRST_RADIUS, dtype),
        slope=jnp.asarray(jnp.inf, dtype),
        steps=jnp.zeros((), jnp.int32),
        still=jnp.zeros((), jnp.int32),
        status=jnp.asarray(RUNNING, jnp.int32),
    )


def advance(problem: Subproblem, state: Iterate) -> Iterate:
    """Differentiate at the point ahead, and choose the next one; unless the start has ended."""
    now, slopes = problem.differentiate(state.ahead)
    first, finite = state.steps == 0, _finite(now, slopes)
    here = state._replace(
        x=state.ahead,
        now=now,
        slopes=slopes,
        scale=jax.tree.map(lambda a, b: jnp.where(first, a, b), _scale(slopes), state.scale),
    )
    here = jax.tree.map(lambda a, b: jnp.where(finite, a, b), here, state)  # not finite: stay where it was
    before, after = (_lagrangian_slope(s) for s in (state._replace(scale=here.scale), here))
    change = jnp.where(problem.upper > problem.lower, after - before, 0.0)  # held variables stay out of the curvature
    curvature, fresh = _measure(state, here.x - state.x, change, ~first)
    radius = jnp.where(finite, here.radius, 0.2 * here.radius)
    here = here._replace(curvature=curvature, fresh=fresh, slope=_slope(problem, here, after), radius=radius)
    met = finite & (residual(here.now) <= problem.tolerance) & (here.slope <= problem.slope_tolerance)

    program = _program(problem, here)
    d, multipliers = solve_quadratic(program)
    ahead, better = _search(problem, here, program, d)
    length = jnp.where(better, jnp.abs(ahead - here.x).max(), 0.0)
    wide = jnp.where(length >= 0.9 * here.radius, 2 * here.radius, jnp.maximum(2 * length, 0.5 * here.radius))
    radius = jnp.where(better, jnp.minimum(wide, _LARGEST_RADIUS), 0.2 * here.radius)
    still = jnp.where(length < _STILL, state.still + 1, 0)
    stalled = (~better & (radius < _LEAST_RADIUS)) | (still >= _PATIENCE)
    status = jnp.where(met, CONVERGED, jnp.where(first & ~finite, NOT_FINITE, jnp.where(stalled, STALLED, RUNNING)))
    new = here._replace(
        ahead=jnp.where(better, ahead, here.x),
        multipliers=jnp.where(met, here.multipliers, multipliers),
        curvature=jnp.where(better, here.curvature, jnp.eye(d.shape[0], dtype=d.dtype)),
        fresh=jnp.where(better, here.fresh, True),
        price=_next_price(here.price, here.radius, program, d, multipliers),
        radius=radius,
        steps=state.steps + 1,
        still=still,
        status=status.astype(jnp.int32),
    )
    running = state.status == RUNNING
    return jax.tree.map(lambda a, b: jnp.where(running, a, b), new, state)


def _scale(slopes: Values) -> Values:
    """Largest components of the gradients at the start, kept from being tiny where a constraint just looks flat."""

    def largest(gradient: Array, least: float) -> Array:
        size = jnp.abs(gradient).max(axis=-1, initial=0.0)
        return jnp.where(size > 0, jnp.maximum(size, least), 1.0)

    return Values(largest(slopes.cost, 0.0), largest(slopes.vanish, 1e-2), largest(slopes.below, 1e-2))


def residual(now: Values) -> Array:
    """Largest violation of a constraint (last axis), in the user's units."""
    return jnp.maximum(jnp.abs(now.vanish).max(axis=-1, initial=0.0), now.below.max(axis=-1, initial=0.0))


def _finite(*values: Values) -> Array:
    return jnp.stack([jnp.isfinite(leaf).all() for leaf in jax.tree.leaves(values)]).all()


def _program(problem: Subproblem, state: Iterate) -> Quadratic:
    now, slopes, scale = state.now, state.slopes, state.scale
    free = problem.upper > problem.lower
    rows = jnp.concatenate([slopes.vanish / scale.vanish[:, None], slopes.below / scale.below[:, None]])
    low = jnp.maximum(problem.lower - state.x, -state.radius)
    high = jnp.minimum(problem.upper - state.x, state.radius)
    return Quadratic(
        slope=jnp.where(free, slopes.cost / scale.cost, 0.0),
        curvature=state.curvature,
        rows=jnp.where(free[None], rows, 0.0),
        offset=jnp.concatenate([now.vanish / scale.vanish, now.below / scale.below]),
        vanish=jnp.arange(rows.shape[0]) < now.vanish.shape[0],
        price=state.price,
        low=jnp.where(free, low, -1.0),
        high=jnp.where(free, high, 1.0),
    )


def _violations(offset: Array, vanish: Array) -> Array:
    return jnp.where(vanish, jnp.abs(offset), jnp.maximum(offset, 0.0))


def _search(problem: Subproblem, state: Iterate, program: Quadratic, d: Array) -> tuple[Array, Array]:
    """Point of least merit on line and arc, and whether it is good enough to go there.

    Once less is promised than the rounding of the merit, the whole arc is taken as long as the constraints hold.
    """

    def merit(x: Array) -> tuple[Array, Array, Array]:
        now = problem.evaluate(x)
        offset = jnp.concatenate([now.vanish / state.scale.vanish, now.below / state.scale.below])
        value = now.cost / state.scale.cost + state.price * _violations(offset, program.vanish).sum()
        return jnp.where(jnp.isfinite(value), value, jnp.inf), offset, residual(now)

    lengths = jnp.asarray(LENGTHS, d.dtype)

    def round_of(bend: Array, _: None) -> tuple[Array, tuple[Array, Array, Array]]:
        a = lengths[:, None]
        points = state.x[None] + a * d[None] + a * a * bend[None]
        points = jnp.clip(points, problem.lower[None], problem.upper[None])
        values, offsets, residuals = jax.vmap(merit)(points)
        return _bend(state, program, d, offsets[0]), (points, values, residuals)

    _, (points, values, residuals) = jax.lax.scan(round_of, jnp.zeros_like(d), None, length=2)
    points, values, residuals = points.reshape(-1, d.shape[0]), values.reshape(-1), residuals.reshape(-1)
    old = state.now.cost / state.scale.cost + state.price * _violations(program.offset, program.vanish).sum()
    promised = -_model_change(program, d)
    rounding = 100 * jnp.finfo(d.dtype).eps * (jnp.abs(state.now.cost / state.scale.cost) + state.price)
    whole = len(LENGTHS)
    holds = (residuals[whole] <= problem.tolerance) & (values[whole] <= old + rounding)
    last = (promised <= rounding) & holds
    k = jnp.where(last, whole, jnp.argmin(values))
    lower = values[k] <= old - 1e-4 * jnp.tile(lengths, 2)[k] * promised
    return points[k], jnp.isfinite(values[k]) & (lower | last)


def _model_change(program: Quadratic, d: Array) -> Array:
    after = _violations(program.rows @ d + program.offset, program.vanish).sum()
    before = _violations(program.offset, program.vanish).sum()
    return program.slope @ d + program.price * (after - before)


def _bend(state: Iterate, program: Quadratic, d: Array, offset: Array) -> Array:
    """Shortest change that takes back, to first order, what the active constraints gained beyond their linear model.

    Variables that the step has put onto a bound stay there.
    """
    linear = program.rows @ d + program.offset
    excess = jnp.where(jnp.isfinite(offset), offset, linear) - linear
    active = program.vanish | (linear > -1e-6)
    edge = 1e-7 * (program.high - program.low)
    inside = (d > program.low + edge) & (d < program.high - edge)
    inside |= jnp.abs(d) >= 0.999 * state.radius
    rows = jnp.where(active[:, None] & inside[None], program.rows, 0.0)
    # (J^T J + small)^-1 J^T: as the rows can be many or dependent, in the space of the variables
    gram = rows.T @ rows
    small = 1e-9 if d.dtype == jnp.float64 else 1e-4
    gram = gram + small * (jnp.trace(gram) + small) * jnp.eye(d.shape[0], dtype=d.dtype)
    return -solve_factored(factor(gram), rows.T @ jnp.where(active, excess, 0.0))


def _lagrangian_slope(state: Iterate) -> Array:
    vanish, below = state.scale.vanish, state.scale.below
    rows = jnp.concatenate([state.slopes.vanish / vanish[:, None], state.slopes.below / below[:, None]])
    return state.slopes.cost / state.scale.cost + state.multipliers @ rows


def _slope(problem: Subproblem, state: Iterate, gradient: Array) -> Array:
    """Largest component of the Lagrangian's gradient that does not press against a bound, and of complementarity."""
    pressed = state.x - jnp.clip(state.x - gradient, problem.lower, problem.upper)
    count = state.now.vanish.shape[0]
    loose = jnp.minimum(state.multipliers[count:], -state.now.below / state.scale.below)
    return jnp.maximum(jnp.abs(pressed).max(), jnp.maximum(loose, 0.0).max(initial=0.0))


def _measure(state: Iterate, s: Array, y: Array, useful: Array) -> tuple[Array, Array]:
    """Damped BFGS update, if `useful`; the first one also sets the size."""
    square = s @ s
    eps = jnp.finfo(s.dtype).eps
    useful &= jnp.isfinite(y).all() & (square > eps**2)
    s, y = (jnp.where(useful, v, jnp.zeros_like(v)) for v in (s, y))
    size = jnp.clip(jnp.where(useful, jnp.abs(s @ y) / jnp.where(useful, square, 1.0), 1.0), 1e-3, 1e3)
    B = jnp.where(state.fresh & useful, size * jnp.eye(s.shape[0], dtype=s.dtype), state.curvature)
    Bs = B @ s
    sBs = s @ Bs
    sy = s @ y
    damp = jnp.where(sy >= 0.2 * sBs, 1.0, 0.8 * sBs / jnp.where(sy >= 0.2 * sBs, 1.0, sBs - sy))
    r = damp * y + (1 - damp) * Bs
    sr = s @ r
    safe = useful & (sr > 0) & (sBs > 0)
    change = r[:, None] * r[None] / jnp.where(safe, sr, 1.0) - Bs[:, None] * Bs[None] / jnp.where(safe, sBs, 1.0)
    return jnp.where(safe, B + change, B), state.fresh & ~useful


def _next_price(price: Array, radius: Array, program: Quadratic, d: Array, multipliers: Array) -> Array:
    """Raise the price while the program buys violations off; let it come down towards the multipliers."""
    before = _violations(program.offset, program.vanish).sum()
    after = _violations(program.rows @ d + program.offset, program.vanish).sum()
    largest = jnp.abs(multipliers).max(initial=0.0)
    hemmed = jnp.abs(d).max() > 0.99 * radius  # a small radius alone keeps it from the constraints
    bought = (after > 0.3 * before) & (largest > 0.9 * price) & ((price < _HEMMED_PRICE) | ~hemmed)
    lower = jnp.maximum(0.7 * price, jnp.maximum(2 * largest, 1.0))
    return jnp.clip(jnp.where(bought, 4 * price, lower), 1e-3, _LARGEST_PRICE)

"""The quadratic programs of a sequential method, always solvable because constraints may be bought off.

    minimise  g.d + d.B d / 2 + sum of price_i * violation_i(A d + b)    within  low <= d <= high

where row i either must vanish (violation |.|) or must not be positive (violation max(., 0)). With
`A d + b = over - under`, `over, under >= 0`, the multiplier y of a row lies between its floor (minus the price, or 0)
and the price, and Newton's method on

    g + B d + A^T y - low_force + high_force = 0,      over (price - y) = under (y - floor) = mu,
    low_force (d - low) = high_force (high - d) = mu,  mu -> 0

needs one positive definite matrix of the size of d: a primal-dual interior point method with Mehrotra's predictor and
corrector (S. Mehrotra, SIAM J. Optim. 2, 575-601, 1992).
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float

from reojax._internal.arrays import Array
from reojax._internal.linalg import factor, solve_factored

ITERATIONS = 40
"""Most Newton steps; 10 to 20 is usual."""
_GAP = 1e-15
"""Complementarity at which it stops (1e-5 for float32), in problems whose gradients and ranges are about 1."""

_SOFT = 1e-10
"""Added to the diagonals, so that what rounding leaves of the curvature next to the active rows counts. It slows the
last digits down (a proximal step) and does not change the answer."""


class Quadratic(NamedTuple):
    """A program as in this module's docstring, n variables and m rows."""

    slope: Float[Array, " n"]
    """g."""
    curvature: Float[Array, "n n"]
    """B, positive definite."""
    rows: Float[Array, "m n"]
    """A."""
    offset: Float[Array, " m"]
    """b."""
    vanish: Bool[Array, " m"]
    """Rows that must vanish; the others must not be positive."""
    price: Float[Array, ""]
    low: Float[Array, " n"]
    high: Float[Array, " n"]
    """Bounds of d, `low < high`."""


class _Point(NamedTuple):
    """All unknowns. The four distances would follow from d and y, but for the rounding."""

    d: Array
    y: Array
    over: Array
    above: Array
    """price - y."""
    under: Array
    below: Array
    """y - floor."""
    push: Array
    """low_force."""
    left: Array
    """d - low."""
    pull: Array
    """high_force."""
    right: Array
    """high - d."""

    def pairs(self) -> tuple[tuple[Array, Array], ...]:
        """Pairs of positive numbers whose products go to zero together."""
        return (self.over, self.above), (self.under, self.below), (self.push, self.left), (self.pull, self.right)

    def complementarity(self) -> Array:
        """Mean of the products."""
        return jnp.concatenate([a * b for a, b in self.pairs()]).mean()


def solve_quadratic(program: Quadratic) -> tuple[Float[Array, " n"], Float[Array, " m"]]:
    """Return the minimiser and the multipliers of the rows."""
    gap = _GAP if program.slope.dtype == jnp.float64 else 1e-5

    def going(carry: tuple[Array, _Point]) -> Array:
        return (carry[0] < ITERATIONS) & (carry[1].complementarity() > gap)

    first = (jnp.zeros((), jnp.int32), _start(program))
    _, point = jax.lax.while_loop(going, lambda carry: (carry[0] + 1, _newton(program, carry[1])), first)
    return point.d, point.y


def _start(program: Quadratic) -> _Point:
    """Begin in the middle: of the box, of the multipliers' ranges, and with room on either side of each row."""
    floor = jnp.where(program.vanish, -program.price, 0.0)
    d = 0.5 * (program.low + program.high)
    value = program.rows @ d + program.offset
    room = 0.5 * (jnp.abs(value) + 1)
    half = 0.5 * (program.price - floor)
    force = jnp.full_like(d, jnp.maximum(1.0, jnp.abs(program.slope).max()))
    return _Point(
        d=d,
        y=0.5 * (floor + program.price),
        over=room + 0.5 * value,
        above=half,
        under=room - 0.5 * value,
        below=half,
        push=force,
        left=d - program.low,
        pull=force,
        right=program.high - d,
    )


def _newton(program: Quadratic, point: _Point) -> _Point:
    (over, above), (under, below), (push, left), (pull, right) = point.pairs()
    soft = jnp.asarray(_SOFT if left.dtype == jnp.float64 else 1e-4, left.dtype)
    give = over / above + under / below + soft
    matrix = program.curvature + jnp.diag(push / left + pull / right + soft)
    upper = factor(matrix + (program.rows.T / give[None]) @ program.rows)
    dual = program.slope + program.curvature @ point.d + program.rows.T @ point.y
    primal = program.rows @ point.d + program.offset

    def direction(to_over: Array, to_under: Array, to_push: Array, to_pull: Array) -> _Point:
        """Newton's step towards given products of the pairs."""
        lack = primal - to_over / above + to_under / below
        d = solve_factored(upper, to_push / left - to_pull / right - dual - program.rows.T @ (lack / give))
        y = (program.rows @ d + lack) / give
        return _Point(
            d=d,
            y=y,
            over=to_over / above - over + over / above * y,
            above=-y,
            under=to_under / below - under - under / below * y,
            below=y,
            push=to_push / left - push - push / left * d,
            left=d,
            pull=to_pull / right - pull + pull / right * d,
            right=-d,
        )

    def along(step: _Point, length: Array | float) -> _Point:
        return jax.tree.map(lambda a, b: a + length * b, point, step)

    def longest(step: _Point) -> Array:
        """Longest multiple of a step, at most 1, that keeps all pairs positive."""
        now, move = (jnp.concatenate([jnp.concatenate(pair) for pair in p.pairs()]) for p in (point, step))
        return jnp.where(move < 0, -now / jnp.where(move < 0, move, 1.0), 1.0).min(initial=1.0)

    affine = direction(*(jnp.zeros_like(a) for a, _ in point.pairs()))
    mu = point.complementarity()
    aim = mu * jnp.clip(along(affine, longest(affine)).complementarity() / mu, 0.0, 1.0) ** 3
    step = direction(*(aim - a * b for a, b in affine.pairs()))
    return along(step, 0.995 * longest(step))

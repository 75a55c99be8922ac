"""Solving words for targets: damped Gauss-Newton within the box, then less travel along the solutions.

Both run on the table, on many rows at once, one program per number of slots (`MANY`, `FEW`). Nothing here raises: what
is not solved says so by its residual.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float

from reojax._internal.arrays import Array
from reojax._internal.kept import Program
from reojax.planning.residual import Miss, Word, chain, dual, miss, pull, step
from reojax.planning.table import Table, read
from reojax.session import LEAN_COMPILE, LEAST_COMPILE, SEARCH_COMPILE

_SOLVED = 1e-14
"""Squared residual [rad^2] at which the search on the table stops; the true rotations take over."""
_STALLED = 0.9
"""Part of the squared residual that two steps must leave for more steps to be tried; what will arrive is faster.
Single loops, which have fewer amplitudes than a rotation has angles, may be slow and go on."""
_FEASIBLE = 1e-10
"""Squared residual up to which a shortened word still counts as on the target."""


class Iterate(NamedTuple):
    """Amplitudes found."""

    x: Float[Array, "d k m"]
    """Amplitudes [rad]."""
    square: Float[Array, " m"]
    """Squared residual on the table [rad^2]."""
    going: Bool[Array, " m"]
    """Whether more steps may bring it to the target."""


def solve(table: Table, word: Word, x: Array, steps: int | Array) -> Iterate:
    """Bring words to their targets by Levenberg-Marquardt steps, clipped to the box."""
    used = jnp.broadcast_to((word.letter >= 0)[None], x.shape)

    def body(state):
        i, x, tried, at, strength, before = state
        # keep what was tried if it is better, and trust the linear model more or less by that
        then = miss(table, word, tried)
        # taken if it is nearer; the damping follows
        better = then.square < at.square
        before = jnp.stack([at.square, before[0]])
        strength = jnp.clip(jnp.where(better, 0.2 * strength, 6 * strength), 1e-4, 1e6)
        x, at = jnp.where(better[None, None], tried, x), _choose(better, then, at)
        # damping falls with the residual, so that the last steps are Gauss-Newton's own
        damping = strength * jnp.sqrt(at.square) * (at.jacobian**2).sum((0, 1, 2))
        dx = _inside(x, word, used, lambda free, held: step(at, free, held, damping))
        return i + 1, x, jnp.clip(x + dx, word.low, word.high), at, strength, before

    def going(state):
        i, _, _, at, strength, _ = state
        return (i <= steps) & ((at.square > _SOLVED) & (strength < 1e5)).any()

    nothing = _nothing(x)
    start = (0, x, x, nothing, jnp.full_like(nothing.square, 1.5), jnp.stack([nothing.square] * 2))
    _, x, _, at, _, before = jax.lax.while_loop(going, body, start)
    alone = (word.letter >= 0).sum(0) == 1
    return Iterate(x, at.square, (at.square > _SOLVED) & (alone | (at.square < _STALLED * before[1])))


def shorten(table: Table, word: Word, x: Array, price: Float[Array, "d k m"], steps: int | Array) -> Iterate:
    """Move solved words along their solutions to less travel, `sum(price |x|)`, each amplitude keeping its sign."""
    sign = jnp.where(x < 0, -1.0, 1.0).astype(x.dtype)
    used = jnp.broadcast_to((word.letter >= 0)[None], x.shape)
    word = word._replace(low=jnp.where(sign > 0, 0.0, word.low), high=jnp.where(sign > 0, word.high, 0.0))
    slope = price * sign
    zero = jnp.zeros_like(x[0, 0])

    def direction(at: Miss, free: Array, held: Array, reach: Array) -> Array:
        # less travel, its part that would leave the target taken out: J^T (J J^T)^-1 J slope - slope
        downhill = jnp.where(free, slope, 0.0)
        force = dual(at.jacobian, free, zero, (at.jacobian * downhill[:, :, None]).sum((0, 1)))
        along = pull(at.jacobian, force, free) - downhill
        longest = jnp.abs(along).max((0, 1))
        return (reach / jnp.where(longest > 0, longest, 1.0))[None, None] * along + step(at, free, held, zero)

    def body(i, state):
        """Evaluate what was tried; every third time, after one step along the solutions and two back to them, judge."""
        x, tried, at, reach = state
        then = miss(table, word, tried)
        judged, first = i % 3 == 0, i == 0
        less = (slope * (tried - x)).sum((0, 1)) < 0
        better = judged & (first | (less & (then.square < _FEASIBLE)))
        reach = jnp.where(judged & ~first, jnp.clip(jnp.where(better, 1.8, 0.3) * reach, 1e-6, 1.0), reach)
        x, at = jnp.where(better[None, None], tried, x), _choose(better, then, at)
        here = jnp.where(judged, x, tried)
        then = jax.tree.map(lambda a, b: jnp.where(judged, a, b), at, then)
        length = jnp.where(judged, reach, 0.0)
        dx = _inside(here, word, used, lambda free, held: direction(then, free, held, length))
        return x, jnp.clip(here + dx, word.low, word.high), at, reach

    x, _, at, _ = jax.lax.fori_loop(0, 3 * steps + 1, body, (x, x, _nothing(x), jnp.full_like(zero, 0.2)))
    return Iterate(x, at.square, at.square < 0)


def refine(
    table: Table, word: Word, x: Array, true: Float[Array, "4 k m"], strength: Float[Array, " m"]
) -> tuple[Array, Array]:
    """Amplitudes after a step from the `true` rotations of the loops, damped by `strength`, and residuals before it.

    The derivatives are those of the table, good to some 1e-5, so that each step takes about five digits off.
    """
    near, slopes = read(table, word.letter, x)
    same_sign = jnp.where(((true * near).sum(0) < 0)[None], -true, true)
    at = chain(word, same_sign, slopes)
    used = jnp.broadcast_to((word.letter >= 0)[None], x.shape)
    damping = strength * (at.jacobian**2).sum((0, 1, 2))
    dx = _up_to_the_edge(x, word, used, lambda free, held: step(at, free, held, damping))
    return jnp.clip(x + dx, word.low, word.high), at.square


def _inside(x: Array, word: Word, used: Array, direction: Callable[[Array, Array], Array]) -> Array:
    """Step in which amplitudes on the edge of the box that would leave it are held.

    Args:
        x: amplitudes, inside the box.
        word: holds the box.
        used: slots that exist.
        direction: step of the free amplitudes, given which are free and the steps of those that are not.
    """
    rest = jnp.zeros_like(x)

    def hold(_, state):
        free, dx = state
        free = free & ~(((x <= word.low) & (dx < 0)) | ((x >= word.high) & (dx > 0)))
        return free, direction(free, rest)

    return jax.lax.fori_loop(0, 3, hold, (used, rest))[1]


def _up_to_the_edge(x: Array, word: Word, used: Array, direction: Callable[[Array, Array], Array]) -> Array:
    """Step in which amplitudes that would leave the box go to its edge, and the others make up for it.

    For short steps; with long ones all amplitudes would end on the edge. Arguments as for `_inside`.
    """

    def hold(_, state):
        free, dx = state
        held = jnp.where(free, 0.0, dx)
        dx = jnp.where(free, direction(free, held), dx)
        beyond = (x + dx < word.low) | (x + dx > word.high)
        return free & ~beyond, jnp.where(beyond, jnp.clip(x + dx, word.low, word.high) - x, dx)

    return jax.lax.fori_loop(0, 4, hold, (used, jnp.zeros_like(x)))[1]


def _nothing(x: Array) -> Miss:
    """What is known before anything is evaluated."""
    d, k, m = x.shape
    return Miss(jnp.zeros((3, m), x.dtype), jnp.zeros((d, k, 3, m), x.dtype), jnp.full(m, jnp.inf, x.dtype))


def _choose(better: Array, then: Miss, at: Miss) -> Miss:
    return jax.tree.map(lambda a, b: jnp.where(better.reshape(*(1,) * (a.ndim - 1), -1), a, b), then, at)


class Programs(NamedTuple):
    """What is compiled: the functions of this file."""

    solve: Callable[..., Iterate]
    shorten: Callable[..., Iterate]
    refine: Callable[..., tuple[Array, Array]]


def _compiled(*options: dict[str, Any]) -> Programs:
    functions = zip((solve, shorten, refine), options, strict=True)
    return Programs(*(Program(function, compiler_options=chosen) for function, chosen in functions))


MANY = _compiled(SEARCH_COMPILE, SEARCH_COMPILE, LEAN_COMPILE)
"""For many targets: what runs often is fast."""
FEW = _compiled(LEAN_COMPILE, LEAN_COMPILE, LEAST_COMPILE)
"""For few: what is run a few times compiles quickly."""

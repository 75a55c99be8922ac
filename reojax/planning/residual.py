"""The rotation after a word, how far it misses the target, and the derivatives of that.

Everything is batched with the rows (one word for one target) on the last axis. A slot of a word is a letter, its
amplitudes and a count: the loop is run so many times over, `M^n`. With quaternions the power is in closed form,
so a word of hundreds of equal loops costs what one loop costs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, Int

from reojax._internal.arrays import Array
from reojax.planning.quaternions import inverse, product
from reojax.planning.table import Table, read


class Word(NamedTuple):
    """Words to solve, `k` slots each, for targets; rows last."""

    letter: Int[Array, "k m"]
    """Letters; -1 for a slot that is not used."""
    runs: Float[Array, "k m"] | None
    """How many times over each loop is run; None: once, which needs no powers."""
    target: Float[Array, "4 m"]
    """Rotations to reach, quaternions, between the folded ends of the word."""
    low: Float[Array, "d k m"]
    """Smallest amplitudes [rad]."""
    high: Float[Array, "d k m"]
    """Largest amplitudes [rad]."""


class Miss(NamedTuple):
    """How far words miss."""

    residual: Float[Array, "3 m"]
    """`2 sin(angle / 2)` times the axis of the rotation left, which is the rotation vector if it is small."""
    jacobian: Float[Array, "d k 3 m"]
    """Derivatives by the amplitudes."""
    square: Float[Array, " m"]
    """Squared length of `residual`."""


def miss(table: Table, word: Word, x: Float[Array, "d k m"]) -> Miss:
    """Evaluate words with amplitudes `x` on the table."""
    q, dq = read(table, word.letter, x)
    return chain(word, q, dq)


def chain(word: Word, q: Float[Array, "4 k m"], dq: Float[Array, "d 4 k m"]) -> Miss:
    """Put the loops' quaternions and their derivatives together."""
    if word.runs is not None:
        q, dq = _powers(word.runs, q, dq)
    q, dq = jax.lax.optimization_barrier((q, dq))  # once, not again for every product
    loops = [tuple(q[:, slot]) for slot in range(q.shape[1])]
    # of each loop M^n: what stands before it in the product, and what after it
    before = [inverse(tuple(word.target))]
    for loop in loops:
        before.append(product(before[-1], loop))
    w, *v = before.pop()
    after = [(jnp.ones_like(w), *jnp.zeros_like(q[1:, 0]))]
    for loop in loops[:0:-1]:
        after.insert(0, product(loop, after[0]))
    # 2 v of the rotation left, on the side where w > 0
    sign = jnp.where(w < 0, -2.0, 2.0).astype(w.dtype)
    residual = sign[None] * jnp.stack(v)
    left, right = jax.lax.optimization_barrier((_slots(before), _slots(after)))
    # d(before M after) = before dM after
    changes = product(product(left, tuple(dq[:, i] for i in range(4))), right)
    jacobian = sign[None, None, None] * jnp.stack(changes[1:], axis=2)
    return Miss(residual, jacobian, (residual * residual).sum(0))


def _slots(side: Sequence[Sequence[Array]]) -> tuple[Array, ...]:
    """Components (1, k, m) of the quaternions of k slots."""
    return tuple(jnp.stack(component)[None] for component in zip(*side, strict=True))


def _powers(count: Array, q: Array, dq: Array) -> tuple[Array, Array]:
    """Quaternions of `M^n` and their derivatives, from those of M: `(w, v) = (cos f, sin f u)` becomes `n f`."""
    w, v = q[0], q[1:]
    sine = jnp.sqrt((v * v).sum(0))
    turns = sine > 1e-9
    safe = jnp.where(turns, sine, 1.0)
    # f, and n f
    half = jnp.arctan2(sine, w)
    c, s = jnp.cos(count * half), jnp.sin(count * half)
    ratio = jnp.where(turns, s / safe, count)
    # df = w u . dv - |v| dw; then dw' = -n sin(n f) df, dv' = ratio dv + (n cos(n f) df - ratio u . dv) u
    axis = v / safe[None]
    along = (axis[None] * dq[:, 1:]).sum(1)
    change = w[None] * along - sine[None] * dq[:, 0]
    dw = -(count * s)[None] * change
    dv = ratio[None, None] * dq[:, 1:] + ((count * c)[None] * change - ratio[None] * along)[:, None] * axis[None]
    return jnp.concatenate([c[None], ratio[None] * v]), jnp.concatenate([dw[:, None], dv], axis=1)


def step(
    m: Miss, free: Bool[Array, "d k m"], held: Float[Array, "d k m"], damping: Float[Array, " m"]
) -> Float[Array, "d k m"]:
    """Gauss-Newton step of the free amplitudes while the others move by `held`: `-J^T (J J^T + damping)^-1 r`.

    Of all steps to the target it is the shortest.
    """
    residual = m.residual + (m.jacobian * held[:, :, None]).sum((0, 1))
    return -pull(m.jacobian, dual(m.jacobian, free, damping, residual), free)


def pull(jacobian: Array, force: Array, free: Array) -> Array:
    """`J^T force`, zero where not free."""
    return jnp.where(free, (jacobian * force[None, None]).sum(2), 0.0)


def dual(jacobian: Array, free: Array, damping: Array, right: Array) -> Array:
    """Solve `(J J^T + damping) y = right` with the free columns of J; 3x3, in closed form."""
    masked = jnp.where(free[:, :, None], jacobian, 0.0)
    x, y, z = (masked[:, :, i] for i in range(3))
    # entries of J J^T + damping, its adjugate and its determinant
    floor = damping + _tiny(x.dtype)
    a, b, c = ((p * p).sum((0, 1)) + floor for p in (x, y, z))
    d, e, f = ((p * r).sum((0, 1)) for p, r in ((x, y), (x, z), (y, z)))
    rows = [[b * c - f * f, e * f - d * c, d * f - e * b], [a * c - e * e, d * e - a * f], [a * b - d * d]]
    (aa, ab, ac), (bb, bc), (cc,) = rows
    determinant = a * aa + d * ab + e * ac
    u, v, w = right
    return jnp.stack(_apply(((aa, ab, ac), (ab, bb, bc), (ac, bc, cc)), (u, v, w))) / determinant[None]


def _apply(matrix: Sequence[Sequence[Array]], vector: Sequence[Array]) -> list[Array]:
    return [row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2] for row in matrix]


def _tiny(dtype: jnp.dtype) -> float:
    return 1e-13 if dtype == jnp.float64 else 1e-6

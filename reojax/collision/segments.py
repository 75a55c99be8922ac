"""Distance between two line segments, the centre lines of two capsules: exact, with safe derivatives of any order.

The closest points are found as in C. Ericson, Real-Time Collision Detection (2005), 5.1.9: those of the two lines
where both lie within the segments, or else the closest of the four pairs of an end and a segment. Points are arrays
with their three components in front, (3, ...); everything else is elementwise.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from reojax.mechanics._fast.materialize import materialize

Points = jax.Array


def dot(a: Points, b: Points) -> jax.Array:
    """Scalar product over the components in front."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def closest_parameters(a0: Points, a1: Points, b0: Points, b1: Points) -> tuple[jax.Array, jax.Array]:
    """Where on the segments a0-a1 and b0-b1 the points closest to each other lie, both from 0 to 1.

    Of parallel segments that pass each other, one of the pairs of an end and a segment. Points without length are 0.
    """
    # the gap w + s u - t v, and the products that its square is made of
    u, v, w = a1 - a0, b1 - b0, a0 - b0
    uu, vv, uv, uw, vw = materialize((dot(u, u), dot(v, v), dot(u, v), dot(u, w), dot(v, w)))
    ww = dot(w, w)
    safe_uu, safe_vv = jnp.where(uu > 0, uu, 1), jnp.where(vv > 0, vv, 1)

    def on_a(t: jax.Array) -> jax.Array:
        """Nearest place on a to the place t on b."""
        return jnp.clip((uv * t - uw) / safe_uu, 0, 1)

    def on_b(s: jax.Array) -> jax.Array:
        """Nearest place on b to the place s on a."""
        return jnp.clip((uv * s + vw) / safe_vv, 0, 1)

    def square(s: jax.Array, t: jax.Array) -> jax.Array:
        """Squared gap."""
        return ww + 2 * (s * uw - t * vw - s * t * uv) + s * s * uu + t * t * vv

    # the nearest of the four pairs of an end and a segment
    zero, one = jnp.zeros_like(uu), jnp.ones_like(uu)
    best = (zero, on_b(zero))
    least = square(*best)
    for s, t in ((one, on_b(one)), (on_a(zero), zero), (on_a(one), one)):
        distance = square(s, t)
        nearer = distance < least
        best = (jnp.where(nearer, s, best[0]), jnp.where(nearer, t, best[1]))
        least = jnp.where(nearer, distance, least)
    # where the whole lines are nearest, unless they are parallel to rounding
    determinant = uu * vv - uv * uv
    crossing = determinant > 4 * jnp.finfo(uu.dtype).eps * uu * vv
    safe = jnp.where(crossing, determinant, 1)
    s = (uv * vw - vv * uw) / safe
    t = (uu * vw - uv * uw) / safe
    # that counts if it is on both segments
    inside = crossing & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    return jnp.where(inside, s, best[0]), jnp.where(inside, t, best[1])


def quick_distance(a0: Points, a1: Points, b0: Points, b1: Points) -> jax.Array:
    """Distance between the segments a0-a1 and b0-b1 in a third of the operations, for looking where they are near.

    Never less than the distance; more than it by rounding only, but for segments that are parallel to rounding.
    """
    u, v, w = a1 - a0, b1 - b0, a0 - b0
    uu, vv, uv, uw, vw = materialize((dot(u, u), dot(v, v), dot(u, v), dot(u, w), dot(v, w)))
    # nearest places of the lines, held on a; then on b to that one, and on a to this one
    determinant = uu * vv - uv * uv
    s = jnp.clip((uv * vw - vv * uw) / jnp.where(determinant > 0, determinant, 1), 0, 1)
    t = jnp.clip((uv * s + vw) / jnp.where(vv > 0, vv, 1), 0, 1)
    s = jnp.clip((uv * t - uw) / jnp.where(uu > 0, uu, 1), 0, 1)
    gap = w + s[None] * u - t[None] * v
    return jnp.sqrt(dot(gap, gap))


def between(a0: Points, a1: Points, b0: Points, b1: Points) -> Points:
    """Shortest vector from the segment b0-b1 to the segment a0-a1, (3, ...)."""
    s, t = materialize(closest_parameters(a0, a1, b0, b1))
    return (a0 - b0) + s[None] * (a1 - a0) - t[None] * (b1 - b0)


@jax.custom_jvp
def segment_distance(a0: Points, a1: Points, b0: Points, b1: Points) -> jax.Array:
    """Distance between the segments a0-a1 and b0-b1.

    Its derivative is that of the distance between the two closest points, held where they are on their segments: they
    are closest, so how they slide along does not count to first order. Zero where the segments cross, where it has
    none.
    """
    w = between(a0, a1, b0, b1)
    return jnp.sqrt(dot(w, w))


@segment_distance.defjvp
def _segment_distance_jvp(primals, tangents):
    a0, a1, b0, b1 = primals
    s, t = materialize(closest_parameters(*primals))
    s, t = s[None], t[None]
    # the shortest vector, its length and its direction
    w = (a0 - b0) + s * (a1 - a0) - t * (b1 - b0)
    square = dot(w, w)
    apart = square > 0
    distance = jnp.sqrt(jnp.where(apart, square, 1))
    normal = jnp.where(apart, w / distance[None], 0)
    # how the nearest points, held on their segments, move along that direction
    da0, da1, db0, db1 = tangents
    moved = (1 - s) * da0 + s * da1 - (1 - t) * db0 - t * db1
    return jnp.where(apart, distance, 0), dot(normal, moved)

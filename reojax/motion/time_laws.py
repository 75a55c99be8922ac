"""Time laws: how a motion runs along an edge, `s(u)` from 0 to 1 over its duration, at rest at both ends.

A law is a piecewise polynomial, so that its derivatives are exact and its corners known. Only the path
matters for the net rotation (thesis 2.4); the law decides what torques and speeds it takes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array, as_numbers, is_concrete
from reojax._internal.checks import did_you_mean, shorten
from reojax.motion.splines import least_jerk


class Law(NamedTuple):
    """A time law `s(u)` on [0, 1], `s(0) = 0`, `s(1) = 1`: a polynomial between each two breaks."""

    breaks: Float[Array, " p+1"]
    """Where the pieces meet, from 0 to 1, not decreasing."""
    coefficients: Float[Array, "p d+1"]
    """Of the powers of `u - breaks[i]`, lowest first, for each piece."""


def quintic() -> Law:
    """`10 u^3 - 15 u^4 + 6 u^5`: rates and accelerations start and end at zero; the least jerk between two rests."""
    return Law(np.array([0.0, 1.0]), np.array([[0.0, 0.0, 0.0, 10.0, -15.0, 6.0]]))


def trapezoid(ramp: ArrayLike = 1 / 3) -> Law:
    """Constant acceleration, constant rate, constant deceleration.

    Args:
        ramp: share of the duration that each ramp takes, above 0 and at most 1/2; may be traced.

    Raises:
        ValueError: if `ramp` is anything else.
    """
    r = as_numbers("ramp", ramp)
    if r.shape or (is_concrete(r) and not 0 < r <= 0.5):
        raise ValueError(f"`ramp` is {shorten(ramp)}; it must be one number above 0 and at most 0.5.")
    if is_concrete(r) and r == 0.5:  # two pieces, as the one between would take no time
        return Law(np.array([0.0, 0.5, 1.0]), np.array([[0.0, 0, 2, 0, 0, 0], [0.5, 2, -2, 0, 0, 0]]))
    rate = 1 / (1 - r)
    xp = np if isinstance(r, np.ndarray | np.floating) else jnp
    zero, one = xp.zeros_like(r), xp.ones_like(r)
    breaks = xp.stack([zero, r, 1 - r, one])
    rows = [(zero, zero, rate / (2 * r)), (rate * r / 2, rate, zero), (1 - rate * r / 2, rate, -rate / (2 * r))]
    return Law(breaks, xp.stack([xp.stack([*row, zero, zero, zero]) for row in rows]))  # of one degree for all laws


def minimum_jerk(times: ArrayLike = (), places: ArrayLike = ()) -> Law:
    """The spline of least `integral of (s''')^2` through given points; without any it is `quintic`.

    At rest at both ends, polynomials of degree five between the points, four derivatives continuous.

    Args:
        times: (q,) where the points are, increasing, inside (0, 1); may be traced.
        places: (q,) the value of `s` at each; may be traced.

    Raises:
        ValueError: if the two do not go together, or the times do not increase inside (0, 1).
    """
    at, place = as_numbers("times", times), as_numbers("places", places)
    if at.ndim != 1 or at.shape != place.shape:
        raise ValueError(f"`times` and `places` have shapes {at.shape} and {place.shape}; both must be (q,).")
    if is_concrete((at, place)) and not (
        np.isfinite(place).all() and (np.diff(np.concatenate([[0.0], at, [1.0]])) > 0).all()
    ):
        raise ValueError(f"`times` {np.asarray(at)} must increase inside (0, 1), and `places` {place} be finite.")
    breaks = jnp.concatenate([jnp.zeros(1, at.dtype), jnp.asarray(at), jnp.ones(1, at.dtype)])
    values = jnp.concatenate([jnp.zeros(1, place.dtype), jnp.asarray(place), jnp.ones(1, place.dtype)])
    return Law(breaks, least_jerk(jnp.diff(breaks), values[:, None])[:, :, 0])


LAWS: dict[str, Callable[[], Law]] = {"quintic": quintic, "trapezoid": trapezoid, "minimum-jerk": minimum_jerk}
"""Laws by name, for command lines."""


def by_name(name: str) -> Law:
    """Build a law by its name, for command lines.

    Raises:
        ValueError: if `name` is not in `LAWS`.
    """
    if name not in LAWS:
        raise ValueError(
            f"there is no time law named {shorten(name)}; the names are {', '.join(LAWS)}.{did_you_mean(name, LAWS)}"
        )
    return LAWS[name]()


def check_law(law: Law | str) -> Law:
    """Return a law, looked up if it is a name.

    Raises:
        ValueError: if it is neither.
    """
    if isinstance(law, str):
        return by_name(law)
    if not isinstance(law, Law):
        raise ValueError(
            f"`law` is {shorten(law)}; it must be a Law, such as `quintic()`, or one of {', '.join(LAWS)}."
        )
    return law

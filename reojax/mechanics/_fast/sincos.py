"""Sine and cosine that vectorise: on CPU `jnp.sin` and `jnp.cos` are calls, one element at a time.

Reduction to |r| <= pi / 4 by subtracting a multiple of pi / 2 in three parts (W. J. Cody and W. Waite,
Software Manual for the Elementary Functions, 1980), then the minimax polynomials of S. L. Moshier's Cephes
library. Absolute error below 3e-16 in float64 up to 1e6 rad, 2e-7 in float32 up to 1e4 rad.
"""

from typing import Any

import jax
from jax import lax

from reojax.mechanics._fast.scalar import add, mul, sub

_HALF_PI = {
    8: (1.570796251296997, 7.549789415861596e-08, 5.390302858158119e-15),
    4: (1.5703125, 4.837512969970703e-04, 7.549789948768648e-08),
}
_SIN = {
    8: (
        -1.66666666666666307295e-1,
        8.33333333332211858878e-3,
        -1.98412698295895385996e-4,
        2.75573136213857245213e-6,
        -2.50507477628578072866e-8,
        1.58962301576546568060e-10,
    ),
    4: (-1.6666654611e-1, 8.3321608736e-3, -1.9515295891e-4),
}
_COS = {
    8: (
        4.16666666666665929218e-2,
        -1.38888888888730564116e-3,
        2.48015872888517045348e-5,
        -2.75573141792967388112e-7,
        2.08757008419747316778e-9,
        -1.13585365213876817300e-11,
    ),
    4: (4.166664568298827e-2, -1.388731625493765e-3, 2.443315711809948e-5),
}


def horner(coefficients: tuple[float, ...], x: Any) -> Any:
    """Return the polynomial with two `coefficients` or more, lowest degree first, at `x`."""
    result = coefficients[-1]
    for c in coefficients[-2::-1]:
        result = add(mul(result, x), c)
    return result


@jax.custom_jvp
def sincos(angle: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Return sine and cosine of `angle` [rad]; float32 or float64, any shape."""
    size = angle.dtype.itemsize
    # angle = quarter pi / 2 + r
    quarter = lax.round(mul(angle, 0.6366197723675814), lax.RoundingMethod.TO_NEAREST_EVEN)
    r = angle
    for part in _HALF_PI[size]:
        r = sub(r, mul(quarter, part))
    # r + r^3 P(r^2), and 1 - r^2 / 2 + r^4 Q(r^2)
    z = mul(r, r)
    sine = add(r, mul(mul(r, z), horner(_SIN[size], z)))
    cosine = add(sub(1, mul(0.5, z)), mul(mul(z, z), horner(_COS[size], z)))
    half = mul(0.5, quarter)  # quadrant = quarter mod 4, found without integers, which vectorise badly
    whole = lax.floor(half)
    swap = lax.ne(half, whole)
    quarter_turns = mul(0.5, whole)
    minus = lax.ne(quarter_turns, lax.floor(quarter_turns))
    # odd quadrants swap sine and cosine; the third and fourth change their sign
    s = lax.select(swap, cosine, sine)
    c = lax.select(swap, lax.neg(sine), cosine)
    return lax.select(minus, lax.neg(s), s), lax.select(minus, lax.neg(c), c)


@sincos.defjvp
def _sincos_jvp(primals, tangents):
    s, c = sincos(*primals)
    (rate,) = tangents
    return (s, c), (c * rate, -s * rate)

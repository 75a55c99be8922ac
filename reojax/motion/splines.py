"""The smoothest curve through points: the spline of least jerk, of polynomials of degree five."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax._internal.linalg import solve_positive

# Coefficients of u^0..u^5 from (s, s', s'') at u = 0 and (s, s', s'') at u = 1
_HERMITE = np.linalg.inv(
    np.array(
        [
            [1, 0, 0, 0, 0, 0],
            [0, 1, 0, 0, 0, 0],
            [0, 0, 2, 0, 0, 0],
            [1, 1, 1, 1, 1, 1],
            [0, 1, 2, 3, 4, 5],
            [0, 0, 2, 6, 12, 20],
        ]
    )
)
# Integral over [0, 1] of s''' squared, as a form in the coefficients
_JERK = np.zeros((6, 6))
for _a in range(3, 6):
    for _b in range(3, 6):
        _factor = np.prod([_a, _a - 1, _a - 2, _b, _b - 1, _b - 2])
        _JERK[_a, _b] = _factor / (_a + _b - 5)
_FORM = _HERMITE.T @ _JERK @ _HERMITE


@jax.jit
def least_jerk(lengths: Float[Array, " p"], values: Float[Array, "p+1 m"]) -> Float[Array, "p 6 m"]:
    """Coefficients of the curve of least integrated squared jerk through `values`, at rest at both ends.

    Args:
        lengths: (p,) durations between the points, positive.
        values: (p + 1, m) the points.

    Returns:
        (p, 6, m) coefficients of the powers of the time since each point, lowest first.
    """
    dtype = jnp.result_type(lengths, values)
    h, points = jnp.asarray(lengths, dtype), jnp.asarray(values, dtype)
    count = h.shape[0]
    # jerk of each piece as a form in (s, s', s'') at both of its ends, and their sum over all pieces
    ends = jax.vmap(lambda scale: scale[:, None] * jnp.asarray(_FORM, dtype) * scale[None])(_scales(h))
    ends = ends / (h**5)[:, None, None]
    total = jnp.zeros((3 * (count + 1), 3 * (count + 1)), dtype)
    for i in range(count):
        total = total.at[3 * i : 3 * i + 6, 3 * i : 3 * i + 6].add(ends[i])
    # rates and accelerations inside that make it least; at rest at both ends
    free = np.array([3 * i + order for i in range(1, count) for order in (1, 2)], int)
    states = jnp.zeros((count + 1, 3, points.shape[1]), dtype).at[:, 0].set(points)
    if len(free):
        pull = -total[free][:, ::3] @ points
        size = jnp.sqrt(jnp.diag(total)[free])  # rates and accelerations have other units
        even = total[np.ix_(free, free)] / (size[:, None] * size[None, :])
        found = solve_positive(even, pull / size[:, None]) / size[:, None]
        states = states.at[1:-1, 1:].set(found.reshape(count - 1, 2, -1))
    # coefficients from both ends of each piece, by the share of it; then by time
    pairs = jnp.concatenate([states[:-1], states[1:]], axis=1)
    unit = jnp.einsum("ab,pb,pbm->pam", jnp.asarray(_HERMITE, dtype), _scales(h), pairs)
    return unit / jax.vmap(lambda step: step ** jnp.arange(6))(h)[:, :, None]


def _scales(h: jax.Array) -> jax.Array:
    """(p, 6) what turns (s, s', s'') at both ends by time into the same by the share of the piece."""
    one = jnp.ones_like(h)
    return jnp.stack([one, h, h * h, one, h, h * h], axis=1)

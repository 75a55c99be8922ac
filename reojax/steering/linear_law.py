"""The linear law of `reojax.steering.onboard`, in JAX."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array
from reojax._internal.linalg import solve_symmetric3


def steer_by(
    row: dict[str, Array],
    table: dict[str, Array],
    time: Array,
    steer: Array,
    filtered: Array,
    rate: Array,
    error: Array,
    worth: Array,
    tau: Array,
    largest: Array,
) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """The linear part, `onboard.corrected`: the new steering vector, and what was left of the error before [rad].

    `c + worth (gramian + rest)^-1 (e - gramian c - held back)`, arguments as there: `steer`, `filtered` (3,) and
    `rate` (3,) per second, `error` (3,) in the inertial frame, `tau` in seconds, `largest` in rad.
    """
    held_back = row["density"] @ (2 * tau * (filtered - steer) + tau**2 * rate)
    left = error - row["gramian"] @ steer - held_back
    can = row["gramian"] - 2 * tau * row["density"] + row["rest"] * jnp.eye(3, dtype=tau.dtype)
    steer = steer + worth * solve_symmetric3(positive(can, row["rest"]), left[:, None])[:, 0]
    later = jnp.where((table["at"] >= time)[:, None], jnp.abs(table["direction"] @ steer), 0)
    return steer * jnp.minimum(1, largest / jnp.maximum(later.max(), 1e-12)), left


def smooth(steer: Array, filtered: Array, rate: Array, step: Array, tau: Array) -> tuple[Array, Array]:
    """`onboard.smooth`: the filter `tau^2 c'' + 2 tau c' + c = steer`, `step` seconds later, exactly."""
    gap, decay = filtered - steer, jnp.exp(-step / tau)
    slope = rate + gap / tau
    return steer + (gap + step * slope) * decay, (rate - step / tau * slope) * decay


def positive(matrix: Float[Array, "3 3"], least: Array) -> Float[Array, "3 3"]:
    """The symmetric matrix with its eigenvalues raised to `least`, by Jacobi's rotations."""
    vectors = jnp.eye(3, dtype=matrix.dtype)
    for _ in range(6):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            angle = 0.5 * jnp.arctan2(2 * matrix[p, q], matrix[q, q] - matrix[p, p])
            c, s = jnp.cos(angle), jnp.sin(angle)
            turn = jnp.eye(3, dtype=matrix.dtype).at[p, p].set(c).at[q, q].set(c).at[p, q].set(s).at[q, p].set(-s)
            matrix, vectors = turn.T @ matrix @ turn, vectors @ turn
    return (vectors * jnp.maximum(jnp.diagonal(matrix), least)[None]) @ vectors.T


def row_at(table: dict[str, Array], time: Array) -> dict[str, Any]:
    """The table at one time, as `onboard.at` reads it."""
    at = table["at"]
    k = jnp.clip((at <= time).sum() - 1, 0, at.shape[0] - 2)
    h = at[k + 1] - at[k]
    u = jnp.clip((time - at[k]) / h, 0, 1)
    q, omega = table["quaternion"][jnp.stack([k, k + 1])], table["omega"][jnp.stack([k, k + 1])]
    spin = 0.5 * jnp.concatenate(
        [-(q[:, 1:] * omega).sum(1, keepdims=True), q[:, :1] * omega + jnp.cross(q[:, 1:], omega)], axis=1
    )
    a, b = u * u * (3 - 2 * u), u * (1 - u)
    turned = (1 - a) * q[0] + a * q[1] + h * b * ((1 - u) * spin[0] - u * spin[1])
    lines = ("connection", "direction", "gramian", "rest", "drift", "to_end")
    found = {name: (1 - u) * table[name][k] + u * table[name][k + 1] for name in lines}
    density = (table["gramian"][k] - table["gramian"][k + 1]) / h
    return found | {"rotation": so3.from_quaternion(turned), "density": density}

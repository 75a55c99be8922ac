"""The last steps towards a fastest motion: its net rotation to rounding, and its joints within their limits exactly.

An optimiser looks at a motion at samples, and stops a little off. But the motion is a polynomial by pieces, so that it
is known where its joints are farthest; each step here is the least change of the unknowns that to first order puts the
net rotation right and leaves no joint beyond its limits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax.motion.trajectory import Trajectory
from reojax.robot import Robot

_CLEAR = 1e-9
"""How far polished joints stay from their limits [rad]; more than rounding."""
_STEPS = 10
_FAR = -0.5
"""What is further from its limit than this is left out of a step."""

Look = Callable[[Any, Any], tuple[Any, Any]]
"""From unknowns (n,) and shares of the pieces (2, p, j) to numbers (r,) and their derivatives (r, n)."""


def restore_feasibility(
    look: Look,
    build: Callable[[Any], Trajectory],
    miss: Callable[[Trajectory], Any],
    start: Float[np.ndarray, " n"],
    box: tuple[np.ndarray, np.ndarray, np.ndarray],
    equal: int,
) -> Float[np.ndarray, " n"]:
    """Return the unknowns of a motion, changed little, for the net rotation wanted and all joints within limits.

    Args:
        look: what must vanish, the first `equal` numbers, and what must not be positive, the others.
        build: makes the motion.
        miss: of a motion, what `look` gives roughly in its first numbers.
        start: the unknowns.
        box: least and largest unknowns, and their scales.
        equal: how many numbers must vanish, 3 or 0.
    """
    lower, upper, scale = box
    x = start
    for _ in range(_STEPS):
        trajectory = build(x)
        value, slope = (np.array(part) for part in look(x, farthest(trajectory)))
        if equal:
            value[:equal] = miss(trajectory)
        value[equal:] += _CLEAR
        if np.abs(value[:equal]).max(initial=0) < 1e-12 and value[equal:].max(initial=0) <= 0:
            break
        change = least_norm_step(value, slope * scale, equal, (lower - x) / scale, (upper - x) / scale)
        x = np.clip(x + scale * change, lower, upper)
    return x


def limits(robot: Robot) -> list[tuple[int, int, float]]:
    """Sign, joint and place [rad] of all limits that there are."""
    ends = ((1, np.asarray(robot.upper)), (-1, np.asarray(robot.lower)))
    return [(sign, k, float(end[k])) for sign, end in ends for k in range(robot.joints) if np.isfinite(end[k])]


def beyond_limits(robot: Robot, trajectory: Trajectory, share: Float[Array, "2 p j"]) -> Float[Array, " l"]:
    """How far joints are beyond their limits [rad] at a share of each piece, for all limits and pieces."""
    time = jnp.asarray(share) * jnp.diff(trajectory.breaks)[None, :, None]
    place = jnp.zeros_like(time)
    for row in range(trajectory.coefficients.shape[1])[::-1]:
        place = place * time + trajectory.coefficients[None, :, row]
    past = [sign * (place[0 if sign > 0 else 1, :, k] - limit) for sign, k, limit in limits(robot)]
    return jnp.concatenate([jnp.zeros(0, place.dtype), *past])


def beyond(robot: Robot, trajectory: Trajectory) -> float:
    """Farthest that a joint goes beyond its limits [rad], at any time; 0 for none."""
    return float(np.asarray(beyond_limits(robot, trajectory, farthest(trajectory))).max(initial=0.0))


def farthest(trajectory: Trajectory) -> Float[np.ndarray, "2 p j"]:
    """Share of each piece at which each joint is largest, and at which it is smallest."""
    lengths = np.diff(np.asarray(trajectory.breaks, float))
    powers = np.asarray(trajectory.coefficients, float)
    powers = powers * lengths[:, None, None] ** np.arange(powers.shape[1])[None, :, None]  # of the share
    share = np.zeros((2, len(lengths), trajectory.joints))
    for p, k in np.ndindex(share.shape[1:]):
        place = np.polynomial.Polynomial(powers[p, :, k])
        turns = place.deriv().trim().roots()
        at = np.array([0.0, 1.0, *np.clip(turns[abs(turns.imag) < 1e-6].real, 0, 1)])
        share[:, p, k] = at[[place(at).argmax(), place(at).argmin()]]
    return share


def least_norm_step(
    value: np.ndarray, slope: np.ndarray, equal: int, lower: np.ndarray, upper: np.ndarray
) -> np.ndarray:
    """Least change with `value + slope @ change` zero in the first `equal` rows and not positive in the others."""
    from scipy.optimize import minimize

    near = np.concatenate([np.arange(equal), equal + np.flatnonzero(value[equal:] > _FAR)])
    value, slope = value[near], slope[near]
    constraints = [
        {"type": kind, "fun": lambda u, r=rows: -(value[r] + slope[r] @ u), "jac": lambda u, r=rows: -slope[r]}
        for kind, rows in (("eq", slice(0, equal)), ("ineq", slice(equal, None)))
        if len(value[rows])
    ]
    answer = minimize(
        lambda u: 0.5 * u @ u, np.clip(0 * lower, lower, upper), jac=lambda u: u, method="SLSQP",
        bounds=list(zip(lower, upper, strict=True)), constraints=constraints, options={"ftol": 1e-24, "maxiter": 50},
    )  # fmt: skip
    return np.where(np.isfinite(answer.x), answer.x, 0)

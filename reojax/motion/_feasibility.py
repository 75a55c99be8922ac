"""Feasibility restoration of a fastest motion: its net rotation to rounding, its joints within their limits exactly.

An optimiser looks at a motion at samples, and stops a little off. But the motion is a polynomial by pieces, so that it
is known where its joints are farthest; each step here is the least change of the unknowns that to first order puts the
net rotation right and leaves no joint beyond its limits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax.motion.trajectory import Trajectory
from reojax.optimisation.quadratic import solve_quadratic
from reojax.robot import Robot

_CLEAR = 1e-9
"""How far polished joints stay from their limits [rad]; more than rounding."""
_STEPS = 10
_FAR = -0.5
"""What is further from its limit than this is left out of a step."""


class Conditions(NamedTuple):
    """What a motion must meet, as functions of its unknowns."""

    equality: Float[Array, " p"]
    """Must be zero: the rotation vector from the net rotation wanted, or nothing."""
    inequality: Float[Array, " q"]
    """Must not be positive."""


class Linearised(NamedTuple):
    """The same with their derivatives by the unknowns."""

    equality: Float[Array, " p"]
    inequality: Float[Array, " q"]
    equality_jacobian: Float[Array, "p n"]
    inequality_jacobian: Float[Array, "q n"]


def linearise(function: Callable[[Array], Conditions], x: Array) -> Linearised:
    """Conditions of the unknowns (n,) with their derivatives."""
    slope, value = jax.jacfwd(lambda x: (function(x),) * 2, has_aux=True)(x)
    return Linearised(*value, *slope)


def restore_feasibility(
    linearisation: Callable[[Any, Any], Linearised],
    build: Callable[[Any], Trajectory],
    miss: Callable[[Trajectory], Any],
    start: Float[np.ndarray, " n"],
    box: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> Float[np.ndarray, " n"]:
    """Return the unknowns of a motion, changed little, for the net rotation wanted and all joints within limits.

    Args:
        linearisation: conditions of the motion with derivatives, by the unknowns and shares of the pieces (2, p, j).
        build: makes the motion.
        miss: of a motion, exactly what the equality gives roughly.
        start: the unknowns.
        box: least and largest unknowns, and their scales.
    """
    lower, upper, scale = box
    x = start
    for _ in range(_STEPS):
        # conditions where the joints are farthest; the rotation exactly
        trajectory = build(x)
        now = Linearised(*(np.array(part) for part in linearisation(x, farthest(trajectory))))
        if now.equality.size:
            now = now._replace(equality=np.asarray(miss(trajectory)))
        now = now._replace(inequality=now.inequality + _CLEAR)
        if np.abs(now.equality).max(initial=0) < 1e-12 and now.inequality.max(initial=0) <= 0:
            break
        # the least step that to first order meets them all
        x = np.clip(x + scale * least_norm_step(now, scale, (lower - x) / scale, (upper - x) / scale), lower, upper)
    return x


Ends = tuple[tuple[int, int], ...]
"""Limits that there are: sign, 1 for an upper one and -1 for a lower one, and joint."""


def ends_of(robot: Robot) -> Ends:
    """All finite limits of a robot whose numbers can be read."""
    ends = ((1, np.asarray(robot.upper)), (-1, np.asarray(robot.lower)))
    return tuple((sign, int(k)) for sign, end in ends for k in np.flatnonzero(np.isfinite(end)))


def past_end(robot: Robot, end: tuple[int, int], theta: Float[Array, "... j"]) -> Float[Array, "..."]:
    """How far a joint is beyond a limit in some postures [rad]; negative within."""
    sign, joint = end
    limit = robot.upper[joint] if sign > 0 else robot.lower[joint]
    return sign * (theta[..., joint] - limit)


def beyond_limits(robot: Robot, trajectory: Trajectory, share: Float[Array, "2 p j"], ends: Ends) -> Float[Array, " l"]:
    """How far joints are beyond their limits [rad] at a share of each piece, for all limits and pieces.

    Args:
        robot: the robot.
        trajectory: the motion.
        share: where in each piece each joint is looked at, against its upper and its lower limit.
        ends: the limits.
    """
    # Horner's rule at those shares
    time = jnp.asarray(share) * jnp.diff(trajectory.breaks)[None, :, None]
    place = jnp.zeros_like(time)
    for row in range(trajectory.coefficients.shape[1])[::-1]:
        place = place * time + trajectory.coefficients[None, :, row]
    past = [past_end(robot, end, place[0 if end[0] > 0 else 1]) for end in ends]
    return jnp.concatenate([jnp.zeros(0, place.dtype), *past])


def beyond(robot: Robot, trajectory: Trajectory) -> float:
    """Farthest that a joint goes beyond its limits [rad], at any time; 0 for none."""
    return float(np.asarray(beyond_limits(robot, trajectory, farthest(trajectory), ends_of(robot))).max(initial=0.0))


def farthest(trajectory: Trajectory) -> Float[np.ndarray, "2 p j"]:
    """Share of each piece at which each joint is largest, and at which it is smallest."""
    lengths = np.diff(np.asarray(trajectory.breaks, float))
    powers = np.asarray(trajectory.coefficients, float)
    powers = powers * lengths[:, None, None] ** np.arange(powers.shape[1])[None, :, None]  # of the share
    share = np.zeros((2, len(lengths), trajectory.joints))
    for p, k in np.ndindex(share.shape[1:]):
        # ends of the piece, and where the rate is zero
        place = np.polynomial.Polynomial(powers[p, :, k])
        turns = place.deriv().trim().roots()
        at = np.array([0.0, 1.0, *np.clip(turns[abs(turns.imag) < 1e-6].real, 0, 1)])
        share[:, p, k] = at[[place(at).argmax(), place(at).argmin()]]
    return share


def least_norm_step(now: Linearised, scale: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Least scaled change with `equality + jacobian @ change` zero, `inequality + jacobian @ change` not positive."""
    near = now.inequality > _FAR
    rows = np.concatenate([now.equality_jacobian, now.inequality_jacobian[near]]) * scale
    offset = np.concatenate([now.equality, now.inequality[near]])
    n = len(scale)
    step = solve_quadratic(np.eye(n), np.zeros(n), rows, offset, now.equality.size, lower, upper)
    return step.d if step.solved else np.zeros(n)

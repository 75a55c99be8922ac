"""What must stay within bounds along a motion: joint angles, the motors' voltages, the clearance of collision pairs."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array
from reojax.collision.clearance import clearance as clearances
from reojax.mechanics.dynamics import joint_load
from reojax.motion.motor import Motor, demand
from reojax.robot import Robot

FEASIBLE = 1e-4
"""How far a limit may be passed: rad, share of the supply, or m."""
_BETWEEN = 5e-3
"""What a search keeps of joint limits [rad] and motors [share of the supply] for what lies between its nodes."""
_SOFT = 0.02
"""Power over which driving turns into being driven back [W]."""


class RightingTask(NamedTuple):
    """What all motions of a search share."""

    robot: Robot
    motors: Motor | None
    clearance: Array | None
    spare: Array
    """Clearance that a search keeps beyond it at the nodes, for what lies between them [m]."""
    start: Array
    end: Array
    weights: Array
    about: Array
    """(3,) axis, base frame, about which the end may be turned in any way; zero if about none."""


def nearest(task: RightingTask, goal: Float[Array, "3 3"], rotation: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """Of all ends `exp(psi n) goal` that will do, `n = goal about`, the one nearest to `rotation`; `goal` for no axis.

    `trace(exp(-psi n) M)` with `M = rotation goal^T` is `n M n + cos(psi) (trace(M) - n M n) - sin(psi) trace(hat(n)
    M)`, which is largest where the tangent of psi is the ratio of the last two (Rodrigues' formula).
    """
    n, between = goal @ task.about, rotation @ goal.T
    along = jnp.trace(between) - n @ between @ n
    return so3.exp(jnp.arctan2(-jnp.trace(so3.hat(n) @ between), along) * n) @ goal


def bounds(task: RightingTask, spare: bool = False) -> tuple[Float[Array, " c"], Float[Array, " c"]]:
    """Lowest and highest value (c,) of each condition of `conditions`, in its units: rad, share of the supply, m.

    With `spare` they are those that a search keeps at its nodes, for what lies between them.
    """
    robot = task.robot
    dtype = robot.mass.dtype
    least, most = jnp.minimum(task.start, task.end), jnp.maximum(task.start, task.end)
    kept = jnp.clip(jnp.minimum(robot.upper - most, least - robot.lower), 0, _BETWEEN if spare else 0)
    pairs: list[tuple[Any, Any]] = [(robot.lower + kept, robot.upper - kept)]
    if task.motors is not None:
        share = jnp.full(robot.joints, 1 - (_BETWEEN if spare else 0), dtype)
        pairs.append((-share, share))
    if task.clearance is not None:
        count = len(robot.collision_pairs)
        pairs.append((jnp.full(count, task.clearance + (task.spare if spare else 0)), jnp.full(count, jnp.inf)))
    low, high = (jnp.concatenate(side) for side in zip(*pairs, strict=True))
    return low, high


def conditions(task: RightingTask, state: Float[Array, " s"]) -> Float[Array, " c"]:
    """What is limited, at one node, of `(theta, theta_dot, theta_ddot, h)` with the momentum `h` in the base frame.

    Joint angles [rad]; the voltage that each motor needs, in shares of the supply (`reojax.motion.motor`, with the
    jump of the gears' losses smoothed); the distances of the collision pairs [m]. (c,) altogether.
    """
    robot = task.robot
    theta, rate, acceleration, h = jnp.split(state, np.cumsum([robot.joints] * 3))
    parts: list[Any] = [theta]
    if task.motors is not None:
        load = joint_load(robot, theta, rate, acceleration, momentum=h)
        squared, linear, constant = demand(robot, task.motors, rate, load, soft=_SOFT)
        parts.append((squared + linear.sum(0) + constant) / task.motors.supply)
    if task.clearance is not None:
        parts.append(clearances(robot, theta))
    return jnp.concatenate(parts)


def states(
    rows: Float[Array, "k 3 p+1"], points: Float[Array, "p+1 j"], rotation: Float[Array, "k 3 3"], momentum: Array
) -> Float[Array, "k s"]:
    """What `conditions` reads, at each node: (k, 3 j + 3), in rad, s and kg m^2/s, the momentum in the base frame.

    `rows` give angles, rates and accelerations from the spline's points; `momentum` is (3,) in the inertial frame.
    """
    joints = jnp.einsum("kop,pj->koj", rows, points).reshape(len(rows), -1)
    return jnp.concatenate([joints, rotation.swapaxes(1, 2) @ momentum], axis=1)


def conditions_and_slopes(
    task: RightingTask, state: Float[Array, "k s"], lift: Float[Array, "k 3 j n"]
) -> tuple[Float[Array, "k c"], Float[Array, "k c n"]]:
    """`conditions` at all nodes, and how they change with what `lift` carries to the nodes; `h` is held."""
    joints = task.robot.joints
    if task.motors is None and task.clearance is None:
        return state[:, :joints], lift[:, 0]
    slope = jax.vmap(jax.jacfwd(lambda s: conditions(task, s)))(state)[:, :, : 3 * joints]
    value = jax.vmap(lambda s: conditions(task, s))(state)
    return value, slope @ lift.reshape(len(state), 3 * joints, -1)

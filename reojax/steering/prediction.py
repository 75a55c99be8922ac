"""Where the joints that are told now will have turned the robot at the end, and how that changes with the steering.

The told motion ahead is `theta(t) - direction(t) c(t)`, held within the joints' limits, with the steering vector `c`
behind its filter. The base follows `R' = R hat(A^-1 (B theta' + R^T H))`, `H' = -drag R omega`, of the robot as it is
estimated: unlike in the linear law, nothing here is a first variation, and errors of the inertias are in it.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array
from reojax._internal.linalg import solve_symmetric3
from reojax.mechanics.momentum import momentum_matrices
from reojax.motion.trajectory import Trajectory
from reojax.robot import Robot
from reojax.steering.linear_law import smooth


def miss_and_slope(
    robot: Robot,
    trajectory: Trajectory,
    table: dict[str, Array],
    goal: Float[Array, "3 3"],
    now: tuple[Array, Array, Array, Array],
    steering: tuple[Array, Array, Array, Array],
    steps: int,
) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
    """What the end misses, inertial frame [rad], and its derivative by the steering vector.

    Args:
        robot: the robot as it is estimated.
        trajectory: the motion that was planned.
        table: the gains' table; its `direction` is what a steering vector changes, its `bias` (`bias_of`) what steps of
            this size miss of the end of the motion as planned.
        goal: orientation to end in.
        now: time, orientation with the joints where they are told to be, momentum, drag.
        steering: `steer, filtered, rate` and the filter's `tau`.
        steps: of the integration, Runge-Kutta of fourth order.
    """
    time, rotation, momentum, drag = now
    steer, filtered, rate, tau = steering
    length = jnp.maximum(trajectory.breaks[-1] - time, 1e-9) / steps
    times = time + length * jnp.arange(2 * steps + 1, dtype=length.dtype) / 2
    plan = jax.vmap(trajectory.at)(times)
    direction, slope = jax.vmap(lambda t: _direction(table, t))(times)
    bias = jax.vmap(lambda column: jnp.interp(time, table["at"], column))(table["bias"].T)

    def miss(steer: Array) -> tuple[Array, Array]:
        def node(t: Array, theta: Array, theta_dot: Array, direction: Array, slope: Array) -> tuple[Array, Array]:
            c, c_dot = smooth(steer, filtered, rate, t - time, tau)
            told = theta - direction @ c
            inside = jnp.clip(told, robot.lower, robot.upper)
            rates = jnp.where(inside == told, theta_dot - slope @ c - direction @ c_dot, 0)
            A, B = momentum_matrices(robot, inside)
            both = solve_symmetric3(A, jnp.concatenate([(B @ rates)[:, None], jnp.eye(3, dtype=t.dtype)], axis=1))
            return both[:, 0], both[:, 1:]

        turning, mobility = jax.vmap(node)(times, plan.theta, plan.theta_dot, direction, slope)
        found = so3.log(_end(length, turning, mobility, rotation, momentum, drag) @ goal.T) - bias
        return found, found

    by, value = jax.jacfwd(miss, has_aux=True)(steer)
    return value, by


@partial(jax.jit, static_argnums=4)
def bias_of(
    robot: Robot, trajectory: Trajectory, table: dict[str, Array], rotation: Float[Array, "m 3 3"], steps: int
) -> Float[Array, "m 3"]:
    """What `miss_and_slope` misses of the planned motion, from each of the table's times on, by its steps alone."""
    three = jnp.zeros(3, rotation.dtype)
    none = table | {"bias": jnp.zeros_like(rotation[:, 0])}

    def from_here(inputs: tuple[Array, Array]) -> Array:
        time, here = inputs
        now = time, here, table["momentum"], three[0]
        steering = three, three, three, jnp.ones((), rotation.dtype)
        return miss_and_slope(robot, trajectory, none, rotation[-1], now, steering, steps)[0]

    return jax.lax.map(from_here, (table["at"], rotation), batch_size=16)


def _direction(table: dict[str, Array], time: Array) -> tuple[Array, Array]:
    """`direction` at one time, by straight lines, and its rate."""
    at = table["at"]
    k = jnp.clip((at <= time).sum() - 1, 0, at.shape[0] - 2)
    h = at[k + 1] - at[k]
    first, last = table["direction"][k], table["direction"][k + 1]
    return first + jnp.clip((time - at[k]) / h, 0, 1) * (last - first), (last - first) / h


def _end(length: Array, turning: Array, mobility: Array, rotation: Array, momentum: Array, drag: Array) -> Array:
    """Orientation after all steps, of `omega = turning + mobility R^T H` at both ends and the middle of each."""

    def step(carry: tuple[Array, Array], nodes: tuple[Array, Array]) -> tuple[tuple[Array, Array], None]:
        r, h = carry
        a, m = nodes

        def omega(node: int, r: Array) -> Array:
            return a[node] + m[node] @ (r.T @ h)

        first = omega(0, r)
        second = omega(1, r @ so3.exp(length / 2 * first))
        third = omega(1, r @ so3.exp(length / 2 * second))
        last = omega(2, r @ so3.exp(length * third))
        turn = length / 6 * (first + 2 * second + 2 * third + last) + length**2 / 12 * jnp.cross(first, last)
        after = r @ so3.exp(turn)
        return (after, h - drag * (r @ turn)), None

    def triples(values: Array) -> Array:
        return jnp.stack([values[:-1:2], values[1::2], values[2::2]], axis=1)

    (end, _), _ = jax.lax.scan(step, (rotation, momentum), (triples(turning), triples(mobility)))
    return end


def steer_to(
    miss: Float[Array, "3"],
    slope: Float[Array, "3 3"],
    ahead: Float[Array, "m j 3"],
    steer: Float[Array, "3"],
    worth: Array,
    rest: Array,
    largest: Array,
) -> Float[Array, "3"]:
    """A damped Gauss-Newton step of the steering vector against the miss, of which a reading is `worth` a share.

    `ahead` is `direction` from now on: no joint is changed by more than `largest`.
    """
    eye = jnp.eye(3, dtype=miss.dtype)
    steer = steer - worth * solve_symmetric3(slope.T @ slope + rest**2 * eye, (slope.T @ miss)[:, None])[:, 0]
    most = jnp.abs(ahead @ steer).max()
    return steer * jnp.minimum(1, largest / jnp.maximum(most, 1e-12))

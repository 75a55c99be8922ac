"""Where the joints that are told now will have turned the robot at the end, and how that changes with the steering.

The told motion ahead is `theta(t) - bumps(t) c(t)` (`reojax.steering.bumps`), held within the joints' limits, with the
steering `c` (n, j) behind its filter. The base follows `R' = R hat(A^-1 (B theta' + R^T H))`, `H' = -drag R omega`, of
the robot as it is estimated: unlike in the linear law, nothing here is a first variation, and errors of the inertias
are in it. How the end changes with `c` is the first variation about the told motion, one sum over the nodes.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array
from reojax._internal.linalg import solve_symmetric3
from reojax.mechanics.variation import Instant, instant, turn_of_instant
from reojax.motion.trajectory import Trajectory
from reojax.robot import Robot
from reojax.steering.bumps import bumps


class Ahead(NamedTuple):
    """The rest of a motion, from now on."""

    robot: Robot
    """As it is estimated."""
    time: Array
    length: Array
    """Of a step of the integration [s]."""
    rotation: Array
    """Orientation now, with the joints where they are told to be."""
    momentum: Array
    drag: Array
    goal: Array
    """(3, 3) orientation to end in."""
    bias: Array
    """(3,) what steps of this size miss of the end of the motion as planned."""
    theta: Array
    """(2 s + 1, j) planned joint angles at the nodes."""
    theta_dot: Array
    low: Array
    """(2 s + 1, j) what a joint may be told there, least and most, and how these limits move."""
    high: Array
    low_dot: Array
    high_dot: Array
    values: Array
    """(2 s + 1, n) of the bumps."""
    rates: Array
    gone: Array
    """(2 s + 1, 2) how much is left of the filter's gap and of its rate, each with its own rate after it."""
    gone_rates: Array


def ahead_of(
    robot: Robot,
    trajectory: Trajectory,
    table: dict[str, Array],
    goal: Float[Array, "3 3"],
    now: tuple[Array, Array, Array, Array],
    tau: Array,
    largest: Array,
    steps: int,
    count: int,
) -> Ahead:
    """Everything that does not depend on the steering.

    Args:
        robot: the robot as it is estimated.
        trajectory: the motion that was planned.
        table: its `bias` (`bias_of`) by `at`.
        goal: orientation to end in.
        now: time, orientation with the joints where they are told to be, momentum, drag.
        tau: of the filter [s].
        largest: change of a joint [rad].
        steps: of the integration, Runge-Kutta of fourth order.
        count: of the bumps.
    """
    time, rotation, momentum, drag = now
    end = trajectory.breaks[-1]
    length = jnp.maximum(end - time, 1e-9) / steps
    times = time + length * jnp.arange(2 * steps + 1, dtype=length.dtype) / 2
    plan = jax.vmap(trajectory.at)(times)
    values, rates = jax.vmap(lambda t: bumps(t, end, count))(times)
    low, high = plan.theta - largest, plan.theta + largest
    moves = low > robot.lower[None], high < robot.upper[None]
    low, high = jnp.maximum(robot.lower[None], low), jnp.minimum(robot.upper[None], high)
    bias = jax.vmap(lambda column: jnp.interp(time, table["at"], column))(table["bias"].T)
    s = (times - time) / tau
    decay = jnp.exp(-s)
    gone = jnp.stack([(1 + s) * decay, tau * s * decay], axis=1)
    gone_rates = jnp.stack([-s * decay / tau, (1 - s) * decay], axis=1)
    return Ahead(
        robot=robot,
        time=time,
        length=length,
        rotation=rotation,
        momentum=momentum,
        drag=drag,
        goal=goal,
        bias=bias,
        theta=plan.theta,
        theta_dot=plan.theta_dot,
        low=low,
        high=high,
        low_dot=jnp.where(moves[0], plan.theta_dot, 0),
        high_dot=jnp.where(moves[1], plan.theta_dot, 0),
        values=values,
        rates=rates,
        gone=gone,
        gone_rates=gone_rates,
    )


def miss_and_slope(
    ahead: Ahead, steer: Float[Array, "n j"], filtered: Float[Array, "n j"], rate: Float[Array, "n j"]
) -> tuple[Float[Array, "3"], Float[Array, "3 n j"]]:
    """What the end misses, inertial frame [rad], and its derivative by the steering."""
    known, theta_dot, own = _instants(ahead, steer, filtered, rate)
    rotation = _history(ahead, known, theta_dot)
    miss = so3.log(rotation[-1] @ ahead.goal.T) - ahead.bias
    half = jax.vmap(lambda a, b: a @ so3.exp(0.5 * so3.log(a.T @ b)))(rotation[:-1], rotation[1:])
    both = jnp.concatenate([rotation[:1], jnp.stack([half, rotation[1:]], axis=1).reshape(-1, 3, 3)])
    turn = jax.vmap(partial(turn_of_instant, ahead.robot), (0, 0, 0, None))
    g, growth = turn(known, theta_dot, both, ahead.momentum)
    g = _transitions(growth, ahead.length / 2) @ g
    count = ahead.values.shape[0]
    weight = jnp.full(count, 2.0, miss.dtype).at[1::2].set(4).at[0].set(1).at[-1].set(1) * ahead.length / 6
    carried = -ahead.values * (weight * (1 - ahead.gone[:, 0]))[:, None]
    return miss, jnp.einsum("kaj,kj,kn->anj", g, own, carried)


def miss_of(ahead: Ahead, steer: Array, filtered: Array, rate: Array) -> Float[Array, "3"]:
    """What the end misses alone, arguments and result as of `miss_and_slope`."""
    known, theta_dot, _ = _instants(ahead, steer, filtered, rate)
    return so3.log(_history(ahead, known, theta_dot)[-1] @ ahead.goal.T) - ahead.bias


def _instants(ahead: Ahead, steer: Array, filtered: Array, rate: Array) -> tuple[Instant, Array, Array]:
    """At the nodes: what the mechanics need, the told rates, and which joints are not held at a limit."""
    parts = jnp.stack([filtered - steer, rate])
    c = steer[None] + jnp.einsum("kq,qnj->knj", ahead.gone, parts)
    c_dot = jnp.einsum("kq,qnj->knj", ahead.gone_rates, parts)
    told = ahead.theta - jnp.einsum("kn,knj->kj", ahead.values, c)
    back = jnp.einsum("kn,knj->kj", ahead.rates, c) + jnp.einsum("kn,knj->kj", ahead.values, c_dot)
    inside = jnp.clip(told, ahead.low, ahead.high)
    own = (inside == told).astype(told.dtype)
    theta_dot = jnp.where(
        told < inside, ahead.low_dot, jnp.where(told > inside, ahead.high_dot, ahead.theta_dot - back)
    )
    return jax.vmap(partial(instant, ahead.robot))(inside, theta_dot), theta_dot, own


def _history(ahead: Ahead, known: Instant, theta_dot: Float[Array, "k j"]) -> Float[Array, "s+1 3 3"]:
    """Orientations at the ends of all steps, from both ends and the middle of each."""
    eye, length = jnp.eye(3, dtype=theta_dot.dtype), ahead.length

    def rate_terms(A: Array, B: Array, rate: Array) -> Array:
        return solve_symmetric3(A, jnp.concatenate([(B @ rate)[:, None], eye], axis=1))

    both = jax.vmap(rate_terms)(known.A, known.B, theta_dot)
    nodes = jnp.stack([both[:-1:2], both[1::2], both[2::2]], axis=1)

    def step(carry: tuple[Array, Array], node: Array) -> tuple[tuple[Array, Array], Array]:
        r, h = carry

        def omega(k: int, r: Array) -> Array:
            return node[k, :, 0] + node[k, :, 1:] @ (r.T @ h)

        first = omega(0, r)
        second = omega(1, r @ so3.exp(length / 2 * first))
        third = omega(1, r @ so3.exp(length / 2 * second))
        last = omega(2, r @ so3.exp(length * third))
        turn = length / 6 * (first + 2 * second + 2 * third + last) + length**2 / 12 * jnp.cross(first, last)
        after = r @ so3.exp(turn)
        return (after, h - ahead.drag * (r @ turn)), after

    _, found = jax.lax.scan(step, (ahead.rotation, ahead.momentum), nodes)
    return jnp.concatenate([ahead.rotation[None], found])


def _transitions(growth: Float[Array, "k 3 3"], half: Array) -> Float[Array, "k 3 3"]:
    """`Phi(end, s)` at nodes a half step apart: the trapezoid rule, backward from the identity."""

    def back(after: Array, pair: tuple[Array, Array]) -> tuple[Array, Array]:
        slope = after @ pair[1]
        before = after + half / 2 * (slope + (after + half * slope) @ pair[0])
        return before, before

    eye = jnp.eye(3, dtype=growth.dtype)
    _, found = jax.lax.scan(back, eye, (growth[:-1], growth[1:]), reverse=True)
    return jnp.concatenate([found, eye[None]])


@partial(jax.jit, static_argnums=(4, 5))
def bias_of(
    robot: Robot,
    trajectory: Trajectory,
    table: dict[str, Array],
    rotation: Float[Array, "m 3 3"],
    steps: int,
    count: int,
) -> Float[Array, "m 3"]:
    """What `miss_and_slope` misses of the planned motion, from each of the table's times on, by its steps alone."""
    none = table | {"bias": jnp.zeros_like(rotation[:, 0])}
    still = jnp.zeros((count, trajectory.joints), rotation.dtype)
    one = jnp.ones((), rotation.dtype)

    def from_here(inputs: tuple[Array, Array]) -> Array:
        time, here = inputs
        now = time, here, table["momentum"], still[0, 0]
        return miss_of(
            ahead_of(robot, trajectory, none, rotation[-1], now, one, jnp.inf * one, steps, count), still, still, still
        )

    return jax.lax.map(from_here, (table["at"], rotation), batch_size=16)

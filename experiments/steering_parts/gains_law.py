"""The law on board (`reojax.steering.onboard`) in JAX, so that many falls run side by side; no estimator."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from common.types import Array

import reojax
from reojax import so3
from reojax.steering.linear_law import row_at, smooth, steer_by
from reojax.steering.readings import Reading, References
from reojax.steering.tables import gain_table

_MEMORY = 32


class GainsState(NamedTuple):
    """As `onboard.OnboardState`; `estimate` is empty."""

    time: Array
    steer: Array
    filtered: Array
    rate: Array
    read: Array
    past: Array
    momentum: Array
    drag: Array
    values: Array


class GainsLaw:
    """`onboard.OnboardLaw` with the same `start` and `update` as a `SteeringLaw`."""

    def __init__(self, robot: reojax.Robot, plan: reojax.Trajectory, *, settle: float, left: float):
        table = gain_table(reojax.correction_gains(robot, plan, samples=32, left=left))
        fillers = {"drift": np.zeros((len(table["at"]), 3, 4)), "to_end": np.tile(np.eye(3), (len(table["at"]), 1, 1))}
        self.table: Any = {name: jnp.asarray(value) for name, value in (table | fillers).items()}
        self.robot, self.plan, self.settle = robot, plan, settle
        self.tau, self.largest = jnp.asarray(5e-3), jnp.asarray(0.6)

    def start(self) -> GainsState:
        """No change yet."""
        zero, three = jnp.zeros(()), jnp.zeros(3)
        return GainsState(zero, three, three, three, zero, jnp.zeros((_MEMORY, 4)), three, zero, jnp.zeros(0))

    def update(self, state: GainsState, reading: Reading) -> tuple[GainsState, References]:
        """`onboard.OnboardLaw.step`."""
        time, _, seen, taken = (jnp.asarray(x, float) for x in reading)
        now, steer = row_at(self.table, time), state.steer
        comes = jnp.isfinite(seen).all()
        then = row_at(self.table, taken)
        before = jax.vmap(lambda column: jnp.interp(taken, state.past[:, 0], column))(state.past[:, 1:].T)
        own = then["rotation"] @ so3.exp(then["connection"] @ (-then["direction"] @ before))
        since = (then["gramian"] - now["gramian"]) @ (before + state.filtered) / 2
        error = so3.log(jnp.where(comes, seen, own) @ own.T) - since
        worth = jnp.where(comes, 1 - jnp.exp(-(taken - state.read) / self.settle), 0)
        steer, left = steer_by(
            now, self.table, time, steer, state.filtered, state.rate, error, worth, self.tau, self.largest
        )
        filtered, rate = smooth(steer, state.filtered, state.rate, time - state.time, self.tau)
        past = jnp.concatenate([state.past[1:], jnp.concatenate([time[None], filtered])[None]])
        told = jnp.clip(self.plan.at(time).theta - now["direction"] @ filtered, self.robot.lower, self.robot.upper)
        read = jnp.where(comes, taken, state.read)
        after = state._replace(time=time, steer=steer, filtered=filtered, rate=rate, read=read, past=past)
        return after, References(told, error, left)

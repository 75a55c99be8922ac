"""The law that `Steering` builds: one step of estimator and corrector, all state explicit."""

from __future__ import annotations

import dataclasses
from functools import partial

import jax
import jax.numpy as jnp

from reojax import so3
from reojax._internal.arrays import Array
from reojax.mechanics.momentum import connection
from reojax.robot import Robot
from reojax.steering.bumps import bumps
from reojax.steering.clear_of_itself import Keep, towards
from reojax.steering.estimator import Estimate, Model, along, kalman_update, off, robot_with
from reojax.steering.least_change import Effort, steer_to
from reojax.steering.linear_law import row_at, smooth, steer_by
from reojax.steering.prediction import Ahead, ahead_of, miss_and_slope
from reojax.steering.readings import MEMORY, Believed, Reading, References, SteeringState, check_reading


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["model", "table", "goal", "frame", "start_covariance", "effort", "tau", "settle", "largest", "keep"],
    meta_fields=["steps", "bumps"],
)
@dataclasses.dataclass(frozen=True, eq=False)
class SteeringLaw:
    """What `Steering` builds: an immutable pytree; `start`, `step`, and the same without checks, `update`."""

    model: Model
    table: dict[str, Array]
    """Gains along the motion, by name."""
    goal: Array
    """(3, 3) orientation to end in, from where the motion begins."""
    frame: Array
    """(3, 3) orientation where the motion begins: readings are of the base to the inertial frame of the first one."""
    start_covariance: Array
    effort: Effort
    """Of a change of the joints, for the prediction."""
    tau: Array
    settle: Array
    largest: Array
    keep: Keep | None
    """The clearance that corrections keep, if one was asked for; `keep.proven` is that of the motion."""
    steps: int
    """Of the prediction; 0 for the linear law."""
    bumps: int
    """Of which changes are made; see `reojax.steering.bumps`."""

    def start(self) -> SteeringState:
        """State at the release: the robot as planned, at rest, oriented as the inertial frame."""
        dtype = self.model.noise.dtype
        none = jnp.zeros((self.bumps, self.model.robot.joints) if self.steps else 3, dtype)
        values = jnp.asarray([p.start for p in self.model.parameters], dtype)
        return SteeringState(
            time=jnp.zeros((), dtype),
            taken=jnp.zeros((), dtype),
            rotation=jnp.eye(3, dtype=dtype),
            momentum=self.table["momentum"],
            drag=jnp.zeros((), dtype),
            values=values,
            covariance=self.start_covariance,
            past_time=jnp.arange(-MEMORY, 0, dtype=dtype) * 1e-9,
            past_offset=jnp.zeros((MEMORY, self.model.robot.joints), dtype),
            steer=none,
            filtered=none,
            rate=none,
        )

    def step(self, state: SteeringState, reading: Reading) -> tuple[SteeringState, References]:
        """Take a reading in: the new state, and what the joints are told.

        Raises:
            ValueError: if the reading comes out of order, is older than what is remembered, has another shape, or an
                orientation is no rotation. NaN is no mistake: a sensor that says nothing.
        """
        return _update(self, state, check_reading(self.model.robot, state, reading))

    def believed(self, state: SteeringState) -> Believed:
        """What is known after the last reading, in the inertial frame of the first motion."""
        return Believed(
            robot=robot_with(self.model.robot, self.model.parameters, state.values),
            taken=state.taken,
            rotation=self.frame @ state.rotation,
            momentum=self.frame @ state.momentum,
            drag=state.drag,
            values=state.values,
            covariance=state.covariance,
        )

    def resume(self, state: SteeringState, following: SteeringLaw) -> tuple[SteeringLaw, SteeringState]:
        """Go on with the next motion and all that is known: at the end of each manoeuvre, or with one planned anew.

        Args:
            state: after the last reading of this motion, its joints at rest where `following` begins.
            following: law of the next motion, with the same `parameters`: planned for `believed(state)`, or as it was
                planned before. The motion, its `momentum` and its `goal` are seen from where this one was to end.

        Returns:
            `following`, which takes readings in the frame of the first motion, and its state: time begins at zero
            again; orientation, momentum, drag and parameters go on with their covariance.

        Raises:
            ValueError: if the parameters are not the same.
        """
        names = [[p.name for p in one.model.parameters] for one in (self, following)]
        if names[0] != names[1]:
            raise ValueError(f"`following` estimates {names[1]}, this law {names[0]}; both must be the same.")
        onward = dataclasses.replace(following, frame=self.frame @ self.goal)
        turn = jnp.eye(state.covariance.shape[0], dtype=state.covariance.dtype)
        turn = turn.at[:3, :3].set(self.goal.T).at[3:6, 3:6].set(self.goal.T)
        fresh = onward.start()
        after = fresh._replace(
            taken=state.taken - state.time,
            rotation=self.goal.T @ state.rotation,
            momentum=self.goal.T @ state.momentum,
            drag=state.drag,
            values=state.values,
            covariance=turn @ state.covariance @ turn.T,
            past_time=state.past_time - state.time,
        )
        return onward, after

    def update(self, state: SteeringState, reading: Reading) -> tuple[SteeringState, References]:
        """`step` without the checks, for `jax.lax.scan` and `jax.vmap`."""
        return _update(self, state, reading)


@jax.jit
def _update(law: SteeringLaw, state: SteeringState, reading: Reading) -> tuple[SteeringState, References]:
    dtype = law.model.noise.dtype
    time, theta, seen, taken = (jnp.asarray(x, dtype) for x in reading)
    planned = law.model.trajectory.at(time).theta
    # a joint that is not read is taken to be where it is told to be
    row = row_at(law.table, time)
    own = _told(law, planned, _change(law, row, time, state.filtered))
    offset = jnp.where(jnp.isfinite(theta), theta, own) - planned
    times = jnp.concatenate([state.past_time[1:], time[None]])
    offsets = jnp.concatenate([state.past_offset[1:], offset[None]])
    # orientation: predicted to when it was taken, corrected there; then along the joints to now
    seen = law.frame.T @ seen
    fresh = jnp.isfinite(seen).all() & (taken > state.taken)
    until = jnp.where(fresh, taken, state.taken)
    start = Estimate(state.rotation, state.momentum, state.covariance)
    robot = robot_with(law.model.robot, law.model.parameters, state.values)
    then = along(law.model, robot, state, start, state.taken, until, times, offsets, True)
    then, drag, values = kalman_update(law.model, state, then, jnp.where(fresh, seen, then.rotation), fresh)
    state = state._replace(drag=drag, values=values)
    robot = robot_with(law.model.robot, law.model.parameters, values)
    now = along(law.model, robot, state, then, until, time, times, offsets, False)
    worth = 1 - jnp.exp(-(time - state.time) / law.settle)
    if law.steps:
        ahead = _ahead(law, robot, now, drag, time, planned + offset, own)
        left, slope = miss_and_slope(ahead, state.steer, state.filtered, state.rate)
        error = left - jnp.einsum("anj,nj->a", slope, state.steer)
        steer = steer_to(left, slope, state.steer, law.effort, worth, law.largest)
    else:
        error, left, steer = _linear(law, state, now, row, time, offset, worth)
    filtered, rate = smooth(steer, state.filtered, state.rate, time - state.time, law.tau)
    told = _told(law, planned, _change(law, row, time, filtered))
    state = SteeringState(
        time=time,
        taken=until,
        rotation=then.rotation,
        momentum=then.momentum,
        drag=drag,
        values=values,
        covariance=then.covariance,
        past_time=times,
        past_offset=offsets,
        steer=steer,
        filtered=filtered,
        rate=rate,
    )
    return state, References(told, error, left)


def _ahead(law: SteeringLaw, robot: Robot, now: Estimate, drag: Array, time: Array, theta: Array, told: Array) -> Ahead:
    """The rest of the motion; joints that lag behind what they are told will have turned the base by then."""
    rotation = now.rotation @ so3.exp(connection(robot, theta) @ (told - theta))
    here = time, rotation, now.momentum, drag
    return ahead_of(robot, law.model.trajectory, law.table, law.goal, here, law.tau, law.largest, law.steps, law.bumps)


def _linear(
    law: SteeringLaw,
    state: SteeringState,
    now: Estimate,
    row: dict[str, Array],
    time: Array,
    offset: Array,
    worth: Array,
) -> tuple[Array, Array, Array]:
    """Error and steering by the first variation: error at the end, if the joints kept to the plan from here."""
    carried = row["rotation"] @ so3.exp(row["connection"] @ offset)
    unknown = jnp.concatenate([now.momentum - law.table["momentum"], state.drag[None], off(law.model, state.values)])
    error = row["to_end"] @ so3.log(now.rotation @ carried.T) + row["drift"] @ unknown
    steer, left = steer_by(
        row, law.table, time, state.steer, state.filtered, state.rate, error, worth, law.tau, law.largest
    )
    return error, left, steer


def _change(law: SteeringLaw, row: dict[str, Array], time: Array, filtered: Array) -> Array:
    """What the joints are to be less than planned."""
    if law.steps:
        return bumps(time, law.model.trajectory.breaks[-1], law.bumps)[0] @ filtered
    return row["direction"] @ filtered


def _told(law: SteeringLaw, planned: Array, change: Array) -> Array:
    """Where the joints go: the planned posture less a change, within the limits, and clear if that is asked."""
    robot = law.model.robot
    low, high = jnp.maximum(robot.lower, planned - law.largest), jnp.minimum(robot.upper, planned + law.largest)
    wanted = jnp.clip(planned - change, low, high)
    return wanted if law.keep is None else towards(robot, law.keep, planned, wanted)

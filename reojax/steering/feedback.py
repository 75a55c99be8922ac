"""Feedback in flight: what is wrong with a release is estimated while the motion runs, and the rest takes it back.

An extended Kalman filter on the rotation group (F. L. Markley, J. Guid. Control Dyn. 26, 2003) holds the orientation,
the angular momentum, a wire's drag and chosen parameters of the robot. It goes along the joint angles that are read,

    R' = R hat(A^-1 (B theta' + R^T H)),      H' = -drag R omega,

and an orientation that comes late is compared at the time when it was taken. What the estimate says of the end of the
motion goes to the law of `correction_gains`, as it runs on board (`reojax.steering.onboard`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from reojax import so3
from reojax._internal.arrays import Array, as_numbers, common_float
from reojax.captures.parameters import Parameter, parameter
from reojax.mechanics.own_units import without_names
from reojax.motion.trajectory import Trajectory
from reojax.robot import Robot
from reojax.steering.clear_of_itself import Keep, keep_of, towards
from reojax.steering.drift import drift_of
from reojax.steering.estimator import Estimate, Model, along, changed, corrected, off
from reojax.steering.gains import correction_gains
from reojax.steering.linear_law import row_at, smooth, steer_by
from reojax.steering.readings import MEMORY, Reading, References, SteeringState, checked
from reojax.steering.tables import gain_table


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["model", "table", "start_covariance", "tau", "settle", "largest", "keep"],
    meta_fields=[],
)
@dataclasses.dataclass(frozen=True, eq=False)
class SteeringLaw:
    """What `Steering` builds: an immutable pytree; `start`, `step`, and the same without checks, `update`."""

    model: Model
    table: dict[str, Array]
    start_covariance: Array
    tau: Array
    settle: Array
    largest: Array
    keep: Keep | None
    """The clearance that corrections keep, if one was asked for; `keep.proven` is that of the motion."""

    def start(self) -> SteeringState:
        """State at the release: the robot as planned, at rest, oriented as the inertial frame."""
        dtype = self.model.noise.dtype
        three = jnp.zeros(3, dtype)
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
            steer=three,
            filtered=three,
            rate=three,
        )

    def step(self, state: SteeringState, reading: Reading) -> tuple[SteeringState, References]:
        """Take a reading in: the new state, and what the joints are told.

        Raises:
            ValueError: if the reading comes out of order, is older than what is remembered, has another shape, or an
                orientation is no rotation. NaN is no mistake: a sensor that says nothing.
        """
        return _update(self, state, checked(self.model.robot, state, reading))

    def update(self, state: SteeringState, reading: Reading) -> tuple[SteeringState, References]:
        """`step` without the checks, for `jax.lax.scan` and `jax.vmap`."""
        return _update(self, state, reading)


def Steering(
    robot: Robot,
    trajectory: Trajectory,
    *,
    noise: float = np.deg2rad(1.0),
    momentum: ArrayLike | None = None,
    momentum_std: ArrayLike = 0.0,
    drag_std: float = 0.0,
    parameters: Sequence[Parameter | str] = (),
    parameters_std: Sequence[float] = (),
    wander: float = 1e-3,
    tau: float = 5e-3,
    settle: float = 3e-2,
    largest: float = 0.6,
    samples: int = 32,
    weights: ArrayLike | None = None,
    left: float = 1.0,
    clearance: float | None = None,
) -> SteeringLaw:
    """Estimator and corrector of one motion: readings in, joint angles out, all state explicit.

    `state = law.start()`, then `state, told = law.step(state, Reading(time, theta, rotation, taken))` at each reading.

    Args:
        robot: the robot as it is believed to be.
        trajectory: the motion of its joints.
        noise: standard deviation of the read orientation, about each axis [rad].
        momentum: (3,) angular momentum that the motion was planned for, inertial frame [kg m^2/s]; default zero.
        momentum_std: (3,) or one number, standard deviation of what the release adds to it [kg m^2/s].
        drag_std: standard deviation of the wires' moment per angular velocity of the base [N m s/rad].
        parameters: numbers of the robot that are estimated too: names as for `calibrate`, or `Parameter`s.
        parameters_std: standard deviation of each.
        wander: what the orientation goes astray beyond all this, per root of time [rad/s^(1/2)].
        tau: time constant of the filter that smooths corrections [s].
        settle: time over which a correction is made [s].
        largest: largest change of a joint [rad]; the robot's limits hold too.
        samples: of each piece of the trajectory, for the tables.
        weights: (j,) price of changing each joint, as for `correction_gains`.
        left: as for `correction_gains`.
        clearance: least distance between the robot's parts, from 0 up, that every posture which the joints are told is
            proven to keep [m]; default not asked. The motion must keep it. A correction that would come nearer goes
            only part of its way, and what it leaves is corrected later, if there is time.

    Raises:
        ValueError: naming the entry, its value and the rule.
    """
    h = np.zeros(3) if momentum is None else momentum
    gains = correction_gains(robot, trajectory, samples=samples, weights=weights, left=left, momentum=h)
    numbers = {"noise": noise, "wander": wander, "tau": tau, "settle": settle, "largest": largest, "drag_std": drag_std}
    for entry, value in numbers.items():
        single = np.asarray(as_numbers(entry, value))
        if (
            single.shape
            or not np.isfinite(single)
            or single < 0
            or (single == 0 and entry not in ("wander", "drag_std"))
        ):
            raise ValueError(f"`{entry}` is {value!r}; it must be one positive number.")
    chosen = tuple(parameter(robot, p) if isinstance(p, str) else p for p in parameters)
    if not all(isinstance(p, Parameter) for p in chosen):
        raise ValueError(f"`parameters` is {parameters!r}; each must be a name or a Parameter.")
    if len(parameters_std) != len(chosen):
        raise ValueError(f"`parameters_std` has {len(parameters_std)} numbers for {len(chosen)} parameters.")
    spread = np.broadcast_to(np.asarray(as_numbers("momentum_std", momentum_std)), (3,))
    std = np.concatenate([np.zeros(3), spread, [drag_std], np.asarray(parameters_std, float)])
    if not (np.isfinite(std) & (std >= 0)).all():
        raise ValueError(f"standard deviations must be finite and not negative; they are {std[3:].tolist()}.")
    keep = None if clearance is None else keep_of(robot, trajectory, clearance)
    dtype = common_float(robot, trajectory)
    one = partial(jnp.asarray, dtype=dtype)
    plain = without_names(
        robot, couplings=True, shapes=keep is not None
    )  # one compiled step serves all robots of this tree
    robot, trajectory, h = jax.tree.map(one, (plain, trajectory, np.asarray(h, float)))
    table = {name: one(value) for name, value in gain_table(gains).items()} | {"momentum": h, "to_end": gains.to_end}
    table["drift"] = drift_of(robot, chosen, gains, h)
    return SteeringLaw(
        model=Model(robot, trajectory, one(noise), one(wander), chosen),
        table=table,
        start_covariance=jnp.diag(one(std) ** 2),
        tau=one(tau),
        settle=one(settle),
        largest=one(largest),
        keep=keep,
    )


@jax.jit
def _update(law: SteeringLaw, state: SteeringState, reading: Reading) -> tuple[SteeringState, References]:
    dtype = law.model.noise.dtype
    time, theta, seen, taken = (jnp.asarray(x, dtype) for x in reading)
    planned = law.model.trajectory.at(time).theta
    # a joint that is not read is taken to be where it is told to be
    row = row_at(law.table, time)
    own = _told(law, planned, row["direction"] @ state.filtered)
    offset = jnp.where(jnp.isfinite(theta), theta, own) - planned
    times = jnp.concatenate([state.past_time[1:], time[None]])
    offsets = jnp.concatenate([state.past_offset[1:], offset[None]])
    # orientation: predicted to when it was taken, corrected there; then along the joints to now
    fresh = jnp.isfinite(seen).all() & (taken > state.taken)
    until = jnp.where(fresh, taken, state.taken)
    start = Estimate(state.rotation, state.momentum, state.covariance)
    robot = changed(law.model.robot, law.model.parameters, state.values)
    then = along(law.model, robot, state, start, state.taken, until, times, offsets, True)
    then, drag, values = corrected(law.model, state, then, jnp.where(fresh, seen, then.rotation), fresh)
    state = state._replace(drag=drag, values=values)
    robot = changed(law.model.robot, law.model.parameters, values)
    now = along(law.model, robot, state, then, until, time, times, offsets, False)
    # error at the end, if the joints kept to the plan from here
    carried = row["rotation"] @ so3.exp(row["connection"] @ offset)
    unknown = jnp.concatenate([now.momentum - law.table["momentum"], drag[None], off(law.model, values)])
    error = row["to_end"] @ so3.log(now.rotation @ carried.T) + row["drift"] @ unknown
    worth = 1 - jnp.exp(-(time - state.time) / law.settle)
    steer, left = steer_by(
        row, law.table, time, state.steer, state.filtered, state.rate, error, worth, law.tau, law.largest
    )
    filtered, rate = smooth(steer, state.filtered, state.rate, time - state.time, law.tau)
    told = _told(law, planned, row["direction"] @ filtered)
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


def _told(law: SteeringLaw, planned: Array, back: Array) -> Array:
    """Where the joints go: the planned posture less a correction, within the limits, and clear if that is asked."""
    robot = law.model.robot
    wanted = jnp.clip(planned - back, robot.lower, robot.upper)
    return wanted if law.keep is None else towards(robot, law.keep, planned, wanted)

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
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from reojax import so3
from reojax._internal import checks
from reojax._internal.arrays import Array, as_numbers, common_float
from reojax._internal.linalg import solve_symmetric3
from reojax.captures.parameters import Parameter, parameter
from reojax.mechanics.momentum import momentum_matrices
from reojax.motion.trajectory import Trajectory
from reojax.robot import Robot
from reojax.steering.gains import CorrectionGains, correction_gains
from reojax.steering.tables import gain_table

_MEMORY = 64
"""Joint readings that are remembered."""
_LONGEST = 4e-3
"""Longest step of the integration from one reading to the next [s]."""


class Reading(NamedTuple):
    """What the sensors say at one time; NaN where they say nothing."""

    time: ArrayLike
    """Now: when the joints were read [s]."""
    theta: ArrayLike
    """(j,) joint angles [rad]."""
    rotation: ArrayLike
    """(3, 3) orientation of the base, the latest that has come."""
    taken: ArrayLike
    """When it was taken, not after `time` [s]."""


class References(NamedTuple):
    """What the joints are told, and what it is good for."""

    theta: Float[Array, " j"]
    """Joint angles to go to [rad]."""
    error: Float[Array, "3"]
    """Error of the orientation that is expected at the end if the joints kept to the plan, inertial frame [rad]."""
    left: Float[Array, "3"]
    """What the change under way does not take back of it [rad]."""


class SteeringState(NamedTuple):
    """All that `Steering` remembers."""

    time: Float[Array, ""]
    """Of the last reading [s]."""
    taken: Float[Array, ""]
    """Of the last orientation [s]."""
    rotation: Float[Array, "3 3"]
    """Estimated orientation then."""
    momentum: Float[Array, "3"]
    """Estimated angular momentum then, inertial frame [kg m^2/s]."""
    drag: Float[Array, ""]
    """Estimated drag [N m s/rad]."""
    values: Float[Array, " q"]
    """Estimated parameters, in the order in which they were given."""
    covariance: Float[Array, "7+q 7+q"]
    """Of orientation (inertial frame), momentum, drag and parameters."""
    past_time: Float[Array, " n"]
    """When joints were read, the latest last [s]."""
    past_offset: Float[Array, "n j"]
    """How far they were from the motion [rad]."""
    steer: Float[Array, "3"]
    """Steering vector."""
    filtered: Float[Array, "3"]
    """The same behind the filter."""
    rate: Float[Array, "3"]
    """Its rate."""


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["robot", "trajectory", "table", "start_covariance", "noise", "wander", "tau", "settle", "largest"],
    meta_fields=["parameters"],
)
@dataclasses.dataclass(frozen=True, eq=False)
class SteeringLaw:
    """What `Steering` builds: an immutable pytree; `start`, `step`, and the same without checks, `update`."""

    robot: Robot
    trajectory: Trajectory
    table: dict[str, Array]
    start_covariance: Array
    noise: Array
    wander: Array
    tau: Array
    settle: Array
    largest: Array
    parameters: tuple[Parameter, ...]

    def start(self) -> SteeringState:
        """State at the release: the robot as planned, at rest, oriented as the inertial frame."""
        dtype = self.noise.dtype
        three = jnp.zeros(3, dtype)
        values = jnp.asarray([p.start for p in self.parameters], dtype)
        return SteeringState(
            time=jnp.zeros((), dtype),
            taken=jnp.zeros((), dtype),
            rotation=jnp.eye(3, dtype=dtype),
            momentum=self.table["momentum"],
            drag=jnp.zeros((), dtype),
            values=values,
            covariance=self.start_covariance,
            past_time=jnp.arange(-_MEMORY, 0, dtype=dtype) * 1e-9,
            past_offset=jnp.zeros((_MEMORY, self.robot.joints), dtype),
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
        return _update(self, state, self._checked(state, reading))

    def update(self, state: SteeringState, reading: Reading) -> tuple[SteeringState, References]:
        """`step` without the checks, for `jax.lax.scan` and `jax.vmap`."""
        return _update(self, state, reading)

    def _checked(self, state: SteeringState, reading: Reading) -> Reading:
        checks.instance("reading", reading, Reading, "Reading(time, theta, rotation, taken)")
        time, theta, rotation, taken = (np.asarray(as_numbers(f, v)) for f, v in reading._asdict().items())
        joints = self.robot.joints
        shapes = {"time": ((), time), "theta": ((joints,), theta), "rotation": ((3, 3), rotation), "taken": ((), taken)}
        for entry, (shape, value) in shapes.items():
            if value.shape != shape:
                raise ValueError(f"reading.{entry} has shape {value.shape}; it must be {shape}.")
        if not np.isfinite(time):
            raise ValueError(f"reading.time is {time}; it must be finite.")
        last, last_taken, memory = (np.asarray(x) for x in (state.time, state.taken, state.past_time))
        if time <= last:
            raise ValueError(f"reading.time is {time:g} s, not after the last reading's {last:g} s: out of order.")
        if not np.isfinite(rotation).all():
            return Reading(time, theta, np.full((3, 3), np.nan), time)
        checks.rotations("reading.rotation", rotation)
        if not taken <= time:
            raise ValueError(f"reading.taken is {taken} s; an orientation is taken by the time it is read, {time:g} s.")
        if taken <= last_taken and taken != 0:
            raise ValueError(
                f"reading.taken is {taken:g} s, not after the last orientation's {last_taken:g} s: out of order."
            )
        if taken < memory[0]:
            raise ValueError(f"reading.taken is {taken:g} s, before the last {_MEMORY} readings of the joints.")
        return Reading(time, theta, rotation, taken)


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
    dtype = common_float(robot, trajectory)
    one = partial(jnp.asarray, dtype=dtype)
    robot, trajectory, h = jax.tree.map(one, (robot, trajectory, np.asarray(h, float)))
    table = {name: one(value) for name, value in gain_table(gains).items()} | {"momentum": h, "to_end": gains.to_end}
    table["drift"] = _drift(robot, chosen, gains, h)
    return SteeringLaw(
        robot=robot,
        trajectory=trajectory,
        table=table,
        start_covariance=jnp.diag(one(std) ** 2),
        noise=one(noise),
        wander=one(wander),
        tau=one(tau),
        settle=one(settle),
        largest=one(largest),
        parameters=chosen,
    )


@partial(jax.jit, static_argnums=1)
def _drift(robot: Robot, chosen: tuple[Parameter, ...], gains: CorrectionGains, momentum: Array) -> Array:
    """(m, 3, 4 + q) turn of the end from each sample on per momentum, drag and parameters, by the trapezoid rule."""
    values = jnp.asarray([p.start for p in chosen], momentum.dtype)

    def rates(theta: Array, rate: Array, rotation: Array, to_end: Array) -> tuple[Array, Array, Array]:
        omega, by = _omega_and_slopes(robot, chosen, values, theta, rate, rotation, momentum)
        return to_end @ rotation @ by[:, :3], to_end @ rotation @ by[:, 4:], rotation @ omega

    by_momentum, by_values, spin = jax.vmap(rates)(gains.theta, gains.theta_dot, gains.rotation, gains.to_end)
    length = jnp.diff(gains.at)

    def onward(values: Array) -> Array:
        step = length.reshape(-1, *(1,) * (values.ndim - 1))
        total = jnp.cumsum(step * (values[1:] + values[:-1]) / 2, axis=0)
        return jnp.concatenate([jnp.zeros_like(total[:1]), total])

    turned = onward(spin)
    first = onward(by_momentum)
    braked = onward((by_momentum @ turned[..., None])[..., 0])
    first, braked, rest = ((x[-1:] - x) for x in (first, braked, onward(by_values)))
    drag = -(braked - (first @ turned[..., None])[..., 0])
    return jnp.concatenate([first, drag[..., None], rest], axis=2)


def _omega_and_slopes(
    robot: Robot, chosen: tuple[Parameter, ...], values: Array, theta: Array, rate: Array, rotation: Array, h: Array
) -> tuple[Array, Array]:
    """Angular velocity of the base, and its slopes (3, 4 + q) by momentum, drag (none) and parameters."""

    def omega(values: Array) -> tuple[Array, Array]:
        A, B = momentum_matrices(_changed(robot, chosen, values), theta)
        both = solve_symmetric3(A, jnp.concatenate([(B @ rate + rotation.T @ h)[:, None], rotation.T], axis=1))
        return both[:, 0], both

    if chosen:
        slopes, both = jax.jacfwd(omega, has_aux=True)(values)
    else:
        both = omega(values)[1]
        slopes = jnp.zeros((3, 0), values.dtype)
    return both[:, 0], jnp.concatenate([both[:, 1:], jnp.zeros((3, 1), values.dtype), slopes], axis=1)


def _changed(robot: Robot, chosen: tuple[Parameter, ...], values: Array) -> Robot:
    for k, entry in enumerate(chosen):
        robot = entry.put(robot, values[k])
    return robot


class _Estimate(NamedTuple):
    rotation: Array
    momentum: Array
    covariance: Array


@jax.jit
def _update(law: SteeringLaw, state: SteeringState, reading: Reading) -> tuple[SteeringState, References]:
    dtype = law.noise.dtype
    time, theta, seen, taken = (jnp.asarray(x, dtype) for x in reading)
    planned = law.trajectory.at(time).theta
    # a joint that is not read is taken to be where it is told to be
    row = _row(law.table, time)
    own = planned - row["direction"] @ state.filtered
    offset = jnp.where(jnp.isfinite(theta), theta, own) - planned
    times = jnp.concatenate([state.past_time[1:], time[None]])
    offsets = jnp.concatenate([state.past_offset[1:], offset[None]])
    # orientation: predicted to when it was taken, corrected there; then along the joints to now
    fresh = jnp.isfinite(seen).all() & (taken > state.taken)
    until = jnp.where(fresh, taken, state.taken)
    start = _Estimate(state.rotation, state.momentum, state.covariance)
    robot = _changed(law.robot, law.parameters, state.values)
    then = _along(law, robot, state, start, state.taken, until, times, offsets, True)
    then, drag, values = _corrected(law, state, then, jnp.where(fresh, seen, then.rotation), fresh)
    state = state._replace(drag=drag, values=values)
    robot = _changed(law.robot, law.parameters, values)
    now = _along(law, robot, state, then, until, time, times, offsets, False)
    # error at the end, if the joints kept to the plan from here
    carried = row["rotation"] @ so3.exp(row["connection"] @ offset)
    unknown = jnp.concatenate([now.momentum - law.table["momentum"], drag[None], _off(law, values)])
    error = row["to_end"] @ so3.log(now.rotation @ carried.T) + row["drift"] @ unknown
    worth = 1 - jnp.exp(-(time - state.time) / law.settle)
    steer, left = steer_by(
        row, law.table, time, state.steer, state.filtered, state.rate, error, worth, law.tau, law.largest
    )
    filtered, rate = smooth(steer, state.filtered, state.rate, time - state.time, law.tau)
    told = jnp.clip(planned - row["direction"] @ filtered, law.robot.lower, law.robot.upper)
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


def _off(law: SteeringLaw, values: Array) -> Array:
    return values - jnp.asarray([p.start for p in law.parameters], values.dtype)


def _along(
    law: SteeringLaw,
    robot: Robot,
    state: SteeringState,
    at: _Estimate,
    begin: Array,
    end: Array,
    times: Array,
    offsets: Array,
    spread: bool,
) -> _Estimate:
    """The estimate at `end`, along the joints as they were read, with its covariance if `spread`."""
    count = jnp.maximum(jnp.ceil((end - begin) / _LONGEST - 1e-6), 1)
    h = (end - begin) / count
    size = 7 + len(law.parameters)

    def joints(t: Array) -> Array:
        return law.trajectory.at(t).theta + jax.vmap(lambda column: jnp.interp(t, times, column))(offsets.T)

    def step(k: Array, at: _Estimate) -> _Estimate:
        t = begin + k * h
        first, middle, last = (joints(t + share * h) for share in (0.0, 0.5, 1.0))
        safe = jnp.where(h > 0, h, 1)
        rates = [
            (-3 * first + 4 * middle - last) / safe,
            (last - first) / safe,
            (first - 4 * middle + 3 * last) / safe,
        ]
        start = _rate(robot, first, rates[0], at.rotation, at.momentum)
        turned = at.rotation @ so3.exp(h / 2 * start)
        half, by = _omega_and_slopes(law.robot, law.parameters, state.values, middle, rates[1], turned, at.momentum)
        stop = _rate(robot, last, rates[2], at.rotation @ so3.exp(h * half), at.momentum)
        turn = h / 6 * (start + 4 * half + stop) + h * h / 12 * jnp.cross(start, stop)
        spin = turned @ half
        momentum = at.momentum - h * state.drag * spin
        covariance = at.covariance
        if spread:
            onward = jnp.eye(size, dtype=h.dtype)
            seen_momentum = turned @ by[:, :3]  # R A^-1 R^T
            onward = onward.at[:3, :3].add(h * seen_momentum @ so3.hat(at.momentum))
            onward = onward.at[:3, 3:].add(h * turned @ by)
            onward = onward.at[3:6, 6].add(-h * spin)
            covariance = onward @ covariance @ onward.T
            covariance = covariance.at[np.arange(3), np.arange(3)].add(h * law.wander**2)
        return _Estimate(at.rotation @ so3.exp(turn), momentum, covariance)

    return jax.lax.fori_loop(0, count.astype(int), step, at)


def _rate(robot: Robot, theta: Array, rate: Array, rotation: Array, momentum: Array) -> Array:
    A, B = momentum_matrices(robot, theta)
    return solve_symmetric3(A, (B @ rate + rotation.T @ momentum)[:, None])[:, 0]


def _corrected(
    law: SteeringLaw, state: SteeringState, at: _Estimate, seen: Array, fresh: Bool[Array, ""]
) -> tuple[_Estimate, Array, Array]:
    """Kalman's correction by one orientation; no change where it is not fresh."""
    p = at.covariance
    miss = so3.log(seen @ at.rotation.T)
    total = p[:3, :3] + law.noise**2 * jnp.eye(3, dtype=p.dtype)
    gain = jnp.where(fresh, solve_symmetric3(total, p[:3]).T, 0)
    change = gain @ miss
    keep = jnp.eye(p.shape[0], dtype=p.dtype).at[:, :3].add(-gain)
    # Joseph's form: symmetric, positive
    covariance = keep @ p @ keep.T + law.noise**2 * gain @ gain.T
    rotation = so3.exp(change[:3]) @ at.rotation
    found = _Estimate(rotation, at.momentum + change[3:6], covariance)
    return found, state.drag + change[6], state.values + change[7:]


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
    """The linear part, `onboard.corrected`: the new steering vector, and what was left of the error before."""
    held_back = row["density"] @ (2 * tau * (filtered - steer) + tau**2 * rate)
    left = error - row["gramian"] @ steer - held_back
    can = row["gramian"] - 2 * tau * row["density"] + row["rest"] * jnp.eye(3, dtype=tau.dtype)
    steer = steer + worth * solve_symmetric3(_positive(can, row["rest"]), left[:, None])[:, 0]
    later = jnp.where((table["at"] >= time)[:, None], jnp.abs(table["direction"] @ steer), 0)
    return steer * jnp.minimum(1, largest / jnp.maximum(later.max(), 1e-12)), left


def smooth(steer: Array, filtered: Array, rate: Array, step: Array, tau: Array) -> tuple[Array, Array]:
    """`onboard.smooth`."""
    gap, decay = filtered - steer, jnp.exp(-step / tau)
    slope = rate + gap / tau
    return steer + (gap + step * slope) * decay, (rate - step / tau * slope) * decay


def _positive(matrix: Float[Array, "3 3"], least: Array) -> Float[Array, "3 3"]:
    """The symmetric matrix with its eigenvalues raised to `least`, by Jacobi's rotations."""
    vectors = jnp.eye(3, dtype=matrix.dtype)
    for _ in range(6):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            angle = 0.5 * jnp.arctan2(2 * matrix[p, q], matrix[q, q] - matrix[p, p])
            c, s = jnp.cos(angle), jnp.sin(angle)
            turn = jnp.eye(3, dtype=matrix.dtype).at[p, p].set(c).at[q, q].set(c).at[p, q].set(s).at[q, p].set(-s)
            matrix, vectors = turn.T @ matrix @ turn, vectors @ turn
    return (vectors * jnp.maximum(jnp.diagonal(matrix), least)[None]) @ vectors.T


def _row(table: dict[str, Array], time: Array) -> dict[str, Any]:
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

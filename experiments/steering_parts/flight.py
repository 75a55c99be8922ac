"""A fall in closed loop, with everything that may be wrong; the truth is integrated apart from the estimator."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from common.types import Array

import reojax
from reojax import so3
from reojax.steering.law import SteeringLaw
from reojax.steering.readings import Reading

TICK = 2e-3
"""Time between readings of the joints and commands [s]: 500 Hz."""
_FINE = 4
"""Steps of the truth to a tick."""


class Wrong(NamedTuple):
    """What is wrong with one fall."""

    momentum: Array
    """(3,) [kg m^2/s], inertial frame."""
    drag: Array
    """Of the wires [N m s/rad]."""
    scale: Array
    """(links,) logarithm of the factor of each link's inertia."""


class Sensors(NamedTuple):
    """How orientation and joints are read and the joints follow."""

    noise: float
    """Standard deviation of the orientation about each axis [rad]."""
    latency: int
    """Age of the orientation [ticks]."""
    every: int
    """Ticks from one orientation to the next."""
    dropped: float
    """Share of orientations that never come."""
    encoder: float
    """Size of an encoder's count at the joint [rad]."""
    servo: float
    """Time constant of the joints' servos, of second order [s]."""
    speed: float = np.inf
    """Fastest that a joint turns [rad/s]."""


def fly(
    robot: reojax.Robot,
    trajectory: reojax.Trajectory,
    law: SteeringLaw,
    sensors: Sensors,
    key: Array,
    wrong: Wrong,
    steered: Array,
) -> tuple[Array, Array, Any]:
    """Orientation at the end of one fall, largest change of a joint, and the last estimate; `steered` 0 or 1."""
    truth = robot.replace(inertia=robot.inertia * jnp.exp(wrong.scale)[:, None, None])
    ticks = round(float(np.asarray(trajectory.breaks)[-1]) / TICK)
    noise, drop = jax.random.split(key)
    tilt = jax.vmap(so3.exp)(sensors.noise * jax.random.normal(noise, (ticks, 3)))
    gone = jax.random.uniform(drop, (ticks,)) < sensors.dropped

    def turn_rate(theta: Array, rate: Array, rotation: Array, momentum: Array) -> Array:
        return reojax.base_velocity(truth, theta, rate, momentum=rotation.T @ momentum)

    def truth_step(k: Array, carry: tuple, begin: Array, end: Array) -> tuple:
        rotation, momentum = carry
        h = TICK / _FINE
        rate = (end - begin) / TICK
        theta = begin + (k + 0.5) / _FINE * (end - begin)
        half = rotation @ so3.exp(h / 2 * turn_rate(theta, rate, rotation, momentum))
        omega = turn_rate(theta, rate, half, momentum)
        return rotation @ so3.exp(h * omega), momentum - h * wrong.drag * (half @ omega)

    def tick(carry: tuple, inputs: tuple) -> tuple[tuple, Array]:
        state, rotation, momentum, theta, theta_rate, told, past = carry
        number, tilt, gone = inputs
        time = number * TICK
        planned = trajectory.at(time - TICK).theta
        aim = planned + steered * (told - planned)
        gap, decay = theta - aim, jnp.exp(-TICK / sensors.servo)  # the servo follows what it was told
        slope = theta_rate + gap / sensors.servo
        after = aim + (gap + TICK * slope) * decay
        after = theta + jnp.clip(after - theta, -sensors.speed * TICK, sensors.speed * TICK)
        theta_rate = jnp.clip((theta_rate - TICK / sensors.servo * slope) * decay, -sensors.speed, sensors.speed)
        rotation, momentum = jax.lax.fori_loop(
            0, _FINE, partial(truth_step, begin=theta, end=after), (rotation, momentum)
        )
        past = jnp.concatenate([past[1:], rotation[None]])
        comes = ~gone & (number % sensors.every == 0) & (number >= sensors.latency)
        seen = jnp.where(comes, past[-1 - sensors.latency] @ tilt, jnp.nan)
        read = jnp.round(after / sensors.encoder) * sensors.encoder
        reading = Reading(time, read, seen, time - sensors.latency * TICK)
        state, references = law.update(state, reading)
        change = jnp.abs(references.theta - trajectory.at(time).theta).max()
        return (state, rotation, momentum, after, theta_rate, references.theta, past), change

    first = trajectory.at(0.0).theta
    eye = jnp.eye(3)
    carry = (law.start(), eye, wrong.momentum, first, 0 * first, first, jnp.tile(eye, (sensors.latency + 1, 1, 1)))
    (state, rotation, *_), change = jax.lax.scan(tick, carry, (jnp.arange(1, ticks + 1), tilt, gone))
    return rotation, change.max(), (state.momentum, state.drag, state.values)


def many(function: Callable, draws: tuple, *, chunk: int = 100) -> Any:
    """`function` over the leading axis of `draws`, so many at a time."""
    size = len(jax.tree.leaves(draws)[0])
    parts = [
        jax.tree.map(np.asarray, function(*jax.tree.map(lambda x, i=i: x[i : i + chunk], draws)))
        for i in range(0, size, chunk)
    ]
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)

"""Motions of the joints among which a search takes its starts: random ones, and loops that turn the robot far."""

from __future__ import annotations

from collections.abc import Hashable
from functools import cache, partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax.mechanics.curvature import curvature_terms
from reojax.robot import Robot
from reojax.steering.end import end_of
from reojax.steering.free_points import free_points

_RANDOM, _LOOPS = 512, 512
"""Motions of either kind."""
CHUNK = 32
"""Motions that are followed to their ends at once: one program."""
_ROUNDS = 40
"""Of the iteration for the phases of a loop."""
_FEWEST = 8 / 3
"""Pieces of a spline that make one round of a loop, at least."""


class RobotKey:
    """A robot that is equal to another of the same numbers."""

    def __init__(self, robot: Robot):
        self.robot = robot
        leaves, structure = jax.tree.flatten(robot)
        self.key: Hashable = (structure, *(np.asarray(leaf).tobytes() for leaf in leaves))

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RobotKey) and self.key == other.key


class Starts(NamedTuple):
    """Motions to start from."""

    points: Float[np.ndarray, "k p+1 j"]
    """Of their splines [rad]."""
    ends: Float[np.ndarray, "k 3 3"]
    """Where they end without momentum."""


@cache
def starts_of(key: RobotKey, pieces: int, seed: int, start: bytes, end: bytes) -> Starts:
    """Motions within the limits, half of them random, half of them loops through several rounds, by one seed.

    `start` and `end` are the bytes of postures (j,) [rad], between which the motions go. The last calls are kept.
    """
    robot = key.robot
    first, last = np.frombuffer(start), np.frombuffer(end)
    rng = np.random.default_rng(seed)
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    share = np.linspace(0, 1, pieces + 1)[:, None]
    smooth = share**3 * (10 - 15 * share + 6 * share**2)
    straight = first + smooth * (last - first)
    inside = rng.uniform(low, high, (_RANDOM, pieces + 1, robot.joints))
    away = np.concatenate([inside, _loops(robot, rng, low, high, pieces)]) - straight
    size = rng.uniform(0.1, 0.8, (_RANDOM, 1, 1)), rng.uniform(0.3, 1, (_LOOPS, 1, 1))
    size = np.concatenate([np.broadcast_to(size[0], (_RANDOM, pieces + 1, 1)), size[1] * _ramp(share)])
    points = np.clip(straight + size * away, robot.lower, robot.upper)
    for number, (joint, driver) in enumerate(robot.couplings):
        points[..., joint] = float(robot.coupling_ratio[number]) * points[..., driver] + float(
            robot.coupling_offset[number]
        )
    points[:, 0], points[:, -1] = first, last
    return Starts(points, ends_of(robot, points, np.zeros(3), 1.0))


def _ramp(share: np.ndarray) -> np.ndarray:
    """Size of a loop along its motion: from nothing, within a fifth, and back to nothing."""
    u = np.clip(5 * np.minimum(share, 1 - share), 0, 1)
    return (u * u * (3 - 2 * u))[None]


def _loops(
    robot: Robot, rng: np.random.Generator, low: np.ndarray, high: np.ndarray, pieces: int
) -> Float[np.ndarray, "k p+1 j"]:
    """Loops round random postures, with the phases of the joints that turn the robot most about random axes.

    A small loop `theta = c + Re(z exp(i phi))` turns the base by `pi Im(z^H F z) / 2` about an axis, with the
    curvature `F` there (`reojax.curvature`). Where no joint may go further than `|z_k| <= r_k`, the largest are those
    of `z_k = r_k (i F z)_k / |(i F z)_k|`, found by repetition, as the power method finds an eigenvector.
    """
    variables, _ = free_points(robot, jnp.zeros((2, robot.joints)))
    carry, offset = np.asarray(variables.carry), np.asarray(variables.offset)
    free = carry.argmax(0)
    middle, half = ((high + low) / 2)[free], ((high - low) / 2)[free]
    centre = middle + 0.6 * half * rng.uniform(-1, 1, (_LOOPS, len(free))) * rng.uniform(0, 1, (_LOOPS, 1))
    room = half - np.abs(centre - middle)
    axis = rng.normal(size=(_LOOPS, 3))
    turning = np.concatenate([
        np.asarray(_curvatures(robot, jnp.asarray(part @ carry.T + offset)))
        for part in np.split(centre, _LOOPS // CHUNK)
    ])  # fmt: skip
    form = 1j * np.einsum("ka,kaij,ig,jh->kgh", axis, turning, carry, carry, optimize=True)
    form = room[:, :, None] * form * room[:, None]
    shift = 0.1 * np.abs(form).sum(2).max(1)[:, None]
    z = np.exp(2j * np.pi * rng.uniform(size=room.shape))
    for _ in range(_ROUNDS):
        z = np.einsum("kgh,kh->kg", form, z) + shift * z
        z = z / np.maximum(np.abs(z), 1e-300)
    rounds = rng.uniform(1, max(1.0, pieces / _FEWEST), (_LOOPS, 1))
    phase = 2 * np.pi * (rounds * np.linspace(0, 1, pieces + 1) + rng.uniform(size=(_LOOPS, 1)))
    own = centre[:, None] + np.real((room * z)[:, None] * np.exp(1j * phase)[:, :, None])
    return own @ carry.T + offset


@jax.jit
def _curvatures(robot: Robot, postures: Float[Array, "k j"]) -> Float[Array, "k 3 j j"]:
    robot = jax.tree.map(lambda x: jnp.asarray(x, postures.dtype), robot)
    return jax.lax.map(lambda theta: curvature_terms(robot, theta)[2], postures)


def ends_of(robot: Robot, points: np.ndarray, momentum: np.ndarray, duration: float) -> Float[np.ndarray, "k 3 3"]:
    """Where motions (k, p + 1, j) end, coarsely, with a momentum (3,) in a duration."""
    found = []
    for first in range(0, len(points), CHUNK):
        part = points[np.minimum(np.arange(first, first + CHUNK), len(points) - 1)]
        found.append(np.asarray(_ends(robot, part, jnp.asarray(momentum, float), jnp.asarray(duration, float))))
    return np.concatenate(found)[: len(points)]


@jax.jit
def _ends(robot: Robot, points: Array, momentum: Array, duration: Array) -> Array:
    robot = jax.tree.map(lambda x: jnp.asarray(x, points.dtype), robot)
    return jax.lax.map(partial(_end, robot, momentum, duration), points, batch_size=CHUNK)


def _end(robot: Robot, momentum: Array, duration: Array, points: Array) -> Array:
    return end_of(robot, points, duration, momentum, 3)[-1]

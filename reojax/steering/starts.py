"""Random motions of the joints, among which a search takes its starts."""

from __future__ import annotations

from collections.abc import Hashable
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np

from reojax._internal.arrays import Array
from reojax.robot import Robot
from reojax.steering.end import end_of

_TABLE = 1024
"""Random motions from which a search takes its starts."""


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


@cache
def random_motions(key: RobotKey, pieces: int, seed: int, start: bytes, end: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Random motions (k, p + 1, j) within the limits, and where they end without momentum (k, 3, 3)."""
    robot = key.robot
    first, last = np.frombuffer(start), np.frombuffer(end)
    rng = np.random.default_rng(seed)
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    share = np.linspace(0, 1, pieces + 1)[:, None]
    smooth = share**3 * (10 - 15 * share + 6 * share**2)
    straight = first + smooth * (last - first)
    inside = rng.uniform(low, high, (_TABLE, pieces + 1, robot.joints))
    size = rng.uniform(0.1, 0.8, (_TABLE, 1, 1))
    points = straight + size * (inside - straight)
    for number, (joint, driver) in enumerate(robot.couplings):
        points[..., joint] = float(robot.coupling_ratio[number]) * points[..., driver] + float(
            robot.coupling_offset[number]
        )
    points[:, 0], points[:, -1] = first, last
    return points, np.asarray(_ends(robot, jnp.asarray(points)))


@jax.jit
def _ends(robot: Robot, points: Array) -> Array:
    robot = jax.tree.map(lambda x: jnp.asarray(x, points.dtype), robot)
    still, one = jnp.zeros(3, points.dtype), jnp.ones((), points.dtype)
    return jax.lax.map(lambda p: end_of(robot, p, one, still, 3)[-1], points, batch_size=32)

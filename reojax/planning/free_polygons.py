"""Polygons in shape space as functions of their free corners: travel, rotation, and what they miss a target by.

The variables x are the free corners, each the angles of the independent joints that move, and one angle more: `turn`,
by which the target is turned on about an axis. It is held at zero while a target is sought, and made largest to find
out how far one loop can turn about that axis. Joint travel has a kink wherever a joint rests on an edge; while
searching it is rounded off, `|d|` of an edge becoming `sqrt(d^2 + r^2) - r`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array
from reojax.collision.constraint import clearance_shortfall
from reojax.mechanics.holonomy import net_rotation
from reojax.path import Path
from reojax.planning.cache import Cache
from reojax.planning.checks import key_of
from reojax.planning.freedom import Freedom
from reojax.robot import Robot

COARSE, FINE = 2, 8
"""Steps per edge while searching, and when judging: on the prototype within 270 degrees the coarse ones miss the true
rotation by some 1e-5, which the last solutions make up for, the fine ones by 1e-13."""
_CALL, _CALL_LONG = 256, 8
"""Polygons whose rotations are computed together, and of robots with more than `ALONE` joints."""
ALONE = 9
"""Joints of a robot beyond which polygons are improved one by one: the kernels' loops over joints, which compile in a
fraction of the time, take less for one polygon than their share of many side by side."""
_SAMPLES = 20
"""Postures per edge at which the clearance is held while searching; answers are proven afterwards. With eight, links
pass through each other between two of them, and of 16 targets of the prototype three are not reached."""
_KEPT = 8
"""Robots and joints whose programs are kept."""


class Aim(NamedTuple):
    """What one polygon is solved for."""

    target: Float[Array, "3 3"]
    """Rotation to reach."""
    axis: Float[Array, "3"]
    """Axis about which `turn` is added to it."""
    ends: Float[Array, "2 j"]
    """Postures at the start and at the end."""
    rounding: Float[Array, ""]
    """Rounding of the travel on each edge [rad]."""
    short: Float[Array, ""]
    """1 where travel is made least."""
    far: Float[Array, ""]
    """1 where `turn` is made largest. Where both are 0 only the target counts."""
    margin: Float[Array, " p"]
    """Clearance that each pair is to keep [m]; of no effect where none is asked for."""


class Polygons(NamedTuple):
    """The polygons of one robot's joints with so many free corners."""

    corners: int
    moves: Float[np.ndarray, "j k"]
    travel: Callable[[Array, Aim], Array]
    """Joint travel, rounded off; `turn` with a minus, where an aim is to go far; or zero."""
    miss: Callable[[Array, Aim], Array]
    """Rotation vector (3,) from the target, by `COARSE` steps."""
    too_near: Callable[[Array, Aim], Array]
    """What is missing to the clearance, for an inequality."""
    net_rotations: Callable[..., Array]
    """Net rotations (m, 3, 3) of whole paths (m, v, j), steps per edge."""

    def paths(self, x: np.ndarray, freedom: Freedom) -> np.ndarray:
        """Whole joint paths (m, v, j) of polygons (m, n)."""
        count = self.moves.shape[1]
        inner = freedom.base + x[:, :-1].reshape(len(x), self.corners, count) @ self.moves.T
        first, last = (np.broadcast_to(end, (len(x), 1, len(end))) for end in (freedom.start, freedom.end))
        return np.concatenate([first, inner, last], axis=1)

    def rotations(self, paths: np.ndarray, steps: int = FINE) -> np.ndarray:
        """Net rotations (m, 3, 3) of whole paths (m, v, j)."""
        size = _CALL_LONG if paths.shape[2] > ALONE else _CALL
        calls = [np.arange(i, i + size) for i in range(0, len(paths), size)]
        found = [
            np.asarray(self.net_rotations(paths[np.minimum(call, len(paths) - 1)], steps), float) for call in calls
        ]
        return np.concatenate(found)[: len(paths)] if found else np.zeros((0, 3, 3))


_polygons: Cache[Polygons] = Cache(_KEPT)


def polygons_of(robot: Robot, freedom: Freedom, corners: int) -> Polygons:
    """Polygons with `corners` free corners; postures and limits are data, so that one program serves them all."""
    key = key_of(robot), freedom.joints, corners
    return _polygons.get(key, lambda: _polygons_of(robot, freedom.joints, freedom.moves, corners))


def _polygons_of(robot: Robot, joints: tuple[int, ...], moves: np.ndarray, corners: int) -> Polygons:
    count = len(joints)
    weight = np.abs(moves).sum(0)
    place = np.array(joints, int)

    def inner(x: Array) -> Array:
        return x[:-1].reshape(corners, count)

    def travel(x: Array, aim: Aim) -> Array:
        # |d| of every edge and joint rounded off, with those that follow a joint
        first, last = aim.ends[0][place], aim.ends[1][place]
        edges = jnp.diff(jnp.concatenate([first[None], inner(x), last[None]]), axis=0)
        rounded = jnp.sqrt(edges * edges + aim.rounding**2) - aim.rounding
        return aim.short * (rounded * weight[None]).sum() - aim.far * x[-1]

    def points(x: Array, aim: Aim) -> Array:
        # joints that do not move stay as at the start
        base = aim.ends[0] - moves @ aim.ends[0][place]
        return jnp.concatenate([aim.ends[:1], base[None] + inner(x) @ moves.T, aim.ends[1:]])

    def miss(x: Array, aim: Aim) -> Array:
        # log of target^T R, the target turned on about the axis
        target = aim.target @ so3.exp(x[-1] * aim.axis)
        return so3.log(target.T @ net_rotation(robot, Path(points(x, aim)), steps=COARSE))

    def too_near(x: Array, aim: Aim) -> Array:
        return clearance_shortfall(robot, points(x, aim), 0.0, samples=_SAMPLES, more=aim.margin)

    def net_rotations(paths: Array, steps: int) -> Array:
        return jax.vmap(lambda path: net_rotation(robot, Path(path), steps=steps))(paths)

    return Polygons(corners, moves, travel, miss, too_near, jax.jit(net_rotations, static_argnums=1))

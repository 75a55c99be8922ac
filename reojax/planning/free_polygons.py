"""Closed polygons within the joint limits: their travel, what they miss a target by, and random ones to start from.

A polygon is the vector of its free corners, each the angles of the joints that twist and bend. Robots with feet fold
them before the polygon and unfold them after it, as they do for words. Joint travel has a kink wherever a joint rests
on an edge; while searching it is rounded off, `|d|` of an edge becoming `sqrt(d^2 + r^2) - r`.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array
from reojax.manoeuvres import Layout
from reojax.mechanics.holonomy import net_rotation
from reojax.path import Path
from reojax.planning import quaternions
from reojax.planning.checks import key_of
from reojax.planning.words import AmplitudeBox, fold_angles
from reojax.robot import Robot

COARSE, FINE = 2, 8
"""Steps per edge while searching, and when judging."""
_RANDOM = 4096
"""Random polygons of either kind that starts are taken from."""
_CALL = 64
"""Polygons whose rotations are computed together."""
_PRICE = 60.0
"""Travel that a radian of distance to the target counts for among them [rad]."""
_KEPT = 8
"""Robots and boxes that are kept."""
_Kept = TypeVar("_Kept")


class Polygons(NamedTuple):
    """The closed polygons of one robot, as functions of their corners x (n,)."""

    paths: Callable[[np.ndarray], np.ndarray]
    """Whole joint paths (m, v, j), both ends at zero, of polygons (m, n)."""
    rotations: Callable[[np.ndarray], np.ndarray]
    """Net rotations (m, 3, 3) of polygons (m, n), by `FINE` steps."""
    travel: Callable[[Array, Any], Array]
    """Joint travel, rounded off; takes (x, (target, r)), as does `miss`."""
    miss: Callable[[Array, Any], Array]
    """Rotation vector (3,) from the target, by `COARSE` steps."""


class PolygonTable(NamedTuple):
    """Random polygons within one box: the first half of any kind, the others words of rectangles."""

    low: Float[np.ndarray, " n"]
    high: Float[np.ndarray, " n"]
    x: Float[np.ndarray, "k n"]
    turns: Float[np.ndarray, "4 k"]
    """Quaternions of their net rotations."""
    lengths: Float[np.ndarray, " k"]
    """Their joint travel [rad]."""

    def near(self, target: Float[np.ndarray, "3 3"], count: int) -> Float[np.ndarray, "c n"]:
        """Those which end near a target with little travel, the most promising first, of either kind in turn."""
        away = quaternions.angles(quaternions.product(quaternions.from_matrices(target[None]), self.turns))
        order = np.argsort((self.lengths + _PRICE * away).reshape(2, _RANDOM), axis=1) + [[0], [_RANDOM]]
        return self.x[order.T.ravel()[:count]]


_polygons: OrderedDict[Hashable, Polygons] = OrderedDict()
_pools: OrderedDict[Hashable, PolygonTable] = OrderedDict()


def family_of(
    robot: Robot, layout: Layout, box: AmplitudeBox, corners: int, seed: int
) -> tuple[Polygons, PolygonTable]:
    """Polygons with `corners` free corners and random ones within the box; the last few are kept, with programs."""
    low, high = box.low[0], box.high[0]
    key = key_of(robot), jax.dtypes.canonicalize_dtype(float), layout, corners
    polygons = _kept(_polygons, key, lambda: _polygons_of(robot, layout, corners))
    key = *key, low.tobytes(), high.tobytes(), seed
    return polygons, _kept(_pools, key, lambda: _pool(polygons, low, high, corners, seed))


def _kept(store: OrderedDict[Hashable, _Kept], key: Hashable, make: Callable[[], _Kept]) -> _Kept:
    """What is stored under a key, made if it is not there; the least recently used goes when there are too many."""
    if key not in store:
        store[key] = make()
        if len(store) > _KEPT:
            store.popitem(last=False)
    store.move_to_end(key)
    return store[key]


def _polygons_of(robot: Robot, layout: Layout, corners: int) -> Polygons:
    rest = fold_angles(layout)[None]
    before = np.concatenate([0 * rest, rest]) if layout.fold else rest
    after = before[::-1]
    place = np.zeros((3, layout.joints))
    place[[0, 1, 2], [layout.twist[0], layout.bend, layout.twist[1]]] = 1.0

    def paths(x: np.ndarray) -> np.ndarray:
        inner = x.reshape(len(x), corners, 3) @ place + rest[None]
        first, last = (np.broadcast_to(end, (len(x), *end.shape)) for end in (before, after))
        return np.concatenate([first, inner, last], axis=1)

    def path(x: Array) -> Path:
        inner = x.reshape(corners, 3) @ jnp.asarray(place, x.dtype) + jnp.asarray(rest, x.dtype)
        return Path(jnp.concatenate([jnp.asarray(before, x.dtype), inner, jnp.asarray(after, x.dtype)]))

    def travel(x: Array, data: Any) -> Array:
        moves = jnp.diff(x.reshape(corners, 3), axis=0, prepend=0.0, append=0.0)
        return (jnp.sqrt(moves * moves + data[1] ** 2) - data[1]).sum()

    def miss(x: Array, data: Any) -> Array:
        return so3.log(data[0].T @ net_rotation(robot, path(x), steps=COARSE))

    turned = jax.jit(jax.vmap(lambda x: net_rotation(robot, path(x), steps=FINE)))

    def rotations(x: np.ndarray) -> np.ndarray:
        calls = [np.arange(i, i + _CALL) for i in range(0, len(x), _CALL)]
        found = [np.asarray(turned(x[np.minimum(call, len(x) - 1)]), float) for call in calls]
        return np.concatenate(found)[: len(x)] if found else np.zeros((0, 3, 3))

    return Polygons(paths, rotations, travel, miss)


def _pool(polygons: Polygons, low: np.ndarray, high: np.ndarray, corners: int, seed: int) -> PolygonTable:
    rng = np.random.default_rng(seed)
    kinds = np.concatenate([_anyhow(rng, low, high, corners), _words(rng, low, high, corners)])
    size = np.where(rng.random(len(kinds)) < 0.5, 1.0, 10.0 ** rng.uniform(-3, 0, len(kinds)))
    x = (kinds * size[:, None, None]).reshape(len(kinds), -1)
    lengths = np.abs(np.diff(polygons.paths(x), axis=1)).sum((1, 2))
    turns = quaternions.from_matrices(polygons.rotations(x))
    return PolygonTable(np.tile(low, corners), np.tile(high, corners), x, turns, lengths)


def _anyhow(rng: np.random.Generator, low: np.ndarray, high: np.ndarray, corners: int) -> np.ndarray:
    """Random polygons (k, corners, 3) on each edge of which every joint rests or moves."""
    moves = rng.random((corners, _RANDOM, 3)) < 0.5
    angles = rng.uniform(low, high, moves.shape)
    points = [np.zeros((_RANDOM, 3))]
    for moving, angle in zip(moves, angles, strict=True):
        points.append(np.where(moving, angle, points[-1]))
    return np.stack(points[1:], axis=1)


def _words(rng: np.random.Generator, low: np.ndarray, high: np.ndarray, corners: int) -> np.ndarray:
    """Rectangles (k, corners, 3) of random amplitudes one after another, as many as there are corners for."""
    loops = (corners + 1) // 4
    if not loops:
        return _anyhow(rng, low, high, corners)
    bend, twist = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 1.0])
    shape = np.stack([bend, bend + twist, twist, np.zeros(3)])
    points = (shape * rng.uniform(low, high, (_RANDOM, loops, 1, 3))).reshape(_RANDOM, -1, 3)
    return np.pad(points, ((0, 0), (0, 1), (0, 0)))[:, np.minimum(np.arange(corners), 4 * loops)]

"""Where the search for free paths starts: random polygons within the limits, found by the rotation that they make."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from reojax.planning import quaternions
from reojax.planning.cache import Cache
from reojax.planning.clear_paths import Clear
from reojax.planning.free_polygons import COARSE, Polygons
from reojax.planning.freedom import Freedom

_RANDOM = 4096
"""Random polygons of either kind: on the prototype half as many take 2 % more travel in the median."""
_PRICE = 60.0
"""Travel that a radian of distance to the target counts for among them [rad]."""
_CONTACT = 1e6
"""Travel that contact counts for, where polygons are to be clear of the robot itself [rad]."""
_KEPT = 8
"""Robots and limits whose polygons are kept."""


class PolygonTable(NamedTuple):
    """Random polygons within the limits: the first half of any kind, the others rectangles one after another."""

    x: Float[np.ndarray, "m n"]
    turns: Float[np.ndarray, "4 m"]
    """Quaternions of their net rotations."""
    lengths: Float[np.ndarray, " m"]
    """Their joint travel [rad]."""
    clear: Bool[np.ndarray, " m"] | None = None
    """Which of them keep the clearance at a few samples, if one is asked for."""

    def near(self, target: Float[np.ndarray, "3 3"], count: int) -> Float[np.ndarray, "c n"]:
        """Those which end near a target with little travel, the most promising first, of either kind in turn.

        If a clearance is asked for, those that keep it come first, as far as there are enough.
        """
        away = quaternions.angles(quaternions.product(quaternions.from_matrices(target.T[None]), self.turns))
        worse = self.lengths + _PRICE * away
        if self.clear is not None:
            worse = worse + np.where(self.clear, 0.0, _CONTACT)
        order = np.argsort(worse.reshape(2, -1), axis=1) + [[0], [self.x.shape[0] // 2]]
        return self.x[order.T.ravel()[:count]]

    def farthest(self, axis: Float[np.ndarray, "3"], count: int) -> Float[np.ndarray, "c n"]:
        """Those which turn most about an axis and little otherwise, with that turn as their last variable."""
        best = self.farthest_rows(axis, count)
        x = self.x[best].copy()
        along = axis @ (np.where(self.turns[0] < 0, -1, 1) * self.turns[1:])[:, best]
        x[:, -1] = 2 * np.arcsin(np.clip(along, 1e-12, 1.0))
        return x

    def farthest_rows(self, axis: Float[np.ndarray, "3"], count: int) -> np.ndarray:
        """Their rows, the most promising first, of either kind in turn."""
        # sin(f / 2) of the turn, along the axis and across it
        half = np.where(self.turns[0] < 0, -1, 1) * self.turns[1:]
        along = axis @ half
        across = np.sqrt(((half - along * axis[:, None]) ** 2).sum(0))
        order = np.argsort((across - along).reshape(2, -1), axis=1) + [[0], [self.x.shape[0] // 2]]
        return order.T.ravel()[:count]


_tables: Cache[PolygonTable] = Cache(_KEPT)
_clear: Cache[np.ndarray] = Cache(_KEPT)


def table_of(polygons: Polygons, freedom: Freedom, key: object, seed: int, clear: Clear | None = None) -> PolygonTable:
    """Random polygons of a robot (its `key`) within some limits, and which are clear; the last few are kept."""
    bounds = (freedom.start, freedom.end, freedom.low, freedom.high)
    whole = key, freedom.joints, polygons.corners, seed, *(array.tobytes() for array in bounds)
    table = _tables.get(whole, lambda: _table(polygons, freedom, seed))
    if clear is None:
        return table
    rows = _clear.get((*whole, clear.margin), lambda: clear.keeps_at_samples(polygons.paths(table.x, freedom)))
    return table._replace(clear=rows)


def _table(polygons: Polygons, freedom: Freedom, seed: int) -> PolygonTable:
    rng, corners = np.random.default_rng(seed), polygons.corners
    place = list(freedom.joints)
    first, last = freedom.start[place], freedom.end[place]
    away = np.concatenate([_anyhow(rng, freedom, first, corners), _rectangles(rng, freedom, first, corners)])
    # half of them shrunk by up to a thousand, drawn onto the straight way from start to end
    size = np.where(rng.random(len(away)) < 0.5, 1.0, 10.0 ** rng.uniform(-3, 0, len(away)))
    onward = np.linspace(0, 1, corners + 2)[1:-1, None] * (last - first)
    x = np.clip(first + onward + size[:, None, None] * away, freedom.low, freedom.high)
    x = np.pad(x.reshape(len(x), -1), ((0, 0), (0, 1)))
    # what they turn the base by, and their travel
    paths = polygons.paths(x, freedom)
    turns = quaternions.from_matrices(polygons.rotations(paths, COARSE))
    return PolygonTable(x, turns, np.abs(np.diff(paths, axis=1)).sum((1, 2)))


def _anyhow(rng: np.random.Generator, freedom: Freedom, first: np.ndarray, corners: int) -> np.ndarray:
    """Random polygons (m, corners, k), seen from their start, on each edge of which every joint rests or moves.

    How many move, three joints or all of them, differs from polygon to polygon.
    """
    count = len(first)
    # how likely a joint moves on an edge, for each polygon
    share = 0.5 * rng.uniform(min(1.0, 3 / max(count, 1)), 1.0, (_RANDOM, 1))
    angles = rng.uniform(freedom.low, freedom.high, (corners, _RANDOM, count)) - first
    points = [np.zeros((_RANDOM, count))]
    for angle in angles:
        points.append(np.where(rng.random((_RANDOM, count)) < share, angle, points[-1]))
    return np.stack(points[1:], axis=1)


def _rectangles(rng: np.random.Generator, freedom: Freedom, first: np.ndarray, corners: int) -> np.ndarray:
    """Rectangles (m, corners, k), seen from their start, as many one after another as there are corners for.

    Some joints move, then some others, then the first go back, then the others.
    """
    loops, count = (corners + 1) // 4, len(first)
    if not loops or not count:
        return _anyhow(rng, freedom, first, corners)
    # up to three joints, or half of them, move first, as many others second
    order = rng.random((_RANDOM, loops, count)).argsort(-1)
    most = np.minimum(3, 1 + count // 2)
    one = order < rng.integers(1, most + 1, (_RANDOM, loops, 1))
    other = ~one & (order < one.sum(-1, keepdims=True) + rng.integers(1, most + 1, (_RANDOM, loops, 1)))
    angles = rng.uniform(freedom.low, freedom.high, (_RANDOM, loops, count)) - first
    # the four corners of each rectangle; what is left of the corners stays at the start
    shape = np.stack([one, one | other, other, np.zeros_like(one)], axis=2)
    points = (shape * angles[:, :, None]).reshape(_RANDOM, 4 * loops, count)
    return np.pad(points, ((0, 0), (0, 1), (0, 0)))[:, np.minimum(np.arange(corners), 4 * loops)]

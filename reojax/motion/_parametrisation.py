"""What the unknowns of a fastest motion are: moves in times of their own, time laws, or a spline in shape space.

Each kind is static and hashable, its numbers come as arrays: one compiled program serves all motions of a kind.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

import jax.numpy as jnp
import numpy as np

from reojax._internal.arrays import Array
from reojax.motion.time_laws import Law
from reojax.motion.trajectory import Trajectory, join, overlap_pieces, through
from reojax.path import Path


class Parametrisation(Protocol):
    """What unknowns `x` (n,) make of some numbers, a pytree of arrays. Hashable."""

    keeps_rotation: ClassVar[bool]
    """Whether the net rotation is the same for all unknowns."""

    def build(self, x: Array, numbers: Any, /) -> Trajectory:
        """The motion."""
        ...

    def duration(self, x: Array) -> Array:
        """How long it takes [s]."""
        ...

    def order(self, x: Array) -> Array:
        """Times (q,) that must not be positive [s], linear in the unknowns."""
        ...


class EdgeNumbers(NamedTuple):
    """What `OverlappedEdges` are made of."""

    corners: Array
    """(v, j) of the path [rad]."""
    law: Law
    """Of every move."""


@dataclass(frozen=True)
class OverlappedEdges:
    """Moves, each one joint's part in one edge, by one law: beginnings, lengths, one factor a joint, the duration."""

    moves: tuple[tuple[int, int], ...]
    """Edge and joint of each."""
    keeps_rotation: ClassVar[bool] = False

    def build(self, x: Array, numbers: EdgeNumbers) -> Trajectory:
        """The motion whose moves overlap; amplitudes of each joint times its factor."""
        count = len(self.moves)
        factor = x[2 * count : -1]
        corners = numbers.corners * factor[None]
        return overlap_pieces(corners, numbers.law, x[:count], x[count : 2 * count], self.moves)

    def duration(self, x: Array) -> Array:
        """The last unknown."""
        return x[-1]

    def order(self, x: Array) -> Array:
        """Every move ends before the whole does, and before the next one of its joint begins."""
        count = len(self.moves)
        begin, end = x[:count], x[:count] + x[count : 2 * count]
        before, after = self._pairs().T
        return jnp.concatenate([end - x[-1], end[before] - begin[after]])

    def _pairs(self) -> np.ndarray:
        """(q, 2) moves of one joint that follow one another."""
        joint = np.array(self.moves)[:, 1]
        each = [np.flatnonzero(joint == k) for k in np.unique(joint)]
        return np.concatenate([np.stack([mine[:-1], mine[1:]], axis=1) for mine in each])


@dataclass(frozen=True)
class FreeLaws:
    """A law of its own for each edge, a spline of least jerk: durations (edges,), then places (edges, points)."""

    edges: int
    points: int
    keeps_rotation: ClassVar[bool] = True

    def build(self, x: Array, corners: Array) -> Trajectory:
        """The motion along the edges between `corners` (v, j) [rad], at rest at each."""
        places = x[self.edges :].reshape(self.edges, self.points)
        each = zip(corners[:-1], corners[1:], places, x[: self.edges], strict=True)
        return join([self._edge(*edge) for edge in each])

    def _edge(self, start: Array, end: Array, place: Array, duration: Array) -> Trajectory:
        share = jnp.concatenate([jnp.zeros(1), place, jnp.ones(1)])
        points = start[None] + share[:, None] * (end - start)[None]
        return through(Path(points), duration / (self.points + 1))

    def duration(self, x: Array) -> Array:
        """The sum of all edges'."""
        return x[: self.edges].sum()

    def order(self, x: Array) -> Array:
        """Nothing."""
        return x[:0]


@dataclass(frozen=True)
class SplineLoop:
    """A closed spline of least jerk: times between knots (knots,), then the postures at the inner ones."""

    knots: int
    keeps_rotation: ClassVar[bool] = False

    def build(self, x: Array, ends: Array) -> Trajectory:
        """The motion that begins and ends at rest in the posture `ends` (j,) [rad]."""
        inner = x[self.knots :].reshape(self.knots - 1, -1)
        return through(Path(jnp.concatenate([ends[None], inner, ends[None]])), x[: self.knots])

    def duration(self, x: Array) -> Array:
        """The sum of the times."""
        return x[: self.knots].sum()

    def order(self, x: Array) -> Array:
        """Nothing."""
        return x[:0]

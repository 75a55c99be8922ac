"""Where searches start: words with random amplitudes, found by the rotation that they make."""

from __future__ import annotations

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from reojax.planning import quaternions
from reojax.planning.table import Table, read
from reojax.planning.words import AmplitudeBox

_POOL = 4096
"""Loops drawn for each letter."""
_WORDS = 1 << 16
"""Words of each length."""

FIRST = 3
"""Starts that are simply the nearest ones."""
_CANDIDATES, _CHOICE = 250, 3
"""Words among which the others are chosen: so many, or so many times as many as are chosen."""

_read = jax.jit(read)


class Starts(NamedTuple):
    """Words to start from, rows last."""

    letter: Int[np.ndarray, "k m"]
    """Letters."""
    x: Float[np.ndarray, "d k m"]
    """Amplitudes [rad]."""
    distance: Float[np.ndarray, " m"]
    """Chord between the quaternions of start and target: half the angle between them, if small."""


class GuessTable:
    """Random words of a table's loops by length, made when first asked for; seeded, so always the same."""

    def __init__(self, table: Table, box: AmplitudeBox):
        rng = np.random.default_rng(0)
        letter = np.repeat(np.arange(len(box.letters)), _POOL)
        low, high = box.low[letter].T, box.high[letter].T
        x = rng.uniform(low, high)
        edge = rng.random(x.shape) < rng.choice([0.0, 0.5, 1.0], x.shape[1])
        x = np.where(edge, np.where(rng.random(x.shape) < 0.5, low, high), x)
        small = rng.random(x.shape) < 0.1
        small[1] = False
        x = np.where(small, x * 10.0 ** -rng.uniform(0, 3, x.shape), x)
        self._letter, self._x = letter, x
        turns = x[::2] * x[1:2] < 0  # which way round, by each distal joint
        self._kind = 2 * letter + turns[0] if len(turns) == 1 else 2 * turns[0] + turns[1]
        self._q = np.asarray(_read(table, letter, x)[0])
        self.letters, self.amplitudes, self.rotations = letter, x, self._q
        self._words = {}

    def reaches(self, target: Float[np.ndarray, "4 m"], slots: int, within: float) -> Bool[np.ndarray, " m"]:
        """Whether a word of `slots` loops ends within a chord of each target."""
        return np.isfinite(self._of(slots)[1].query(target.T, distance_upper_bound=within, workers=-1)[0])

    def near(self, target: Float[np.ndarray, "4 m"], slots: int, count: int) -> Starts:
        """Words of `slots` loops near each target, (..., m, count), without regard to the quaternion's sign.

        First come the `FIRST` nearest ones, then the nearest of every kind (letters, and which way round each loop
        goes), then the second of every kind, and so on: where one fails, others of its kind mostly fail too.
        """
        index, tree = self._of(slots)
        asked = count if count <= FIRST else max(_CHOICE * count, _CANDIDATES)
        distance, nearest = tree.query(target.T, k=asked, workers=-1)
        distance, loops = distance.reshape(-1, asked), index[:, np.reshape(nearest, (-1, asked)) % index.shape[1]]
        if count < asked:
            chosen = _by_kind(self._kind[loops])[:, :count]
            distance = np.take_along_axis(distance, chosen, 1)
            loops = np.take_along_axis(loops, chosen[None], 2)
        return Starts(self._letter[loops], self._x[:, loops], distance)

    def _of(self, slots: int):
        from scipy.spatial import KDTree

        if slots not in self._words:
            everything = np.arange(len(self._letter))[None]
            index = everything if slots == 1 else _of_length(slots, len(self._letter))
            q = self._q[:, index[0]]
            for row in index[1:]:
                q = np.stack(quaternions.product(q, self._q[:, row]))
            q = q / np.sqrt((q * q).sum(0))
            self._words[slots] = index, KDTree(np.concatenate([q, -q], axis=1).T)
        return self._words[slots]


def _of_length(slots: int, loops: int) -> np.ndarray:
    """Loops (slots, words) of random words; the same whatever was asked for before."""
    return np.random.default_rng(slots).integers(loops, size=(slots, _WORDS))


def _by_kind(kinds: Int[np.ndarray, "k m n"]) -> Int[np.ndarray, "m n"]:
    """Order of n words with loops of some `kinds` (0..3): the `FIRST`, then the first of each kind, then the second."""
    kind = np.zeros(kinds.shape[1:], int)
    for of_slot in kinds:
        kind = 4 * kind + of_slot
    order, place = np.argsort(kind, axis=1, kind="stable"), np.arange(kinds.shape[2])[None]
    together = np.take_along_axis(kind, order, 1)
    begins = np.concatenate([np.ones_like(together[:, :1]), np.diff(together, axis=1)], axis=1) != 0
    rank = np.empty_like(kind)
    np.put_along_axis(rank, order, place - np.maximum.accumulate(np.where(begins, place, 0), axis=1), 1)
    rank[:, :FIRST] = -1
    return np.argsort(rank, axis=1, kind="stable")

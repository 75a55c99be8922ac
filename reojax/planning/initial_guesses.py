"""Where searches start: words with random amplitudes, found by the rotation that they make."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from reojax._internal.kept import Program
from reojax.planning import quaternions
from reojax.planning.table import Table, read
from reojax.planning.words import AmplitudeBox
from reojax.session import LEAST_COMPILE

_POOL = 4096
"""Loops drawn for each letter."""
_WORDS, _BENT_WORDS = 1 << 16, 1 << 18
"""Words of each length, and those whose loops all bend as far as they may: there are more of them, as what needs them
is far away."""
_FEW = 16
"""Targets for which all words are looked through; more than these are looked up in a tree."""

FIRST = 3
"""Starts that are simply the nearest ones."""
_CANDIDATES, _CHOICE = 250, 3
"""Words among which the others are chosen: so many, or so many times as many as are chosen."""

_read = Program(read, compiler_options=LEAST_COMPILE)


class Starts(NamedTuple):
    """Words to start from, rows last."""

    letter: Int[np.ndarray, "k m"]
    """Letters."""
    x: Float[np.ndarray, "d k m"]
    """Amplitudes [rad]."""
    distance: Float[np.ndarray, " m"]
    """Chord between the quaternions of start and target: half the angle between them, if small."""


class GuessTable:
    """Random words of a table's loops by length, made when first asked for; seeded, so always the same.

    Two sets: of all loops, and of those whose centre joint bends to a limit. Few words of the first set come near the
    targets that a number of loops barely reaches, and most words that do reach them are like those of the second.
    """

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
        bent = rng.uniform(low, high)
        bent[1] = np.where(rng.random(len(letter)) < 0.5, low[1], high[1])
        self.letters, self.amplitudes = letter, x
        self.rotations = np.asarray(_read(table, letter, x)[0])
        self._all = _Loops(letter, x, self.rotations, _WORDS)
        self._bent = _Loops(letter, bent, np.asarray(_read(table, letter, bent)[0]), _BENT_WORDS)

    def reaches(self, target: Float[np.ndarray, "4 m"], slots: int, within: float) -> Bool[np.ndarray, " m"]:
        """Whether a word of `slots` loops ends within a chord of each target."""
        return self._all.words(slots).nearest(target, 1, within)[0][:, 0] < within

    def near(self, target: Float[np.ndarray, "4 m"], slots: int, count: int) -> Starts:
        """Words of `slots` loops near each target, (..., m, count), without regard to the quaternion's sign.

        First come the `FIRST` nearest ones, then the nearest of every kind (letters, and which way round each loop
        goes), then the second of every kind, and so on: where one fails, others of its kind mostly fail too.
        """
        words = self._all.words(slots)
        asked = count if count <= FIRST else max(_CHOICE * count, _CANDIDATES)
        distance, nearest = words.nearest(target, asked)
        if count < asked:
            chosen = _by_kind(self._all.kind[words.loops[:, nearest]])[:, :count]
            distance, nearest = np.take_along_axis(distance, chosen, 1), np.take_along_axis(nearest, chosen, 1)
        return self._all.starts(words.loops[:, nearest], distance)

    def bent(self, target: Float[np.ndarray, "4 m"], slots: int, count: int) -> Starts:
        """The `count` nearest words of loops that bend to a limit, as `near` gives words."""
        words = self._bent.words(slots)
        distance, nearest = words.nearest(target, count)
        return self._bent.starts(words.loops[:, nearest], distance)


class _Loops:
    """Loops, and random words of them."""

    def __init__(self, letter: Int[np.ndarray, " l"], x: Float[np.ndarray, "d l"], q: np.ndarray, words: int):
        self._letter, self._x, self._q, self._size = letter, x, q, words
        turns = x[::2] * x[1:2] < 0  # which way round, by each distal joint
        self.kind = 2 * letter + turns[0] if len(turns) == 1 else 2 * turns[0] + turns[1]
        self._words: dict[int, _Words] = {}

    def words(self, slots: int) -> _Words:
        """Words of `slots` loops; the same whatever was asked for before."""
        if slots not in self._words:
            every = np.arange(len(self._letter))[None]
            rng = np.random.default_rng(slots)
            loops = every if slots == 1 else rng.integers(every.size, size=(slots, self._size))
            q = self._q[:, loops[0]]
            for row in loops[1:]:
                q = np.stack(quaternions.product(q, self._q[:, row]))
            self._words[slots] = _Words(loops, q / np.sqrt((q * q).sum(0)))
        return self._words[slots]

    def starts(self, loops: Int[np.ndarray, "k m n"], distance: Float[np.ndarray, "m n"]) -> Starts:
        """Words to start from."""
        return Starts(self._letter[loops], self._x[:, loops], distance)


class _Words:
    """Words of one length, found by their rotations."""

    def __init__(self, loops: Int[np.ndarray, "k n"], q: Float[np.ndarray, "4 n"]):
        self.loops, self._q = loops, q
        self._tree: Any = None

    def nearest(
        self, target: Float[np.ndarray, "4 m"], count: int, within: float = np.inf
    ) -> tuple[Float[np.ndarray, "m count"], Int[np.ndarray, "m count"]]:
        """Chords to the nearest words of each target, and which they are; nearest first, beyond `within` left open."""
        if self._tree is None and target.shape[1] > _FEW:
            from scipy.spatial import KDTree  # importing it takes as long as it saves with few targets

            self._tree = KDTree(np.concatenate([self._q, -self._q], axis=1).T)
        if self._tree is None:
            found = [_nearest(self._q, t[:, None], count) for t in target.T]
            chords, words = ([part[i] for part in found] for i in (0, 1))
            return np.reshape(chords, (-1, count)), np.reshape(np.array(words, int), (-1, count))
        chord, word = (
            a.reshape(-1, count) for a in self._tree.query(target.T, k=count, distance_upper_bound=within, workers=-1)
        )
        return chord, word % self._q.shape[1]


def _nearest(
    q: Float[np.ndarray, "4 n"], target: Float[np.ndarray, "4 1"], count: int
) -> tuple[Float[np.ndarray, " count"], Int[np.ndarray, " count"]]:
    square = np.minimum(((q - target) ** 2).sum(0), ((q + target) ** 2).sum(0))
    first = np.argpartition(square, count - 1)[:count]
    first = first[np.argsort(square[first], kind="stable")]
    return np.sqrt(square[first]), first


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

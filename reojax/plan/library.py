"""Where searches start: words with random amplitudes, found by the rotation that they make."""

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float, Int

from reojax.plan import quaternions
from reojax.plan.loops import Table, read
from reojax.plan.words import Box

_POOL = 4096
"""Loops drawn for each letter."""
_WORDS = 1 << 16
"""Words of each length."""

_read = jax.jit(read)


class Starts(NamedTuple):
    """Words to start from, rows last."""

    letter: Int[np.ndarray, "k m"]
    """Letters."""
    x: Float[np.ndarray, "d k m"]
    """Amplitudes [rad]."""
    distance: Float[np.ndarray, " m"]
    """Chord between the quaternions of start and target: half the angle between them, if small."""


class Library:
    """Random words of a table's loops by length, made when first asked for; seeded, so always the same."""

    def __init__(self, table: Table, box: Box):
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
        self._q = np.asarray(_read(table, letter, x)[0])
        self._words = {}

    def near(self, target: Float[np.ndarray, "4 m"], slots: int, count: int) -> Starts:
        """The `count` words of `slots` loops nearest to each target, (..., m, count) without regard to the sign."""
        index, tree = self._of(slots)
        distance, nearest = tree.query(target.T, k=count, workers=-1)
        nearest = np.reshape(nearest, (-1, count)) % index.shape[1]
        loops = index[:, nearest]
        return Starts(self._letter[loops], self._x[:, loops], distance.reshape(-1, count))

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

"""Rows of words for targets, solved in chunks of one size: on the table, then on the true net rotations."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import jax
import numpy as np

from reojax.manoeuvres import Layout
from reojax.planning.gauss_newton import Found, refine, shorten, solve
from reojax.planning.initial_guesses import Pool, Starts
from reojax.planning.residual import Word
from reojax.planning.table import Table, fold_rotation, tabulate, true_rotations
from reojax.planning.words import Box, last_twist
from reojax.robot import Robot

_ROWS = 256
"""Rows per call."""
SIZES = (2, 4, 6)
"""Numbers of slots that there are programs for."""
_BURSTS = (6, 10)
"""Steps on the table."""
_NEWTON = 12
"""Steps on the true rotations."""
_SHORT = 1e-6
"""Largest change of amplitudes [rad] of a step that, from within the tolerance, is not looked at where it ends."""
_SOFTEST = 1e-10
"""Least damping of those steps, relative to the squared derivatives."""


class Scene(NamedTuple):
    """A robot with everything that planning computes once."""

    robot: Robot
    layout: Layout
    box: Box
    table: Table
    pool: Pool
    fold: np.ndarray
    """(4,) rotation while the feet fold."""


class Rows(NamedTuple):
    """Words for targets; what `solve` starts from and gives back. Rows last."""

    owner: np.ndarray
    """(m,) index of the target."""
    letter: np.ndarray
    """(k, m) letters, -1 unused."""
    runs: np.ndarray
    """(k, m) how often each loop is run."""
    x: np.ndarray
    """(d, k, m) amplitudes [rad]."""
    square: np.ndarray
    """(m,) squared residual [rad^2]."""

    def take(self, keep: np.ndarray) -> "Rows":
        """Some of the rows."""
        return Rows(*(field[..., keep] for field in self))


def scene(robot: Robot, layout: Layout, box: Box) -> Scene:
    """Compute what all plans of a robot within a box share."""
    table = jax.tree.map(jax.numpy.asarray, tabulate(robot, layout, box))
    return Scene(robot, layout, box, table, Pool(table, box), fold_rotation(robot, layout))


def price(box: Box, letter: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Joint travel per amplitude (d, k, m): every joint of a rectangle goes out and back."""
    each = [4.0, 2.0] if box.low.shape[1] == 2 else [2.0, 2.0, 2.0]
    return np.array(each)[:, None, None] * np.where(letter >= 0, count, 0.0)[None]


def travel(box: Box, rows: Rows) -> np.ndarray:
    """Joint travel (m,) [rad] of the loops of each row."""
    return (price(box, rows.letter, rows.runs) * np.abs(rows.x)).sum((0, 1))


def attempt(scene: Scene, targets: np.ndarray, rows: Rows) -> Rows:
    """Solve rows on the table; after some steps only those go on that still come nearer."""
    found, going = rows._replace(x=rows.x.copy(), square=rows.square.copy()), np.arange(len(rows.owner))
    for steps in _BURSTS:
        if not len(going):
            break
        x, square, more = _on_table(
            scene, targets, found.take(going), lambda word, x, _, steps=steps: solve(scene.table, word, x, steps)
        )
        found.x[..., going], found.square[going] = x, square
        going = going[more]
    return found


def shortened(scene: Scene, targets: np.ndarray, rows: Rows) -> Rows:
    """Less travel for solved rows, on the table."""
    if not len(rows.owner):
        return rows
    x, square, _ = _on_table(scene, targets, rows, lambda word, x, price: shorten(scene.table, word, x, price))
    return rows._replace(x=x, square=square)


def settle(scene: Scene, targets: np.ndarray, rows: Rows, tolerance: float) -> Rows:
    """Solve rows on the true net rotations; `square` is then true, and amplitudes are the best seen."""
    best = rows._replace(square=np.full(rows.square.shape, np.inf))
    x, strength = rows.x.copy(), np.full(rows.square.shape, _SOFTEST)
    going = np.arange(len(rows.owner))
    for _ in range(_NEWTON):
        if not len(going):
            break
        at = rows._replace(x=x).take(going)
        square, moved = _true_step(scene, targets, at, strength[going])
        better = square < best.square[going]
        best.square[going] = np.where(better, square, best.square[going])
        best.x[..., going] = np.where(better, at.x, best.x[..., going])
        strength[going] *= np.where(better, 0.1, 100)
        strength = np.maximum(strength, _SOFTEST)
        x[..., going] = np.where(better, moved, 0.5 * (at.x + best.x[..., going]))
        there = (square <= tolerance**2) & (np.abs(moved - at.x).max((0, 1)) < _SHORT)
        best.x[..., going[there]] = moved[..., there]
        going = going[~there & (best.square[going] > min(tolerance, 1e-11) ** 2)]
    return best


def _true_step(scene: Scene, targets: np.ndarray, rows: Rows, strength: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squared residuals on the true rotations, and amplitudes after one step."""
    used = rows.letter >= 0
    last = last_twist(scene.box.letters, rows.letter, rows.x)
    true = np.zeros((4, *used.shape))
    true[0] = 1
    true[:, used] = true_rotations(scene.robot, scene.layout, np.stack([rows.x[0], rows.x[1], last])[:, used])
    squares, moved = [], []
    for word, x, size, part in _chunks(scene, targets, rows):
        known = _padded(true[..., part], _ROWS, 1.0), _padded(strength[part], _ROWS, 1.0)
        square, x = refine(scene.table, word, x, *known)
        squares.append(np.asarray(square)[:size])
        moved.append(np.asarray(x)[..., :size])
    return np.concatenate(squares), np.concatenate(moved, axis=-1)


def starting_rows(owner: np.ndarray, starts: Starts) -> Rows:
    """Rows of the starts (..., m, n) for targets `owner` (m,)."""
    n = starts.distance.shape[1]
    slots = starts.letter.shape[0]
    unused = min(size for size in SIZES if size >= slots) - slots
    letter = np.pad(starts.letter.reshape(slots, -1), ((0, unused), (0, 0)), constant_values=-1)
    x = np.pad(starts.x.reshape(len(starts.x), slots, letter.shape[1]), ((0, 0), (0, unused), (0, 0)))
    return Rows(np.repeat(owner, n), letter, np.ones(letter.shape), x, np.full(letter.shape[1], np.inf))


def least(rows: Rows, value: np.ndarray, keep: int = 1) -> Rows:
    """For each target the `keep` rows of least `value`."""
    order = np.lexsort((value, rows.owner))
    owner = rows.owner[order]
    rank = np.arange(len(owner)) - np.searchsorted(owner, owner)
    return rows.take(order[rank < keep])


def _on_table(scene: Scene, targets: np.ndarray, rows: Rows, program: Callable[..., Found]) -> Found:
    def run(chunk: tuple[Word, np.ndarray, int, slice]) -> list[np.ndarray]:
        word, x, size, _ = chunk
        costs = price(scene.box, np.asarray(word.letter), np.asarray(word.runs))
        return [np.asarray(field)[..., :size] for field in program(word, x, costs)]

    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(run, _chunks(scene, targets, rows)))
    return Found(*(np.concatenate(field, axis=-1) for field in zip(*results, strict=True)))


def _chunks(scene: Scene, targets: np.ndarray, rows: Rows) -> Iterator[tuple[Word, np.ndarray, int, slice]]:
    """Words of `_ROWS` rows each; what is added to fill them is solved already."""
    box = scene.box
    for first in range(0, len(rows.owner), _ROWS):
        part = slice(first, first + _ROWS)
        letter = _padded(rows.letter[:, part], _ROWS, -1)
        size = min(_ROWS, len(rows.owner) - first)
        low, high = (np.moveaxis(np.where((letter >= 0)[..., None], edge[letter], 0.0), -1, 0) for edge in box[1:])
        target = _padded(targets[:, rows.owner[part]], _ROWS, 0.0)
        target[0, size:] = 1.0
        word = Word(letter, _padded(rows.runs[:, part], _ROWS, 1.0), target, low, high)
        yield word, _padded(rows.x[..., part], _ROWS, 0.0), size, part


def _padded(array: np.ndarray, size: int, value: float) -> np.ndarray:
    width = [(0, 0)] * (array.ndim - 1) + [(0, size - array.shape[-1])]
    return np.pad(array, width, constant_values=value)


def joined(parts: Sequence[Rows]) -> Rows:
    """Rows of several answers, one after another, numbered anew."""
    fields = [np.concatenate(field, axis=-1) for field in zip(*parts, strict=True)]
    return Rows(np.arange(fields[0].size), *fields[1:])

"""Rows of words for targets, solved in chunks of one size: on the table, then on the true net rotations."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import jax
import numpy as np

from reojax.manoeuvres import Layout
from reojax.planning.gauss_newton import Iterate, refine, shorten, solve
from reojax.planning.initial_guesses import GuessTable, Starts
from reojax.planning.residual import Word
from reojax.planning.table import Table, fold_rotation, tabulate, true_rotations
from reojax.planning.words import AmplitudeBox, last_twist
from reojax.robot import Robot
from reojax.session import usable_cores

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


class Context(NamedTuple):
    """A robot with everything that planning computes once."""

    robot: Robot
    layout: Layout
    box: AmplitudeBox
    table: Table
    pool: GuessTable
    fold: np.ndarray
    """(4,) rotation while the feet fold."""


class Candidates(NamedTuple):
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

    def take(self, keep: np.ndarray | slice) -> "Candidates":
        """Some of the rows."""
        return Candidates(*(field[..., keep] for field in self))

    def with_slots(self, slots: int) -> "Candidates":
        """The same words with unused slots at their ends."""
        more = ((0, slots - len(self.letter)), (0, 0))
        letter, runs = np.pad(self.letter, more, constant_values=-1), np.pad(self.runs, more, constant_values=1.0)
        return self._replace(letter=letter, runs=runs, x=np.pad(self.x, ((0, 0), *more)))


def context(robot: Robot, layout: Layout, box: AmplitudeBox) -> Context:
    """Compute what all plans of a robot within a box share."""
    table = jax.device_put(tabulate(robot, layout, box))
    return Context(robot, layout, box, table, GuessTable(table, box), fold_rotation(robot, layout))


def price(box: AmplitudeBox, letter: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Joint travel per amplitude (d, k, m): every joint of a rectangle goes out and back."""
    each = [4.0, 2.0] if box.low.shape[1] == 2 else [2.0, 2.0, 2.0]
    return np.array(each)[:, None, None] * np.where(letter >= 0, count, 0.0)[None]


def travel(box: AmplitudeBox, rows: Candidates) -> np.ndarray:
    """Joint travel (m,) [rad] of the loops of each row."""
    return (price(box, rows.letter, rows.runs) * np.abs(rows.x)).sum((0, 1))


def attempt(context: Context, targets: np.ndarray, rows: Candidates, bursts: int = len(_BURSTS)) -> Candidates:
    """Solve rows on the table; after some steps only those go on that still come nearer."""
    found, going = rows._replace(x=rows.x.copy(), square=rows.square.copy()), np.arange(len(rows.owner))
    for steps in _BURSTS[:bursts]:
        if not len(going):
            break
        x, square, more = _on_table(
            context, targets, found.take(going), lambda word, x, _, steps=steps: solve(context.table, word, x, steps)
        )
        found.x[..., going], found.square[going] = x, square
        going = going[more]
    return found


def shorten_candidates(context: Context, targets: np.ndarray, rows: Candidates) -> Candidates:
    """Less travel for solved rows, on the table."""
    if not len(rows.owner):
        return rows
    x, square, _ = _on_table(context, targets, rows, lambda word, x, price: shorten(context.table, word, x, price))
    return rows._replace(x=x, square=square)


def settle(context: Context, targets: np.ndarray, rows: Candidates, tolerance: float) -> Candidates:
    """Solve rows on the true net rotations; `square` is then true, and amplitudes are the best seen."""
    best = rows._replace(x=rows.x.copy(), square=np.full(rows.square.shape, np.inf))  # its own arrays
    x, strength = rows.x.copy(), np.full(rows.square.shape, _SOFTEST)
    going = np.arange(len(rows.owner))
    for _ in range(_NEWTON):
        if not len(going):
            break
        at = rows._replace(x=x).take(going)
        square, moved = _true_step(context, targets, at, strength[going])
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


def _true_step(
    context: Context, targets: np.ndarray, rows: Candidates, strength: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Squared residuals on the true rotations, and amplitudes after one step."""
    used = rows.letter >= 0
    last = last_twist(context.box.letters, rows.letter, rows.x)
    true = np.zeros((4, *used.shape))
    true[0] = 1
    true[:, used] = true_rotations(context.robot, context.layout, np.stack([rows.x[0], rows.x[1], last])[:, used])
    squares, moved = [], []
    for word, x, size, part in _chunks(context, targets, rows):
        known = _pad(true[..., part], _ROWS, 1.0), _pad(strength[part], _ROWS, 1.0)
        square, x = refine(context.table, word, x, *known)
        squares.append(np.asarray(square)[:size])
        moved.append(np.asarray(x)[..., :size])
    return np.concatenate(squares), np.concatenate(moved, axis=-1)


def starting_rows(owner: np.ndarray, starts: Starts) -> Candidates:
    """Rows of the starts (..., m, n) for targets `owner` (m,)."""
    slots = starts.letter.shape[0]
    letter = starts.letter.reshape(slots, -1)
    x = starts.x.reshape(len(starts.x), *letter.shape)
    owner = np.repeat(owner, starts.distance.shape[1])
    rows = Candidates(owner, letter, np.ones(letter.shape), x, np.full(letter.shape[1], np.inf))
    return rows.with_slots(min(size for size in SIZES if size >= slots))


def least(rows: Candidates, value: np.ndarray, keep: int = 1) -> Candidates:
    """For each target the `keep` rows of least `value`."""
    order = np.lexsort((value, rows.owner))
    owner = rows.owner[order]
    return rows.take(order[rank_in_target(owner) < keep])


def rank_in_target(owner: np.ndarray) -> np.ndarray:
    """Place of each row among those of its target, where targets are in order."""
    return np.arange(len(owner)) - np.searchsorted(owner, owner)


def _on_table(context: Context, targets: np.ndarray, rows: Candidates, program: Callable[..., Iterate]) -> Iterate:
    def run(chunk: tuple[Word, np.ndarray, int, slice]) -> list[np.ndarray]:
        word, x, size, _ = chunk
        costs = price(context.box, np.asarray(word.letter), np.asarray(word.runs))
        with jax.enable_x64(True):  # a thread of its own starts with JAX's default
            return [np.asarray(field)[..., :size] for field in program(word, x, costs)]

    with ThreadPoolExecutor(usable_cores()) as pool:
        results = list(pool.map(run, _chunks(context, targets, rows)))
    return Iterate(*(np.concatenate(field, axis=-1) for field in zip(*results, strict=True)))


def _chunks(context: Context, targets: np.ndarray, rows: Candidates) -> Iterator[tuple[Word, np.ndarray, int, slice]]:
    """Words of `_ROWS` rows each; what is added to fill them is solved already."""
    box = context.box
    for first in range(0, len(rows.owner), _ROWS):
        part = slice(first, first + _ROWS)
        letter = _pad(rows.letter[:, part], _ROWS, -1)
        size = min(_ROWS, len(rows.owner) - first)
        low, high = (np.moveaxis(np.where((letter >= 0)[..., None], edge[letter], 0.0), -1, 0) for edge in box[1:])
        target = _pad(targets[:, rows.owner[part]], _ROWS, 0.0)
        target[0, size:] = 1.0
        word = Word(letter, _pad(rows.runs[:, part], _ROWS, 1.0), target, low, high)
        yield word, _pad(rows.x[..., part], _ROWS, 0.0), size, part


def _pad(array: np.ndarray, size: int, value: float) -> np.ndarray:
    width = [(0, 0)] * (array.ndim - 1) + [(0, size - array.shape[-1])]
    return np.pad(array, width, constant_values=value)


def join(parts: Sequence[Candidates]) -> Candidates:
    """Rows of several answers, one after another, words of any length."""
    slots = max(len(part.letter) for part in parts)
    fields = zip(*(part.with_slots(slots) for part in parts), strict=True)
    return Candidates(*(np.concatenate(field, axis=-1) for field in fields))

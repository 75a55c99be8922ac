"""Rows of words for targets, solved in chunks of one size: on the table, then on the true net rotations."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import jax
import numpy as np

from reojax.manoeuvres import Layout
from reojax.planning.gauss_newton import FEW, MANY, Iterate, Programs
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
_FEW, _FEW_ROWS = 64, 64
"""Up to so many targets, calls are of so few rows and all of them of the most slots: what counts is compilation."""
_BURSTS = (6, 10)
"""Steps on the table."""
_ENOUGH, _THOROUGH = 8, 20
"""Steps to less travel: what takes four fifths of what there is to gain, and where time does not count."""
_NEWTON = 12
"""Steps on the true rotations."""
_FINE = 1e-10
"""Tolerance [rad] below which the default steps of integration, good to some 1e-11, are not enough."""
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
    program = _programs(targets).solve
    for steps in _BURSTS[:bursts]:
        if not len(going):
            break
        x, square, more = _on_table(
            context, targets, found.take(going), lambda word, x, _, steps=steps: program(context.table, word, x, steps)
        )
        found.x[..., going], found.square[going] = x, square
        going = going[more]
    return found


def shorten_candidates(
    context: Context, targets: np.ndarray, rows: Candidates, *, thorough: bool = False
) -> Candidates:
    """Less travel for solved rows, on the table; of few targets thoroughly in any case."""
    if not len(rows.owner):
        return rows
    program, steps = _programs(targets).shorten, _THOROUGH if thorough or _are_few(targets) else _ENOUGH
    x, square, _ = _on_table(
        context, targets, rows, lambda word, x, price: program(context.table, word, x, price, steps)
    )
    return rows._replace(x=x, square=square)


def settle(context: Context, targets: np.ndarray, rows: Candidates, tolerance: float) -> Candidates:
    """Solve rows on the true net rotations; `square` is then true, and amplitudes are the best seen."""
    best = rows._replace(x=rows.x.copy(), square=np.full(rows.square.shape, np.inf))  # its own arrays
    x, strength = rows.x.copy(), np.full(rows.square.shape, _SOFTEST)
    going = np.arange(len(rows.owner))
    accuracy = 2 if _are_few(targets) or tolerance < _FINE else 1  # what is compiled for `plans` serves few
    for _ in range(_NEWTON):
        if not len(going):
            break
        at = rows._replace(x=x).take(going)
        square, moved = _true_step(context, targets, at, strength[going], accuracy)
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
    context: Context, targets: np.ndarray, rows: Candidates, strength: np.ndarray, accuracy: int
) -> tuple[np.ndarray, np.ndarray]:
    """Squared residuals on the true rotations, by `accuracy` times the default steps, and amplitudes after one step."""
    used = rows.letter >= 0
    last = last_twist(context.box.letters, rows.letter, rows.x)
    true = np.zeros((4, *used.shape))
    true[0] = 1
    amplitudes = np.stack([rows.x[0], rows.x[1], last])[:, used]
    true[:, used] = true_rotations(context.robot, context.layout, amplitudes, accuracy)
    program = _programs(targets).refine

    def step(word: Word, x: np.ndarray, part: slice) -> Sequence:
        known, soft = _pad(true[..., part], word.letter.shape, 0.0), _pad(strength[part], x.shape[-1:], 1.0)
        known[0, word.letter < 0] = 1.0
        return program(context.table, word, x, known, soft)

    moved, square = _in_chunks(context, targets, rows, step)
    return square, moved


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


def _are_few(targets: np.ndarray) -> bool:
    return targets.shape[1] <= _FEW


def _programs(targets: np.ndarray) -> Programs:
    return FEW if _are_few(targets) else MANY


def _on_table(context: Context, targets: np.ndarray, rows: Candidates, program: Callable[..., Iterate]) -> Iterate:
    prices = price(context.box, rows.letter, rows.runs)

    def run(word: Word, x: np.ndarray, part: slice) -> Iterate:
        return program(word, x, _pad(prices[..., part], x.shape[1:], 0.0))

    return Iterate(*_in_chunks(context, targets, rows, run))


def _in_chunks(
    context: Context, targets: np.ndarray, rows: Candidates, program: Callable[[Word, np.ndarray, slice], Sequence]
) -> list[np.ndarray]:
    """Arrays of all rows by a program of some; amplitudes are the first of them."""
    slots = rows.letter.shape[0]

    def run(chunk: tuple[Word, np.ndarray, slice]) -> list[np.ndarray]:
        with jax.enable_x64(True):  # a thread of its own starts with JAX's default
            x, *rest = (np.asarray(field) for field in program(*chunk))
        size = len(rows.owner[chunk[2]])
        return [x[:, :slots, :size], *(field[..., :size] for field in rest)]

    with ThreadPoolExecutor(usable_cores()) as pool:
        results = list(pool.map(run, _chunks(context, targets, rows)))
    return [np.concatenate(field, axis=-1) for field in zip(*results, strict=True)]


def _chunks(context: Context, targets: np.ndarray, rows: Candidates) -> Iterator[tuple[Word, np.ndarray, slice]]:
    """Words of one number of rows each, and which rows they are; what is added to fill them is solved already."""
    shape = (SIZES[-1], _FEW_ROWS) if _are_few(targets) else (rows.letter.shape[0], _ROWS)
    once = (rows.runs == 1).all()
    for first in range(0, len(rows.owner), shape[1]):
        part = slice(first, first + shape[1])
        letter = _pad(rows.letter[:, part], shape, -1)
        low, high = (
            np.moveaxis(np.where((letter >= 0)[..., None], edge[letter], 0.0), -1, 0) for edge in context.box[1:]
        )
        target = _pad(targets[:, rows.owner[part]], shape[1:], 0.0)
        target[0, len(rows.owner[part]) :] = 1.0
        word = Word(letter, None if once else _pad(rows.runs[:, part], shape, 1.0), target, low, high)
        yield word, _pad(rows.x[..., part], shape, 0.0), part


def _pad(array: np.ndarray, shape: tuple[int, ...], value: float) -> np.ndarray:
    """Fill up the last axes to `shape`."""
    same = array.ndim - len(shape)
    width = [(0, 0)] * same + [(0, size - have) for size, have in zip(shape, array.shape[same:], strict=True)]
    return np.pad(array, width, constant_values=value)


def join(parts: Sequence[Candidates]) -> Candidates:
    """Rows of several answers, one after another, words of any length."""
    slots = max(len(part.letter) for part in parts)
    fields = zip(*(part.with_slots(slots) for part in parts), strict=True)
    return Candidates(*(np.concatenate(field, axis=-1) for field in fields))

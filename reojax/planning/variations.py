"""The closest word for a target that no start near it has reached: the best words so far, varied again and again.

Words that barely reach such a target have many amplitudes at their limits. So the best few of those that were solved
are kept, some of their loops are drawn anew, all are solved, and of old and new the best few are kept again, until that
helps no more. What is drawn does not depend on what else is planned at the same time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reojax.planning.candidates import Candidates, Context, attempt, join, rank_in_target

_KEPT, _CHILDREN = 6, 16
"""Words kept from one generation to the next, and variations of each."""
_GENERATIONS = 120
"""Most generations."""
_PATIENCE, _BETTER = {False: 4, True: 20}, {False: 0.9, True: 0.99}
"""Generations in a row without a better word after which a target is left, and the part of the squared residual that a
better word may leave: with loops that are run once, and with loops that are run many times, where the words are many
more and come nearer little by little."""
_BENT, _TWISTED = 0.9, 0.25
"""Share of the bends and of the twists drawn anew that are at a limit."""
_ALIKE = 1e-4
"""Relative difference of squared residuals below which two words of a target are taken for the same."""
_TOGETHER = 128
"""Targets solved together."""
_DONE = 1e-13
"""Squared residual on the table [rad^2] at which a target is reached."""


def vary(context: Context, targets: np.ndarray, known: Sequence[Candidates], slots: int, most: int) -> Candidates:
    """The best few words of up to `slots` loops, repeated ones `most`, for each target that has rows in `known`."""
    rows = join(known)
    owners = np.unique(rows.owner)
    parts = []
    for first in range(0, len(owners), _TOGETHER):
        some = rows.take(np.isin(rows.owner, owners[first : first + _TOGETHER]))
        parts.append(_vary(context, targets, some, slots, most))
    return join(parts)


def _vary(context: Context, targets: np.ndarray, known: Candidates, slots: int, most: int) -> Candidates:
    rng = np.random.default_rng(0)
    again = most > slots
    blank = np.arange(len(known.letter)) >= slots
    best = _best(known)
    owners = np.unique(best.owner)
    least, stalled = np.full(len(owners), np.inf), np.zeros(len(owners), int)
    for _ in range(_GENERATIONS):
        now = best.square[np.searchsorted(best.owner, owners)]
        stalled = np.where(now < _BETTER[again] * least, 0, stalled + 1)
        least = np.minimum(now, least)
        going = owners[(now > _DONE) & (stalled < _PATIENCE[again])]
        if not len(going):
            break
        parents = best.take(np.flatnonzero(np.isin(best.owner, going)))
        children = attempt(context, targets, _variations(context, rng, parents, blank, most), bursts=1)
        rows = join([best, children])
        kept = _best_of(rows)
        fresh = kept >= len(best.owner)  # what is not among the best after the first steps is not solved further
        best = _best(join([rows.take(kept[~fresh]), attempt(context, targets, rows.take(kept[fresh]))]))
    return best


def _variations(
    context: Context, rng: np.random.Generator, parents: Candidates, blank: np.ndarray, most: int
) -> Candidates:
    """Children of the best words: some loops drawn anew, the others moved a little or not; a loop more or less."""
    n, slots = _KEPT * _CHILDREN, len(blank)
    letter, x = _draw(context, rng, (slots, n))
    new = rng.random((slots, n)) < rng.choice([1 / slots, 2 / slots, 0.5], n)
    new[rng.integers(max(1, int((~blank).sum())), size=n), np.arange(n)] = True
    new &= ~blank[:, None]
    moved = 0.1 * rng.normal(size=x.shape) * (rng.random(n) < 0.5)
    child = parents.take(np.repeat(np.arange(len(parents.owner)), _CHILDREN))
    # the same for every target
    drawn = (rank_in_target(parents.owner)[:, None] * _CHILDREN + np.arange(_CHILDREN)).ravel()
    letter, new, x, moved = (field[..., drawn] for field in (letter, new, x, moved))
    there = child.letter >= 0
    often = np.floor((most / slots) ** rng.random((slots, n)))[:, drawn] if most > slots else np.ones(new.shape)
    runs = np.where(new, often, np.where(there, child.runs, 0.0))
    new &= runs.sum(0) <= most  # no more loops than are allowed
    letter = np.where(new, letter, child.letter)
    low, high = (np.moveaxis(edge[letter], -1, 0) for edge in context.box[1:])
    x = np.clip(np.where(new[None], x, child.x + moved), low, high)
    runs = np.where(new, often, child.runs)
    return child._replace(
        letter=letter, x=np.where(letter >= 0, x, 0.0), runs=runs, square=np.full(len(child.owner), np.inf)
    )


def _draw(context: Context, rng: np.random.Generator, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Letters and amplitudes, most bends and some twists at a limit."""
    box = context.box
    letter = rng.integers(len(box.letters), size=shape)
    low, high = (np.moveaxis(edge[letter], -1, 0) for edge in box[1:])
    at_limit = np.array([_BENT if d == 1 else _TWISTED for d in range(len(low))])[:, None, None]
    limit = np.where(rng.random(low.shape) < 0.5, low, high)
    return letter, np.where(rng.random(low.shape) < at_limit, limit, rng.uniform(low, high))


def _best(rows: Candidates) -> Candidates:
    """The `_KEPT` best rows of each target, best first, in the order of targets."""
    return rows.take(_best_of(rows))


def _best_of(rows: Candidates) -> np.ndarray:
    """Where these are; of rows that ended alike, one."""
    order = np.lexsort((rows.square, rows.owner))
    owner, square = rows.owner[order], rows.square[order]
    alike = (np.diff(owner) == 0) & (np.diff(square) < _ALIKE * square[1:]) & (square[1:] > _DONE)
    order = order[~np.concatenate([[False], alike])]
    return order[rank_in_target(rows.owner[order]) < _KEPT]

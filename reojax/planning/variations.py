"""The closest word for a target that no start near it has reached: the best words so far, varied again and again.

Words that come closest to such a target have most amplitudes at their limits, where few words of random amplitudes
begin. So the best few are kept, some of their loops are drawn anew, all are solved, and of old and new the best few are
kept again, until that helps no more. What is drawn does not depend on what else is planned at the same time.
"""

from __future__ import annotations

import numpy as np

from reojax.planning.candidates import Candidates, Context, attempt

_FIRST = 4000
"""Random words to begin with, for each target."""
_KEPT, _CHILDREN = 40, 15
"""Words kept from one generation to the next, and variations of each."""
_GENERATIONS, _PATIENCE = 60, 8
"""Most generations, and those in a row without a better word after which a target is left."""
_BETTER = 0.99
"""Part of the squared residual that a better word may leave."""
_TOGETHER = 32
"""Targets solved together."""
_DONE = 1e-13
"""Squared residual on the table [rad^2] at which a target is reached."""


def vary(context: Context, targets: np.ndarray, known: Candidates, slots: int, most: int) -> Candidates:
    """Rows of words of up to `slots` loops, repeated ones `most`, the best few for each target of a row in `known`."""
    parts = []
    for first in range(0, len(known.owner), _TOGETHER):
        parts.append(_vary(context, targets, known.take(slice(first, first + _TOGETHER)), slots, most))
    return _together(parts) if parts else known


def _vary(context: Context, targets: np.ndarray, known: Candidates, slots: int, most: int) -> Candidates:
    rng = np.random.default_rng(0)
    used = len(known.letter)
    blank = np.arange(used) >= slots
    letter, x = _draw(context, rng, (used, _FIRST))
    letter = np.where(blank[:, None], -1, letter)
    best = _best(_together([known, attempt(context, targets, _children(known, letter, x, np.ones(letter.shape)))]))
    going = known.owner
    least, stalled = np.full(len(going), np.inf), np.zeros(len(going), int)
    for _ in range(_GENERATIONS):
        now = best.square.reshape(len(known.owner), _KEPT)[:, 0]
        stalled = np.where(now < _BETTER * least, 0, stalled + 1)
        least = np.minimum(now, least)
        going = known.owner[(now > _DONE) & (stalled < _PATIENCE)]
        if not len(going):
            break
        parents = best.take(np.flatnonzero(np.isin(best.owner, going)))
        children = attempt(context, targets, _variations(context, rng, parents, blank, most))
        best = _best(_together([best, children]))
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
    targets = len(parents.owner) // _KEPT
    child = parents.take(np.repeat(np.arange(len(parents.owner)), _CHILDREN))
    letter, new = (np.tile(field, (1, targets)) for field in (letter, new))
    x, moved = (np.tile(field, (1, 1, targets)) for field in (x, moved))
    there = child.letter >= 0
    new &= there | (np.where(there, child.runs, 0).sum(0) + slots <= most)  # no more loops than are allowed
    letter = np.where(new, letter, child.letter)
    low, high = (np.moveaxis(edge[letter], -1, 0) for edge in context.box[1:])
    x = np.clip(np.where(new[None], x, child.x + moved), low, high)
    runs = np.where(new, 1.0, child.runs)
    return child._replace(
        letter=letter, x=np.where(letter >= 0, x, 0.0), runs=runs, square=np.full(len(child.owner), np.inf)
    )


def _draw(context: Context, rng: np.random.Generator, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Letters and amplitudes, half of which are at a limit."""
    box = context.box
    letter = rng.integers(len(box.letters), size=shape)
    low, high = (np.moveaxis(edge[letter], -1, 0) for edge in box[1:])
    limit = np.where(rng.random(low.shape) < 0.5, low, high)
    return letter, np.where(rng.random(low.shape) < 0.5, limit, rng.uniform(low, high))


def _children(known: Candidates, letter: np.ndarray, x: np.ndarray, runs: np.ndarray) -> Candidates:
    """The same words for every target of `known`."""
    m, n = len(known.owner), letter.shape[1]
    x = np.where(letter >= 0, x, 0.0)
    return Candidates(
        np.repeat(known.owner, n),
        np.tile(letter, (1, m)),
        np.tile(runs, (1, m)),
        np.tile(x, (1, 1, m)),
        np.full(m * n, np.inf),
    )


def _best(rows: Candidates) -> Candidates:
    """The `_KEPT` best rows of each target, best first, in the order of targets."""
    order = np.lexsort((rows.square, rows.owner))
    owner = rows.owner[order]
    rank = np.arange(len(owner)) - np.searchsorted(owner, owner)
    return rows.take(order[rank < _KEPT])


def _together(parts: list[Candidates]) -> Candidates:
    return Candidates(*(np.concatenate(field, axis=-1) for field in zip(*parts, strict=True)))

"""Which word: the fewest loops that reach each target, or the least travel.

How many loops are needed is decided by trying 1, 2, 3, ...: for each length, words of all letters and signs start
near the target and are solved; what is found is solved again on the true rotations. A number is given up when no
start succeeds, so "not with fewer" is a numerical decision, not a proof.
"""

from collections.abc import Callable, Sequence

import numpy as np

from reojax.planning import quaternions
from reojax.planning.candidates import (
    SIZES,
    Candidates,
    Context,
    attempt,
    least,
    settle,
    shorten_candidates,
    starting_rows,
    travel,
)
from reojax.planning.initial_guesses import FIRST, Starts
from reojax.planning.repeated_loops import group_rows, loops
from reojax.planning.variations import vary

LONGEST = 6
"""Longest word whose loops each have amplitudes of their own; longer words repeat loops."""
_ROUNDS = ((0, FIRST), (FIRST, 10), (10, 40))
"""Starts tried for each target, from and to; each round where those before failed."""
_LAST_ROUND = (40, 240)
"""Further starts for what is not reached with the longest word that is allowed, however far off the others ended."""
_LONGEST_ROUND = (240, 2000)
"""Yet more for words of `LONGEST` loops, after which there is nothing else to try: on robots with tilted axes and
unequal links they reach one more of four targets that those before miss, in 80 ms each."""
_HOPE = 0.1
"""Squared residual [rad^2] that some start must come down to for another round."""
_FAR = {1: 0.06, 2: 0.1, 3: 0.15}
"""Chord to the nearest start beyond which a word of so many loops is not tried; longer words: `_FAR_LONG`."""
_FAR_LONG = 0.25
_CLOSE = 1e-9
"""Squared residual on the table [rad^2] from which the true rotations are tried."""
_CLOSE_FEW = {1: 1e-5, 2: 1e-6}
"""The same for words of so few loops that they barely reach a target or do not, which the table cannot tell apart."""
_NEAR, _PATIENCE = 1e-4, 6
"""Squared residual on the table up to which such words are tried on, and how often."""
_EXACT = 1e-13
"""Squared residual on the table that leaves no doubt."""
_AGAIN = 4
"""Rows of a target that are tried on the true rotations where the first one failed."""
_LEAST_TRAVEL = 10
"""Starts of least travel among the nearest ones, when travel counts."""


class Answer:
    """The best word so far for each of m targets: solved before not, then by what counts."""

    def __init__(self, scene: Context, targets: np.ndarray, tolerance: float):
        m, d = targets.shape[1], scene.box.low.shape[1]
        slots = SIZES[-1]
        square = 4 * (targets[1:] ** 2).sum(0)
        empty = np.full((slots, m), -1), np.ones((slots, m)), np.zeros((d, slots, m)), square
        self.rows = Candidates(np.arange(m), *empty)  # arrays of its own, which `update_best` writes into
        self.travel = np.zeros(m)
        self.tolerance = tolerance
        self._box = scene.box

    @property
    def solved(self) -> np.ndarray:
        """(m,) whether the word reaches the target, on the true rotations."""
        return self.rows.square <= self.tolerance**2

    def update_best(self, rows: Candidates) -> None:
        """Take rows, one for each of some targets, that are better than what is there."""
        cost = travel(self._box, rows)
        now = self.rows.square[rows.owner]
        reaches, reached = rows.square <= self.tolerance**2, self.solved[rows.owner]
        better = (reaches & ~reached) | (~reached & (rows.square < now))
        better |= reaches & reached & (cost < self.travel[rows.owner])
        owner, rows, cost = rows.owner[better], rows.take(better), cost[better]
        slots = rows.letter.shape[0]
        for field, value, blank in (("letter", rows.letter, -1), ("runs", rows.runs, 1.0), ("x", rows.x, 0.0)):
            mine = getattr(self.rows, field)
            mine[..., owner] = blank
            mine[..., :slots, owner] = value
        self.rows.square[owner] = rows.square
        self.travel[owner] = cost


def fewest(scene: Context, targets: np.ndarray, most: int, tolerance: float) -> Answer:
    """Words of the fewest loops, up to `most`, and of these of least travel, for targets (4, m)."""
    answer = Answer(scene, targets, tolerance)
    longest = min(most, LONGEST)
    for slots in range(1, longest + 1):
        _with_loops(scene, targets, answer, slots, _ROUNDS)
    if most > LONGEST:
        _with_small_loops(scene, targets, most, answer, loops)
    last = (_LONGEST_ROUND,) if longest == LONGEST else ()
    _with_loops(scene, targets, answer, longest, (*_ROUNDS, _LAST_ROUND, *last), whatever=True)
    _with_variations(scene, targets, answer, longest, most)
    return answer


def _with_loops(
    scene: Context,
    targets: np.ndarray,
    answer: Answer,
    slots: int,
    rounds: Sequence[tuple[int, int]],
    whatever: bool = False,
) -> None:
    """Try words of `slots` loops for what is not reached yet; with `whatever` also where there is little hope."""
    waiting = np.flatnonzero(~answer.solved)
    if len(waiting) and not whatever:
        waiting = waiting[scene.pool.reaches(targets[:, waiting], slots, _FAR.get(slots, _FAR_LONG))]
    closest = np.zeros(len(waiting))
    close = _CLOSE_FEW.get(slots, _CLOSE)
    for first, last in rounds:
        trying = np.flatnonzero(~answer.solved[waiting] & (whatever | (closest < _HOPE)))
        if not len(trying):
            break
        starts = scene.pool.near(targets[:, waiting[trying]], slots, last)
        some = Starts(*(field[..., first:last] for field in starts))
        found = attempt(scene, targets, starting_rows(waiting[trying], some))
        if slots in _CLOSE_FEW:
            found = _continue_search(scene, targets, found)
        closest[trying] = found.square.reshape(-1, last - first).min(1)
        missed = found.take(found.square >= close)
        answer.update_best(least(missed, missed.square))
        _update_from_solutions(scene, targets, answer, found.take(found.square < close), keep=1)


def _with_variations(scene: Context, targets: np.ndarray, answer: Answer, slots: int, most: int) -> None:
    """Try variations of the best words for what nothing else reached."""
    waiting = np.flatnonzero(~answer.solved)
    if not len(waiting):
        return
    found = vary(scene, targets, answer.rows.take(waiting), slots, most)
    missed = found.take(found.square >= _CLOSE)
    answer.update_best(least(missed, missed.square))
    _update_from_solutions(scene, targets, answer, found.take(found.square < _CLOSE), keep=4)


def _continue_search(scene: Context, targets: np.ndarray, found: Candidates) -> Candidates:
    """Go on with what comes near a target slowly, as words do that barely reach it."""
    found = found._replace(x=found.x.copy(), square=found.square.copy())
    for _ in range(_PATIENCE):
        near = np.flatnonzero((found.square > _EXACT) & (found.square < _NEAR))
        then = attempt(scene, targets, found.take(near))
        found.x[..., near], found.square[near] = then.x, then.square
    return found


def cheapest(scene: Context, targets: np.ndarray, most: int, tolerance: float) -> Answer:
    """Words of least travel, of up to `most` loops; never more than those of the fewest loops."""
    answer = fewest(scene, targets, min(most, LONGEST), tolerance)
    waiting = np.flatnonzero((answer.travel > 0) | ~answer.solved)
    for slots in range(1, min(most, LONGEST) + 1):
        starts = scene.pool.near(targets[:, waiting], slots, _ROUNDS[-1][1])
        rows = starting_rows(waiting, starts)
        value = travel(scene.box, rows) + 20 * starts.distance.ravel()
        found = attempt(scene, targets, least(rows, value, _LEAST_TRAVEL))
        missed = found.take(found.square >= _CLOSE)
        answer.update_best(least(missed, missed.square))
        _update_from_solutions(scene, targets, answer, found.take(found.square < _CLOSE), keep=4)
    if most > LONGEST:
        _with_small_loops(scene, targets, most, answer, lambda rows: travel(scene.box, rows))
    return answer


def _with_small_loops(
    scene: Context, targets: np.ndarray, most: int, answer: Answer, value: Callable[[Candidates], np.ndarray]
) -> None:
    """Try words of many equal loops where nothing else reached the target; of the solved ones the least `value`."""
    found = attempt(scene, targets, group_rows(scene, targets, np.flatnonzero(~answer.solved), most))
    missed = found.take(found.square >= _CLOSE)
    answer.update_best(least(missed, missed.square))
    found = found.take(found.square < _CLOSE)
    best = least(found, value(found) + np.where(found.square > _EXACT, 1e6, 0.0), _AGAIN)
    short = settle(scene, targets, shorten_candidates(scene, targets, best), answer.tolerance)
    plain = settle(scene, targets, best, answer.tolerance)
    for rows in (short, plain):
        off = np.where(rows.square <= answer.tolerance**2, 0.0, 1e9)
        answer.update_best(least(rows, off + 1e3 * value(rows) + travel(scene.box, rows)))


def _update_from_solutions(scene: Context, targets: np.ndarray, answer: Answer, found: Candidates, keep: int) -> None:
    """Shorten what reaches the target on the table, and solve it on the true rotations."""
    value = travel(scene.box, found) + np.where(found.square > _EXACT, 1e3, 0.0)
    short = shorten_candidates(scene, targets, least(found, value, keep))
    answer.update_best(settle(scene, targets, least(short, travel(scene.box, short)), answer.tolerance))
    lost = ~answer.solved[found.owner]  # at the edge of what can be reached, where the table is not enough
    again = settle(scene, targets, least(found.take(lost), found.square[lost], _AGAIN), answer.tolerance)
    answer.update_best(least(again, again.square))


def rotation_from_folded(scene: Context, targets: np.ndarray) -> np.ndarray:
    """Targets (4, m) as seen between the folded ends of a word: `F^-1 R F`."""
    fold = scene.fold[:, None]
    return np.stack(quaternions.product(quaternions.product(quaternions.inverse(fold), targets), fold))

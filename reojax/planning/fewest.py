"""Which word: the fewest loops that reach each target, or the least travel.

How many loops are needed is decided by trying 1, 2, 3, ...: for each length, words of all letters and signs start
near the target and are solved; what is found is solved again on the true rotations. A number is given up when no
start succeeds, so "not with fewer" is a numerical decision, not a proof.
"""

from collections.abc import Callable

import numpy as np

from reojax.planning import quaternions
from reojax.planning.candidates import (
    SIZES,
    Candidates,
    Context,
    attempt,
    join,
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
_FEW_ROUNDS = (("near", 0, FIRST), ("near", FIRST, 10), ("near", 10, 40))
"""Starts tried for each target with one or two loops: which set, from and to; each round where those before failed."""
_ROUNDS = (("bent", 0, FIRST), ("bent", FIRST, 10), ("near", 0, FIRST), ("bent", 10, 40))
"""The same for more loops, of which few amplitudes are small."""
_LAST_FEW_ROUNDS = (*_FEW_ROUNDS, ("near", 40, 240))
_LAST_ROUNDS = (("bent", 0, FIRST), ("bent", FIRST, 10), ("bent", 10, 40), ("bent", 40, 100))
"""Starts for what is not reached with the longest word that is allowed, however far off the others ended."""
_HOPE = {1: 0.01, 2: 0.01, 3: 0.01}
"""Squared residual [rad^2] that some start must come down to for another round; longer words: `_HOPE_LONG`."""
_HOPE_LONG = 0.1
_FAR = {1: 0.06, 2: 0.07, 3: 0.15}
"""Chord to the nearest start beyond which a word of so many loops is not tried; longer words: `_FAR_LONG`."""
_FAR_LONG = 0.25
_CLOSE = 1e-9
"""Squared residual on the table [rad^2] from which the true rotations are tried."""
_CLOSE_FEW = {1: 1e-5, 2: 1e-6}
"""The same for words of so few loops that they barely reach a target or do not, which the table cannot tell apart."""
_NEAR, _SLOW, _PATIENCE = 1e-4, 0.9, 6
"""Squared residual on the table up to which such words are tried on, what part of it each try must leave for another
one, and how many there are."""
_EXACT = 1e-13
"""Squared residual on the table that leaves no doubt."""
_AGAIN = 4
"""Rows of a target that are tried on the true rotations where the first one failed."""
_LEAST_TRAVEL = 10
"""Starts of least travel among the nearest ones, when travel counts."""


class BestWords:
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
        owner, rows = rows.owner[better], rows.take(better).with_slots(len(self.rows.letter))
        for field in ("letter", "runs", "x", "square"):
            getattr(self.rows, field)[..., owner] = getattr(rows, field)
        self.travel[owner] = cost[better]


def fewest(scene: Context, targets: np.ndarray, most: int, tolerance: float) -> BestWords:
    """Words of the fewest loops, up to `most`, and of these of least travel, for targets (4, m)."""
    answer = BestWords(scene, targets, tolerance)
    longest = min(most, LONGEST)
    for slots in range(1, longest + 1):
        _with_loops(scene, targets, answer, slots)
    if most > LONGEST:
        _with_small_loops(scene, targets, most, answer, loops)
    _with_what_is_left(scene, targets, answer, longest, most)
    return answer


def _with_loops(scene: Context, targets: np.ndarray, answer: BestWords, slots: int) -> None:
    """Try words of `slots` loops for what is not reached yet, where there is hope."""
    waiting = np.flatnonzero(~answer.solved)
    if len(waiting):
        waiting = waiting[scene.pool.reaches(targets[:, waiting], slots, _FAR.get(slots, _FAR_LONG))]
    closest, hope = np.zeros(len(waiting)), _HOPE.get(slots, _HOPE_LONG)
    rounds = _FEW_ROUNDS if slots in _CLOSE_FEW else _ROUNDS
    # the first starts, which mostly succeed, are settled first; the others together
    for some in (rounds[:1], rounds[1:]):
        parts, on_target = [], answer.solved[waiting]
        for kind, first, last in some:
            trying = np.flatnonzero(~on_target & (closest < hope))
            if not len(trying):
                break
            starts = getattr(scene.pool, kind)(targets[:, waiting[trying]], slots, last)
            parts.append(_solve_starts(scene, targets, waiting[trying], starts, first))
            closest[trying] = parts[-1].square.reshape(-1, last - first).min(1)
            on_target[trying] = closest[trying] < _CLOSE
        if parts:
            _update(scene, targets, answer, join(parts), 1, _CLOSE_FEW.get(slots, _CLOSE))


def _with_what_is_left(scene: Context, targets: np.ndarray, answer: BestWords, slots: int, most: int) -> None:
    """Try what there is still to try: more starts, however far off others ended, then variations of the best words."""
    known = []
    for kind, first, last in _LAST_FEW_ROUNDS if slots in _CLOSE_FEW else _LAST_ROUNDS:
        waiting = np.flatnonzero(~answer.solved)
        if not len(waiting):
            return
        starts = getattr(scene.pool, kind)(targets[:, waiting], slots, last)
        known.append(_solve_starts(scene, targets, waiting, starts, first))
        _update(scene, targets, answer, known[-1], 1, _CLOSE_FEW.get(slots, _CLOSE))
    waiting = np.flatnonzero(~answer.solved)
    if len(waiting):
        known = [part.take(np.isin(part.owner, waiting)) for part in known]
        _update(scene, targets, answer, vary(scene, targets, [answer.rows.take(waiting), *known], slots, most), 4)


def _solve_starts(scene: Context, targets: np.ndarray, owner: np.ndarray, starts: Starts, first: int) -> Candidates:
    """Solve the starts from the `first` one for the targets `owner`, on the table."""
    some = Starts(*(field[..., first:] for field in starts))
    found = attempt(scene, targets, starting_rows(owner, some))
    return _continue_search(scene, targets, found) if len(some.letter) in _CLOSE_FEW else found


def _update(
    scene: Context, targets: np.ndarray, answer: BestWords, found: Candidates, keep: int, close: float = _CLOSE
) -> None:
    """Take the best of rows solved on the table; of those on the target, `keep` of least travel are settled."""
    missed = found.take(found.square >= close)
    answer.update_best(least(missed, missed.square))
    _update_from_solutions(scene, targets, answer, found.take(found.square < close), keep)


def _continue_search(scene: Context, targets: np.ndarray, found: Candidates) -> Candidates:
    """Go on with what comes near a target slowly, as words do that barely reach it."""
    found = found._replace(x=found.x.copy(), square=found.square.copy())
    near = np.flatnonzero((found.square > _EXACT) & (found.square < _NEAR))
    for _ in range(_PATIENCE):
        then, before = attempt(scene, targets, found.take(near)), found.square[near]
        found.x[..., near], found.square[near] = then.x, then.square
        near = near[(then.square > _EXACT) & (then.square < _SLOW * before)]
    return found


def cheapest(scene: Context, targets: np.ndarray, most: int, tolerance: float) -> BestWords:
    """Words of least travel, of up to `most` loops; never more than those of the fewest loops."""
    answer = fewest(scene, targets, min(most, LONGEST), tolerance)
    waiting = np.flatnonzero((answer.travel > 0) | ~answer.solved)
    for slots in range(1, min(most, LONGEST) + 1):
        starts = scene.pool.near(targets[:, waiting], slots, _FEW_ROUNDS[-1][2])
        rows = starting_rows(waiting, starts)
        value = travel(scene.box, rows) + 20 * starts.distance.ravel()
        found = attempt(scene, targets, least(rows, value, _LEAST_TRAVEL))
        _update(scene, targets, answer, found, keep=4)
    if most > LONGEST:
        _with_small_loops(scene, targets, most, answer, lambda rows: travel(scene.box, rows))
    return answer


def _with_small_loops(
    scene: Context, targets: np.ndarray, most: int, answer: BestWords, value: Callable[[Candidates], np.ndarray]
) -> None:
    """Try words of many equal loops where nothing else reached the target; of the solved ones the least `value`."""
    found = attempt(scene, targets, group_rows(scene, targets, np.flatnonzero(~answer.solved), most))
    missed = found.take(found.square >= _CLOSE)
    answer.update_best(least(missed, missed.square))
    found = found.take(found.square < _CLOSE)
    best = least(found, value(found) + np.where(found.square > _EXACT, 1e6, 0.0), _AGAIN)
    short = settle(scene, targets, shorten_candidates(scene, targets, best, thorough=True), answer.tolerance)
    plain = settle(scene, targets, best, answer.tolerance)
    for rows in (short, plain):
        off = np.where(rows.square <= answer.tolerance**2, 0.0, 1e9)
        answer.update_best(least(rows, off + 1e3 * value(rows) + travel(scene.box, rows)))


def _update_from_solutions(
    scene: Context, targets: np.ndarray, answer: BestWords, found: Candidates, keep: int
) -> None:
    """Shorten what reaches the target on the table, and solve it on the true rotations."""
    value = travel(scene.box, found) + np.where(found.square > _EXACT, 1e3, 0.0)
    short = shorten_candidates(scene, targets, least(found, value, keep), thorough=keep > 1)
    answer.update_best(settle(scene, targets, least(short, travel(scene.box, short)), answer.tolerance))
    lost = ~answer.solved[found.owner]  # at the edge of what can be reached, where the table is not enough
    again = settle(scene, targets, least(found.take(lost), found.square[lost], _AGAIN), answer.tolerance)
    answer.update_best(least(again, again.square))


def rotation_from_folded(scene: Context, targets: np.ndarray) -> np.ndarray:
    """Targets (4, m) as seen between the folded ends of a word: `F^-1 R F`."""
    fold = scene.fold[:, None]
    return np.stack(quaternions.product(quaternions.product(quaternions.inverse(fold), targets), fold))

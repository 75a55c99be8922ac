"""Small loops, many times over: words like A^30 B^12 A^25, for limits that one loop at a time does not satisfy.

A loop of given amplitudes turns the base by a fixed rotation, and how many of each a target takes follows from
splitting it into turns about the loops' axes (an Euler split about axes that are not quite perpendicular), with real
numbers of loops and as few as possible. Then the numbers are made whole, up or down, and the amplitudes solved for. The
loops are A and B at the limits, and those which turn most about the principal axes of what all loops within the limits
do: of some robots A and B at the limits turn about nearly the same axis, and only others turn them across it.
"""

from __future__ import annotations

from itertools import permutations, product as every
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from reojax.planning import quaternions
from reojax.planning.candidates import Candidates, Context
from reojax.planning.table import true_rotations
from reojax.planning.words import last_twist

_PATTERNS = (
    *((0, 1, 0), (1, 0, 1), (0, 1, 0, 1), (1, 0, 1, 0), (0, 1, 0, 1, 0), (1, 0, 1, 0, 1)),
    *permutations((2, 3, 4)),
    *((a, b, a) for a, b in permutations((2, 3, 4), 2)),
    *((a, b, a, b) for a, b in ((2, 3), (3, 2), (2, 4), (3, 4))),
)
"""Groups of loops: 0 for A and 1 for B at the limits, 2 to 4 for the loops along the principal axes."""
_SLOTS = 6
_STARTS = 12
"""Splits tried for each pattern and target."""
_KEPT = 3
"""Splits of each target and pattern that are made whole, from the fewest loops to the most: few loops may leave no
room to make the numbers whole."""

_CLOSEST = 6
"""Splits of each target that are made whole where none reaches it."""


class Units(NamedTuple):
    """One loop of each kind, for both ways (positive first)."""

    letter: Int[np.ndarray, "5 2"]
    """Letters."""
    x: Float[np.ndarray, "d 5 2"]
    """Amplitudes [rad]."""
    turn: Float[np.ndarray, "3 5 2"]
    """Half the rotation vector [rad]."""


def units(scene: Context) -> Units:
    """Loops at the limits, and along the principal axes of all loops."""
    box = scene.box
    free = box.low.shape[1] == 3
    letter = np.zeros((2, 2), int) if free else np.array([[0, 0], [1, 1]])
    x = np.zeros((box.low.shape[1], 2, 2))
    for kind, way in np.ndindex(2, 2):
        low, high = box.low[letter[kind, way]], box.high[letter[kind, way]]
        x[:, kind, way] = [(low if way else high)[0], high[1], *([0.0] if free else [])]
        if free:
            end = -x[0, kind, way] if kind == 0 else x[0, kind, way]
            x[2, kind, way] = np.clip(end, low[2], high[2])
    chosen = _along_principal_axes(_half_vectors(scene.pool.rotations))
    letter = np.concatenate([letter, scene.pool.letters[chosen]])
    x = np.concatenate([x, scene.pool.amplitudes[:, chosen]], axis=1)
    amplitudes = np.stack([x[0], x[1], last_twist(box.letters, letter, x)]).reshape(3, -1)
    turn = _half_vectors(true_rotations(scene.robot, scene.layout, amplitudes))
    return Units(letter, x, turn.reshape(3, *letter.shape))


def _half_vectors(q: Float[np.ndarray, "4 m"]) -> Float[np.ndarray, "3 m"]:
    """Half the rotation vectors of quaternions, the short way round."""
    q = np.where(q[0] < 0, -q, q)
    sine = np.sqrt((q[1:] ** 2).sum(0))
    return np.arctan2(sine, q[0]) / np.where(sine > 0, sine, 1.0) * q[1:]


def _along_principal_axes(vectors: Float[np.ndarray, "3 m"]) -> Int[np.ndarray, "3 2"]:
    """For both ways along each principal axis of some vectors the one that goes far along it and little across it."""
    axes = np.linalg.eigh(vectors @ vectors.T)[1]
    along = axes.T @ vectors
    worth = along * np.abs(along) / np.maximum(np.sqrt((vectors**2).sum(0)), np.finfo(float).tiny)
    return np.stack([worth.argmax(1), worth.argmin(1)], axis=1)[::-1]


def group_rows(scene: Context, targets: np.ndarray, owner: np.ndarray, most: int) -> Candidates:
    """Rows to start from, for the targets `owner`: all ways to make the best splits whole with up to `most` loops."""
    one = units(scene)
    kind, numbers, who = _splits(one, targets[:, owner], most)
    rows = []
    for i in range(len(owner)):
        for pattern in np.unique(kind[:, who == i], axis=1).T:
            mine = np.flatnonzero((who == i) & (kind == pattern[:, None]).all(0))
            mine = mine[np.argsort(np.abs(numbers[:, mine]).sum(0))]
            for split in mine[np.unique(np.linspace(0, len(mine) - 1, _KEPT).astype(int))]:
                rows.extend(_whole(one, kind[:, split], numbers[:, split], most, owner[i]))
    fields = [np.stack(field, axis=-1) for field in zip(*rows, strict=True)] if rows else _nothing(one)
    owners, letter, runs, x = fields
    return Candidates(owners, letter, runs, x, np.full(len(rows), np.inf))


def loops(rows: Candidates) -> np.ndarray:
    """Number of loops (m,) of each row."""
    return np.where(rows.letter >= 0, rows.runs, 0).sum(0)


def _nothing(one: Units) -> list[np.ndarray]:
    shape = (_SLOTS, 0)
    return [np.zeros(0, int), np.zeros(shape, int), np.ones(shape), np.zeros((len(one.x), *shape))]


def _whole(one: Units, kind: np.ndarray, numbers: np.ndarray, most: int, owner: int) -> list[tuple]:
    """Rows with the numbers of a split rounded up or down; scaled down, if they are more than `most`."""
    used = kind >= 0
    size, way = np.abs(numbers[used]), (numbers[used] < 0).astype(int)
    kinds = kind[used]
    size = size * min(1.0, most / size.sum())
    rows = []
    for up in every((0, 1), repeat=len(size)):
        runs = np.floor(size) + np.array(up)
        if runs.min() < 1 or runs.sum() > most:
            continue
        letter, count, x = np.full(_SLOTS, -1), np.ones(_SLOTS), np.zeros((len(one.x), _SLOTS))
        letter[: len(size)], count[: len(size)] = one.letter[kinds, way], runs
        x[:, : len(size)] = one.x[:, kinds, way] * np.minimum(size / runs, 1.0) ** 0.4
        rows.append((owner, letter, count, x))
    return rows


def _splits(one: Units, targets: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Solve for real numbers of loops: kinds (6, s), numbers (6, s) and the target's number (s,) of each split."""
    rng = np.random.default_rng(0)
    m = targets.shape[1]
    kind = np.full((_SLOTS, len(_PATTERNS)), -1)
    for column, pattern in enumerate(_PATTERNS):
        kind[: len(pattern), column] = pattern
    kind = np.tile(np.repeat(kind, _STARTS, axis=1), m)
    who = np.repeat(np.arange(m), len(_PATTERNS) * _STARTS)
    target = targets[:, who]
    used = kind >= 0
    # numbers of loops in units of a half angle of one radian
    size = np.sqrt((one.turn**2).sum(0)).max(1)
    scale = np.where(used, 1 / np.maximum(size, 1e-9)[np.maximum(kind, 0)], 0.0)
    n = rng.uniform(-1.5, 1.5, kind.shape) * scale
    best, least = n.copy(), np.full(n.shape[1], np.inf)
    for i in range(120):
        # J J^T of the scaled numbers
        residual, jacobian = _miss(one, kind, n, target)
        weighted = jacobian * scale[None]
        matrix = np.einsum("iks,jks->sij", weighted, weighted) + 1e-9 * np.eye(3)
        # the fewest loops that reach the target so far
        total = np.abs(n).sum(0)
        better = ((residual**2).sum(0) < 1e-8) & (total < least)
        best[:, better], least[better] = n[:, better], total[better]
        # towards fewer loops, by less and less, and onto the target: d - J^T (J J^T)^-1 (J d + r)
        downhill = -0.15 * np.sign(n) * used * (i >= 20) * (1 - i / 120)
        back = np.einsum("iks,ks->si", weighted, downhill) + residual.T
        force = np.linalg.solve(matrix, back[..., None])[..., 0]
        n = n + scale * np.clip(downhill - np.einsum("iks,si->ks", weighted, force), -0.5, 0.5)
    done = np.isfinite(least)
    none = ~np.bincount(who[done], minlength=m).astype(bool)
    if none.any():  # where nothing reaches the target, what comes closest with as many loops as are allowed
        n = n * np.minimum(1.0, most / np.maximum(np.abs(n).sum(0), 1e-9))
        away = (_miss(one, kind, n, target)[0] ** 2).sum(0).reshape(m, -1)
        near = np.argsort(away, axis=1)[none, :_CLOSEST] + np.flatnonzero(none)[:, None] * away.shape[1]
        best[:, near.ravel()], done[near.ravel()] = n[:, near.ravel()], True
    return kind[:, done], best[:, done], who[done]


def _miss(one: Units, kind: np.ndarray, n: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Residual (3, s) and its derivatives (3, 6, s) by the numbers of loops."""
    # quaternions of n loops that turn by the vector 2 turn: (cos n a, sin(n a) / a turn)
    turn = one.turn[:, np.maximum(kind, 0), (n < 0).astype(int)] * np.where(n < 0, -1.0, 1.0) * (kind >= 0)
    angle = np.sqrt((turn**2).sum(0))
    sine = np.where(angle > 0, np.sin(n * angle) / np.where(angle > 0, angle, 1.0), n)
    q = np.concatenate([np.cos(n * angle)[None], sine * turn])
    # products from the front, the target's inverse first, and from the back
    before = [np.stack(quaternions.inverse(target))]
    for i in range(len(n)):
        before.append(np.stack(quaternions.product(before[-1], q[:, i])))
    after = [np.array([1.0, 0, 0, 0])[:, None] * np.ones_like(n[0])]
    for i in reversed(range(1, len(n))):
        after.append(np.stack(quaternions.product(q[:, i], after[-1])))
    # twice the vector part of what is left, on the side where the scalar is positive
    end = before.pop()
    sign = np.where(end[0] < 0, -2.0, 2.0)
    # dq / dn = q (0, turn), between what comes before and after
    rate = [np.concatenate([0 * angle[:1], turn[:, i]]) for i in range(len(n))]
    columns = [
        np.stack(quaternions.product(quaternions.product(b, quaternions.product(q[:, i], r)), a))[1:]
        for i, (b, r, a) in enumerate(zip(before, rate, after[::-1], strict=True))
    ]
    return sign * end[1:], sign * np.stack(columns, axis=1)

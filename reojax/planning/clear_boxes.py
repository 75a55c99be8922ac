"""Amplitudes of manoeuvres that stay clear of the robot itself: boxes of them, found on a grid of loops.

Every loop starts and ends at rest, so a word is clear when each of its loops is. Which loops are clear is looked up
on a grid of amplitudes; the set is covered by boxes about zero, each a letter of its own to the search. Between the
nodes of the grid nothing is proven, so plans are looked at afterwards.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from jaxtyping import Bool

from reojax.manoeuvres import Layout
from reojax.planning.clear_paths import Clear
from reojax.planning.words import AmplitudeBox, last_twist, loop_corners

_NODES = {2: 12, 3: 6}
"""Steps of the grid from zero to either limit, for letters of two and three amplitudes."""
_BOXES = 3
"""Most boxes of a letter."""
_GAIN = 0.03
"""Share of the clear loops that a further box must add."""


def clear_boxes(layout: Layout, box: AmplitudeBox, clear: Clear) -> AmplitudeBox:
    """Boxes of clear loops within the box of each letter, as further letters of the same names."""
    letters, low, high = "", [], []
    for k, letter in enumerate(box.letters):
        axes = [_nodes(*ends, _NODES[box.low.shape[1]]) for ends in zip(box.low[k], box.high[k], strict=True)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij")).reshape(len(axes), -1)
        last = last_twist(letter, np.zeros(grid.shape[1], int), grid)
        kept = clear.keeps(loop_corners(layout, grid[0], grid[1], last)).reshape([len(axis) for axis in axes])
        for first, end in _cover(kept, [int(np.flatnonzero(axis == 0)[0]) for axis in axes]):
            letters += letter
            low.append([axis[i] for axis, i in zip(axes, first, strict=True)])
            high.append([axis[i] for axis, i in zip(axes, end, strict=True)])
    return AmplitudeBox(letters, np.array(low), np.array(high))


def _nodes(low: float, high: float, count: int) -> np.ndarray:
    """Amplitudes from the lower limit through zero to the upper one."""
    below = np.linspace(low, 0, count + 1) if low < 0 else np.zeros(1)
    above = np.linspace(0, high, count + 1)[1:] if high > 0 else np.zeros(0)
    return np.concatenate([below, above])


def _cover(kept: Bool[np.ndarray, "..."], zero: list[int]) -> list[tuple[list[int], list[int]]]:
    """Boxes of nodes, all kept, about the node `zero`, first and last node: each the one that adds most."""
    ends = [
        [(a, b) for a in range(at + 1) for b in range(at, size)] for at, size in zip(zero, kept.shape, strict=True)
    ]  # along each axis
    first, last = (np.array([[e[i] for e in along] for along in product(*ends)]) for i in (0, 1))
    whole = np.nonzero(_sum(~kept, first, last) == 0)[0]
    first, last = first[whole], last[whole]
    missing, boxes = kept.copy(), []
    while len(boxes) < _BOXES:
        gain = _sum(missing, first, last)
        best = int(gain.argmax())
        if boxes and gain[best] < _GAIN * kept.sum():
            break
        boxes.append((first[best].tolist(), last[best].tolist()))
        missing[tuple(slice(a, b + 1) for a, b in zip(first[best], last[best], strict=True))] = False
    return boxes


def _sum(field: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Number of true nodes within boxes (m, d), by cumulative sums."""
    total = np.pad(field.astype(int), [(1, 0)] * field.ndim)
    for axis in range(field.ndim):
        total = total.cumsum(axis)
    result = np.zeros(len(first), int)
    for corner in product((0, 1), repeat=field.ndim):
        index = np.where(corner, last + 1, first)
        result += (-1) ** (field.ndim - sum(corner)) * total[tuple(index.T)]
    return result

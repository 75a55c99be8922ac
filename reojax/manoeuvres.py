"""The thesis's two manoeuvres, A and B: rectangles in shape space (thesis 2.4, figures 2.1 and 2.2).

Both bend the centre joint, twist the two distal joints, unbend, and twist back. In A the distal
joints turn opposite ways and the robot turns about roll; in B the last distal joint is reversed, both
turn the same way, and the robot turns mainly about yaw.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array, as_numbers, is_concrete
from reojax._internal.checks import numbers, shorten, whole
from reojax.path import Path, polygon


class Layout(NamedTuple):
    """Which joints of a robot play which part in a manoeuvre."""

    joints: int
    """Number of joints of the robot."""
    twist: tuple[int, int]
    """The two distal joints, first and last."""
    bend: int
    """The centre joint."""
    fold: tuple[int, int] | None = None
    """Joints that fold the feet before the loop and unfold them after it (steps 1 and 6, thesis 1.4)."""
    fold_angle: tuple[float, float] = (pi / 2, pi / 2)
    """How far the feet fold [rad]."""


FOUR_BODY = Layout(joints=3, twist=(0, 2), bend=1)
"""The thesis's prototype: four links, L-shaped end links fixed (thesis 2.6)."""

SIX_BODY = Layout(joints=5, twist=(1, 3), bend=2, fold=(0, 4), fold_angle=(pi / 2, -pi / 2))
"""The thesis's full cat: six links, the feet fold and unfold (thesis 1.4)."""


REVERSAL = {"a": -1.0, "b": 1.0}
"""How far the last distal joint turns per turn of the first one."""

_ON = np.array([[0.0, 1, 1, 0, 0], [0.0, 0, 1, 1, 0], [0.0, 0, 1, 1, 0]])
"""Corners of the loop as shares of its bend, first and last twist: bend, twist, unbend, untwist."""


def manoeuvre_a(twist: ArrayLike, bend: ArrayLike, layout: Layout = FOUR_BODY) -> Path:
    """Manoeuvre A: bend, twist the distal joints opposite ways, unbend, untwist (thesis figure 2.1).

    On `FOUR_BODY` the polygon (0,0,0), (0,bend,0), (twist,bend,-twist), (twist,0,-twist), (0,0,0).

    Args:
        twist: final angle of the first distal joint [rad]; the last one goes to `-twist`.
        bend: final angle of the centre joint [rad].
        layout: which joints twist, bend and fold.

    Raises:
        ValueError: if an amplitude is not one finite number, or the layout contradicts itself.
    """
    return _manoeuvre("a", twist, bend, layout)


def manoeuvre_b(twist: ArrayLike, bend: ArrayLike, layout: Layout = FOUR_BODY) -> Path:
    """Manoeuvre B: as A, but the last distal joint turns the same way as the first (thesis figure 2.2).

    On `FOUR_BODY` the polygon (0,0,0), (0,bend,0), (twist,bend,twist), (twist,0,twist), (0,0,0).
    Arguments and errors as for `manoeuvre_a`.
    """
    return _manoeuvre("b", twist, bend, layout)


def rectangle(twist: ArrayLike, bend: ArrayLike, last_twist: ArrayLike, layout: Layout = FOUR_BODY) -> Path:
    """Bend, twist, unbend, untwist, the two distal joints to angles of their own; A and B are two of these loops.

    On `FOUR_BODY` the polygon (0,0,0), (0,bend,0), (twist,bend,last_twist), (twist,0,last_twist), (0,0,0).
    A layout that folds the feet folds them before and unfolds them after. Errors as for `manoeuvre_a`.

    Args:
        twist: final angle of the first distal joint [rad].
        bend: final angle of the centre joint [rad].
        last_twist: final angle of the last distal joint [rad].
        layout: which joints twist, bend and fold.
    """
    given = {"twist": twist, "bend": bend, "last_twist": last_twist}
    twist, bend, last = (_amplitude(entry, value) for entry, value in given.items())
    check_layout(layout)
    dtype = min(twist.dtype, bend.dtype, last.dtype, key=lambda d: d.itemsize)
    moves, folded = rectangle_corners(layout), np.tile(fold_angles(layout), (5, 1))
    if layout.fold is not None:  # starts and ends with the feet unfolded
        moves, folded = np.pad(moves, ((1, 1), (0, 0), (0, 0))), np.pad(folded, ((1, 1), (0, 0)))
    moves, folded = moves.astype(dtype), folded.astype(dtype)
    return polygon(folded + bend * moves[..., 0] + twist * moves[..., 1] + last * moves[..., 2])


def rectangle_corners(layout: Layout) -> Float[np.ndarray, "5 j 3"]:
    """Corners of the loop per bend, first twist and last twist: what every use of it is made from, feet left out."""
    corners = np.zeros((5, layout.joints, 3))
    for k, joint in enumerate((layout.bend, *layout.twist)):
        corners[:, joint, k] = _ON[k]
    return corners


def fold_angles(layout: Layout) -> Float[np.ndarray, " j"]:
    """Joint angles between loops: zero, but for folded feet [rad]."""
    angles = np.zeros(layout.joints)
    if layout.fold is not None:
        angles[list(layout.fold)] = layout.fold_angle
    return angles


def _manoeuvre(name: str, twist: ArrayLike, bend: ArrayLike, layout: Layout) -> Path:
    twist = _amplitude("twist", twist)
    return rectangle(twist, bend, REVERSAL[name] * twist, layout)


def _amplitude(entry: str, value: ArrayLike) -> Array:
    number = as_numbers(entry, value)
    if number.shape:
        raise ValueError(f"`{entry}` is {shorten(value)}; it must be one real number, in radians.")
    if is_concrete(number) and not np.isfinite(number):
        raise ValueError(f"`{entry}` is {value}; it must be finite.")
    return number


def check_layout(layout: Layout) -> None:
    """Raise a `ValueError` for a layout that contradicts itself."""
    if not isinstance(layout, Layout):
        raise ValueError(f"`layout` is {shorten(layout)}; it must be a Layout, such as FOUR_BODY.")
    joints = whole("layout.joints", layout.joints, 3, 10**4)
    for entry in ("twist", "fold"):
        pair = getattr(layout, entry)
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            if entry == "twist" or pair is not None:
                raise ValueError(f"`layout.{entry}` is {shorten(pair)}; it must be two joints.")
    if layout.fold is not None:
        numbers("layout.fold_angle", layout.fold_angle, (2,))
    used: Sequence[int] = (*layout.twist, layout.bend, *(layout.fold or ()))
    for joint in used:
        if isinstance(joint, bool) or not isinstance(joint, int | np.integer):
            raise ValueError(f"the layout names joint {shorten(joint)}; joints go by their numbers.")
        if not 0 <= joint < joints:
            raise ValueError(f"the layout names joint {joint}; its robot has joints 0 to {layout.joints - 1}.")
    if len(set(used)) != len(used):
        raise ValueError(f"the layout uses joints {tuple(used)}; each joint may play only one part.")


BY_NAME = {"a": manoeuvre_a, "b": manoeuvre_b}
"""The manoeuvres by the names that the command line has for them."""

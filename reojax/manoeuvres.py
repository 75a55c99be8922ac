"""The thesis's two manoeuvres, A and B: rectangles in shape space (thesis 2.4, figures 2.1 and 2.2).

Both bend the centre joint, twist the two distal joints, unbend, and twist back. In A the distal
joints turn opposite ways and the robot turns about roll; in B the last distal joint is reversed, both
turn the same way, and the robot turns mainly about yaw.
"""

from collections.abc import Sequence
from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array, as_numbers, is_concrete
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
    return _rectangle(twist, bend, layout, last=-1)


def manoeuvre_b(twist: ArrayLike, bend: ArrayLike, layout: Layout = FOUR_BODY) -> Path:
    """Manoeuvre B: as A, but the last distal joint turns the same way as the first (thesis figure 2.2).

    On `FOUR_BODY` the polygon (0,0,0), (0,bend,0), (twist,bend,twist), (twist,0,twist), (0,0,0).
    Arguments and errors as for `manoeuvre_a`.
    """
    return _rectangle(twist, bend, layout, last=1)


def _rectangle(twist: ArrayLike, bend: ArrayLike, layout: Layout, last: int) -> Path:
    """Corners of the loop, the last distal joint turning `last` times the first one's way."""
    twist, bend = _amplitude("twist", twist), _amplitude("bend", bend)
    check_layout(layout)
    first, second = layout.twist
    bending = _shape(layout, {layout.bend: 1.0})
    twisting = _shape(layout, {first: 1.0, second: float(last)})
    on_twist = np.array([0.0, 0.0, 1.0, 1.0, 0.0])
    on_bend = np.array([0.0, 1.0, 1.0, 0.0, 0.0])
    folded = np.zeros((5, layout.joints))
    if layout.fold is not None:
        on_twist, on_bend = np.pad(on_twist, 1), np.pad(on_bend, 1)
        folding = _shape(layout, dict(zip(layout.fold, layout.fold_angle, strict=True)))
        folded = np.outer([0, 1, 1, 1, 1, 1, 0], folding)
    dtype = min(twist.dtype, bend.dtype, key=lambda d: d.itemsize)
    twisted, bent = np.outer(on_twist, twisting).astype(dtype), np.outer(on_bend, bending).astype(dtype)
    return polygon(folded.astype(dtype) + twist * twisted + bend * bent)


def _shape(layout: Layout, angles: dict[int, float]) -> np.ndarray:
    shape = np.zeros(layout.joints)
    shape[list(angles)] = list(angles.values())
    return shape


def _amplitude(entry: str, value: ArrayLike) -> Array:
    number = as_numbers(entry, value)
    if number.shape:
        raise ValueError(f"`{entry}` is {value!r}; it must be one real number, in radians.")
    if is_concrete(number) and not np.isfinite(number):
        raise ValueError(f"`{entry}` is {value}; it must be finite.")
    return number


def check_layout(layout: Layout) -> None:
    """Raise a `ValueError` for a layout that contradicts itself."""
    if not isinstance(layout, Layout):
        raise ValueError(f"`layout` is {layout!r}; it must be a Layout, such as FOUR_BODY.")
    used: Sequence[int] = (*layout.twist, layout.bend, *(layout.fold or ()))
    for joint in used:
        if not 0 <= joint < layout.joints:
            raise ValueError(f"the layout names joint {joint}; its robot has joints 0 to {layout.joints - 1}.")
    if len(set(used)) != len(used):
        raise ValueError(f"the layout uses joints {tuple(used)}; each joint may play only one part.")


BY_NAME = {"a": manoeuvre_a, "b": manoeuvre_b}
"""The manoeuvres by the names that the command line has for them."""

"""The letters that plans are written in, and the joint paths that they stand for.

A letter is a family of loops, rectangles in shape space that start and end at zero: bend the centre joint, twist
the two distal joints, unbend, untwist (thesis 2.4). In A the last distal joint goes the opposite way, in B the
same way; in R each distal joint has an amplitude of its own. A robot with feet folds them once before a word
and unfolds them after it: that turns the base as if every loop folded and unfolded (the two between loops retrace
each other), and moves the joints less.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from reojax.manoeuvres import REVERSAL, Layout, fold_angles, rectangle_corners
from reojax.robot import Robot

VOCABULARIES = {"manoeuvres": "AB", "rectangles": "R"}
"""Letters of each vocabulary of words."""


class AmplitudeBox(NamedTuple):
    """Amplitudes allowed for each letter, letters on the first axis: twist, bend and, if free, last twist [rad]."""

    letters: str
    """Names, one character each."""
    low: Float[np.ndarray, "letter d"]
    """Smallest amplitudes."""
    high: Float[np.ndarray, "letter d"]
    """Largest amplitudes."""


def box_of(robot: Robot, layout: Layout, letters: str, twist_limit: float, bend_limit: float) -> AmplitudeBox:
    """Amplitudes within both the limits asked for and the robot's own joint limits.

    Raises:
        ValueError: if a joint may not be at zero, or the feet cannot fold.
    """
    lower, upper = np.asarray(robot.lower, float), np.asarray(robot.upper, float)
    used = (*layout.twist, layout.bend, *(layout.fold or ()))
    at = dict(zip(layout.fold, layout.fold_angle, strict=True)) if layout.fold else {}
    for joint in used:
        for angle in (0.0, at.get(joint, 0.0)):
            if not lower[joint] - 1e-9 <= angle <= upper[joint] + 1e-9:
                raise ValueError(
                    f"joint {robot.joint_names[joint]!r} is limited to {lower[joint]:.6g}..{upper[joint]:.6g} rad; "
                    f"the layout needs it at {angle:.6g} rad."
                )
    first, last = layout.twist
    twist = max(lower[first], -twist_limit), min(upper[first], twist_limit)
    other = max(lower[last], -twist_limit), min(upper[last], twist_limit)
    bend = max(lower[layout.bend], -bend_limit), min(upper[layout.bend], bend_limit)
    low, high = [], []
    for letter in letters:
        if letter == "R":
            rows = [twist, bend, other]
        else:
            ends = sorted(REVERSAL[letter.lower()] * end for end in other)
            rows = [(max(twist[0], ends[0]), min(twist[1], ends[1])), bend]
        low.append([row[0] for row in rows])
        high.append([row[1] for row in rows])
    return AmplitudeBox(letters, np.array(low), np.array(high))


def last_twist(letters: str, word: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Angle of the last distal joint [rad] for amplitudes `x` (d, ...) of the letters `word` (...)."""
    if x.shape[0] == 3:
        return x[2]
    return np.array([REVERSAL[letter.lower()] for letter in letters])[word] * x[0]


def loop_corners(layout: Layout, twist: np.ndarray, bend: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Corners (m, 5, j) of rectangles with amplitudes (m,), feet folded."""
    amplitudes = np.stack([bend, twist, last])
    return fold_angles(layout) + np.einsum("vjk,km->mvj", rectangle_corners(layout), amplitudes)


def word_corners(layout: Layout, twist: np.ndarray, bend: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Corners (v, j) of the path of a word of loops with amplitudes (k,), feet unfolded at both ends."""
    if not len(twist):
        return np.zeros((1, layout.joints))
    loops = loop_corners(layout, twist, bend, last)[:, 1:].reshape(-1, layout.joints)
    rest = fold_angles(layout)[None]
    ends = [rest * 0] if layout.fold is not None else []
    return np.concatenate([*ends, rest, loops, *ends])

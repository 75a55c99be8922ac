"""Unit quaternions (w, x, y, z) of many rotations at once, in NumPy or JAX: the components are on the first axis."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from reojax._internal.quaternions import inverse as inverse, matrix_rows, outer_rows, product as product


def from_matrices(rotations: np.ndarray) -> Float[np.ndarray, "4 m"]:
    """Quaternions of rotations (m, 3, 3), w >= 0, from the largest component of each (Shepperd)."""
    r = np.moveaxis(np.asarray(rotations, float), 0, -1)
    rows = np.array(outer_rows(r))
    diagonal = rows[range(4), range(4)]
    q = np.take_along_axis(rows, diagonal.argmax(0)[None, None], 0)[0]
    q = q / np.sqrt((q * q).sum(0))
    return np.where(q[0] < 0, -q, q)


def to_matrices(q: Any) -> Float[np.ndarray, "m 3 3"]:
    """Rotations (m, 3, 3) of unit quaternions (4, m)."""
    return np.moveaxis(np.array(matrix_rows(q)), (0, 1), (-2, -1))


def angles(q: Any) -> Float[np.ndarray, " m"]:
    """Angles of rotations, in [0, pi] [rad]."""
    w, x, y, z = q
    return 2 * np.arctan2(np.sqrt(x * x + y * y + z * z), np.abs(w))


def power(q: np.ndarray, count: np.ndarray) -> Float[np.ndarray, "4 m"]:
    """Quaternions of `M^n` for unit quaternions (4, m) of M."""
    sine = np.sqrt((q[1:] ** 2).sum(0))
    turn = count * np.arctan2(sine, q[0])
    ratio = np.where(sine > 0, np.sin(turn) / np.where(sine > 0, sine, 1.0), count)
    return np.concatenate([np.cos(turn)[None], ratio * q[1:]])

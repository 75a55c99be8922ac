"""Unit quaternions (w, x, y, z) of many rotations at once, in NumPy or JAX: the components are on the first axis."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float


def product(p: Any, q: Any) -> tuple[Any, Any, Any, Any]:
    """Quaternion of `P @ Q`; any four components that can be multiplied."""
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def inverse(q: Any) -> tuple[Any, Any, Any, Any]:
    """Quaternion of the inverse rotation."""
    w, x, y, z = q
    return w, -x, -y, -z


def from_matrices(rotations: np.ndarray) -> Float[np.ndarray, "4 m"]:
    """Quaternions of rotations (m, 3, 3), w >= 0, from the largest component of each (Shepperd)."""
    r = np.moveaxis(np.asarray(rotations, float), 0, -1)
    x, y, z = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    xy, yz, zx = r[0, 1] + r[1, 0], r[1, 2] + r[2, 1], r[2, 0] + r[0, 2]
    a, b, c = r[0, 0], r[1, 1], r[2, 2]
    diagonal = np.stack([1 + a + b + c, 1 + a - b - c, 1 - a + b - c, 1 - a - b + c])
    ww, xx, yy, zz = diagonal
    rows = np.stack([[ww, x, y, z], [x, xx, xy, zx], [y, xy, yy, yz], [z, zx, yz, zz]])
    q = np.take_along_axis(rows, diagonal.argmax(0)[None, None], 0)[0]
    q = q / np.sqrt((q * q).sum(0))
    return np.where(q[0] < 0, -q, q)


def to_matrices(q: Any) -> Float[np.ndarray, "m 3 3"]:
    """Rotations (m, 3, 3) of unit quaternions (4, m)."""
    w, x, y, z = q
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


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

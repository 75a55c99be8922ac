"""Orientation along a path in three angles that start at zero and do not jump."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array


def tilt_and_roll(rotations: Float[Array, "m 3 3"]) -> Float[np.ndarray, "m 3"]:
    """Tilt about x, tilt about y and roll about z [rad] along a history of rotations.

    `R = exp((tilt_x, tilt_y, 0)) Rz(roll)`: a roll about z, counted on beyond a half turn, and then the
    shortest turn that brings z where it is. In ZXZ angles (a, b, c) the tilt has length b and direction a,
    and roll = a + c, so these are the ZXZ angles without their jumps at b = 0. A jump is left where z is
    turned upside down (b = pi).
    """
    r = np.asarray(rotations, float)
    x, y, z = r[:, 0, 2], r[:, 1, 2], r[:, 2, 2]
    # the tilt turns z to (x, y, z) about (-y, x, 0), by the angle between them
    level = np.hypot(x, y)
    factor = np.divide(np.arctan2(level, z), level, out=np.ones_like(level), where=level > 0)
    return np.stack([-y * factor, x * factor, roll_along(r)], axis=1)


def roll_along(rotations: Float[Array, "m 3 3"]) -> Float[Array, " m"]:
    """The roll about z of `tilt_and_roll` alone [rad]; may be traced."""
    r, xp = rotations, np if isinstance(rotations, np.ndarray) else jnp
    return xp.unwrap(xp.arctan2(r[:, 1, 0] - r[:, 0, 1], r[:, 0, 0] + r[:, 1, 1]))


LEVEL = 0.1
"""Tilt [rad] below which the first and the third ZXZ angle count as undefined one by one; their sum is not."""


def zxz_without_jumps(rotations: Float[Array, "m 3 3"]) -> Float[np.ndarray, "m 3"]:
    """ZXZ angles (a, b, c) [rad] along a history of rotations, counted on where they would jump.

    `(a, b, c)` and `(a + pi, -b, c - pi)` are the same rotation, so b may be negative. While it is smaller than
    `LEVEL`, c is carried over from the neighbours, a is the rest of a + c, and b the tilt in that direction; the three
    are then the rotation within `LEVEL`. A jump is left at b = pi.
    """
    a, b, total = _direction_tilt_sum(rotations)
    defined = np.flatnonzero(b >= LEVEL)
    if not defined.size:
        return np.stack([total, b, np.zeros_like(b)], axis=1)
    direction = np.unwrap(np.concatenate([[0.0], a[defined]]), period=np.pi)[1:]
    c = np.interp(np.arange(len(a)), defined, total[defined] - direction)
    return np.stack([total - c, b * np.cos(a - total + c), c], axis=1)


def zxz_beside(rotations: Float[Array, "m 3 3"], reference: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, "m 3"]:
    """ZXZ angles [rad] of rotations, of all that are possible those nearest to `reference`.

    Where the tilt of either is below `LEVEL`, c is that of the reference and b the tilt in the direction a. NaN where
    a rotation has NaN.
    """
    seen = np.asarray(np.isfinite(rotations).all(axis=(1, 2)))
    result = np.full((len(reference), 3), np.nan)
    a, b, total = _direction_tilt_sum(np.asarray(rotations, float)[seen])
    near = reference[seen]
    # of (a, b, c) and (a + pi, -b, c - pi) the one that is nearer
    ways = []
    for turn, tilt in ((a, b), (a + np.pi, -b)):
        first = _nearest(turn, near[:, 0])
        ways.append(np.stack([first, tilt, _nearest(total - first, near[:, 2])], axis=1))
    far = [((way - near) ** 2).sum(axis=1) for way in ways]
    result[seen] = np.where((far[0] <= far[1])[:, None], *ways)
    # little tilt: c of the reference, a the rest of a + c
    small = seen.copy()
    small[seen] = np.minimum(b, abs(near[:, 1])) < LEVEL
    level = small[seen]
    rest = _nearest(total[level] - reference[small, 2], reference[small, 0])
    tilt = b[level] * np.cos(a[level] - rest)
    result[small] = np.stack([rest, tilt, reference[small, 2]], axis=1)
    return result


def _direction_tilt_sum(rotations: Float[Array, "m 3 3"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First ZXZ angle a, second one b >= 0, and a + c without jumps [rad]."""
    r = np.asarray(rotations, float)
    b = np.arctan2(np.hypot(r[:, 0, 2], r[:, 1, 2]), r[:, 2, 2])
    return np.arctan2(r[:, 0, 2], -r[:, 1, 2]), b, tilt_and_roll(r)[:, 2]


def _nearest(angle: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """The angle, whole turns added so that it lies within half a turn of the reference."""
    return angle - 2 * np.pi * np.round((angle - reference) / (2 * np.pi))

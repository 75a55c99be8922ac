"""Orientation along a path in three angles that start at zero and do not jump."""

import numpy as np
from jaxtyping import Float

from reojax._arrays import Array


def tilt_and_roll(rotations: Float[Array, "m 3 3"]) -> Float[np.ndarray, "m 3"]:
    """Tilt about x, tilt about y and roll about z [rad] along a history of rotations.

    `R = exp((tilt_x, tilt_y, 0)) Rz(roll)`: a roll about z, counted on beyond a half turn, and then the
    shortest turn that brings z where it is. In ZXZ angles (a, b, c) the tilt has length b and direction a,
    and roll = a + c, so these are the ZXZ angles without their jumps at b = 0. A jump is left where z is
    turned upside down (b = pi).
    """
    r = np.asarray(rotations, float)
    x, y, z = r[:, 0, 2], r[:, 1, 2], r[:, 2, 2]
    level = np.hypot(x, y)
    factor = np.divide(np.arctan2(level, z), level, out=np.ones_like(level), where=level > 0)
    roll = np.unwrap(np.arctan2(r[:, 1, 0] - r[:, 0, 1], r[:, 0, 0] + r[:, 1, 1]))
    return np.stack([-y * factor, x * factor, roll], axis=1)

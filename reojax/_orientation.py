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


def continued_zxz(rotations: Float[Array, "m 3 3"]) -> Float[np.ndarray, "m 3"]:
    """ZXZ angles (a, b, c) [rad] along a history of rotations, `R = Rz(a) Rx(b) Rz(c)`, told without jumps.

    (a, b, c) and (a + pi, -b, c + pi) are one rotation: of these, and of their full turns, each sample takes what is
    nearest to the one before, so b may change its sign and a and c go on beyond a half turn. The first b that is not
    zero is entered with a between -pi/2 and pi/2. Where b is zero only a + c means anything; a then stays. Close to
    it a and c turn fast, against each other, and only b and a + c can be compared.
    """
    r = np.asarray(rotations, float)
    sine = np.hypot(r[:, 0, 2], r[:, 1, 2])
    a, b = np.arctan2(r[:, 0, 2], -r[:, 1, 2]), np.arctan2(sine, r[:, 2, 2])
    c = np.arctan2(r[:, 2, 0], r[:, 2, 1])
    total = np.arctan2(r[:, 1, 0] - r[:, 0, 1], r[:, 0, 0] + r[:, 1, 1])
    level = sine < 1e-9
    first = np.argmin(level) if not level.all() else 0
    last = np.array([0.0, 0.0, total[first]]) if level[first] else np.array([0.0, b[first], c[first]])
    if not level[first] and np.cos(a[first]) < 0:
        last += [0.0, -2 * b[first], np.pi]
    angles = np.empty((len(r), 3))
    for k in range(len(r)):
        here = np.array([[a[k], b[k], c[k]], [a[k] + np.pi, -b[k], c[k] + np.pi]])
        if level[k] and r[k, 2, 2] > 0:
            here = np.array([[last[0], 0.0, total[k] - last[0]]])
        here[:, ::2] -= 2 * np.pi * np.round((here[:, ::2] - last[::2]) / (2 * np.pi))
        last = angles[k] = here[np.argmin(np.abs(here - last).sum(1))]
    return angles

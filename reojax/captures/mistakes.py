"""The usual mistakes in captures, and captures without them: order of quaternions, inverses, degrees and radians."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from reojax.captures.capture import Capture

LARGE = np.deg2rad(20)
"""RMS error above which a mistake is looked for [rad]."""
_ORDERS = {
    "": (0, 1, 2, 3),
    "the columns qw, qx, qy, qz seem to hold x, y, z, w": (3, 0, 1, 2),
    "the columns qx, qy, qz, qw seem to hold w, x, y, z": (1, 2, 3, 0),
}
"""Where w, x, y and z of the true quaternion stand in the one that was read as w, x, y, z."""
_INVERSE = "the orientations seem to be the inverse ones, from the fixed frame to the base"


def suspects(capture: Capture) -> Iterator[tuple[str, Capture]]:
    """What may be wrong with a capture, and the capture without that."""
    seen = capture.seen_rotation
    if capture.rotation is not None and seen.any():
        for order, places in _ORDERS.items():
            for inverse in (False, True):
                if order or inverse:
                    rotation = _reorder(capture.rotation, seen, places, inverse)
                    yield " and ".join(filter(None, (order, _INVERSE * inverse))), capture._replace(rotation=rotation)
    if capture.theta is not None:
        yield "the joint angles seem to be degrees taken for radians", capture._replace(theta=np.deg2rad(capture.theta))
        yield "the joint angles seem to be radians taken for degrees", capture._replace(theta=np.rad2deg(capture.theta))


def _reorder(rotation: np.ndarray, seen: np.ndarray, places: tuple[int, ...], inverse: bool) -> np.ndarray:
    """The rotations, their quaternions' entries put in place and turned round; what was not seen stays so."""
    from scipy.spatial.transform import Rotation

    read = Rotation.from_matrix(rotation[seen]).as_quat(scalar_first=True)
    turn = Rotation.from_quat(read[:, places], scalar_first=True)
    mended = np.array(rotation)
    mended[seen] = (turn.inv() if inverse else turn).as_matrix()
    return mended

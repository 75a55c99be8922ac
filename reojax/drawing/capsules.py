"""Capsules as small flat faces, for pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from reojax.drawing.solids import Faces

_SIDES, _RINGS = 16, 4
"""Faces around, and from the equator of an end to its pole."""


def capsule_faces(start: ArrayLike, end: ArrayLike, radius: ArrayLike) -> Faces:
    """Faces of a capsule, its ends round, in the frame in which `start` and `end` are given."""
    a, b, r = np.asarray(start, float), np.asarray(end, float), float(np.asarray(radius))
    length = float(np.linalg.norm(b - a))
    along = (b - a) / length if length > 0 else np.array([0.0, 0.0, 1.0])
    across = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    across /= np.linalg.norm(across)
    lift = np.linspace(0, np.pi / 2, _RINGS + 1)
    parts = max(1, int(np.ceil(length / (2 * r)))) if length > 0 else 0
    body = np.linspace(0, length, parts + 1)[1:-1] if parts else np.zeros(0)
    height = np.concatenate([-r * np.sin(lift[::-1]), body, length + r * np.sin(lift)])
    width = np.concatenate([r * np.cos(lift[::-1]), np.full(len(body), r), r * np.cos(lift)])
    if length == 0:  # one equator for both ends
        height, width = np.delete(height, _RINGS), np.delete(width, _RINGS)
    turn = 2 * np.pi * np.arange(_SIDES + 1) / _SIDES
    ring = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(along, across)
    points = a + height[:, None, None] * along + width[:, None, None] * ring
    return np.stack([points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]], axis=2).reshape(-1, 4, 3)

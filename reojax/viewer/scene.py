"""A robot and its motions as plain lists, for the page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from reojax.drawing.colours import INK, link_colour
from reojax.drawing.solids import joint_faces, link_faces, size
from reojax.mechanics.attitude import tilt_and_roll
from reojax.robot import Robot
from reojax.viewer import numbers
from reojax.viewer.clip import Clip

_LISTED = 64
"""Most characters of a name in a legend; a longer one is cut."""


def robot_data(robot: Robot) -> dict[str, Any]:
    """Tree, masses and shapes of a robot: its capsules, or solids of its inertia for links that have none."""
    scale = size(robot)
    solids, pins = link_faces(robot), joint_faces(robot)
    masses = np.asarray(robot.mass, float)
    with_capsules = set(robot.capsule_link)
    axis = np.asarray(robot.axis, float)
    axis = axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-300)
    links = [
        {
            "name": shorten(name),
            "mass": float(masses[k]),
            "com": _list(robot.com[k], 12),
            "colour": link_colour(k),
            "faces": [] if k in with_capsules else _mesh(solids[k], scale),
            "pin": [] if k == 0 else _mesh(pins[k - 1], scale),
            "capsules": [
                [_list(start, 9), _list(end, 9), float(np.asarray(radius))]
                for link, start, end, radius in robot.capsules
                if link == k
            ],
        }
        for k, name in enumerate(robot.link_names)
    ]
    joints = [
        {
            "name": shorten(name),
            "parent": robot.parent[k],
            "axis": _list(axis[k], 15),
            "anchor": _list(robot.anchor[k], 12),
        }
        for k, name in enumerate(robot.joint_names)
    ]
    return {"name": shorten(robot.name), "links": links, "joints": joints, "ink": INK, "size": scale}


def clip_data(clip: Clip, label: str, target: Float[np.ndarray, "3 3"] | None) -> dict[str, Any]:
    """A motion: its poses, from which the page makes the scene, and its curves [deg]."""
    from scipy.spatial.transform import Rotation

    quaternion = Rotation.from_matrix(clip.rotation).as_quat()  # (x, y, z, w), as three.js has it
    flips = np.sign(np.einsum("mi,mi->m", quaternion[1:], quaternion[:-1]))
    quaternion[1:] *= np.cumprod(np.where(flips == 0, 1, flips))[:, None]
    return {
        "label": label,
        "clock": _list(clip.clock, 9),
        "corners": _list(clip.corners, 9),
        "theta": _list(clip.theta, 9),
        "quaternion": _list(quaternion, 10),
        "angles": _list(np.rad2deg(tilt_and_roll(clip.rotation)), 3),
        "nearest": None
        if clip.nearest is None
        else {
            "clock": round(clip.nearest.clock, 6),
            "links": list(clip.nearest.place.links),
            "points": _list(clip.nearest.own, 6),
            "text": numbers.nearest(clip),
        },
        "left": None if target is None else _list(np.rad2deg(numbers.angle_to(clip.rotation, target)), 4),
    }


def table(columns: Sequence[dict[str, str]]) -> list[list[str]]:
    """Rows of name and one value for each column; a dash where a column has none."""
    names = list(dict.fromkeys(name for column in columns for name in column))
    return [[name, *(column.get(name, "\N{EN DASH}") for column in columns)] for name in names]


def shorten(name: str) -> str:
    """A name that fits in a legend."""
    return name if len(name) <= _LISTED else name[: _LISTED - 1] + "\N{HORIZONTAL ELLIPSIS}"


def _mesh(faces: Float[np.ndarray, "f 4 3"], scale: float) -> list[float]:
    """Corners of quadrilaterals in a row, to a millionth of the robot's size."""
    digits = max(0, 5 - int(np.floor(np.log10(scale))))
    return _list(faces.ravel(), digits)


def _list(values: Any, digits: int) -> list[Any]:
    return (np.round(np.asarray(values, float), digits) + 0.0).tolist()

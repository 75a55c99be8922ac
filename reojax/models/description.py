"""What a robot file says, before anything is merged, locked or dropped: links and joints, in the file's frames."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from reojax._internal.quaternions import matrix_rows

Kind = Literal["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "ball"]


class Shape(NamedTuple):
    """A collision shape of a link."""

    kind: str
    """"sphere", "capsule", "cylinder", "box", "ellipsoid", "mesh" or "plane"."""
    size: tuple[float, ...]
    """Sphere: radius; capsule, cylinder: radius, half length along z; box, ellipsoid: half sides; mesh: scale [m]."""
    rotation: np.ndarray
    """(3, 3) shape to link."""
    position: np.ndarray
    """(3,) of its centre, in the link's frame [m]."""
    file: str = ""
    """Of a mesh, as the robot file names it."""
    vertices: np.ndarray | None = None
    """Of a mesh that has been read, (v, 3) in the shape's frame [m]."""
    faces: np.ndarray | None = None
    """Likewise, (f, 3) numbers of vertices."""


class LinkEntry(NamedTuple):
    """A link; without mass where the file gives none."""

    mass: float
    """Mass [kg]."""
    com: np.ndarray
    """(3,) centre of mass in the link's frame [m]."""
    inertia: np.ndarray
    """(3, 3) about the centre of mass, in the link's frame [kg m^2]."""
    shapes: tuple[Shape, ...] = ()


class JointEntry(NamedTuple):
    """A joint, its child placed in its parent as at the joint's zero."""

    kind: Kind
    parent: str
    child: str
    rotation: np.ndarray
    """(3, 3) child to parent at zero."""
    position: np.ndarray
    """(3,) of the child's origin in the parent's frame at zero [m]."""
    axis: np.ndarray
    """(3,) unit vector in the child's frame."""
    point: np.ndarray
    """(3,) a point of the axis in the child's frame [m]."""
    lower: float = -np.inf
    """Limits [rad or m]."""
    upper: float = np.inf
    mimic: tuple[str, float, float] | None = None
    """(driver, ratio, offset) of a joint that follows another one."""
    gear_ratio: float = 1.0
    """Rotor turns per joint turn."""
    armature: float = 0.0
    """Rotor inertia as felt at the joint, `N^2 J` [kg m^2]."""
    rest: float = 0.0
    """Position at the file's rest [rad or m]."""


class Description(NamedTuple):
    """A robot file, read."""

    name: str
    links: dict[str, LinkEntry]
    joints: dict[str, JointEntry]
    """In the file's order."""
    root: str
    """Link without a parent."""
    constraints: tuple[tuple[str, str, tuple[str, ...], tuple[str, ...]], ...] = ()
    """Equality constraints: name, type, links, joints that each ties."""
    notes: tuple[str, ...] = ()


def rotation_of_rpy(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Rotation by roll about x, then pitch about y, then yaw about z, the axes fixed (URDF's rpy)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def rotation_of_quaternion(quaternion: np.ndarray) -> np.ndarray:
    """Rotation of a quaternion (w, x, y, z), made unit."""
    return np.array(matrix_rows(np.asarray(quaternion, float) / np.linalg.norm(quaternion)))


def ball_as_hinges(name: str, joint: JointEntry) -> tuple[dict[str, LinkEntry], dict[str, JointEntry]]:
    """A ball joint as three hinges about x, y and z of the child's frame, with two links without mass between them."""
    zero, nothing = np.zeros(3), LinkEntry(0.0, np.zeros(3), np.zeros((3, 3)))
    between = [f"{name}_x_link", f"{name}_y_link"]
    ends = [joint.parent, *between, joint.child]
    hinges = {}
    for k, letter in enumerate("xyz"):
        place = (joint.rotation, joint.position) if k == 0 else (np.eye(3), zero)
        hinges[f"{name}_{letter}"] = joint._replace(
            kind="revolute",
            parent=ends[k],
            child=ends[k + 1],
            rotation=place[0],
            position=place[1],
            axis=np.eye(3)[k],
        )
    return {link: nothing for link in between}, hinges

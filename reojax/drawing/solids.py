"""Solid parts as small flat faces: what a link looks like, worked out from its mass, inertia and joints.

A robot has no drawings, only mass, centre of mass and inertia of its links and where the joints are. A link is
drawn as the uniform cylinder or box that has its mass and inertia, with beams to the joints that lie outside it. An end
link whose mass lies to one side of its joint's axis is drawn bent: a shank along the axis and a foot out to the
**centre of percussion** `q = S u / (m c.u)`. Here `c` is the centre of mass seen from the joint, `u` its direction
across the axis and `S` the second moment of mass about the joint; a massless L with a point mass at the end of its
foot has exactly that mass there, at the foot's height on the axis and at its length from it.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax.robot import Robot

Faces = Float[np.ndarray, "f 4 3"]
"""Quadrilaterals, corners in order and counter-clockwise seen from outside [m]."""
_ROUND = 16
"""Sides of the prism that stands for a cylinder."""
_LIKE = 0.03
"""Relative difference of two second moments up to which a link counts as round."""
_SIDE = 0.1
"""Share of a link's second moment across the joint axis that the offset of its centre of mass must make for a foot."""
_BENT = np.cos(np.deg2rad(20))
"""Centre of mass and centre of percussion seen under a smaller angle than this are on one straight beam."""
_PIN = 0.14
"""Half the length of a joint's pin at most, as a share of the robot's size; a longer one would run along a link."""
_INNER = 0.5
"""Scale of a link that fills the same space as a heavier neighbour, so that the neighbour shows."""
_THIN = 0.02
"""Thickness of the thinnest part, as a share of the robot's size."""


def link_faces(robot: Robot) -> list[Faces]:
    """Faces of each link in the link's own frame [m]."""
    thin = _THIN * size(robot)
    return [_link(robot, link, thin) for link in range(robot.links)]


def joint_faces(robot: Robot) -> list[Faces]:
    """Faces of a pin through each joint, in the frame of the link it carries [m]; a collar if links lie along it."""
    scale = size(robot)
    return [_pin(robot, k, e, scale) for k, e in enumerate(_units(robot.axis))]


def size(robot: Robot) -> float:
    """About the length of the longest branch, from the base frame's origin [m]."""
    spread = np.sqrt([np.trace(_spread(robot, i)) for i in range(robot.links)])
    com = np.asarray(robot.com, float)
    reach = [np.linalg.norm(com[0]) + 1.5 * spread[0]]
    path = [0.0]
    for k, p in enumerate(robot.parent):
        path.append(path[p] + float(np.linalg.norm(robot.anchor[k])))
        reach.append(path[-1] + np.linalg.norm(com[k + 1]) + 1.5 * spread[k + 1])
    return float(max(reach))


def beam(start: np.ndarray, end: np.ndarray, radius: float, *, sides: int = _ROUND) -> Faces:
    """Round beam from `start` to `end`, with flat ends."""
    along = end - start
    length = np.linalg.norm(along)
    if length <= 1e-3 * radius:
        return np.zeros((0, 4, 3))
    frame = _frame(along / length)
    return _prism((start + end) / 2, frame, np.array([radius, radius, length / 2]), sides)


def box(centre: np.ndarray, frame: np.ndarray, half: np.ndarray) -> Faces:
    """Box of half sides `half` along the columns of `frame`."""
    return _prism(centre, frame, half, 4)


def _prism(centre: np.ndarray, frame: np.ndarray, half: np.ndarray, sides: int) -> Faces:
    """Prism along the last column of `frame`, right-handed, cut into slices so that faces sort well by depth."""
    turn = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    ring = np.stack([np.cos(turn), np.sin(turn)], 1) * (np.sqrt(2) if sides == 4 else 1.0)
    slices = int(np.clip(np.ceil(half[2] / max(half[0], half[1], 1e-12)), 2, 8))
    level = np.linspace(-1, 1, slices + 1)
    ring_at = np.concatenate(
        [np.broadcast_to(ring, (slices + 1, sides, 2)), np.broadcast_to(level[:, None, None], (slices + 1, sides, 1))],
        2,
    )
    on = np.roll(ring_at, -1, axis=1)
    wall = np.stack([ring_at[:-1], on[:-1], on[1:], ring_at[1:]], 2).reshape(-1, 4, 3)
    corner = np.arange(0, sides, 2)
    fan = [np.zeros_like(corner) + sides, corner, (corner + 1) % sides, (corner + 2) % sides]
    top, bottom = (np.concatenate([ring_at[i], [[0, 0, level[i]]]])[np.stack(fan, 1)] for i in (-1, 0))
    faces = np.concatenate([wall, top, bottom[:, ::-1]])
    return centre + (faces * half) @ frame.T


def _link(robot: Robot, link: int, thin: float) -> Faces:
    joints, axes = _joints(robot, link)
    if len(joints) == 1 and (bent := _bent(robot, link, joints[0], axes[0], thin)) is not None:
        return bent
    com = np.asarray(robot.com[link], float)
    frame, half, sides = _solid(robot, link, thin)
    radius = max(min(0.3 * half.min(), thin), thin / 2)
    outside = [p for p in joints if (np.abs(frame.T @ (p - com)) > 1.05 * half + radius).any()]
    body = _prism(com, frame, half * (_INNER if _hide_inner_faces(robot, link) else 1), sides)
    return np.concatenate([body, *(beam(com, p, radius) for p in outside)])


def _joints(robot: Robot, link: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Positions and axes of all joints on a link, in its own frame."""
    own = [(np.zeros(3), link - 1)] if link else []
    own += [(np.asarray(robot.anchor[k], float), k) for k, p in enumerate(robot.parent) if p == link]
    axes = _units(robot.axis)
    return [place for place, _ in own], [axes[k] for _, k in own]


def _solid(robot: Robot, link: int, thin: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Frame, half sides and number of sides of the uniform cylinder or box with a link's mass and inertia."""
    values, frame = np.linalg.eigh(_spread(robot, link))  # ascending
    values = np.maximum(values, 0)
    odd = _odd_one(values)
    if odd is None:
        half, sides = np.sqrt(3 * values), 4
    else:
        across = np.sqrt(2 * (values.sum() - values[odd]))
        frame = frame[:, [(odd + 1) % 3, (odd + 2) % 3, odd]]
        half, sides = np.array([across, across, np.sqrt(3 * values[odd])]), _ROUND
    return frame * np.array([1, 1, np.sign(np.linalg.det(frame))]), np.maximum(half, thin / 2), sides


def _hide_inner_faces(robot: Robot, link: int) -> bool:
    """Tell whether a neighbour with more mass fills the same space, in the straight pose."""
    neighbours = [(p, k + 1, np.asarray(robot.anchor[k], float)) for k, p in enumerate(robot.parent)]
    shifts = [(child, shift) for p, child, shift in neighbours if p == link]
    shifts += [(p, -shift) for p, child, shift in neighbours if child == link]
    mine = _spread(robot, link)
    near = 0.01 * np.sqrt(np.trace(mine))
    return any(
        robot.mass[other] > robot.mass[link]
        and np.linalg.norm(robot.com[other] + shift - robot.com[link]) < near
        and np.abs(_spread(robot, other) - mine).max() < 0.02 * np.trace(mine)
        for other, shift in shifts
    )


def _pin(robot: Robot, joint: int, axis: np.ndarray, scale: float) -> Faces:
    """Pin long enough to stick out of the two links of a joint."""
    thin = _THIN * scale
    steps = np.linspace(0, _PIN * scale, 60)
    length = 0.0
    for link, place in ((robot.parent[joint], np.asarray(robot.anchor[joint], float)), (joint + 1, np.zeros(3))):
        joints, axes = _joints(robot, link)
        if len(joints) == 1 and _bent(robot, link, joints[0], axes[0], thin) is not None:
            length = np.inf
            continue
        frame, half, _ = _solid(robot, link, thin)
        line = place - np.asarray(robot.com[link], float) + np.concatenate([steps, -steps])[:, None] * axis
        inside = (np.abs(line @ frame) <= half).all(1).reshape(2, -1)
        length = max(length, np.inf if inside[:, -1].any() else (steps * inside).max())
    if np.isfinite(length):
        return beam(-(length + thin) * axis, (length + thin) * axis, 0.4 * thin, sides=8)
    return beam(-thin * axis, thin * axis, 2 * thin)


def _bent(robot: Robot, link: int, joint: np.ndarray, axis: np.ndarray, thin: float) -> Faces | None:
    """Shank and foot of an end link, or None if one straight part shows it well."""
    com = np.asarray(robot.com[link], float) - joint
    across = com - axis * (axis @ com)
    offset = np.linalg.norm(across)
    about = _spread(robot, link) + np.outer(com, com)
    if offset**4 <= _SIDE * (across @ about @ across):
        return None
    tip = about @ across / offset**2
    if com @ tip >= _BENT * np.linalg.norm(com) * np.linalg.norm(tip):
        return None
    knee = axis * (axis @ tip)
    least = np.sqrt(max(np.linalg.eigvalsh(_spread(robot, link))[0], 0))
    radius = max(min(2 * least, 0.2 * np.linalg.norm(tip - knee)), thin / 2)
    foot = (tip - knee) / np.linalg.norm(tip - knee)
    side = np.cross(axis, foot)
    insert = box(joint + tip, np.stack([side, axis, foot], 1), np.full(3, 1.5 * radius))
    up = np.sign(axis @ tip) * axis * radius
    return np.concatenate([beam(joint, joint + knee + up, radius), beam(joint + knee, joint + tip, radius), insert])


def _spread(robot: Robot, link: int) -> np.ndarray:
    """Second moment of mass about the centre of mass by mass, `(trace(I) / 2 - I) / m` [m^2]; 0 of a massless link."""
    mass = float(robot.mass[link])
    if mass <= 0:
        return np.zeros((3, 3))
    inertia = np.asarray(robot.inertia[link], float)
    inertia = (inertia + inertia.T) / 2
    return (np.trace(inertia) / 2 * np.eye(3) - inertia) / mass


def _odd_one(values: np.ndarray) -> int | None:
    """Of three second moments in order, the one that differs from two that are alike."""
    scale = _LIKE * values[2]
    low, high = values[1] - values[0] <= scale, values[2] - values[1] <= scale
    return None if low == high else 2 if low else 0


def _frame(along: np.ndarray) -> np.ndarray:
    """Right-handed frame with last column `along`."""
    first = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(along, first), along], 1)


def _units(axis: Array) -> np.ndarray:
    vectors = np.asarray(axis, float)
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)

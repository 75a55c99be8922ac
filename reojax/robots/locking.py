"""A joint of a robot held at an angle: two links become one, and what hangs from them turns with it."""

import dataclasses
from typing import Any

import jax
import numpy as np
from numpy.typing import ArrayLike

from reojax._internal.arrays import as_numbers, is_concrete, kind_of_arrays
from reojax._internal.checks import index_of, shorten
from reojax.manoeuvres import Layout
from reojax.mechanics.input_checks import check_robot
from reojax.robot import Robot

_ROUNDING = 1e-9
"""How far beyond a limit an angle may be [rad]: what rounding does to limits in degrees."""


def with_joint_locked(robot: Robot, joint: str | int, angle: ArrayLike = 0.0) -> Robot:
    """Return a copy of any robot with one joint held at an angle, and so one link and one joint less.

    The joint's two links become one body, named as the inner one, with the mass, the inertia (Huygens-Steiner) and the
    capsules of both; its motor stands still, so its rotor has no momentum of its own. The other joints keep their names
    and angles: at any posture momentum is that of the robot as it was, with this joint at `angle`. Joints that are
    coupled to it are held too, where it holds them. A layout that needs the joint is dropped.

    Args:
        robot: the robot.
        joint: the joint, by name or number.
        angle: where it is held [rad]; may be traced.

    Raises:
        ValueError: if there is no such joint, it follows another one, the angle is not finite, or a joint would be held
            outside of its limits.
    """
    check_robot(robot)
    index = index_of("joint", joint, robot.joint_names, "joint")
    for follower, driver in robot.couplings:
        if follower == index:
            name, leader = robot.joint_names[index], robot.joint_names[driver]
            raise ValueError(f"`joint` {name!r} follows {leader!r}; lock {leader!r}, which holds both.")
    value = as_numbers("angle", angle)
    if value.shape or (is_concrete(value) and not np.isfinite(value)):
        raise ValueError(f"`angle` is {shorten(angle)}; it must be one finite number, in rad.")
    held = [(robot.joint_names[index], value)]
    for k, (follower, driver) in enumerate(robot.couplings):
        if driver == index:
            held.append((robot.joint_names[follower], robot.coupling_ratio[k] * value + robot.coupling_offset[k]))
    free = [k for k, (_, driver) in enumerate(robot.couplings) if driver != index]
    robot = dataclasses.replace(
        robot,
        couplings=tuple(robot.couplings[k] for k in free),
        coupling_ratio=robot.coupling_ratio[np.array(free, int)],
        coupling_offset=robot.coupling_offset[np.array(free, int)],
    )
    for name, at in held:
        robot = _lock(robot, robot.joint_names.index(name), at)
    return robot


def _lock(robot: Robot, joint: int, angle: Any) -> Robot:
    """Hold one joint; the frames of all that hangs from it are made parallel to the others again."""
    name = robot.joint_names[joint]
    if is_concrete((angle, robot.lower, robot.upper)):
        low, high = float(robot.lower[joint]), float(robot.upper[joint])
        if not low - _ROUNDING <= angle <= high + _ROUNDING:
            raise ValueError(
                f"joint {name!r} would be held at {angle:.6g} rad; its limits are {low:.6g} to {high:.6g}."
            )
    inner, outer = robot.parent[joint], joint + 1
    links = np.array([i for i in range(robot.links) if i != outer])
    joints = np.array([k for k in range(robot.joints) if k != joint], int)
    place = {int(old): new for new, old in enumerate(joints)}
    number = {int(old): new for new, old in enumerate(links)}
    number[outer] = number[inner]
    carrier = tuple(number[i] for i in robot.capsule_link)
    arrays = _one_body(robot, joint, inner, outer, angle)
    at = f"{float(angle):.6g} rad" if is_concrete(angle) else "a traced angle"
    note = f"locked: joint {name!r:.60} at {at}; merged into link {robot.link_names[inner]!r:.60}: "
    return dataclasses.replace(
        robot,
        **{key: arrays[key][links] for key in ("mass", "com", "inertia")},
        **{key: arrays[key][joints] for key in ("axis", "anchor")},
        **{key: getattr(robot, key)[joints] for key in ("rotor_inertia", "gear_ratio", "lower", "upper")},
        **{key: arrays[key] for key in ("capsule_start", "capsule_end")},
        parent=tuple(number[robot.parent[k]] for k in joints),
        rotor_on=tuple(robot.rotor_on[k] for k in joints),
        link_names=tuple(robot.link_names[i] for i in links),
        joint_names=tuple(robot.joint_names[k] for k in joints),
        capsule_link=carrier,
        collision_pairs=tuple((p, q) for p, q in robot.collision_pairs if carrier[p] != carrier[q]),
        couplings=tuple((place[follower], place[driver]) for follower, driver in robot.couplings),
        layout=_layout(robot.layout, joint, place),
        notes=(*robot.notes, note + robot.link_names[outer][:60]),
    )


def _one_body(robot: Robot, joint: int, inner: int, outer: int, angle: Any) -> dict[str, Any]:
    """Arrays of all links, joints and capsules with `outer` part of `inner`, and all beyond turned by the joint."""
    beyond = {outer}
    for k, parent in enumerate(robot.parent):
        if parent in beyond:
            beyond.add(k + 1)
    link = np.array([i in beyond for i in range(robot.links)])
    jointed = np.array([parent in beyond for parent in robot.parent], bool)
    capsule = np.array([i in beyond for i in robot.capsule_link], bool)
    of_outer = np.array([parent == outer for parent in robot.parent], bool)
    shape_of_outer = np.array([i == outer for i in robot.capsule_link], bool)
    xp, cast = kind_of_arrays(robot, angle)
    mass, com, inertia, axis, anchor = map(cast, (robot.mass, robot.com, robot.inertia, robot.axis, robot.anchor))
    with jax.default_matmul_precision("highest"):  # or a GPU takes 10 bits of float32
        turn = _turn(xp, axis[joint], cast(angle))
        shift = anchor[joint]
        com = xp.where(link[:, None], com @ turn.T, com)
        inertia = xp.where(link[:, None, None], turn @ inertia @ turn.T, inertia)
        axis, turned = xp.where(jointed[:, None], axis @ turn.T, axis), anchor @ turn.T
        anchor = xp.where(jointed[:, None], turned, anchor) + xp.where(of_outer[:, None], shift, 0)
        ends = [xp.where(capsule[:, None], cast(x) @ turn.T, cast(x)) for x in (robot.capsule_start, robot.capsule_end)]
    start, end = (x + xp.where(shape_of_outer[:, None], shift, 0) for x in ends)
    total = mass[inner] + mass[outer]
    other = com[outer] + shift
    centre = (mass[inner] * com[inner] + mass[outer] * other) / xp.where(total > 0, total, 1)
    arm = other - com[inner]
    shared = mass[inner] * mass[outer] / xp.where(total > 0, total, 1)  # Huygens-Steiner about the common centre
    both = inertia[inner] + inertia[outer] + shared * (arm @ arm * np.eye(3, dtype=arm.dtype) - xp.outer(arm, arm))
    here = np.arange(robot.links) == inner
    return {
        "mass": xp.where(here, total, mass),
        "com": xp.where(here[:, None], centre, com),
        "inertia": xp.where(here[:, None, None], both, inertia),
        "axis": axis,
        "anchor": anchor,
        "capsule_start": start,
        "capsule_end": end,
    }


def _turn(xp: Any, axis: Any, angle: Any) -> Any:
    """Rotation (3, 3) by an angle about an axis (Rodrigues)."""
    x, y, z = axis / xp.sqrt((axis * axis).sum())
    zero = xp.zeros_like(x)
    cross = xp.stack([zero, -z, y, z, zero, -x, -y, x, zero]).reshape(3, 3)
    return np.eye(3, dtype=cross.dtype) + xp.sin(angle) * cross + (1 - xp.cos(angle)) * (cross @ cross)


def _layout(layout: Layout | None, joint: int, place: dict[int, int]) -> Layout | None:
    """The layout without one joint; None where it needs it."""
    if layout is None or joint in (*layout.twist, layout.bend, *(layout.fold or ())):
        return None
    first, last = layout.twist
    fold = None if layout.fold is None else (place[layout.fold[0]], place[layout.fold[1]])
    return layout._replace(joints=len(place), twist=(place[first], place[last]), bend=place[layout.bend], fold=fold)

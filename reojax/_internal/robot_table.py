"""A robot as a table for people, and in one line."""

from __future__ import annotations

from typing import Any

import numpy as np

from reojax._internal.arrays import is_concrete

_TOLD = 8
"""Joints that a line names."""


def one_line(robot: Any) -> str:
    """`repr` of a robot: what it is, and what was done to it."""
    joints = list(robot.joint_names)
    more = [f"and {len(joints) - _TOLD} more"] if len(joints) > _TOLD + 1 else []
    named = ", ".join(joints[: _TOLD if more else None] + more) or "none"
    text = f"Robot({robot.name!r:.60}, {robot.links} links, joints {named}"
    if robot.notes:
        told = "; ".join(robot.notes)
        text += f"; {told if len(told) <= 300 else told[:300] + f' ... {len(robot.notes)} notes in all'}"
    return text + ")"


def table(robot: Any) -> str:
    """Links and joints with mass, limits, motors and capsules, then notes."""
    if not is_concrete(robot) or np.ndim(robot.mass) != 1:
        return one_line(robot)  # traced, or many robots in one
    shapes = [sum(link == i for link in robot.capsule_link) for i in range(robot.links)]
    rows: list[tuple[str, ...]] = [
        ("link", "mass kg", "capsules", "joint", "parent", "limits deg", "gear", "rotor kg m^2", "stator on")
    ]
    rows.append((robot.link_names[0], _number(robot.mass[0]), str(shapes[0] or ""), *[""] * 6))
    follows = {joint: driver for joint, driver in robot.couplings}
    for k in range(robot.joints):
        lower, upper = (float(np.rad2deg(limit[k])) for limit in (robot.lower, robot.upper))
        motor = ("", "", "")
        if robot.rotor_inertia[k] or robot.gear_ratio[k] != 1:
            motor = (_number(robot.gear_ratio[k]), _number(robot.rotor_inertia[k]), robot.rotor_on[k])
        name = robot.joint_names[k]
        if k in follows:
            name += f" (follows {robot.joint_names[follows[k]]})"
        rows.append(
            (
                robot.link_names[k + 1],
                _number(robot.mass[k + 1]),
                str(shapes[k + 1] or ""),
                name,
                robot.link_names[robot.parent[k]],
                "none" if np.isinf(lower) and np.isinf(upper) else f"{lower:.4g} .. {upper:.4g}",
                *motor,
            )
        )
    keep = [i for i in range(len(rows[0])) if any(row[i] for row in rows[1:])]
    rows = [tuple(row[i][:36] for i in keep) for row in rows]
    widths = [max(len(row[i]) for row in rows) for i in range(len(keep))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    size = f"{robot.links} links, {robot.joints} joints, {float(np.sum(robot.mass)):.6g} kg"
    head = [f"{robot.name:.60}: {size}"]
    if robot.capsule_link:
        head[0] += f", {len(robot.capsule_link)} capsules in {len(robot.collision_pairs)} pairs to keep apart"
    tail = []
    if robot.layout is not None:
        joints = robot.joint_names
        twist = " and ".join(joints[k] for k in robot.layout.twist)
        tail.append(f"layout: {twist} twist, {joints[robot.layout.bend]} bends")
    for note in robot.notes:
        tail.append(f"note: {note}")
    return "\n".join([*head, "", *lines, *[""] * bool(tail), *tail])


def _number(value: Any) -> str:
    return f"{float(value):.6g}"

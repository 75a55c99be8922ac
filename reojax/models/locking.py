"""What of a robot file does not move: worlds at the root, locked and prismatic joints, followers of what is locked."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from reojax._internal.checks import shorten
from reojax.models.description import Description, JointEntry

MOVING = ("revolute", "continuous")
"""Kinds of joints that a robot keeps."""


def drop_world(
    description: Description, joints: dict[str, JointEntry], lock: Mapping[str, float], base: str | None, notes: list
) -> str:
    """Drop what ties the robot to a world: links without mass at the root, down to the first joint that stays."""
    root = description.root
    while True:
        fixed, front = {root}, [root]
        while front:  # all that is fixed to the root
            link = front.pop()
            for joint in joints.values():
                if joint.parent == link and joint.kind == "fixed" and joint.child not in fixed:
                    fixed.add(joint.child)
                    front.append(joint.child)
        leaving = [n for n, joint in joints.items() if joint.parent in fixed and joint.kind != "fixed"]
        mass = sum(description.links[link].mass for link in fixed)
        if mass > 0 or len(leaving) != 1 or leaving[0] in lock or (base is not None and base in fixed):
            break
        (name,) = leaving
        root = joints[name].child
        notes.append(
            f"dropped at the root: joint {shorten(name)} ({joints[name].kind}) and what is above it, without mass; "
            f"the base is {shorten(root)}"
        )
        for other in [n for n, joint in joints.items() if joint.parent in fixed]:
            del joints[other]
    return root


def held_joints(joints: dict[str, JointEntry], lock: Mapping[str, float], notes: list[str]) -> dict[str, float]:
    """Positions of the joints that do not move."""
    held: dict[str, float] = {}
    for name, joint in joints.items():
        if name in lock:
            value = lock[name]
            if isinstance(value, bool | str) or not np.isreal(value) or not np.isfinite(value):
                raise ValueError(f"`lock[{shorten(name)}]` is {shorten(value)}; it must be a finite number")
            value = float(value)
            if joint.kind in ("floating", "planar", "ball", "fixed") and value:
                raise ValueError(f"`lock[{shorten(name)}]` is {value}; a {joint.kind} joint is held at 0 only")
            if not joint.lower <= value <= joint.upper:
                raise ValueError(
                    f"`lock[{shorten(name)}]` is {value}; the joint's limits are {joint.lower:g} to {joint.upper:g}"
                )
            held[name] = value
            notes.append(f"locked: joint {shorten(name)} at {value!r}")
        elif joint.kind == "fixed":
            held[name] = 0.0
        elif joint.kind == "prismatic":
            held[name] = joint.rest
            notes.append(f"locked: prismatic joint {shorten(name)} at {joint.rest!r} m")
        elif joint.kind not in MOVING:
            raise ValueError(
                f"joint {shorten(name)} is {joint.kind}; only revolute ones move: lock={{{name!r:.60}: 0}} holds it"
            )
    return held


def couple(
    joints: dict[str, JointEntry], held: dict[str, float], lock: Mapping[str, float], notes: list[str]
) -> tuple[dict[str, tuple[str, float, float]], dict[str, float]]:
    """Followers with drivers that follow none, chains composed; followers of held joints are held too."""
    held = dict(held)
    couplings: dict[str, tuple[str, float, float]] = {}
    for name, joint in joints.items():
        if joint.mimic is None or joint.kind == "fixed" or name in lock:
            continue
        driver, ratio, offset = joint.mimic
        if driver not in joints:
            raise ValueError(
                f"joint {shorten(name)} mimics {shorten(driver)}, which is not there: lock={{{name!r:.60}: 0}} holds it"
            )
        seen = {name}
        while driver in joints and driver not in lock and joints[driver].mimic is not None:
            if driver in seen:
                raise ValueError(f"joint {shorten(name)} mimics itself, by way of {shorten(driver)}")
            seen.add(driver)
            further = joints[driver].mimic
            assert further is not None
            driver, ratio, offset = further[0], ratio * further[1], ratio * further[2] + offset
        if driver in seen:
            raise ValueError(f"joint {shorten(name)} mimics itself, by way of {shorten(driver)}")
        if driver in held:
            held[name] = ratio * held[driver] + offset
            notes.append(f"locked: joint {shorten(name)} at {held[name]!r}, which follows {shorten(driver)}")
        elif name not in held:
            couplings[name] = (driver, ratio, offset)
            notes.append(f"coupled: joint {shorten(name)} = {ratio:g} * {shorten(driver)} + {offset:g} rad")
    return couplings, held


def hold_what_carries_nothing(
    description: Description,
    joints: dict[str, JointEntry],
    held: dict[str, float],
    couplings: dict[str, tuple[str, float, float]],
    base: str,
    notes: list[str],
) -> None:
    """Hold joints that move no mass at all, such as grippers that the file draws only: they turn nothing."""
    children: dict[str, list[str]] = {}
    for joint in joints.values():
        children.setdefault(joint.parent, []).append(joint.child)
    idle = []
    for name, joint in joints.items():
        if name in held:
            continue
        below, front = {joint.child}, [joint.child]
        while front:
            for child in children.get(front.pop(), []):
                below.add(child)
                front.append(child)
        links = [description.links[link] for link in below]
        if base not in below and not any(link.mass or link.inertia.any() for link in links):
            idle.append(name)
    for name in idle:
        if all(driver != name or follower in idle for follower, (driver, _, _) in couplings.items()):
            held[name] = joints[name].rest
            couplings.pop(name, None)
            notes.append(f"held at {held[name]!r}: joint {shorten(name)}, which carries no mass")


def check_constraints(
    description: Description, joints: dict[str, JointEntry], held: dict[str, float], group: dict[str, str], notes: list
) -> None:
    """Refuse equality constraints, unless what they tie is held; those on what is dropped are told and left out.

    Raises:
        ValueError: naming the constraint and what it ties.
    """
    for name, kind, links, tied in description.constraints:
        gone = [x for x in links if x not in group] + [x for x in tied if x not in joints]
        if gone:
            notes.append(f"dropped: equality constraint {shorten(name)} ({kind}), whose {shorten(gone[0])} is dropped")
        elif len({group[link] for link in links}) <= 1 and all(joint in held for joint in tied):
            notes.append(f"met by locking: equality constraint {shorten(name)} ({kind})")
        else:
            between = shorten(", ".join((*links, *tied)))
            raise ValueError(
                f"equality constraint {shorten(name)} ({kind}) ties {between}; a robot here is a tree: lock the joints "
                "that it ties"
            )

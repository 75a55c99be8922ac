"""From what a file says to a robot: joints locked, links merged, the root chosen, all frames parallel at rest.

Merging comes first, checks after: a frame without mass, or a half of a body that no body can be, counts only in sum.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from reojax._internal.checks import shorten
from reojax._internal.definiteness import turn_about
from reojax.models.description import Description, JointEntry, Shape, ball_as_hinges
from reojax.models.locking import check_constraints, couple, drop_world, held_joints, hold_what_carries_nothing
from reojax.models.motors import motors


class Reduced(NamedTuple):
    """A robot's numbers, in its own frames, and the shapes of its links."""

    fields: dict[str, Any]
    """Arguments of `make_robot`."""
    shapes: list[tuple[int, str, Shape]]
    """Link, name of the file's link, and shape in the frame of the robot's link."""
    notes: list[str]


_Row = tuple[str, str, str, bool]
"""Joint, inner group, outer group, and whether it is turned round because the base lies on its child's side."""


class _Pose(NamedTuple):
    rotation: np.ndarray
    position: np.ndarray

    def then(self, rotation: np.ndarray, position: np.ndarray) -> "_Pose":
        return _Pose(self.rotation @ rotation, self.position + self.rotation @ position)


def reduce(
    description: Description,
    *,
    base: str | None,
    lock: Mapping[str, float],
    gear_ratio: Mapping[str, float],
    rotor_inertia: Mapping[str, float],
) -> Reduced:
    """Lock, merge, choose the root, and turn all frames parallel.

    Raises:
        ValueError: naming the joint, link or constraint that stands in the way.
    """
    notes = list(description.notes)
    description = _without_balls(description, lock, notes)
    for entry, given in (("lock", lock), ("gear_ratio", gear_ratio), ("rotor_inertia", rotor_inertia)):
        for name in given:
            if name not in description.joints:
                raise ValueError(f"`{entry}` names {shorten(name)}; {_known(description)}")
    if base is not None and base not in description.links:
        listed = shorten(", ".join(description.links))
        raise ValueError(f"`base` is {shorten(base)}; the links are {listed}")
    joints = dict(description.joints)
    root = drop_world(description, joints, lock, base, notes)
    held = held_joints(joints, lock, notes)
    couplings, held = couple(joints, held, lock, notes)
    hold_what_carries_nothing(description, joints, held, couplings, base or root, notes)
    group = _groups(description, joints, held, root, notes)
    check_constraints(description, joints, held, group, notes)
    pose = _poses(joints, held, root)
    base_link = root if base is None else base
    if base_link not in pose:
        raise ValueError(f"`base` is {shorten(base_link)}, which belongs to what is dropped at the root")
    order = _order(joints, held, group, group[base_link])
    return _numbers(description, joints, pose, group, base_link, order, couplings, gear_ratio, rotor_inertia, notes)


def _without_balls(description: Description, lock: Mapping[str, float], notes: list[str]) -> Description:
    """Every ball joint that is not locked as three hinges."""
    links, joints = dict(description.links), {}
    for name, joint in description.joints.items():
        if joint.kind != "ball" or name in lock:
            joints[name] = joint
            continue
        between, hinges = ball_as_hinges(name, joint)
        if taken := (between.keys() & links.keys()) | (hinges.keys() & description.joints.keys()):
            raise ValueError(
                f"ball joint {shorten(name)} becomes three hinges; the name {shorten(min(taken))} is taken"
            )
        links |= between
        joints |= hinges
        notes.append(f"ball joint {shorten(name)} as three hinges about x, y and z: {shorten(', '.join(hinges))[1:-1]}")
    return description._replace(links=links, joints=joints)


def _known(description: Description) -> str:
    return f"the joints are {shorten(', '.join(description.joints))}" if description.joints else "there are no joints"


def _groups(
    description: Description, joints: dict[str, JointEntry], held: dict[str, float], root: str, notes: list[str]
) -> dict[str, str]:
    """The link nearest the root that each link is rigidly tied to."""
    children: dict[str, list[tuple[str, str]]] = {}
    for name, joint in joints.items():
        children.setdefault(joint.parent, []).append((name, joint.child))
    group, front = {root: root}, [root]
    while front:
        link = front.pop()
        for name, child in children.get(link, []):
            group[child] = group[link] if name in held else child
            front.append(child)
    merged: dict[str, list[str]] = {}
    for link in description.links:
        if link in group and group[link] != link:
            merged.setdefault(group[link], []).append(link)
    notes += [f"merged into link {shorten(into)}: {shorten(', '.join(links))[1:-1]}" for into, links in merged.items()]
    return group


def _poses(joints: dict[str, JointEntry], held: dict[str, float], root: str) -> dict[str, _Pose]:
    """Pose of each link in the root's frame, moving joints at zero, the others where they are held."""
    children: dict[str, list[str]] = {}
    for name, joint in joints.items():
        children.setdefault(joint.parent, []).append(name)
    pose, front = {root: _Pose(np.eye(3), np.zeros(3))}, [root]
    while front:
        link = front.pop()
        for name in children.get(link, []):
            joint = joints[name]
            here = pose[link].then(joint.rotation, joint.position)
            value = held.get(name, 0.0)
            if joint.kind == "prismatic":
                here = here.then(np.eye(3), value * joint.axis)
            elif value:
                turn = turn_about(joint.axis, value)
                here = here.then(turn, joint.point - turn @ joint.point)
            pose[joint.child] = here
            front.append(joint.child)
    return pose


def _order(joints: dict[str, JointEntry], held: dict[str, float], group: dict[str, str], base: str) -> list[_Row]:
    """Moving joints, each after the joint that carries its inner link, else as the file has them."""
    waiting = {
        name: (group[joint.parent], group[joint.child])
        for name, joint in joints.items()
        if name not in held and joint.parent in group
    }
    placed, order = {base}, []
    while waiting:
        for name, (inner, outer) in waiting.items():
            if inner in placed or outer in placed:
                turned = outer in placed
                order.append((name, outer, inner, True) if turned else (name, inner, outer, False))
                placed |= {inner, outer}
                del waiting[name]
                break
    return order


class _Placed(NamedTuple):
    """A link of the file in the robot."""

    link: str
    number: int
    """Of the robot's link that it is part of."""
    pose: _Pose
    """In that link's frame, parallel to the base link's."""


def _numbers(
    description: Description,
    joints: dict[str, JointEntry],
    pose: dict[str, _Pose],
    group: dict[str, str],
    base: str,
    order: list[_Row],
    couplings: dict[str, tuple[str, float, float]],
    gear_ratio: Mapping[str, float],
    rotor_inertia: Mapping[str, float],
    notes: list[str],
) -> Reduced:
    """All numbers in frames parallel to the base link's, each link's origin on its joint."""
    home = pose[base]
    seen = {
        link: _Pose(home.rotation.T @ here.rotation, home.rotation.T @ (here.position - home.position))
        for link, here in pose.items()
    }
    names = [group[base], *(outer for _, _, outer, _ in order)]
    number = {link: i for i, link in enumerate(names)}
    tree, origin = _tree(joints, seen, number, order)
    placed = []
    for link in (link for link in description.links if link in group):
        i, here = number[group[link]], seen[link]
        placed.append(_Placed(link, i, here._replace(position=here.position - origin[i])))
    moving = [name for name, *_ in order]
    ratios, rotors = motors(moving, joints, gear_ratio, rotor_inertia, notes)
    fields = {
        **_masses(description, placed, len(names)),
        **tree,
        "gear_ratio": ratios,
        "rotor_inertia": rotors,
        "rotor_on": ["child" if turned else "parent" for _, _, _, turned in order],
        "lower": [joints[name].lower for name in moving],
        "upper": [joints[name].upper for name in moving],
        "link_names": [base, *names[1:]],
        "joint_names": moving,
        "couplings": couplings,
    }
    outside = [name for name in moving if not joints[name].lower <= 0 <= joints[name].upper]
    if outside:
        notes.append(f"theta = 0 is outside of the limits of {shorten(', '.join(outside))[1:-1]}")
    return Reduced(fields, _shapes(description, placed), notes)


def _tree(
    joints: dict[str, JointEntry], seen: dict[str, _Pose], number: dict[str, int], order: list[_Row]
) -> tuple[dict[str, Any], list[np.ndarray]]:
    """Axes, anchors and parents of the joints, and the origin of each link in the base link's frame."""
    origin = [np.zeros(3)]
    axis, anchor, parent = [], [], []
    for name, inner, _, turned in order:
        joint = joints[name]
        child = seen[joint.child]
        point = child.position + child.rotation @ joint.point
        axis.append(child.rotation @ joint.axis * (-1 if turned else 1))
        anchor.append(point - origin[number[inner]])
        parent.append(number[inner])
        origin.append(point)
    fields = {"axis": np.array(axis).reshape(-1, 3), "anchor": np.array(anchor).reshape(-1, 3), "parent": parent}
    return fields, origin


def _masses(description: Description, placed: list[_Placed], links: int) -> dict[str, np.ndarray]:
    """Mass, centre of mass and inertia about it of the robot's links, summed over what each is made of."""
    mass, first, second = np.zeros(links), np.zeros((links, 3)), np.zeros((links, 3, 3))
    for link, i, pose in placed:
        entry = description.links[link]
        mass[i] += entry.mass
        first[i] += entry.mass * (pose.position + pose.rotation @ entry.com)
    com = np.divide(first, mass[:, None], out=np.zeros_like(first), where=mass[:, None] > 0)
    for link, i, pose in placed:
        entry = description.links[link]
        arm = pose.position + pose.rotation @ entry.com - com[i]
        # turned into the link's frame, and moved to the common centre (Steiner)
        second[i] += pose.rotation @ entry.inertia @ pose.rotation.T
        second[i] += entry.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return {"mass": mass, "com": com, "inertia": second}


def _shapes(description: Description, placed: list[_Placed]) -> list[tuple[int, str, Shape]]:
    """The shapes of all links, in the frames of the robot's."""
    shapes = []
    for link, i, pose in placed:
        for shape in description.links[link].shapes:
            here = pose.then(shape.rotation, shape.position)
            shapes.append((i, link, shape._replace(rotation=here.rotation, position=here.position)))
    return shapes

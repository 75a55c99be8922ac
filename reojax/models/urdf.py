"""URDF by the standard library's parser, which here takes no DTD: no entities, no files, no network."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np

from reojax._internal.checks import shorten
from reojax.models.description import Description, JointEntry, LinkEntry, Shape, rotation_of_rpy

KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical")
"""Types of joints; the last is Bullet's."""

_UNLIMITED = 1e4
"""Limits from here on are a file's way to say that there are none [rad or m]."""


class _NoDoctype(ElementTree.TreeBuilder):
    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise ValueError("it has a DTD, which a robot file needs not; nothing that it could define or fetch is read")


def parse_xml(data: bytes) -> ElementTree.Element:
    """Root of an XML document.

    Raises:
        ValueError: saying what is wrong, for what is no XML or has a DTD.
    """
    try:
        return ElementTree.fromstring(data, parser=ElementTree.XMLParser(target=_NoDoctype()))
    except ElementTree.ParseError as error:
        raise ValueError(f"it is no XML: {error}") from None
    except LookupError as error:
        raise ValueError(f"its encoding is unknown: {error}") from None


def read_urdf(root: ElementTree.Element) -> Description:
    """What a URDF says.

    Raises:
        ValueError: naming the link or joint, and what is wrong.
    """
    for element in root.iter():
        if "ros.org/wiki/xacro" in element.tag or element.tag.startswith("xacro:"):
            raise ValueError("it has xacro elements: run it through xacro first")
    notes: list[str] = []
    links: dict[str, LinkEntry] = {}
    for element in root.iterfind("link"):
        name = _name(element, "link", links)
        links[name] = _link(element, f"link {shorten(name)}", notes)
    if not links:
        raise ValueError("it has no links")
    gears = dict(_reductions(root, notes))
    joints: dict[str, JointEntry] = {}
    for element in root.iterfind("joint"):
        name = _name(element, "joint", joints)
        joints[name] = _joint(element, name, links, gears.get(name, 1.0), notes)
    for name in gears:
        if name not in joints:
            notes.append(f"a transmission names a joint {shorten(name)} that is not there")
    return Description(root.get("name") or "robot", links, joints, find_root(links, joints), (), tuple(notes))


def find_root(links: dict[str, LinkEntry], joints: dict[str, JointEntry]) -> str:
    """The link that no joint carries.

    Raises:
        ValueError: if the links are no tree.
    """
    carrier: dict[str, str] = {}
    for name, joint in joints.items():
        if joint.child in carrier:
            raise ValueError(
                f"link {shorten(joint.child)} hangs from two joints, {shorten(carrier[joint.child])} and "
                f"{shorten(name)}; a robot here is a tree, without loops"
            )
        carrier[joint.child] = name
    roots = [name for name in links if name not in carrier]
    if not roots:
        raise ValueError("its links form a loop: every link hangs from another one")
    if len(roots) > 1:
        listed = shorten(", ".join(roots))
        raise ValueError(f"it has {len(roots)} links that hang from none ({listed}); a robot has one")
    reached, front = set(roots), list(roots)
    children: dict[str, list[str]] = {}
    for joint in joints.values():
        children.setdefault(joint.parent, []).append(joint.child)
    while front:
        for child in children.get(front.pop(), []):
            reached.add(child)
            front.append(child)
    if len(reached) < len(links):
        lost = shorten(", ".join(sorted(set(links) - reached)))
        raise ValueError(f"links {lost} form a loop that the root does not reach")
    return roots[0]


def _name(element: ElementTree.Element, what: str, taken: dict) -> str:
    name = element.get("name")
    if not name:
        raise ValueError(f"a {what} has no name")
    if name in taken:
        raise ValueError(f"two {what}s are named {shorten(name)}")
    return name


def _number(where: str, text: str | None, default: float | None = None) -> float:
    if text is None:
        if default is None:
            raise ValueError(f"{where} is missing")
        return default
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"{where} is {shorten(text)}; it must be a number") from None
    if math.isnan(value):
        raise ValueError(f"{where} is {shorten(text)}; it must be a number")
    return value


def _finite(where: str, text: str | None, default: float | None = None) -> float:
    value = _number(where, text, default)
    if not math.isfinite(value):
        raise ValueError(f"{where} is {value}; it must be finite")
    return value


def _vector(where: str, text: str | None, default: tuple[float, ...]) -> np.ndarray:
    if text is None:
        return np.array(default)
    words = text.split()
    if len(words) != len(default):
        raise ValueError(f"{where} is {shorten(text)}; it must be {len(default)} numbers")
    return np.array([_finite(where, word) for word in words])


def _origin(element: ElementTree.Element | None, where: str) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and position of an `<origin>` child."""
    origin = None if element is None else element.find("origin")
    if origin is None:
        return np.eye(3), np.zeros(3)
    rpy = _vector(f"{where}: rpy", origin.get("rpy"), (0.0, 0.0, 0.0))
    return rotation_of_rpy(*rpy), _vector(f"{where}: xyz", origin.get("xyz"), (0.0, 0.0, 0.0))


def _link(element: ElementTree.Element, where: str, notes: list[str]) -> LinkEntry:
    shapes = tuple(_shapes(element, where, notes))
    inertial = element.find("inertial")
    if inertial is None:
        return LinkEntry(0.0, np.zeros(3), np.zeros((3, 3)), shapes)
    rotation, position = _origin(inertial, f"{where}: inertial")
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    weight = _finite(f"{where}: mass", None if mass is None else mass.get("value"), 0.0)
    if weight < 0:
        raise ValueError(f"{where}: mass is {weight} kg; it must not be negative")
    entry = {key: 0.0 for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
    if tensor is not None:
        entry = {key: _finite(f"{where}: {key}", tensor.get(key), 0.0) for key in entry}
    xx, xy, xz, yy, yz, zz = entry.values()
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return LinkEntry(weight, position, rotation @ matrix @ rotation.T, shapes)


def _shapes(element: ElementTree.Element, where: str, notes: list[str]) -> Iterator[Shape]:
    for collision in element.iterfind("collision"):
        for found in collision.findall("geometry/*"):
            try:
                kind, size, file = found.tag, *_size(found, where)
                yield Shape(kind, size, *_origin(collision, f"{where}: collision"), file)
            except ValueError as error:  # a robot turns without it
                notes.append(f"shape left out: {error}")


def _size(shape: ElementTree.Element, where: str) -> tuple[tuple[float, ...], str]:
    if shape.tag == "sphere":
        return (_finite(f"{where}: radius", shape.get("radius")),), ""
    if shape.tag in ("cylinder", "capsule"):
        length = _finite(f"{where}: length", shape.get("length"))
        return (_finite(f"{where}: radius", shape.get("radius")), length / 2), ""
    if shape.tag == "box":
        return tuple(_vector(f"{where}: box size", shape.get("size"), (0.0, 0.0, 0.0)) / 2), ""
    if shape.tag == "mesh":
        return tuple(_vector(f"{where}: mesh scale", shape.get("scale"), (1.0, 1.0, 1.0))), shape.get("filename") or ""
    return (), ""


def _joint(
    element: ElementTree.Element, name: str, links: dict[str, LinkEntry], gear: float, notes: list[str]
) -> JointEntry:
    where = f"joint {shorten(name)}"
    kind: Any = element.get("type")
    if kind not in KINDS:
        raise ValueError(f"{where} has the type {shorten(kind)}; the types are {', '.join(KINDS)}")
    ends = {}
    for end in ("parent", "child"):
        found = element.find(end)
        link = None if found is None else found.get("link")
        if link not in links:
            raise ValueError(f"{where} has the {end} {shorten(link)}; there is no such link")
        ends[end] = link
    rotation, position = _origin(element, where)
    axis = np.array([1.0, 0.0, 0.0])
    found = element.find("axis")
    if kind in ("revolute", "continuous", "prismatic", "planar") and found is not None:
        axis = _vector(f"{where}: axis", found.get("xyz"), (1.0, 0.0, 0.0))
        length = np.linalg.norm(axis)
        if not length > 0:
            raise ValueError(f"{where}: axis is {axis.tolist()}; it must point somewhere")
        axis = axis / length
    lower, upper = _limits(element.find("limit"), kind, where, notes)
    mimic = None
    follower = element.find("mimic")
    if follower is not None:
        mimic = (
            follower.get("joint") or "",
            _finite(f"{where}: mimic multiplier", follower.get("multiplier"), 1.0),
            _finite(f"{where}: mimic offset", follower.get("offset"), 0.0),
        )
    rest = min(max(0.0, lower), upper)
    zero = np.zeros(3)
    kind = "ball" if kind == "spherical" else kind
    return JointEntry(
        kind, ends["parent"], ends["child"], rotation, position, axis, zero, lower, upper, mimic, gear, 0.0, rest
    )


def _limits(limit: ElementTree.Element | None, kind: str, where: str, notes: list[str]) -> tuple[float, float]:
    if kind not in ("revolute", "prismatic"):
        return -np.inf, np.inf
    if limit is None or (limit.get("lower") is None and limit.get("upper") is None):
        notes.append(f"{where} has no limits in the file: taken as unlimited")
        return -np.inf, np.inf
    lower = _number(f"{where}: lower", limit.get("lower"), 0.0)  # URDF's own default
    upper = _number(f"{where}: upper", limit.get("upper"), 0.0)
    if lower >= upper:
        notes.append(f"{where} has limits {lower:g} to {upper:g} in the file, which leave no room: taken as unlimited")
        return -np.inf, np.inf
    if max(-lower, upper) >= _UNLIMITED:
        notes.append(f"{where} has limits {lower:g} to {upper:g} in the file: beyond {_UNLIMITED:g} taken as unlimited")
        lower, upper = (x if abs(x) < _UNLIMITED else np.copysign(np.inf, x) for x in (lower, upper))
    return lower, upper


def _reductions(root: ElementTree.Element, notes: list[str]) -> Iterator[tuple[str, float]]:
    """Joint and reduction of each transmission that has both."""
    for transmission in root.iterfind("transmission"):
        joint = transmission.find("joint")
        reduction = transmission.find(".//mechanicalReduction")
        if joint is None or not joint.get("name") or reduction is None or not (reduction.text or "").strip():
            continue
        name = joint.get("name") or ""
        where = f"joint {shorten(name)}: mechanicalReduction"
        try:
            value = _finite(where, (reduction.text or "").strip())
        except ValueError as error:
            notes.append(f"{error}: taken as 1")
            continue
        if value == 0:
            notes.append(f"{where} is 0: taken as 1")
            continue
        yield name, value

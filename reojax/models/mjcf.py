"""MJCF by MuJoCo's own compiler (extra `models`): includes, defaults and inertias from geoms are as MuJoCo has them."""

# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np

from reojax._internal.checks import shorten
from reojax._internal.definiteness import turn_about
from reojax.models.description import Description, JointEntry, Kind, LinkEntry, Shape, rotation_of_quaternion
from reojax.models.mjcf_compile import compile_mjcf
from reojax.models.mjcf_constraints import constraints_of

_CAREFUL = ("balanceinertia", "settotalmass")
"""Settings of a file that change its inertias: told."""


def read_mjcf(path: str | os.PathLike[str], root: ElementTree.Element, base: str | None) -> Description:
    """What an MJCF says of one of its trees: the one with `base`, else the one with the most hinges.

    Raises:
        ValueError: with MuJoCo's own words, if it does not take the file.
        ImportError: saying what to install.
    """
    notes: list[str] = []
    model = compile_mjcf(path, notes)
    for setting in root.iter("compiler"):
        notes += [f"the file sets {key}={setting.get(key)!r}" for key in _CAREFUL if setting.get(key) is not None]
    bodies = _names(model, "body", model.nbody)
    joints = _names(model, "joint", model.njnt)
    tree = _choose(model, bodies, base, notes)
    gears = _gears(model, joints, notes)
    links: dict[str, LinkEntry] = {}
    entries: dict[str, JointEntry] = {}
    for i in tree:
        links[bodies[i]] = _link(model, i)
        if i != tree[0]:
            _hang(model, i, bodies, joints, gears, links, entries, notes)
    constraints = tuple(constraints_of(model, bodies, joints, notes))
    if model.ntendon:
        notes.append(f"left out: {model.ntendon} tendons; a robot here has joint motors only")
    return Description(root.get("model") or "robot", links, entries, bodies[tree[0]], constraints, tuple(notes))


def _names(model: Any, what: str, count: int) -> list[str]:
    """Names of bodies or joints; those without one get their number."""
    names = [getattr(model, what)(i).name for i in range(count)]
    return [name or _free(f"{what}{i}", names) for i, name in enumerate(names)]


def _free(name: str, taken: Any) -> str:
    while name in taken:
        name += "_"
    return name


def _joints_of(model: Any, body: int) -> range:
    return range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])


def _choose(model: Any, bodies: list[str], base: str | None, notes: list[str]) -> list[int]:
    """Numbers of the bodies of one tree, the root first."""
    trees: dict[int, list[int]] = {}
    for i in range(1, model.nbody):
        trees.setdefault(int(model.body_rootid[i]), []).append(i)
    if not trees:
        raise ValueError("it has no bodies")
    hinges = {root: sum(int(model.body_jntnum[i]) for i in tree[1:]) for root, tree in trees.items()}
    chosen = max(trees, key=lambda root: (hinges[root], sum(model.body_mass[i] for i in trees[root])))
    if base is not None:
        within = [root for root, tree in trees.items() if base in {bodies[i] for i in tree}]
        if not within:
            raise ValueError(f"`base` is {shorten(base)}; the links are {shorten(', '.join(bodies[1:]))}")
        (chosen,) = within
    if others := [bodies[root] for root in trees if root != chosen]:
        notes.append(f"dropped: bodies of the world beside {bodies[chosen]!r}: {shorten(', '.join(others))[1:-1]}")
    if own := _joints_of(model, chosen):
        names = ", ".join(model.joint(j).name or f"joint{j}" for j in own)
        notes.append(f"dropped at the root: joints between the world and {bodies[chosen]!r}: {shorten(names)[1:-1]}")
    return trees[chosen]


def _link(model: Any, body: int) -> LinkEntry:
    turn = rotation_of_quaternion(model.body_iquat[body])
    inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
    shapes = tuple(_shapes(model, body))
    return LinkEntry(float(model.body_mass[body]), np.array(model.body_ipos[body]), inertia, shapes)


def _shapes(model: Any, body: int) -> Iterator[Shape]:
    import mujoco

    kinds = {
        mujoco.mjtGeom.mjGEOM_SPHERE: "sphere",
        mujoco.mjtGeom.mjGEOM_CAPSULE: "capsule",
        mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinder",
        mujoco.mjtGeom.mjGEOM_ELLIPSOID: "ellipsoid",
        mujoco.mjtGeom.mjGEOM_BOX: "box",
        mujoco.mjtGeom.mjGEOM_MESH: "mesh",
    }
    for g in range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body]):
        if not (model.geom_contype[g] or model.geom_conaffinity[g]):
            continue  # a picture only
        kind = kinds.get(mujoco.mjtGeom(int(model.geom_type[g])), "other")
        size, vertices, faces = tuple(float(x) for x in model.geom_size[g]), None, None
        if kind == "sphere":
            size = size[:1]
        elif kind in ("capsule", "cylinder"):
            size = size[:2]
        elif kind == "mesh":
            mesh = int(model.geom_dataid[g])
            first = int(model.mesh_vertadr[mesh])
            vertices = np.array(model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])], float)
            first = int(model.mesh_faceadr[mesh])
            faces = np.array(model.mesh_face[first : first + int(model.mesh_facenum[mesh])])
            size = (1.0, 1.0, 1.0)
        turn = rotation_of_quaternion(model.geom_quat[g])
        yield Shape(kind, size, turn, np.array(model.geom_pos[g]), "", vertices, faces)


def _hang(
    model: Any,
    body: int,
    bodies: list[str],
    joints: list[str],
    gears: dict[int, float],
    links: dict[str, LinkEntry],
    entries: dict[str, JointEntry],
    notes: list[str],
) -> None:
    """The joints of a body, one after the other, with links without mass between them."""
    rotation, position = rotation_of_quaternion(model.body_quat[body]), np.array(model.body_pos[body])
    parent, name = bodies[model.body_parentid[body]], bodies[body]
    nothing = LinkEntry(0.0, np.zeros(3), np.zeros((3, 3)))
    own = list(_joints_of(model, body))
    if not own:
        fixed = _free(f"{parent} to {name}", (*entries, *joints))
        zero = np.zeros(3)
        entries[fixed] = JointEntry("fixed", parent, name, rotation, position, np.array([0, 0, 1.0]), zero)
    for j in own:
        child = name
        if j != own[-1]:
            child = _free(f"{name}_{joints[j]}", (*links, *bodies))
            links[child] = nothing
        entries[joints[j]] = _joint(model, j, parent, child, rotation, position, gears, joints[j], notes)
        parent, rotation, position = child, np.eye(3), np.zeros(3)


def _joint(
    model: Any,
    j: int,
    parent: str,
    child: str,
    rotation: np.ndarray,
    position: np.ndarray,
    gears: dict[int, float],
    name: str,
    notes: list[str],
) -> JointEntry:
    import mujoco

    kinds: dict[Any, Kind] = {
        mujoco.mjtJoint.mjJNT_HINGE: "revolute",
        mujoco.mjtJoint.mjJNT_SLIDE: "prismatic",
        mujoco.mjtJoint.mjJNT_BALL: "ball",
    }
    kind = kinds[mujoco.mjtJoint(int(model.jnt_type[j]))]
    axis, point = np.array(model.jnt_axis[j]), np.array(model.jnt_pos[j])
    lower, upper, rest = -np.inf, np.inf, 0.0
    if model.jnt_limited[j]:
        lower, upper = (float(x) for x in model.jnt_range[j])
        if kind == "ball":
            lower = -upper
        if lower >= upper:
            notes.append(f"joint {shorten(name)} has limits {lower:g} to {upper:g}, which leave no room: taken as none")
            lower, upper = -np.inf, np.inf
    if kind != "ball":  # the file's pose is that of the position `ref`; ours is that of 0
        rest = float(model.qpos0[model.jnt_qposadr[j]])
        if kind == "revolute" and rest:
            back = turn_about(axis / np.linalg.norm(axis), -rest)
            position = position + rotation @ (point - back @ point)
            rotation = rotation @ back
        elif rest:
            position = position - rest * (rotation @ axis)
    return JointEntry(
        kind,
        parent,
        child,
        rotation,
        position,
        axis / np.linalg.norm(axis),
        point,
        lower,
        upper,
        None,
        gears.get(j, 1.0),
        float(model.dof_armature[model.jnt_dofadr[j]]),
        rest,
    )


def _gears(model: Any, joints: list[str], notes: list[str]) -> dict[int, float]:
    """Gear of the actuators on each joint, where they agree."""
    import mujoco

    on_joint = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    found: dict[int, set[float]] = {}
    for a in range(model.nu):
        if int(model.actuator_trntype[a]) in on_joint:
            found.setdefault(int(model.actuator_trnid[a, 0]), set()).add(float(model.actuator_gear[a, 0]))
    gears = {}
    for j, values in found.items():
        if len(values) > 1:
            notes.append(f"actuators of joint {shorten(joints[j])} have different gears: taken as 1")
        elif 0.0 not in values:
            gears[j] = values.pop()
    return gears

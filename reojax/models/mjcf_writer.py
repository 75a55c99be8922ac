"""A robot as MJCF, with a path or a motion as keyframes: MuJoCo opens the same robot and shows the same turn.

**Rotors are bodies of their own**, since MuJoCo's armature has inertia but no angular momentum: a flat disc at the
stator link's centre of mass, on a hinge along the joint's axis, tied to the joint by an equality constraint at the gear
ratio; the link loses exactly the inertia that the disc has. With that MuJoCo's angular momentum is `A omega -
B theta_dot`, rotors included. (In forward dynamics the tie is as stiff as MuJoCo's constraints are; keyframes have it
exactly.)

A free joint carries the base, there is no gravity, and capsules are geoms that touch nothing. The centre of mass of a
replay stays where it is at the start, as in free fall without a push.
"""

from __future__ import annotations

import os
from typing import Any
from xml.etree import ElementTree

import jax
import numpy as np

from reojax._internal import checks
from reojax._internal.arrays import is_concrete
from reojax._internal.files import check_ending, replacing
from reojax.mechanics.holonomy import rotation_history
from reojax.mechanics.kinematics import centre_of_mass
from reojax.path import Path, polygon
from reojax.robot import Robot
from reojax.so3 import to_quaternion

_LEAST = 1e-12
"""Share of the robot's mass and inertia that MuJoCo is given for a link that has none: it wants some in every body."""
_DISC = 1e-9
"""Mass of a rotor's disc, as a share of the robot's; the inertia is what counts."""
_COLOURS = ("0.35 0.45 0.60 1", "0.85 0.55 0.25 1", "0.55 0.65 0.45 1", "0.70 0.50 0.65 1")


def write_mjcf(
    robot: Robot, path: str | os.PathLike[str], motion: Any = None, *, samples: int = 24, rotors: bool = True
) -> None:
    """Write a robot for MuJoCo, and a path or a motion of it as a replay in keyframes.

    The file has a free joint at the base, no gravity and no contacts. Keyframe i is named "replay{i}"; those of a
    motion carry its times, those of a path count the edges. Joint angles are the robot's, the base's quaternion is
    `rotation_history` (w, x, y, z), and its position keeps the robot's centre of mass in place, the base's origin at
    the start being the world's.

    Args:
        robot: the robot.
        path: file to write, ending in .xml or .mjcf.
        motion: a `Path`, waypoints (v, j) [rad], something with `waypoints` such as a plan (one run of it), or
            something with `time` (m,) [s], `theta` (m, j) and `rotation` (m, 3, 3) such as a `Motion`; default none.
        samples: keyframes per edge of a path.
        rotors: write rotors as bodies tied to their joints; otherwise leave them out, and their momentum with them.

    Raises:
        ValueError: naming the entry; or the joint whose rotor has more inertia than its link.
    """
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    checks.whole("samples", samples, 1, 10**6)
    checks.on_host("robot", robot, "write_mjcf")
    target = check_ending(path, "model for MuJoCo", ("xml", "mjcf"))
    checks.whole("samples", samples)
    text = mjcf_text(robot, motion, samples=samples, rotors=rotors)
    with replacing(target) as file:
        file.write(text.encode())


def mjcf_text(robot: Robot, motion: Any = None, *, samples: int = 24, rotors: bool = True) -> str:
    """What `write_mjcf` writes."""
    robot = jax.tree.map(lambda leaf: np.asarray(leaf, np.float64), robot)
    discs = _discs(robot) if rotors else {}
    root = ElementTree.Element("mujoco", model=robot.name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    option = ElementTree.SubElement(root, "option", gravity="0 0 0", timestep="0.001")
    ElementTree.SubElement(option, "flag", contact="disable")
    world = ElementTree.SubElement(root, "worldbody")
    ElementTree.SubElement(world, "light", pos="0 0 10", dir="0 0 -1", directional="true")
    order = _bodies(robot, world, discs)
    equal = ElementTree.SubElement(root, "equality")
    for (joint, driver), ratio, offset in zip(
        robot.couplings, robot.coupling_ratio, robot.coupling_offset, strict=True
    ):
        _tie(equal, robot.joint_names[joint], robot.joint_names[driver], float(ratio), float(offset))
    for k, (_, _, _, spin) in discs.items():
        _tie(equal, _rotor(robot, k), robot.joint_names[k], spin, 0.0)
    if motion is not None:
        _keyframes(ElementTree.SubElement(root, "keyframe"), robot, motion, samples, order, discs)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _numbers(values: Any) -> str:
    """Digits that read back as the same numbers."""
    return " ".join(repr(float(value)) for value in np.ravel(values))


def _rotor(robot: Robot, k: int) -> str:
    return f"{robot.joint_names[k]} rotor"


def _discs(robot: Robot) -> dict[int, tuple[int, float, np.ndarray, float]]:
    """Of each joint with a rotor: stator's link, mass and inertia of the disc, turns per turn of the joint."""
    discs = {}
    for k, (parent, side) in enumerate(zip(robot.parent, robot.rotor_on, strict=True)):
        if robot.rotor_inertia[k] > 0 and robot.gear_ratio[k]:
            axis = robot.axis[k] / np.linalg.norm(robot.axis[k])
            flat = 0.5 * (1 + 1e-9)  # a plate's transverse moments are half the axial one
            inertia = robot.rotor_inertia[k] * ((1 - flat) * np.outer(axis, axis) + flat * np.eye(3))
            spin = float(robot.gear_ratio[k]) * (1 if side == "parent" else -1)
            link = parent if side == "parent" else k + 1
            discs[k] = (link, _DISC * float(robot.mass.sum()), inertia, spin)
    return discs


def _bodies(robot: Robot, world: ElementTree.Element, discs: dict) -> list[tuple[str, int]]:
    """Write the tree; return the hinges in MuJoCo's order, each with its kind and its joint's number."""
    order: list[tuple[str, int]] = []
    children: dict[int, list[int]] = {}
    for k, parent in enumerate(robot.parent):
        children.setdefault(parent, []).append(k)

    def write(link: int, above: ElementTree.Element, joint: int | None) -> None:
        place = np.zeros(3) if joint is None else robot.anchor[joint]
        body = ElementTree.SubElement(above, "body", name=robot.link_names[link], pos=_numbers(place))
        if joint is None:
            ElementTree.SubElement(body, "freejoint", name="free")
        else:
            hinge = {"name": robot.joint_names[joint], "type": "hinge", "axis": _numbers(robot.axis[joint])}
            lower, upper = robot.lower[joint], robot.upper[joint]
            if np.isfinite(lower) or np.isfinite(upper):  # MuJoCo has both or none
                hinge["range"] = _numbers((max(lower, -1e4), min(upper, 1e4)))
            ElementTree.SubElement(body, "joint", hinge)
            order.append(("joint", joint))
        mass, com, inertia = float(robot.mass[link]), np.asarray(robot.com[link]), np.asarray(robot.inertia[link])
        own = {k: disc for k, disc in discs.items() if disc[0] == link}
        for _, disc_mass, disc_inertia, _ in own.values():
            mass, inertia = max(mass - disc_mass, 0.0), inertia - disc_inertia
        _check_rest(robot, link, inertia, own)
        _weigh(body, robot, mass, com, inertia)
        for i, carrier in enumerate(robot.capsule_link):
            if carrier == link:
                _shape(body, robot, i)
        for k, (_, disc_mass, disc_inertia, _) in own.items():
            wheel = ElementTree.SubElement(body, "body", name=_rotor(robot, k), pos=_numbers(com))
            ElementTree.SubElement(wheel, "joint", name=_rotor(robot, k), type="hinge", axis=_numbers(robot.axis[k]))
            order.append(("rotor", k))
            _weigh(wheel, robot, disc_mass, np.zeros(3), disc_inertia)
        for k in children.get(link, []):
            write(k + 1, body, k)

    write(0, world, None)
    return order


def _check_rest(robot: Robot, link: int, inertia: np.ndarray, own: dict) -> None:
    """Refuse rotors that leave their link no inertia that a body can have."""
    small, middle, large = np.linalg.eigvalsh(inertia)
    if own and (small < 0 or large > (small + middle) * (1 + 1e-9)):
        names = ", ".join(repr(robot.joint_names[k]) for k in own)
        raise ValueError(
            f"link {robot.link_names[link]!r} has not the inertia of the rotors of {names:.100} in it, so that MuJoCo "
            "cannot have them as bodies; rotors=False leaves them out."
        )


def _weigh(body: ElementTree.Element, robot: Robot, mass: float, com: np.ndarray, inertia: np.ndarray) -> None:
    """Mass and inertia; what MuJoCo would not take for being zero becomes a trillionth of the robot's."""
    least = _LEAST * max(float(np.abs(robot.inertia).max()), 1e-3 * float(robot.mass.sum()) * _size(robot) ** 2)
    moments, frame = np.linalg.eigh(0.5 * (inertia + inertia.T))
    frame = frame * np.linalg.det(frame)
    moments = np.maximum(moments, least)
    moments[2] = min(moments[2], moments[0] + moments[1])  # rounding of a plate or a rod
    ElementTree.SubElement(
        body,
        "inertial",
        mass=repr(max(mass, _LEAST * float(robot.mass.sum()))),
        pos=_numbers(com),
        quat=_numbers(to_quaternion(frame)),
        diaginertia=_numbers(moments),
    )


def _size(robot: Robot) -> float:
    return float(np.abs(np.concatenate([robot.anchor.ravel(), robot.com.ravel(), [1e-3]])).max())


def _shape(body: ElementTree.Element, robot: Robot, i: int) -> None:
    start, end, radius = robot.capsule_start[i], robot.capsule_end[i], float(robot.capsule_radius[i])
    geom = {"contype": "0", "conaffinity": "0", "rgba": _COLOURS[robot.capsule_link[i] % len(_COLOURS)]}
    if np.linalg.norm(end - start) > 1e-9 * radius:
        geom |= {"type": "capsule", "fromto": _numbers((start, end)), "size": repr(radius)}
    else:
        geom |= {"type": "sphere", "pos": _numbers(start), "size": repr(radius)}
    ElementTree.SubElement(body, "geom", geom)


def _tie(equal: ElementTree.Element, follower: str, driver: str, ratio: float, offset: float) -> None:
    ElementTree.SubElement(
        equal, "joint", joint1=follower, joint2=driver, polycoef=_numbers((offset, ratio, 0.0, 0.0, 0.0))
    )


def _keyframes(
    keys: ElementTree.Element, robot: Robot, motion: Any, samples: int, order: list[tuple[str, int]], discs: dict
) -> None:
    time, theta, rotation = _replay(robot, motion, samples)
    centre = np.asarray(jax.vmap(centre_of_mass, (None, 0))(robot, theta), float)
    position = centre[0] - np.einsum("mab,mb->ma", rotation, centre)
    quaternion = np.asarray(jax.vmap(to_quaternion)(rotation), float)
    columns = [theta[:, k] * (discs[k][3] if kind == "rotor" else 1.0) for kind, k in order]
    hinges = np.stack(columns, 1) if columns else np.zeros((len(theta), 0))
    for i in range(len(theta)):
        qpos = _numbers(np.concatenate([position[i], quaternion[i], hinges[i]]))
        ElementTree.SubElement(keys, "key", name=f"replay{i}", time=repr(float(time[i])), qpos=qpos)


def _replay(robot: Robot, motion: Any, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (m,), joint angles (m, j) and rotations of the base (m, 3, 3)."""
    if all(hasattr(motion, key) for key in ("time", "theta", "rotation")):
        checks.on_host("motion", (motion.time, motion.theta, motion.rotation), "write_mjcf")
        theta = checks.numbers("motion.theta", np.asarray(motion.theta), (-1, robot.joints))
        time = checks.numbers("motion.time", np.asarray(motion.time), (len(theta),))
        rotation = checks.numbers("motion.rotation", np.asarray(motion.rotation), (len(theta), 3, 3))
        return time, theta, rotation
    route = motion if isinstance(motion, Path) else polygon(getattr(motion, "waypoints", motion))
    if not is_concrete(route):
        raise ValueError("`motion` is traced; files are written outside of jit, vmap and grad.")
    corners = checks.numbers("motion", np.asarray(route.waypoints), (-1, robot.joints))
    share = np.arange(samples)[:, None] / samples
    between = [a + share * (b - a) for a, b in zip(corners[:-1], corners[1:], strict=True)]
    theta = np.concatenate([*between, corners[-1:]])
    if len(corners) == 1:
        return np.zeros(1), theta, np.eye(3)[None]
    rotation = np.asarray(rotation_history(robot, route, samples=samples), float)
    return np.arange(len(theta)) / samples, theta, rotation

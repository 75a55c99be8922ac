"""`load_robot`: a robot from a file, and everything that was merged, locked, dropped or assumed in its notes."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from reojax._internal.checks import shorten
from reojax._internal.inertias import mend
from reojax._internal.json_files import read_bytes
from reojax.models.description import Description
from reojax.models.json_file import read_robot
from reojax.models.reduction import reduce
from reojax.models.shapes import fit_capsules
from reojax.models.urdf import parse_xml, read_urdf
from reojax.robot import Robot, make_robot

ENDINGS = (".urdf", ".xml", ".mjcf", ".json")
"""Of files that hold a robot."""
LARGEST = 32 * 2**20
"""Largest robot file that is read [bytes]."""


def load_robot(
    path: str | os.PathLike[str],
    *,
    base: str | None = None,
    lock: Mapping[str, float] | None = None,
    gear_ratio: Mapping[str, float] | None = None,
    rotor_inertia: Mapping[str, float] | None = None,
    repair: bool = False,
    name: str | None = None,
    shapes: bool = True,
) -> Robot:
    """Read a robot from a URDF, an MJCF, or a file that `save_robot` wrote.

    Links that fixed and locked joints tie together become one, with the inertia of all; what ties the root to a world
    is dropped; joints that mimic others become couplings; a ball joint becomes three hinges. The rest keeps the file's
    names, and the file's order as far as each joint must come after the one that carries it. `theta = 0` is the
    file's zero; the base frame is the base link's, and all other frames are parallel to it there. **What was merged,
    locked, dropped or assumed is told in `robot.notes`.**

    A file's armature is `N^2 J`, a rotor's inertia as felt at the joint; its angular momentum is that of `N J`. So it
    counts only where a gear ratio is known: from the MJCF actuator's `gear` (where it is not 1), or from `gear_ratio`.
    URDF has ratios (`mechanicalReduction` of a transmission), but no rotors. Stators sit on the parent's side.

    Args:
        path: .urdf, .xml or .mjcf, .json. MJCF needs `pip install "reojax[models]"`.
        base: link to be the base; default the file's root.
        lock: joint -> position at which it is held [rad or m]. Prismatic joints that are not named are held at rest.
        gear_ratio: joint -> rotor turns per joint turn, over what the file says.
        rotor_inertia: joint -> rotor inertia [kg m^2], over what the file says.
        repair: change inertias that no rigid body has to the nearest possible ones; default refuse them.
        name: name of the robot; default the file's.
        shapes: read collision shapes as capsules that contain them; meshes need `pip install "reojax[models]"`, and
            are looked for beside the file only.

    Raises:
        ValueError: naming the file, and the link, joint or entry that stands in the way.
        ImportError: naming what to install.
    """
    given = {"lock": lock, "gear_ratio": gear_ratio, "rotor_inertia": rotor_inertia}
    for entry, value in given.items():
        if value is not None and not isinstance(value, Mapping):
            raise ValueError(f"`{entry}` is {shorten(value)}; it must map names of joints to numbers.")
    if name is not None and not isinstance(name, str):
        raise ValueError(f"`name` is {shorten(name)}; it must be a string.")
    data = read_bytes(path, LARGEST)
    where = shorten(os.fspath(path))
    if data.lstrip()[:1] == b"{" or Path(path).suffix.lower() == ".json":
        if base is not None or repair or any(given.values()):
            raise ValueError(f"{where} is a saved robot: only `name` can be changed while it is read.")
        robot = read_robot(path)
        return robot if name is None else robot.replace(name=name)
    try:
        description = _describe(path, data, base)
        robot = _build(description, path, base, given, repair, name, shapes)
    except ValueError as error:
        text = str(error)
        raise ValueError(f"cannot load {where}: {text if text.endswith('.') else text + '.'}") from None
    return robot


def joint_kinds(path: str | os.PathLike[str], base: str | None = None) -> dict[str, str]:
    """Kind of each joint of a URDF or MJCF, as the file has it: "revolute", "prismatic" and so on.

    Raises:
        ValueError: naming the file and what is wrong with it.
        ImportError: naming what to install.
    """
    try:
        description = _describe(path, read_bytes(path, LARGEST), base)
    except ValueError as error:
        raise ValueError(f"cannot load {shorten(os.fspath(path))}: {error}.") from None
    return {name: joint.kind for name, joint in description.joints.items()}


def _describe(path: str | os.PathLike[str], data: bytes, base: str | None) -> Description:
    root = parse_xml(data.lstrip())
    if root.tag == "robot":
        return read_urdf(root)
    if root.tag == "mujoco":
        from reojax.models.mjcf import read_mjcf

        return read_mjcf(path, root, base)
    kinds = {"sdf": "an SDF file", "mujocoinclude": "a part that an MJCF file includes", "COLLADA": "a mesh"}
    what = kinds.get(root.tag, f"XML with the root <{root.tag:.40}>")
    raise ValueError(f"it is {what}; a robot file is a URDF (<robot>) or an MJCF (<mujoco>)")


def _build(
    description: Description,
    path: str | os.PathLike[str],
    base: str | None,
    given: Mapping[str, Mapping[str, float] | None],
    repair: bool,
    name: str | None,
    shapes: bool,
) -> Robot:
    reduced = reduce(description, base=base, **{entry: value or {} for entry, value in given.items()})
    fields, notes = reduced.fields, reduced.notes
    fields["inertia"] = mend(fields["inertia"], fields["link_names"], repair=repair, notes=notes)
    capsules = fit_capsules(reduced.shapes, Path(path).resolve().parent, notes) if shapes else []
    return make_robot(**fields, capsules=capsules, name=name or description.name, notes=notes)

"""A robot as JSON, exact to the last bit: Python writes the shortest digits that read back as the same number."""

import os
from typing import Any

import numpy as np

from reojax._internal.arrays import is_concrete
from reojax._internal.checks import shorten
from reojax._internal.files import check_ending, write_json
from reojax._internal.json_files import entries, items, plain_number, read_object
from reojax.capsules import Capsule
from reojax.manoeuvres import Layout, check_layout
from reojax.mechanics.input_checks import check_robot
from reojax.robot import Robot, make_robot

FORMAT, VERSION = "reojax robot", 1

_LINK = ("name", "mass", "com", "inertia")
_JOINT = ("name", "parent", "axis", "anchor", "lower", "upper", "rotor_inertia", "gear_ratio", "rotor_on")
_CAPSULE = ("link", "start", "end", "radius")
_COUPLING = ("joint", "driver", "ratio", "offset")
_ARRAYS = {  # field: where it lies in the file, and its name there
    **{key: ("links", key) for key in ("mass", "com", "inertia")},
    **{key: ("joints", key) for key in ("axis", "anchor", "lower", "upper", "rotor_inertia", "gear_ratio")},
    **{f"capsule_{key}": ("capsules", key) for key in ("start", "end", "radius")},
    **{f"coupling_{key}": ("couplings", key) for key in ("ratio", "offset")},
}
_ENDS = {"lower": -np.inf, "upper": np.inf}
"""What null stands for."""


def save_robot(robot: Robot, path: str | os.PathLike[str]) -> None:
    """Write a robot as JSON; `load_robot` reads back the same numbers, to the last bit.

    The file is written whole or not at all.

    Args:
        robot: the robot; its arrays must hold numbers, not traced values.
        path: to write, ending in .json.

    Raises:
        ValueError: naming the entry, if the robot is none that `make_robot` would make, or the path and what is wrong.
    """
    target = check_ending(path, "robot", ("json",))
    write_json(target, to_json(robot))


def to_json(robot: Robot) -> dict[str, Any]:
    """The robot as an object of JSON, for files that hold more than a robot.

    Raises:
        ValueError: if it is none that `make_robot` would make.
    """
    check_robot(robot)
    if not is_concrete(robot):
        raise ValueError("`robot` is traced; files are written outside of jit, vmap and grad.")
    rows: dict[str, list[dict[str, Any]]] = {
        "links": [{"name": name} for name in robot.link_names],
        "joints": [
            {"name": name, "parent": robot.link_names[parent], "rotor_on": side}
            for name, parent, side in zip(robot.joint_names, robot.parent, robot.rotor_on, strict=True)
        ],
        "capsules": [{"link": robot.link_names[link]} for link in robot.capsule_link],
        "couplings": [{"joint": robot.joint_names[k], "driver": robot.joint_names[d]} for k, d in robot.couplings],
    }
    dtypes = {}
    for field, (table, key) in _ARRAYS.items():
        array = np.asarray(getattr(robot, field))
        if array.dtype != np.float64:
            dtypes[field] = array.dtype.name
        for row, value in zip(rows[table], array.astype(np.float64).tolist(), strict=True):
            row[key] = None if key in _ENDS and value == _ENDS[key] else value
    data = {
        "format": FORMAT,
        "version": VERSION,
        "name": robot.name,
        **rows,
        "collision_pairs": [list(pair) for pair in robot.collision_pairs],
        "layout": None if robot.layout is None else _layout_row(robot.layout),
        "notes": list(robot.notes),
        "dtypes": dtypes,
    }
    from_json(data)  # what cannot be read back is not written
    return data


def from_json(data: Any, where: str = "the robot") -> Robot:
    """The robot of an object that `to_json` made.

    Raises:
        ValueError: naming the entry, its value and the rule.
    """
    required = ("format", "version", "name", "links", "joints")
    top = entries(where, data, required, ("capsules", "couplings", "collision_pairs", "layout", "notes", "dtypes"))
    if top["format"] != FORMAT:
        raise ValueError(f"{where} has the format {shorten(top['format'])}; it must be {FORMAT!r}.")
    if top["version"] != VERSION or isinstance(top["version"], bool):
        raise ValueError(f"{where} has version {shorten(top['version'])}; this reojax reads version {VERSION}.")
    links = _table(f"{where}.links", top["links"], _LINK)
    joints = _table(f"{where}.joints", top["joints"], _JOINT)
    capsules = _table(f"{where}.capsules", top.get("capsules", []), _CAPSULE)
    couplings = _table(f"{where}.couplings", top.get("couplings", []), _COUPLING)
    names = [row["name"] for row in links]
    for k, row in enumerate(joints):
        if row["parent"] not in names:
            raise ValueError(f"{where}.joints[{k}].parent is {shorten(row['parent'])}; there is no such link.")
    followers = [row["joint"] for row in couplings]
    if not all(isinstance(name, str) for name in followers) or len(set(followers)) < len(followers):
        raise ValueError(f"{where}.couplings must name each joint once.")
    layout = _layout(where, top.get("layout"))
    notes = items(f"{where}.notes", top.get("notes", []))
    if not all(isinstance(note, str) for note in notes):
        raise ValueError(f"{where}.notes must be a list of strings.")

    def column(rows: list[dict[str, Any]], key: str) -> list[Any]:
        return [row[key] for row in rows]

    axis = np.array(column(joints, "axis"), float).reshape(-1, 3)  # of any length; make_robot wants unit vectors
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    checked = make_robot(
        **{key: column(links, key) for key in ("mass", "com", "inertia")},
        axis=axis / np.where(length > 0, length, 1),
        anchor=np.array(column(joints, "anchor"), float).reshape(-1, 3),
        **{key: column(joints, key) for key in ("lower", "upper", "rotor_inertia", "gear_ratio", "rotor_on")},
        parent=[names.index(row["parent"]) for row in joints],
        link_names=names,
        joint_names=column(joints, "name"),
        name=top["name"],
        capsules=[Capsule(**row) for row in capsules],
        collision_pairs=[tuple(items(f"{where}.collision_pairs[{i}]", pair)) for i, pair in _pairs(where, top)],
        couplings={row["joint"]: (row["driver"], row["ratio"], row["offset"]) for row in couplings},
        layout=layout,
        notes=notes,
    )
    if layout is not None and layout.joints != checked.joints:
        raise ValueError(f"{where}.layout is for {layout.joints} joints; the robot has {checked.joints}.")
    exact = {}  # as they stand in the file: neither axes made unit nor inertias symmetric
    dtypes = top.get("dtypes", {})
    dtypes = entries(f"{where}.dtypes", dtypes, (), tuple(_ARRAYS))
    tables = {"links": links, "joints": joints, "capsules": capsules, "couplings": couplings}
    for field, (table, key) in _ARRAYS.items():
        dtype = dtypes.get(field, "float64")
        if dtype not in ("float64", "float32", "float16"):
            raise ValueError(f"{where}.dtypes.{field} is {shorten(dtype)}; it must be a floating precision.")
        old = getattr(checked, field)
        exact[field] = np.array(column(tables[table], key), np.float64).reshape(old.shape).astype(dtype)
        exact[field].setflags(write=False)
    return checked.replace(**exact, notes=tuple(notes))


def read_robot(path: str | os.PathLike[str]) -> Robot:
    """Read a robot that `save_robot` wrote.

    Raises:
        ValueError: naming the path, and the entry that is wrong.
    """
    try:
        return from_json(read_object(path))
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith("cannot read") else f"cannot read {str(path)!r}: {text}") from None


def _table(where: str, value: Any, keys: tuple[str, ...]) -> list[dict[str, Any]]:
    """Rows of a list of objects, their numbers checked, null limits made infinite."""
    rows = []
    for i, row in enumerate(items(where, value)):
        row = dict(entries(f"{where}[{i}]", row, keys))
        for key in keys:
            entry = f"{where}[{i}].{key}"
            if key in ("name", "parent", "link", "joint", "driver", "rotor_on"):
                if not isinstance(row[key], str):
                    raise ValueError(f"{entry} is {shorten(row[key])}; it must be a string.")
            elif key in _ENDS and row[key] is None:
                row[key] = _ENDS[key]
            else:
                shape = {"inertia": (3, 3)}.get(key, (3,) if key in ("com", "axis", "anchor", "start", "end") else ())
                row[key] = _numbers(entry, row[key], shape)
        rows.append(row)
    return rows


def _numbers(where: str, value: Any, shape: tuple[int, ...]) -> Any:
    if not shape:
        return plain_number(where, value)
    if not isinstance(value, list) or len(value) != shape[0]:
        raise ValueError(f"{where} is {shorten(value)}; it must be a list of {shape[0]}.")
    return [_numbers(f"{where}[{i}]", entry, shape[1:]) for i, entry in enumerate(value)]


def _pairs(where: str, top: dict[str, Any]) -> list[tuple[int, Any]]:
    return list(enumerate(items(f"{where}.collision_pairs", top.get("collision_pairs", []))))


def _layout_row(layout: Layout) -> dict[str, Any]:
    return {key: list(value) if isinstance(value, tuple) else value for key, value in layout._asdict().items()}


def _layout(where: str, value: Any) -> Layout | None:
    if value is None:
        return None
    row = entries(f"{where}.layout", value, Layout._fields)

    def joints(key: str, count: int) -> tuple[int, ...]:
        numbers = items(f"{where}.layout.{key}", row[key])
        if len(numbers) != count or not all(isinstance(n, int) and not isinstance(n, bool) for n in numbers):
            raise ValueError(f"{where}.layout.{key} is {shorten(numbers)}; it must be {count} numbers of joints.")
        return tuple(numbers)

    for key in ("joints", "bend"):
        if isinstance(row[key], bool) or not isinstance(row[key], int):
            raise ValueError(f"{where}.layout.{key} is {shorten(row[key])}; it must be an integer.")
    first, last = joints("twist", 2)
    fold = None if row["fold"] is None else joints("fold", 2)
    layout = Layout(
        joints=row["joints"],
        twist=(first, last),
        bend=row["bend"],
        fold=None if fold is None else (fold[0], fold[1]),
        fold_angle=tuple(_numbers(f"{where}.layout.fold_angle", row["fold_angle"], (2,))),
    )
    check_layout(layout)
    return layout

"""What the columns of a capture's header mean: time, joint angles, orientation, and in which units."""

import csv
import math
import re
from collections.abc import Sequence
from typing import NamedTuple

from reojax._internal.checks import shorten

SECONDS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
RADIANS = {"rad": 1.0, "radians": 1.0, "deg": math.pi / 180, "degrees": math.pi / 180, "\u00b0": math.pi / 180}
QUATERNION = ("qw", "qx", "qy", "qz")
ZXZ = ("zxz1", "zxz2", "zxz3")
_SUFFIX = re.compile(r"^(?P<name>.*?)[\s_]*(?:[\[(](?P<bracket>[^\])]*)[\])]|_(?P<suffix>[A-Za-z\u00b0]+))$")
_RESERVED = {"time": "time", "t": "time"} | {key: key for key in QUATERNION}
"""What columns without an angle's unit are, even if a joint is called so."""


class Columns(NamedTuple):
    """Where in a row each quantity stands, and what brings its numbers to SI units."""

    time: int
    to_seconds: float
    joints: tuple[int, ...]
    """One for each joint of the robot, or none."""
    joint_factors: tuple[float, ...]
    quaternion: tuple[int, ...]
    """w, x, y, z, or none."""
    zxz: tuple[int, ...]
    """The three angles, or none."""
    zxz_factors: tuple[float, ...]
    ignored: tuple[str, ...]
    """Headers of the other columns."""

    @property
    def has_orientation(self) -> bool:
        """Whether there is an orientation."""
        return bool(self.quaternion or self.zxz)


def split(text: str, delimiter: str | None = None) -> tuple[list[str], str]:
    """Cells of a line, and the delimiter, found if it is not given.

    Raises:
        ValueError: for a line that is none of a CSV file.
    """
    delimiter = max(",;\t", key=text.count) if delimiter is None else delimiter
    try:
        return [cell.strip() for cell in next(csv.reader([text.strip("\r\n")], delimiter=delimiter))], delimiter
    except (csv.Error, StopIteration) as error:
        raise ValueError(f"the line is not one of cells: {error}") from error


def read_header(cells: Sequence[str], joint_names: Sequence[str], angle_unit: str | None) -> Columns:
    """Find the columns of time, of `joint_names` and of orientation in a header.

    The robot's own names come first: as they are, then whatever their case and marks, where that is one joint's only.
    Numbered names (`theta1`) count where no joint has such a name; columns of time and orientation that are called as
    a joint is are told by their units.

    Raises:
        ValueError: saying which column is missing, twice there, or without a unit.
    """
    known = _known(joint_names)
    found: dict[str, int] = {}
    units: dict[str, str | None] = {}
    ignored = []
    for index, cell in enumerate(cells):
        key, unit = _meaning(cell, joint_names, known)
        if key is None:
            ignored.append(cell)
            continue
        if key in found:
            raise ValueError(
                f"columns {shorten(cells[found[key]])} and {shorten(cell)} are the same quantity; one must go."
            )
        found[key], units[key] = index, unit

    def factor(key: str) -> float:
        unit = units[key] or angle_unit
        header = cells[found[key]]
        if unit is None:
            raise ValueError(f"column {header!r} has no unit; call it {header + '_deg'!r} or {header + '_rad'!r}.")
        if unit not in RADIANS:
            raise ValueError(f"column {header!r} has the unit {shorten(unit)}; angles are in deg or rad.")
        return RADIANS[unit]

    if "time" not in found:
        raise ValueError(f"there is no column 'time'; the columns are {_as_list(cells)}.")
    unit = units["time"] or "s"
    if unit not in SECONDS:
        raise ValueError(f"column {cells[found['time']]!r} has the unit {shorten(unit)}; time is in s, ms, us or ns.")
    joints = _all_or_none(found, [_joint(k) for k in range(len(joint_names))], cells, joint_names)
    quaternion, zxz = _all_or_none(found, QUATERNION, cells), _all_or_none(found, ZXZ, cells)
    if quaternion and zxz:
        raise ValueError("the orientation is there twice, as quaternion and as ZXZ angles; one must go.")
    if not (joints or quaternion or zxz):
        raise ValueError(
            f"there are neither joint angles ({_as_list(joint_names)}, or theta1 to theta{len(joint_names)}) nor an "
            f"orientation (qw to qz, or zxz1 to zxz3); the columns are {_as_list(cells)}."
        )
    return Columns(
        time=found["time"],
        to_seconds=SECONDS[unit],
        joints=joints,
        joint_factors=tuple(factor(_joint(k)) for k in range(len(joints))),
        quaternion=quaternion,
        zxz=zxz,
        zxz_factors=tuple(factor(key) for key in ZXZ) if zxz else (),
        ignored=tuple(ignored),
    )


def _joint(number: int) -> str:
    """Key of a joint angle."""
    return f"joint {number}"


def _known(joint_names: Sequence[str]) -> dict[str, str]:
    """Keys of quantities by what their columns are called, lower case and without marks."""
    known: dict[str, str] = {key: key for key in (*QUATERNION, *ZXZ)} | {"time": "time", "t": "time"}
    own = [_plain(name) for name in joint_names]
    if not any(re.fullmatch(r"theta\d+", name) for name in own):
        known |= {f"theta{k + 1}": _joint(k) for k in range(len(own))}
    return known | {name: _joint(k) for k, name in enumerate(own) if own.count(name) == 1}


def _meaning(header: str, joint_names: Sequence[str], known: dict[str, str]) -> tuple[str | None, str | None]:
    """Key of the quantity in a column, None for one of no interest, and the unit its header gives."""
    text = header.strip()
    match = _SUFFIX.match(text)
    ways: list[tuple[str, str | None]] = [(text, None)]
    if match is not None:
        unit = match["bracket"] if match["suffix"] is None else match["suffix"]
        ways.append((match["name"], unit.strip().lower()))
    for name, unit in ways:
        own = [k for k, joint in enumerate(joint_names) if joint == name]
        key = _joint(own[0]) if len(own) == 1 else known.get(_plain(name))
        if key is None:
            continue
        other = _RESERVED.get(_plain(name))
        return (other, unit) if other is not None and unit not in RADIANS else (key, unit)
    return None, None


def _plain(name: str) -> str:
    return re.sub(r"[\s_.-]", "", name.lower())


def _all_or_none(
    found: dict[str, int], keys: Sequence[str], cells: Sequence[str], names: Sequence[str] | None = None
) -> tuple[int, ...]:
    missing = [key for key in keys if key not in found]
    if len(missing) == len(keys):
        return ()
    if missing:
        index = list(keys).index(missing[0])
        what = (
            f"column {missing[0]!r}"
            if names is None
            else f"the column of joint {shorten(names[index])} (or theta{index + 1})"
        )
        raise ValueError(f"{what} is missing; the columns are {_as_list(cells)}.")
    return tuple(found[key] for key in keys)


def _as_list(cells: Sequence[str]) -> str:
    shown = ", ".join(shorten(cell)[1:-1] for cell in cells[:20])
    return shown if len(cells) <= 20 else f"{shown}, and {len(cells) - 20} more"

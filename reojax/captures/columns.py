"""What the columns of a capture's header mean: time, joint angles, orientation, and in which units."""

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

SECONDS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
RADIANS = {"rad": 1.0, "radians": 1.0, "deg": math.pi / 180, "degrees": math.pi / 180, "\u00b0": math.pi / 180}
QUATERNION = ("qw", "qx", "qy", "qz")
ZXZ = ("zxz1", "zxz2", "zxz3")
_SUFFIX = re.compile(r"^(?P<name>.*?)[\s_]*(?:[\[(](?P<bracket>[^\])]*)[\])]|_(?P<suffix>[a-z\u00b0]+))$")


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
    def oriented(self) -> bool:
        """Whether there is an orientation."""
        return bool(self.quaternion or self.zxz)


def read_header(cells: Sequence[str], joint_names: Sequence[str], angle_unit: str | None) -> Columns:
    """Find the columns of time, of `joint_names` and of orientation in a header.

    Raises:
        ValueError: saying which column is missing, twice there, or without a unit.
    """
    found: dict[str, int] = {}
    units: dict[str, str | None] = {}
    ignored = []
    for index, cell in enumerate(cells):
        key, unit = _meaning(cell, joint_names)
        if key is None:
            ignored.append(cell)
            continue
        if key in found:
            raise ValueError(f"columns {cells[found[key]]!r} and {cell!r} are the same quantity; one must go.")
        found[key], units[key] = index, unit

    def factor(key: str) -> float:
        unit = units[key] or angle_unit
        if unit is None:
            header = cells[found[key]]
            raise ValueError(f"column {header!r} has no unit; call it {header + '_deg'!r} or {header + '_rad'!r}.")
        if unit not in RADIANS:
            raise ValueError(f"column {cells[found[key]]!r} has the unit {unit!r}; angles are in deg or rad.")
        return RADIANS[unit]

    if "time" not in found:
        raise ValueError(f"there is no column 'time'; the columns are {_as_list(cells)}.")
    unit = units["time"] or "s"
    if unit not in SECONDS:
        raise ValueError(f"column {cells[found['time']]!r} has the unit {unit!r}; time is in s, ms, us or ns.")
    joints = _all_or_none(found, [f"theta{k + 1}" for k in range(len(joint_names))], cells, joint_names)
    quaternion, zxz = _all_or_none(found, QUATERNION, cells), _all_or_none(found, ZXZ, cells)
    if quaternion and zxz:
        raise ValueError("the orientation is there twice, as quaternion and as ZXZ angles; one must go.")
    if not (joints or quaternion or zxz):
        names = ", ".join(joint_names)
        raise ValueError(
            f"there are neither joint angles ({names}, or theta1 to theta{len(joint_names)}) nor an orientation "
            f"(qw to qz, or zxz1 to zxz3); the columns are {_as_list(cells)}."
        )
    return Columns(
        time=found["time"],
        to_seconds=SECONDS[unit],
        joints=joints,
        joint_factors=tuple(factor(f"theta{k + 1}") for k in range(len(joints))),
        quaternion=quaternion,
        zxz=zxz,
        zxz_factors=tuple(factor(key) for key in ZXZ) if zxz else (),
        ignored=tuple(ignored),
    )


def _meaning(header: str, joint_names: Sequence[str]) -> tuple[str | None, str | None]:
    """Key of the quantity in a column, None for one of no interest, and the unit its header gives."""
    keys = {_plain(name): f"theta{k + 1}" for k, name in enumerate(joint_names)}
    keys |= {f"theta{k + 1}": f"theta{k + 1}" for k in range(len(joint_names))}
    keys |= {key: key for key in (*QUATERNION, *ZXZ)} | {"time": "time", "t": "time"}
    text = header.strip().lower()
    if _plain(text) in keys:
        return keys[_plain(text)], None
    match = _SUFFIX.match(text)
    if match is None:
        return None, None
    unit = match["bracket"] if match["suffix"] is None else match["suffix"]
    return keys.get(_plain(match["name"])), unit.strip()


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
        also = "" if names is None or _plain(names[index]) == missing[0] else f" (joint {names[index]!r})"
        raise ValueError(f"column {missing[0]!r}{also} is missing; the columns are {_as_list(cells)}.")
    return tuple(found[key] for key in keys)


def _as_list(cells: Sequence[str]) -> str:
    shown = ", ".join(cells[:20])
    return shown if len(cells) <= 20 else f"{shown}, and {len(cells) - 20} more"

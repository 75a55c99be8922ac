"""Captured motion: what cameras and encoders saw, as read from a CSV file.

A header, then one row per frame. Columns, in any order, others are ignored:

    time                              [s], or time_ms; strictly increasing, at any rate
    NAME_rad ... or theta1_deg ...    joint angles, by the robot's joint names or, if none is like theta1, by number
    qw, qx, qy, qz                    orientation of link 1 (the base) as a unit quaternion
    zxz1_deg, zxz2_deg, zxz3_deg      or as ZXZ angles

with either or both of joints and orientation. Every angle's header says its unit: `_deg`, `_rad`, `[deg]` or
`(rad)`. Comma, semicolon or tab between cells. Lines that begin with # are comments. A frame may be left out, or
a cell left empty (or NaN): that is a gap.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import as_numbers
from reojax._internal.checks import instance, one_of, shorten
from reojax._internal.files import reading
from reojax.captures.columns import Columns, read_header, split
from reojax.robot import Robot

UNIT_TOLERANCE = 0.02
"""Largest difference of a quaternion's length from 1; within it the quaternion is normalised."""
_GAPS = {"", "nan", "na", "n/a", "null", "none"}
_LONGEST_LINE = 2**20
_LATEST = 1e11
"""Largest time that can be meant [s]; clocks that count from 1970 stand at 1.8e9."""


class Capture(NamedTuple):
    """A captured motion, NaN where something was not seen."""

    time: Float[np.ndarray, " m"]
    """When each frame was taken [s], strictly increasing."""
    theta: Float[np.ndarray, "m j"] | None
    """Joint angles [rad]."""
    rotation: Float[np.ndarray, "m 3 3"] | None
    """Orientation of the base: its components to those of a fixed frame, whichever the cameras have."""
    ignored: tuple[str, ...] = ()
    """Headers of columns that were not read."""

    @property
    def seen_theta(self) -> np.ndarray:
        """(m, j) where a joint angle was seen."""
        return np.zeros((len(self.time), 0), bool) if self.theta is None else np.isfinite(self.theta)

    @property
    def seen_rotation(self) -> np.ndarray:
        """(m,) where the orientation was seen."""
        if self.rotation is None:
            return np.zeros(len(self.time), bool)
        return np.asarray(np.isfinite(self.rotation).all(axis=(1, 2)))


def make_capture(time: object, theta: object = None, rotation: object = None) -> Capture:
    """Build a capture from arrays.

    Args:
        time: (m,) [s], strictly increasing, m >= 2.
        theta: (m, j) joint angles [rad], NaN where not seen.
        rotation: (m, 3, 3) orientations of the base, NaN where not seen.

    Raises:
        ValueError: for wrong shapes, times that do not increase, matrices that are no rotations, infinite numbers,
            or neither angles nor orientations.
    """
    when = np.asarray(as_numbers("time", time), float)
    if when.ndim != 1 or len(when) < 2:
        raise ValueError(f"`time` has shape {when.shape}; it must be (m,) with at least two frames.")
    if not np.isfinite(when).all() or (np.diff(when) <= 0).any():
        row = int(np.argmax(~(np.diff(when, prepend=-np.inf) > 0) | ~np.isfinite(when)))
        raise ValueError(f"time[{row}] is {when[row]}; times must be finite and strictly increasing.")
    joints = None if theta is None else np.asarray(as_numbers("theta", theta), float)
    turned = None if rotation is None else np.asarray(as_numbers("rotation", rotation), float)
    if joints is None and turned is None:
        raise ValueError("neither `theta` nor `rotation` is given; a capture has one of them or both.")
    if joints is not None and (joints.ndim != 2 or len(joints) != len(when)):
        raise ValueError(f"`theta` has shape {joints.shape}; for {len(when)} frames it must be ({len(when)}, j).")
    if joints is not None and np.isinf(joints).any():
        row, joint = np.argwhere(np.isinf(joints))[0]
        raise ValueError(f"theta[{row}, {joint}] is {joints[row, joint]}; it must be finite, or NaN where not seen.")
    if turned is not None:
        if turned.shape != (len(when), 3, 3):
            raise ValueError(f"`rotation` has shape {turned.shape}; it must be ({len(when)}, 3, 3).")
        seen = np.asarray(~np.isnan(turned).any(axis=(1, 2)))
        off = np.where(seen, abs(turned @ turned.swapaxes(1, 2) - np.eye(3)).max(axis=(1, 2)), 0)
        bad = seen & ~((off < 1e-3) & (np.linalg.det(np.where(seen[:, None, None], turned, np.eye(3))) > 0))
        if bad.any():
            row = int(np.argmax(bad))
            raise ValueError(f"rotation[{row}] is {turned[row].tolist()}; it is not a rotation.")
    return Capture(when, joints, turned)


def read_capture(path: str | os.PathLike[str], robot: Robot, *, angle_unit: str | None = None) -> Capture:
    """Read a capture of `robot` from a CSV file; the format is in this module's docstring.

    Args:
        path: the file.
        robot: its joint names are looked for, and its joint limits tell angles beyond reason: more than one and
            a half times a limit, or four turns where there is none, is taken for a wrong unit.
        angle_unit: "deg" or "rad", for angles whose header does not say.

    Raises:
        ValueError: naming file and line, for what cannot be read or cannot be meant.
    """
    instance("robot", robot, Robot, "`make_robot` makes")
    if angle_unit is not None:
        one_of("angle_unit", angle_unit, ("deg", "rad"))
    lines = _lines(path)
    number, text = next(lines, (0, ""))
    if not number:
        raise ValueError(f"{path}: the file is empty.")
    with _at(path, number):
        header, delimiter = split(text)
        columns = read_header(header, robot.joint_names, angle_unit)
        width = len(header)
    largest = [_beyond_reason(low, high) for low, high in zip(robot.lower, robot.upper, strict=True)]
    time, theta, rotation = [], [], []
    for number, text in lines:
        with _at(path, number):
            cells, _ = split(text, delimiter)
            if len(cells) != width:
                raise ValueError(f"the line has {len(cells)} cells; the header has {width}.")
            when = _number(cells[columns.time], "time") * columns.to_seconds
            if math.isnan(when):
                raise ValueError("the time is missing.")
            if abs(when) > _LATEST:
                raise ValueError(
                    f"the time is {when:g} s, beyond reason (more than {_LATEST:g} s); its header may name "
                    "another unit, as in 'time [ns]'."
                )
            if time and when <= time[-1]:
                raise ValueError(
                    f"the time is {when:g} s, after {time[-1]:g} s; times must increase from line to line."
                )
            time.append(when)
            theta.append(_joint_angles(cells, columns, robot.joint_names, largest))
            rotation.append(_orientation(cells, columns))
    if len(time) < 2:
        raise ValueError(f"{path}: the file has {len(time)} lines of data; a motion needs two.")
    capture = Capture(
        time=np.array(time),
        theta=np.array(theta) if columns.joints else None,
        rotation=_rotations(np.array(rotation), bool(columns.quaternion)) if columns.has_orientation else None,
        ignored=columns.ignored,
    )
    for k, name in enumerate(robot.joint_names[: len(columns.joints)]):
        if not capture.seen_theta[:, k].any():
            raise ValueError(f"{path}: no line has an angle of joint {name!r}.")
    if columns.has_orientation and not capture.seen_rotation.any():
        raise ValueError(f"{path}: no line has an orientation.")
    return capture


def _lines(path: str | os.PathLike[str]) -> Iterator[tuple[int, str]]:
    """Numbers and texts of the lines that are neither blank nor comments."""
    number = 0
    with reading(path) as file:
        while line := file.readline(_LONGEST_LINE + 1):
            if len(line) > _LONGEST_LINE:
                raise ValueError(f"{path}, line {number + 1}: it has more than {_LONGEST_LINE} bytes.")
            try:
                text = line.decode("utf-8" if number else "utf-8-sig")
            except UnicodeDecodeError:
                raise ValueError(f"cannot read {shorten(str(path))}: it is not text in UTF-8.") from None
            for part in text.rstrip("\r\n").split("\r"):  # old files end their lines with a carriage return alone
                number += 1
                if part.strip() and not part.lstrip().startswith("#"):
                    yield number, part


@contextmanager
def _at(path: str | os.PathLike[str], number: int) -> Iterator[None]:
    """Put file and line before the message of a `ValueError`."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{path}, line {number}: {error}") from error


def _number(cell: str, what: str) -> float:
    if cell.lower() in _GAPS:
        return math.nan
    try:
        value = math.inf if "_" in cell else float(cell)
    except ValueError:
        value = math.inf
    if not math.isfinite(value):
        raise ValueError(f"{what} is {shorten(cell)}; it must be a finite number, or empty where nothing was seen.")
    return value


def _beyond_reason(lower: float, upper: float) -> float:
    limit = max(abs(float(lower)), abs(float(upper)))
    return max(1.5 * limit, math.pi) if math.isfinite(limit) else 8 * math.pi


def _joint_angles(cells: list[str], columns: Columns, names: tuple[str, ...], largest: list[float]) -> list[float]:
    angles = []
    for column, factor, name, most in zip(columns.joints, columns.joint_factors, names, largest, strict=False):
        angles.append(_number(cells[column], f"joint angle {name!r}") * factor)
        _check_angle(angles[-1], cells[column], f"joint angle {name!r}", factor, most)
    return angles


def _check_angle(angle: float, cell: str, what: str, factor: float, most: float) -> None:
    if abs(angle) > most:
        unit, other = ("rad", "degrees") if factor == 1 else ("deg", "other units")
        raise ValueError(
            f"{what} is {cell} {unit}, beyond reason (more than {most / factor:.4g} {unit}); is it in {other}?"
        )


def _orientation(cells: list[str], columns: Columns) -> list[float]:
    """Quaternion or ZXZ angles [rad], all NaN where one is missing."""
    values = [_number(cells[column], "orientation") for column in (*columns.quaternion, *columns.zxz)]
    if any(map(math.isnan, values)):
        return [math.nan] * len(values)
    if columns.quaternion:
        length = math.hypot(*values)
        if abs(length - 1) > UNIT_TOLERANCE:
            raise ValueError(f"the quaternion {values} has length {length:.4g}; it must be 1. Leave gaps empty.")
        return values
    for key, (column, factor, value) in enumerate(zip(columns.zxz, columns.zxz_factors, values, strict=True), 1):
        _check_angle(value * factor, cells[column], f"ZXZ angle {key}", factor, 8 * math.pi)
    return [value * factor for value, factor in zip(values, columns.zxz_factors, strict=True)]


def _rotations(rows: np.ndarray, quaternion: bool) -> np.ndarray:
    """(m, 3, 3), NaN where nothing was seen."""
    from scipy.spatial.transform import Rotation

    seen = np.isfinite(rows).all(axis=1)
    turned = Rotation.from_quat(rows[seen], scalar_first=True) if quaternion else Rotation.from_euler("ZXZ", rows[seen])
    rotations = np.full((len(rows), 3, 3), np.nan)
    rotations[seen] = turned.as_matrix()
    return rotations

"""Joint trajectories in files: CSV, and ROS 2 `trajectory_msgs/JointTrajectory`, written whole or not at all."""

import json
import os
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from reojax._internal.arrays import as_numbers
from reojax._internal.checks import number, shorten
from reojax._internal.files import check_ending, replacing
from reojax.captures.columns import read_header, split
from reojax.files.points import Movement, points_of
from reojax.motion.time_laws import Law
from reojax.robot import Robot

FORMATS = ("csv", "yaml", "yml", "json")
"""Kinds of trajectory file, by the ending of the name; the last three are the same text."""
REST = 1e-6
"""Largest joint rate at the ends of a trajectory, as a share of the largest on the way, that counts as rest."""


def check_trajectory(path: str | os.PathLike[str]) -> Path:
    """Return `path` if a trajectory can be written there now; for asking before a long computation.

    Raises:
        ValueError: for an ending that is not in `FORMATS`, or a path that cannot be written.
    """
    return check_ending(path, "trajectory", FORMATS)


def write_trajectory(
    path: str | os.PathLike[str],
    robot: Robot,
    time: ArrayLike | Movement,
    theta: ArrayLike | None = None,
    theta_dot: ArrayLike | None = None,
    theta_ddot: ArrayLike | None = None,
    effort: ArrayLike | None = None,
    *,
    durations: ArrayLike | None = None,
    law: Law | str = "quintic",
    rate: float = 200.0,
    delay: float = 0.0,
) -> None:
    """Write a joint trajectory to `path`, in the format that its ending says.

    A .csv has a header with units and one line per point: `time [s]`, then angle, rate, acceleration and, if given,
    torque of every joint. A .yaml, .yml or .json holds a ROS 2 `trajectory_msgs/JointTrajectory` as JSON, which is
    YAML too: `ros2 topic pub --once TOPIC trajectory_msgs/msg/JointTrajectory "$(cat FILE)"`. Its controllers join
    points by quintics and do not check them, so that one must begin and end at rest.

    Args:
        path: the file; it changes only when everything has been written.
        robot: its joint names are written.
        time: (m,) [s], strictly increasing, m >= 2, the first point at time zero; or instead of the four arrays a
            `Motion`, a `Trajectory`, or a `Path`, `Plan`, `FreePaths` or `SavedPlan` with `durations`.
        theta: (m, j) joint angles [rad].
        theta_dot: (m, j) joint rates [rad/s].
        theta_ddot: (m, j) joint accelerations [rad/s^2].
        effort: (m, j) joint torques [N m].
        durations: of a path or plan, seconds of each edge, or one number for every edge.
        law: of a path or plan, the time law of every edge, or its name.
        rate: of anything but arrays and a motion, which has its own times, points per second, about [Hz].
        delay: time from the start to the first point [s].

    Raises:
        ValueError: for wrong shapes, numbers that are not finite, times that do not increase by a nanosecond or more,
            a start or end in motion (ROS 2), missing arrays or durations, plans of many targets, a negative delay,
            joint names that could not be read back from a .csv, or a path that cannot be written.
    """
    check_trajectory(path)
    if isinstance(time, Movement):
        if any(array is not None for array in (theta, theta_dot, theta_ddot)):
            raise ValueError(f"angles, rates or accelerations are given; a {type(time).__name__} has its own.")
        time, theta, theta_dot, theta_ddot = points_of(time, durations=durations, law=law, rate=rate)
    elif durations is not None:
        raise ValueError("`durations` is given; only a path or a plan needs them, not arrays.")
    names = {"positions": "theta", "velocities": "theta_dot", "accelerations": "theta_ddot", "effort": "effort"}
    columns: dict[str, ArrayLike] = {}
    for key, array in (("positions", theta), ("velocities", theta_dot), ("accelerations", theta_ddot)):
        if array is None:
            raise ValueError(
                f"`{names[key]}` is missing: `time` is a {type(time).__name__}, no motion, trajectory, path or plan."
            )
        columns[key] = array
    if effort is not None:
        columns["effort"] = effort
    when = _numbers("time", time)
    if when.ndim != 1 or len(when) < 2:
        raise ValueError(f"`time` has shape {when.shape}; it must be (m,) with at least two points.")
    arrays = {key: _numbers(names[key], value) for key, value in columns.items()}
    for key, array in arrays.items():
        if array.shape != (len(when), robot.joints):
            expected = (len(when), robot.joints)
            raise ValueError(f"`{names[key]}` has shape {array.shape}; for {robot.name!r} it must be {expected}.")
    try:
        delay = number("delay", delay, unit="s", least=0.0)
    except ValueError:
        raise ValueError(f"`delay` is {shorten(delay)}; it must be a time in seconds, not negative.") from None
    nanoseconds = np.round((when - when[0] + delay) * 1e9).astype(np.int64)
    if (np.diff(nanoseconds) < 1).any():
        point = int(np.argmax(np.diff(nanoseconds) < 1)) + 1
        raise ValueError(f"time[{point}] is {when[point]:g} s, not after {when[point - 1]:g} s; times must increase.")
    if Path(path).suffix.lower() == ".csv":
        text = _csv(robot, nanoseconds * 1e-9, arrays)
    else:
        _check_rest(robot, arrays["velocities"])
        text = _joint_trajectory(robot, nanoseconds, arrays)
    with replacing(path) as file:
        file.write(text.encode())


def _numbers(entry: str, value: ArrayLike) -> np.ndarray:
    array = np.asarray(as_numbers(entry, value), float)
    if not np.isfinite(array).all():
        where = ", ".join(map(str, np.argwhere(~np.isfinite(array))[0]))
        raise ValueError(f"{entry}[{where}] is not finite.")
    return array


def _check_rest(robot: Robot, rates: np.ndarray) -> None:
    allowed = REST * np.abs(rates).max(initial=0)
    for end, row in (("start", rates[0]), ("end", rates[-1])):
        if (np.abs(row) > allowed).any():
            joint = int(np.abs(row).argmax())
            raise ValueError(
                f"the trajectory does not {end} at rest: joint {shorten(robot.joint_names[joint])} moves at "
                f"{row[joint]:.4g} rad/s there; a ROS 2 controller would jump. Write a .csv, or choose a motion that "
                "rests at both ends."
            )


def _csv(robot: Robot, time: np.ndarray, arrays: dict[str, np.ndarray]) -> str:
    units = {"positions": ("", "rad"), "velocities": ("rate ", "rad/s"), "accelerations": ("acceleration ", "rad/s^2")}
    units["effort"] = ("torque ", "N m")
    header = ["time [s]"]
    header += [f"{units[key][0]}{name} [{units[key][1]}]" for key in arrays for name in robot.joint_names]
    rows = np.concatenate([time[:, None], *arrays.values()], axis=1)
    lines = [",".join(_quote(cell) for cell in header)]
    _check_readable(robot, lines[0], len(header))
    lines += [",".join(f"{x:.12g}" for x in row) for row in rows]
    return "\n".join(lines) + "\n"


def _check_readable(robot: Robot, header: str, width: int) -> None:
    """Refuse joint names whose columns another program, or `read_capture`, could mistake."""
    for name in robot.joint_names:
        if any(not mark.isprintable() for mark in name) or name != name.strip():
            raise ValueError(f"a .csv cannot have a joint named {shorten(name)}: no marks that do not print, please.")
    try:
        cells, _ = split(header)
        joints = read_header(cells, robot.joint_names, None).joints if len(cells) == width else ()
    except ValueError as error:
        raise ValueError(f"with these joint names a .csv could not be read back: {error}") from error
    if joints != tuple(range(1, robot.joints + 1)):
        names = shorten(", ".join(robot.joint_names))
        raise ValueError(f"the columns of a .csv could not be told apart with the joint names {names}.")


def _quote(cell: str) -> str:
    return '"' + cell.replace('"', '""') + '"' if any(mark in cell for mark in ',"\n') else cell


def _joint_trajectory(robot: Robot, nanoseconds: np.ndarray, arrays: dict[str, np.ndarray]) -> str:
    points = []
    for k, total in enumerate(nanoseconds.tolist()):
        point = {key: array[k].tolist() for key, array in arrays.items()}
        seconds, rest = divmod(total, 10**9)
        points.append(json.dumps(point | {"time_from_start": {"sec": seconds, "nanosec": rest}}, allow_nan=False))
    names = json.dumps(list(robot.joint_names))
    header = '{"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}'
    listed = ",\n  ".join(points)
    return f'{{"header": {header},\n "joint_names": {names},\n "points": [\n  {listed}\n ]}}\n'

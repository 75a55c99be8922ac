"""The twelve robots of the atlas: where each comes from, how it rests, what it keeps clear by, and its motors."""

import warnings
from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from any_robot_parts.files import folder_of
from common.motors import motors_of

import reojax
from reojax import RE_MAX_17, Motor, robots

THESIS_AXES = {"roll": (0.0, 0.0, 1.0), "pitch": (1.0, 0.0, 0.0), "yaw": (0.0, 1.0, 0.0)}
"""Of robots laid out as the thesis's: their long axis is z, their centre bends about x."""
USUAL_AXES = {"roll": (1.0, 0.0, 0.0), "pitch": (0.0, 1.0, 0.0), "yaw": (0.0, 0.0, 1.0)}
"""Of the others: x forwards, z up."""


class Line(NamedTuple):
    """Torque-speed lines at the joints, gears included; one number, or one for each joint."""

    stall: float | Sequence[float]
    """Torque at standstill [N m]."""
    free: float | Sequence[float]
    """Speed without a load [rad/s]."""


class Entry(NamedTuple):
    """What the atlas knows of a robot."""

    make: Callable[[], reojax.Robot]
    source: str
    """Where it comes from, or the package that has its file."""
    axes: dict[str, tuple[float, float, float]]
    clearance: float
    """What its parts keep apart along every path [m]; chosen."""
    motors: Motor | Line
    said: str
    """The motors in words."""
    start: Sequence[float] | None = None
    """Posture at rest, by default the one nearest to zero within the limits [rad]."""


class Subject(NamedTuple):
    """A robot, ready to be asked."""

    name: str
    robot: reojax.Robot
    start: np.ndarray
    """(j,) posture at rest [rad]."""
    axes: dict[str, np.ndarray]
    clearance: float
    motors: Motor


def _file(package: str, file: str) -> Callable[[], reojax.Robot]:
    def make() -> reojax.Robot:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return reojax.load_robot(folder_of(package) / file)

    return make


_SMALL, _LARGE = (9.0, 1.2218), (39.0, 1.3963)  # Kinova Gen3 [N m, rad/s]
_GO1 = ((23.7, 30.1), (23.7, 30.1), (35.55, 20.06))
_LEG = ((88, 32), (139, 20), (88, 32), (139, 20), (35, 30), (35, 30))
_WAIST = ((88, 32), (35, 30), (35, 30))
_ARM = ((25, 37), (25, 37), (25, 37), (25, 37), (25, 37), (5, 22), (5, 22))


def _lines(rows: Sequence[tuple[float, float]]) -> Line:
    return Line(*map(list, zip(*rows, strict=True)))


ENTRIES = {
    "prototype": Entry(robots.prototype, "the thesis", THESIS_AXES, 0.005, RE_MAX_17, "RE-max 17, 24:1, 12 V"),
    "six_body": Entry(robots.six_body, "the thesis", THESIS_AXES, 0.005, RE_MAX_17, "RE-max 17, 24:1, 12 V"),
    "two_cylinder_cat": Entry(
        lambda: robots.two_cylinder_cat(0.25), "Kane and Scher", THESIS_AXES, 0.01, Line(1.0, 20.0),
        "chosen: 1 N m, 20 rad/s",
    ),
    "planar4": Entry(
        lambda: robots.planar(4), "chosen", USUAL_AXES, 0.01, Line(1.0, 10.0), "chosen: 1 N m, 10 rad/s"
    ),
    "satellite_arm": Entry(
        robots.satellite_arm, "Kinova's Gen3 on a cube", USUAL_AXES, 0.02, _lines([_LARGE] * 4 + [_SMALL] * 3),
        "Kinova: 39 N m, 1.40 rad/s; wrist 9 N m, 1.22 rad/s", (0.0, 0.6, 0.0, 1.2, 0.0, 0.8, 0.0),
    ),
    "quadruped": Entry(
        robots.quadruped, "Solo12, limits chosen", USUAL_AXES, 0.005, Line(2.7, 40.0),
        "Grimminger et al.: 2.7 N m; 40 rad/s chosen",
    ),
    "astronaut": Entry(
        robots.astronaut, "de Leva", USUAL_AXES, 0.01, Line(50.0, 8.0), "chosen: 50 N m, 8 rad/s"
    ),
    "SPART arm": Entry(
        _file("spartpy", "urdf/floating_7dof_manipulator.urdf"), "spartpy", USUAL_AXES, 0.02, Line(20.0, 1.0),
        "chosen: 20 N m, 1 rad/s",
    ),
    "Solo12": Entry(
        _file("example-robot-data", "solo_description/robots/solo12.urdf"), "example-robot-data", USUAL_AXES, 0.005,
        Line(2.7, 40.0), "Grimminger et al.: 2.7 N m; 40 rad/s chosen",
    ),
    "Go1": Entry(
        _file("example-robot-data", "go1_description/urdf/go1.urdf"), "example-robot-data", USUAL_AXES, 0.005,
        _lines(_GO1 * 4), "its file: 23.7 N m, 30 rad/s; knees 35.6 N m, 20 rad/s",
    ),
    "G1": Entry(
        _file("example-robot-data", "g1_description/urdf/g1_29dof_rev_1_0.urdf"), "example-robot-data", USUAL_AXES,
        0.005, _lines(_LEG * 2 + _WAIST + _ARM * 2), "its file: 5 to 139 N m, 20 to 37 rad/s",
    ),
    "Ant": Entry(
        _file("gymnasium", "envs/mujoco/assets/ant.xml"), "gymnasium", USUAL_AXES, 0.01, Line(150.0, 10.0),
        "its file: 150 N m; 10 rad/s chosen",
    ),
}  # fmt: skip
"""By name; the public ones from packages of the extra `zoo`."""

_SHARE = 0.5
"""Share of the clearance at rest that is asked for at most."""


@cache
def subject(name: str) -> Subject:
    """Build a robot and put it at rest.

    Raises:
        any_robot_parts.files.Missing: if the package with its file is not installed.
    """
    entry = ENTRIES[name]
    robot = entry.make()
    start = np.zeros(robot.joints) if entry.start is None else np.array(entry.start)
    start = np.clip(start, robot.lower, robot.upper)
    apart = np.asarray(reojax.clearance(robot, start))
    margin = min(entry.clearance, _SHARE * float(apart.min())) if apart.size else 0.0
    axes = {axis: np.array(vector) for axis, vector in entry.axes.items()}
    motors = entry.motors if isinstance(entry.motors, Motor) else motors_of(robot, *entry.motors)
    return Subject(name, robot, start, axes, margin, motors)


def box_of(subject: Subject) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest angles (j,) that its joints take on the way [rad].

    Its limits; half a turn from the posture at rest where there are none, a turn at most.
    """
    start, lower, upper = subject.start, np.asarray(subject.robot.lower), np.asarray(subject.robot.upper)
    half = np.where(np.isfinite(upper - lower), 2 * np.pi, np.pi)
    return np.maximum(lower, start - half), np.minimum(upper, start + half)

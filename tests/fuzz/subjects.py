"""Public functions with arguments that are right, and what is put in the place of one or two of them.

What a version of reojax does not have is left out, so that two versions can be compared.
"""

import datetime
import inspect
import math
import operator
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import reojax

ROBOT = reojax.robots.prototype()
PATH = reojax.manoeuvre_a(1.0, 0.5)
TRAJECTORY = reojax.along(PATH, "quintic", 0.2)
TIME = np.linspace(0, 1, 12)
CAPTURE = reojax.make_capture(TIME, np.zeros((12, 3)), np.broadcast_to(np.eye(3), (12, 3, 3)))
MOTION = reojax.simulate(ROBOT, PATH, durations=0.2, samples=16)
TURN = np.asarray(reojax.net_rotation(ROBOT, PATH))
NO_JOINTS = reojax.make_robot(
    mass=[1.0], com=np.zeros((1, 3)), inertia=[np.eye(3)], axis=np.zeros((0, 3)), anchor=np.zeros((0, 3))
)
STACKED = jax.tree.map(lambda x: np.stack([x, x]), ROBOT)

VALUES: list[Any] = [
    None, True, False, 0, 1, -1, 3, 2**70, -(2**70), 0.0, -0.0, 0.5, -0.5, 1e-300, 1e308, -1e308, 90.0, math.nan,
    math.inf, -math.inf, 1j, "", "x", "0.5", "x" * 10**5, b"x", [], [0.1], [0.1, 0.2, 0.3], [0.1, math.nan, 0.3],
    [0.1, True, 0.3], ["a", "b", "c"], [[1, 2], [3]], {}, {"a": 1}, (), set(), object(), print, np.float16(0.5),
    np.longdouble(0.5), np.timedelta64(5, "ms"), np.datetime64("2020-01-01"), datetime.timedelta(seconds=1),
    np.zeros((2, 3)), np.zeros((2, 0)), np.zeros(0), np.full((2, 3), np.nan), np.eye(3), 2 * np.eye(3), -np.eye(3),
    np.diag([1.0, 1, -1]), np.eye(3, dtype=bool), np.eye(3, dtype=int), np.zeros((5, 3, 3)), np.zeros((0, 3, 3)),
    np.ma.masked_array([1.0, 2.0, 3.0], [1, 0, 0]), np.zeros(3, "float16"), jnp.ones(3, jnp.bfloat16), np.array(["1"]),
    np.ones((2, 3), np.float32), np.ones(10**5), ROBOT, NO_JOINTS, STACKED, PATH, reojax.polygon(np.zeros((1, 3))),
    reojax.polygon(np.zeros((3, 2))), TRAJECTORY, CAPTURE, MOTION, reojax.RE_MAX_17, reojax.Release(),
    reojax.FOUR_BODY, reojax.SIX_BODY, Path("/nowhere/x.csv"), "/dev/null", "/dev/full",
]  # fmt: skip

LIMITS = {"twist_limit": 2.0, "bend_limit": 1.5, "max_manoeuvres": 2}
_WRITE = "x.csv"


def _write(path: Any, time: Any, t: Any, delay: Any) -> Any:
    return reojax.write_trajectory(path, ROBOT, time, t, t, t, delay=delay)


def _release(momentum: Any, drag: Any, pull: Any) -> Any:
    return reojax.released(ROBOT, TRAJECTORY, reojax.Release(momentum, pull=pull, drag=drag), samples=4)


def _merge(folders: Any) -> Any:
    return reojax.merge(folders).results


def _replace(field: str) -> Callable[[Any], Any]:
    def replaced(value: Any) -> Any:
        changed = ROBOT.replace(**{field: value})
        return reojax.net_rotation(changed, PATH, steps=2)

    return replaced


def _problem(variable: Any, lower: Any, upper: Any, target: Any, weight: Any) -> Any:
    variables = [reojax.design.Variable(variable, lower, upper, "rad")]
    cost = reojax.design.weighted({reojax.design.travel(): weight})
    turned = [reojax.design.turned_to(target)]
    return reojax.design.Problem(_build, variables, objective=cost, equality=turned).starts(2)


def _build(values: Any) -> Any:
    return ROBOT, reojax.manoeuvre_a(1.0, values["bend"])


def _sweep(function: Any, axes: Any, chunk_size: Any) -> Any:
    return reojax.sweep(function, axes, chunk_size=chunk_size).results


CHEAP: dict[str, tuple[Any, dict[str, Any]]] = {
    "polygon": ("polygon", {"waypoints": np.zeros((2, 3))}),
    "manoeuvre_a": ("manoeuvre_a", {"twist": 1.0, "bend": 0.5}),
    "manoeuvre_b": ("manoeuvre_b", {"twist": 1.0, "bend": 0.5, "layout": reojax.FOUR_BODY}),
    "Layout": (lambda **k: reojax.manoeuvre_a(1.0, 0.5, reojax.Layout(**k)), {"joints": 3, "twist": (0, 2), "bend": 1}),
    "momentum_matrices": ("momentum_matrices", {"robot": ROBOT, "theta": np.zeros(3)}),
    "connection": ("connection", {"robot": ROBOT, "theta": np.zeros(3)}),
    "angular_momentum": (
        "angular_momentum",
        {"robot": ROBOT, "theta": np.zeros(3), "theta_dot": np.zeros(3), "omega": np.zeros(3)},
    ),
    "inverse_dynamics": (
        "inverse_dynamics",
        {"robot": ROBOT, "theta": np.zeros(3), "theta_dot": np.zeros(3), "theta_ddot": np.zeros(3)},
    ),
    "joint_inertia": ("joint_inertia", {"robot": ROBOT, "theta": np.zeros(3)}),
    "curvature": ("curvature", {"robot": ROBOT, "theta": np.zeros(3)}),
    "link_poses": ("link_poses", {"robot": ROBOT, "theta": np.zeros(3)}),
    "centre_of_mass": ("centre_of_mass", {"robot": ROBOT, "theta": np.zeros(3)}),
    "clearance": ("clearance", {"robot": ROBOT, "theta": np.zeros(3)}),
    "along": ("along", {"path": PATH, "law": "quintic", "durations": 0.2}),
    "through": ("through", {"path": PATH, "durations": 0.2}),
    "trapezoid": ("trapezoid", {"ramp": 0.3}),
    "minimum_jerk": ("minimum_jerk", {"times": [0.5], "places": [0.5]}),
    "with_motors": ("with_motors", {"robot": ROBOT, "motors": reojax.RE_MAX_17}),
    "gains": ("gains", {"robot": ROBOT, "bandwidth": 100.0, "theta": None}),
    "make_capture": ("make_capture", {"time": TIME, "theta": np.zeros((12, 3)), "rotation": None}),
    "read_capture": ("read_capture", {"path": "/nowhere", "robot": ROBOT, "angle_unit": None}),
    "write_trajectory": (_write, {"path": _WRITE, "time": TIME, "t": np.zeros((12, 3)), "delay": 0.0}),
    "merge": (_merge, {"folders": "/nowhere"}),
    "make_robot": (
        "make_robot",
        {"mass": [1.0, 1.0], "com": np.zeros((2, 3)), "inertia": [np.eye(3)] * 2, "axis": [[0, 0, 1.0]],
         "anchor": np.zeros((1, 3)), "lower": [-1.0], "upper": [1.0], "rotor_on": None, "name": "r", "parent": None,
         "gear_ratio": None, "rotor_inertia": None, "link_names": None, "joint_names": None, "capsules": (),
         "collision_pairs": None, "couplings": None, "layout": None, "notes": ()},
    ),
    "capsule": (
        lambda **k: reojax.robots.with_capsules(ROBOT, [reojax.Capsule(**k)]),
        {"link": 0, "start": np.zeros(3), "end": np.ones(3), "radius": 0.1},
    ),
    "robots.planar": ("robots.planar", {"n": 3, "mass": 1.0, "length": 1.0}),
    "robots.by_name": ("robots.by_name", {"name": "prototype"}),
    "with_end_inertia": ("robots.with_end_inertia", {"robot": ROBOT, "inertia": 1e-4}),
    "with_gear_ratio": ("robots.with_gear_ratio", {"robot": ROBOT, "ratio": 24.0}),
    "with_limits": ("robots.with_limits", {"robot": ROBOT, "lower": -1.0, "upper": {"bend": 1.0}}),
    "design.Problem": (_problem, {"variable": "bend", "lower": -1.0, "upper": 1.0, "target": np.eye(3), "weight": 1.0}),
    "design.rectangles": (
        lambda **k: reojax.design.rectangles(**k).variable, {"robot": ROBOT, "start": 0.0, "lead": False}
    ),
    "design.polygons": (lambda **k: reojax.design.polygons(**k).variable, {"robot": ROBOT, "corners": 3, "start": 0.0}),
    "design.fourier_loops": (
        lambda **k: reojax.design.fourier_loops(**k).variable, {"robot": ROBOT, "degree": 2, "start": 0.0}
    ),
    "design.with_mass": ("design.with_mass", {"robot": ROBOT, "link": 0, "mass": 0.1}),
    "design.with_length": ("design.with_length", {"robot": ROBOT, "link": 1, "factor": 1.1, "along": None}),
    "design.with_com_offset": ("design.with_com_offset", {"robot": ROBOT, "link": 1, "offset": np.zeros(3)}),
    "design.turned_about": (lambda **k: callable(reojax.design.turned_about(**k)), {"axis": [0, 0, 1.0], "angle": 1.0}),
    "zipped": (lambda axes: reojax.zipped(axes), {"axes": {"a": [1.0, 2.0]}}),
    "load_robot": ("load_robot", {"path": "/nowhere", "base": None, "lock": None, "gear_ratio": None, "name": None}),
    "save_robot": ("save_robot", {"robot": ROBOT, "path": "x.json"}),
    "write_mjcf": ("write_mjcf", {"robot": ROBOT, "path": "x.xml"}),
    "load_plan": ("load_plan", {"path": "/nowhere"}),
    "view": ("view", {"robot": ROBOT, "motion": MOTION, "certificate": False, "file": "x.html", "target": None,
                      "beside": None,
                      "ghost": None, "names": None, "title": None, "up": None, "rows": None}),
    "so3.exp": ("so3.exp", {"vector": np.ones(3)}),
    "so3.log": ("so3.log", {"rotation": np.eye(3)}),
    "so3.from_quaternion": ("so3.from_quaternion", {"quaternion": [1.0, 0, 0, 0]}),
    "joint_travel": ("joint_travel", {"path": PATH}),
    "plan refused": ("plan", {"robot": NO_JOINTS, "target": np.eye(3), **LIMITS}),
} | {
    f"replace {field}": (_replace(field), {"value": getattr(ROBOT, field)})
    for field in ("mass", "com", "inertia", "axis", "anchor", "rotor_inertia", "gear_ratio", "lower", "rotor_on",
                  "parent", "link_names", "joint_names", "name")
}  # fmt: skip
"""What takes some milliseconds."""

COMPILING = """momentum_matrices connection angular_momentum inverse_dynamics joint_inertia curvature link_poses
centre_of_mass clearance gains so3.exp so3.log so3.from_quaternion view write_mjcf""".split()
"""Those that compile a program all the same."""

DEAR: dict[str, tuple[Any, dict[str, Any]]] = {
    "net_rotation": ("net_rotation", {"robot": ROBOT, "path": PATH, "steps": 2}),
    "rotation_history": ("rotation_history", {"robot": ROBOT, "path": PATH, "samples": 4}),
    "certify": ("certify", {"robot": ROBOT, "path": PATH, "steps": 2, "samples": 16}),
    "controllable_directions": ("controllable_directions", {"robot": ROBOT, "theta": np.zeros(3)}),
    "path_clearance": ("path_clearance", {"robot": ROBOT, "path": PATH}),
    "simulate": (
        "simulate",
        {"robot": ROBOT, "path": PATH, "law": "quintic", "durations": 0.2, "motors": None, "momentum": None,
         "samples": 16, "substeps": None},
    ),
    "released": (
        "released",
        {"robot": ROBOT, "trajectory": TRAJECTORY, "release": reojax.Release(), "samples": 4, "substeps": None},
    ),
    "release": (_release, {"momentum": (0.0, 0.0, 1e-4), "drag": 1e-6, "pull": (0.0, 0.0, 0.0)}),
    "release_spread": (
        "release_spread",
        {"robot": ROBOT, "trajectory": TRAJECTORY, "deviation": reojax.Release((1e-5, 1e-5, 1e-5)),
         "key": jax.random.key(0), "draws": 4, "steps": 4},
    ),
    "minimum_time": (
        "minimum_time",
        {"robot": ROBOT, "path": PATH, "motors": reojax.RE_MAX_17, "law": "quintic", "samples": 16},
    ),
    "track": (
        "track",
        {"robot": ROBOT, "trajectory": TRAJECTORY, "motors": reojax.RE_MAX_17,
         "gains": reojax.Gains(0.1, 1.0, 0.01), "sample_time": 5e-3, "counts": 512.0, "settle": 0.0, "momentum": None,
         "model": None, "substeps": 1},
    ),
    "compare": ("compare", {"robot": ROBOT, "capture": CAPTURE, "motion": MOTION, "offset": 0.0}),
    "calibrate": (
        "calibrate",
        {"robot": ROBOT, "capture": CAPTURE, "parameters": ("end_inertia",), "clock": True, "joint_noise": None,
         "max_steps": 2},
    ),
    "plan": ("plan", {"robot": ROBOT, "target": TURN, **LIMITS, "objective": "count", "vocabulary": "manoeuvres",
                      "layout": None, "clearance": None, "tolerance": 1e-9}),
    "replan": ("replan", {"robot": ROBOT, "target": TURN, "measured": np.eye(3), **LIMITS}),
    "plan_many": ("plan_many", {"robot": ROBOT, "targets": TURN[None], **LIMITS}),
    "free_path": (
        "free_path",
        {"robot": ROBOT, "target": TURN, "start": None, "end": None, "joints": None, "lower": None, "upper": None,
         "repeats": 1, "clearance": None, "corners": 4, "starts": 1, "tolerance": 1e-6, "max_steps": 3, "seed": 0},
    ),
    "righting": (
        "righting",
        {"robot": ROBOT, "target": TURN, "momentum": [0, 0, 1e-4], "duration": 1.0, "start": None, "end": None,
         "motors": None, "weights": None, "pieces": 4, "starts": 1, "tolerance": 1e-3, "max_steps": 2, "seed": 0},
    ),
    "correction_gains": (
        "correction_gains",
        {"robot": ROBOT, "motion": PATH, "samples": 4, "weights": None, "window": 0.1, "left": 0.1, "momentum": None},
    ),
    "design.spread": (
        "design.spread",
        {"robot": ROBOT, "path": PATH, "tolerances": {"mass": 1e-3}, "draws": 4, "seed": 0, "steps": 2},
    ),
    "design.sensitivities": ("design.sensitivities", {"robot": ROBOT, "path": PATH, "steps": 2}),
    "sweep": (_sweep, {"function": lambda a: {"b": a * 2}, "axes": {"a": np.arange(4.0)}, "chunk_size": 2}),
}  # fmt: skip
"""What compiles."""


def calls(of: dict[str, tuple[Any, dict[str, Any]]], draw: random.Random) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Without end: every argument by every value in random order, then two at once."""
    there = {name: (_function(function), arguments) for name, (function, arguments) in of.items()}
    there = {name: (f, _taken(f, right)) for name, (f, right) in there.items() if f and _is_there(of[name][0], right)}
    once = [(name, entry, k) for name, (_, right) in there.items() for entry in right for k in range(len(VALUES))]
    draw.shuffle(once)
    for name, entry, k in once:
        yield _call(name, *there[name], {entry: VALUES[k]})
    while True:
        name = draw.choice(list(there))
        function, right = there[name]
        entries = draw.sample(list(right), min(2, len(right)))
        yield _call(name, function, right, {entry: draw.choice(VALUES) for entry in entries})


def _function(function: Any) -> Callable[..., Any] | None:
    if not isinstance(function, str):
        return function
    try:
        return operator.attrgetter(function)(reojax)
    except AttributeError:
        return None


def _is_there(function: Any, right: dict[str, Any]) -> bool:
    """Whether this version has what a function written here calls: with arguments that are right it does."""
    if isinstance(function, str):
        return True
    try:
        function(**right)
    except (AttributeError, TypeError):
        return False
    except ValueError:  # a path that nobody can write
        pass
    return True


def _taken(function: Callable[..., Any], right: dict[str, Any]) -> dict[str, Any]:
    """Those of the arguments that this version of the function takes."""
    known = inspect.signature(function).parameters
    if any(parameter.kind == parameter.VAR_KEYWORD for parameter in known.values()):
        return right
    return {entry: value for entry, value in right.items() if entry in known}


def _call(name: str, function: Callable[..., Any], right: dict, wrong: dict) -> tuple[str, Callable[[], Any]]:
    shown = ", ".join(f"{entry}={repr(value)[:60]}" for entry, value in wrong.items())
    return f"{name}({shown})", lambda: function(**(right | wrong))

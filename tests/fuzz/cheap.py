"""Public functions that take some milliseconds, with arguments that are right."""

from collections.abc import Callable
from typing import Any

import numpy as np

import reojax
from fuzz.values import LIMITS, MOTION, NO_JOINTS, PATH, ROBOT, TIME

_WRITE = "x.csv"


def _write(path: Any, time: Any, t: Any, delay: Any) -> Any:
    return reojax.write_trajectory(path, ROBOT, time, t, t, t, delay=delay)


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

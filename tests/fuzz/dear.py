"""Public functions that compile programs of some size, with arguments that are right; shapes are few."""

from typing import Any

import jax
import numpy as np

import reojax
from fuzz.values import CAPTURE, MOTION, PATH, ROBOT, TRAJECTORY, TURN

ZERO = np.zeros(3)


def _release(momentum: Any, drag: Any, pull: Any) -> Any:
    return reojax.released(ROBOT, TRAJECTORY, reojax.Release(momentum, pull=pull, drag=drag), samples=4)


def _sweep(function: Any, axes: Any, chunk_size: Any) -> Any:
    return reojax.sweep(function, axes, chunk_size=chunk_size).results


def _motor(**numbers: Any) -> Any:
    return reojax.minimum_time(ROBOT, PATH, reojax.Motor(**numbers), samples=16)


def _write_gains(gains: Any, path: Any, name: Any) -> None:
    reojax.write_gains(GAINS if gains is None else gains, path, name=name)


def _measured(axis: Any, angle: Any, joint: Any, margin: Any, least: Any, after: Any, name: Any) -> Any:
    """All measures that are made from numbers, none of them computed."""
    design = reojax.design
    made = design.off_axis_within(axis, angle), design.bend_within(joint, "bend"), design.clear_by(margin)
    return [callable(one) for one in (*made, design.authority_above(least, after=after), design.value_of(name))]


GAINS = reojax.correction_gains(ROBOT, PATH, samples=4) if hasattr(reojax, "correction_gains") else None
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
    "correction_gains": (
        "correction_gains",
        {"robot": ROBOT, "motion": PATH, "samples": 4, "weights": None, "window": 0.1, "left": 0.1, "momentum": None},
    ),
    "design.spread": (
        "design.spread",
        {"robot": ROBOT, "path": PATH, "tolerances": {"mass": 1e-3}, "draws": 4, "seed": 0, "steps": 2},
    ),
    "design.sensitivities": ("design.sensitivities", {"robot": ROBOT, "path": PATH, "steps": 2}),
    "design.scatter": (
        "design.scatter", {"robot": ROBOT, "path": PATH, "tolerances": {"mass": 1e-3}, "steps": 2}
    ),
    "base_velocity": (
        "base_velocity", {"robot": ROBOT, "theta": ZERO, "theta_dot": ZERO, "momentum": np.zeros(3)}
    ),
    "forward_dynamics": (
        "forward_dynamics",
        {"robot": ROBOT, "theta": ZERO, "theta_dot": ZERO, "torque": ZERO, "momentum": np.zeros(3)},
    ),
    "kinetic_energy": (
        "kinetic_energy", {"robot": ROBOT, "theta": ZERO, "theta_dot": ZERO, "momentum": np.zeros(3)}
    ),
    "nearest_parts": ("nearest_parts", {"robot": ROBOT, "path": PATH, "tolerance": 1e-3}),
    "trajectory_clearance": ("trajectory_clearance", {"robot": ROBOT, "trajectory": TRAJECTORY, "tolerance": 1e-3}),
    "minimum_stretch": (
        "minimum_stretch", {"robot": ROBOT, "trajectory": TRAJECTORY, "motors": reojax.RE_MAX_17, "samples": 16}
    ),
    "motor": (_motor, {"supply": 12.0, "resistance": 3.0, "torque_constant": 0.01, "rotor_inertia": 1e-6,
                       "gear_ratio": 24.0, "efficiency": 0.9}),
    "no_load_speed": ("no_load_speed", {"motor": reojax.RE_MAX_17}),
    "stall_torque": ("stall_torque", {"motor": reojax.RE_MAX_17}),
    "joints_simulated": ("joints_simulated", {"robot": ROBOT, "capture": CAPTURE}),
    "save_plan": ("save_plan", {"plan": None, "path": "x.json", "robot": ROBOT, "target": TURN}),
    "write_gains": (_write_gains, {"gains": None, "path": "x.c", "name": "gains"}),
    "cache": ("cache", {"folder": "kept", "limit": 2**30}),
    "layout_of": ("layout_of", {"robot": ROBOT}),
    "with_joint_locked": ("robots.with_joint_locked", {"robot": ROBOT, "joint": 0, "angle": 0.1}),
    "with_rotor_inertia": ("robots.with_rotor_inertia", {"robot": ROBOT, "inertia": 1e-7}),
    "with_joint_inertia": ("design.with_joint_inertia", {"robot": ROBOT, "joint": 0, "inertia": 1e-5}),
    "with_capsules": ("robots.with_capsules", {"robot": ROBOT, "capsules": (), "collision_pairs": None}),
    "two_cylinder_cat": ("robots.two_cylinder_cat", {"axial_to_transverse": 0.5}),
    "design measures": (
        _measured,
        {"axis": [0, 0, 1.0], "angle": 0.5, "joint": "bend", "margin": 0.01, "least": 0.1, "after": 0.5, "name": "a"},
    ),
    "design.spline_loops": (
        lambda **k: reojax.design.spline_loops(**k).variable, {"robot": ROBOT, "points": 4, "samples": 8, "start": 0.0}
    ),
    "so3.hat": ("so3.hat", {"vector": np.ones(3)}),
    "so3.vee": ("so3.vee", {"matrix": np.zeros((3, 3))}),
    "so3.angle": ("so3.angle", {"rotation": np.eye(3)}),
    "so3.to_quaternion": ("so3.to_quaternion", {"rotation": np.eye(3)}),
    "so3.to_euler_zxz": ("so3.to_euler_zxz", {"rotation": np.eye(3)}),
    "so3.from_euler_zxz": ("so3.from_euler_zxz", {"angles": np.ones(3)}),
    "so3.left_jacobian": ("so3.left_jacobian", {"vector": np.ones(3)}),
    "so3.interpolate": ("so3.interpolate", {"start": np.eye(3), "end": TURN, "fraction": 0.5}),
    "so3.random": ("so3.random", {"key": jax.random.key(0)}),
    "release_spread expected": (
        "release_spread",
        {"robot": ROBOT, "trajectory": TRAJECTORY, "deviation": reojax.Release((1e-5, 1e-5, 1e-5)),
         "key": jax.random.key(0), "expected": reojax.Release(), "draws": 4},
    ),
    "sweep": (_sweep, {"function": lambda a: {"b": a * 2}, "axes": {"a": np.arange(4.0)}, "chunk_size": 2}),
}  # fmt: skip
"""What compiles."""

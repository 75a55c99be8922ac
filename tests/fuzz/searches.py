"""Solvers of the host with arguments that are right, and so few steps that they end at once."""

from typing import Any

import jax.numpy as jnp
import numpy as np

import reojax
from fuzz.values import LIMITS, PATH, ROBOT, TRAJECTORY, TURN


def _build(values: Any) -> Any:
    return ROBOT, reojax.manoeuvre_a(1.0, values["bend"])


def _solved(starts: Any, seed: Any, max_steps: Any, tolerance: Any) -> Any:
    return _PROBLEM.solve(starts, seed=seed, max_steps=max_steps, tolerance=tolerance)


def _free(**options: Any) -> Any:
    return reojax.free_path(ROBOT, TURN, corners=4, starts=1, max_steps=3, **options)


def _law(**options: Any) -> Any:
    return reojax.Steering(ROBOT, TRAJECTORY, **options).table


def _read(time: Any, theta: Any, rotation: Any, taken: Any) -> Any:
    law = reojax.Steering(ROBOT, TRAJECTORY, samples=4, steps=0)
    return law.step(law.start(), reojax.Reading(time, theta, rotation, taken))[1].theta


_PROBLEM = reojax.design.Problem(
    _build,
    [reojax.design.Variable("bend", -1.0, 1.0, "rad")],
    objective=reojax.design.travel(),
    equality=[reojax.design.turned_to(TURN)],
)
FEW = {"starts": 1, "max_steps": 2, "seed": 0}
SEARCHES: dict[str, tuple[Any, dict[str, Any]]] = {
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
    "free_path options": (
        _free, {"twist_limit": None, "bend_limit": None, "layout": None, "momentum": None, "progress": False}
    ),
    "free_paths": ("free_paths", {"robot": ROBOT, "targets": TURN[None], "corners": 4, "tolerance": 1e-6, **FEW}),
    "righting_many": (
        "righting_many",
        {"robot": ROBOT, "targets": TURN[None], "momenta": np.zeros((1, 3)), "duration": 1.0, "pieces": 4,
         "clearance": None, "shorten": False, **FEW},
    ),
    "righting_for_all": (
        "righting_for_all",
        {"robot": ROBOT, "target": TURN, "momentum": np.zeros((1, 3)), "duration": 1.0, "covariance": None,
         "pieces": 4, "tries": 1, "max_steps": 2},
    ),
    "righting_table": (
        "righting_table",
        {"robot": ROBOT, "target": TURN, "momenta": [[0.0], [0.0], [0.0, 1e-5]], "duration": 1.0, "pieces": 4,
         "tolerance": 1e-3, "max_steps": 2},
    ),
    "fastest_loop": (
        "fastest_loop",
        {"robot": ROBOT, "target": TURN, "motors": reojax.RE_MAX_17, "near": PATH, "knots": 6, "starts": 1, "seed": 0,
         "clearance": None, "max_steps": 2},
    ),
    "free_law": (
        "free_law",
        {"robot": ROBOT, "path": PATH, "motors": reojax.RE_MAX_17, "points": 3, "clearance": None, "max_steps": 2},
    ),
    "overlap": (
        "overlap",
        {"robot": ROBOT, "path": PATH, "motors": reojax.RE_MAX_17, "law": "quintic", "clearance": None,
         "max_steps": 2},
    ),
    "design.optimise": (
        "design.optimise",
        {"cost": lambda x: (x**2).sum(), "starts": np.ones((2, 2)), "lower": -np.ones(2), "upper": np.ones(2),
         "equality": None, "inequality": None, "data": None, "scale": None, "tolerance": 1e-8, "max_steps": 2},
    ),
    "design.optimise, a cost of data": (
        "design.optimise",
        {"cost": lambda x, data: (x**2).sum() * jnp.asarray(data).sum(), "starts": np.ones((2, 2)),
         "lower": -np.ones(2), "upper": np.ones(2), "data": np.ones(2), "slope_tolerance": 1e-6, "max_steps": 2},
    ),
    "design.descend": (
        "design.descend",
        {"cost": lambda x: (x**2).sum(), "starts": np.ones((2, 2)), "lower": -np.ones(2), "upper": np.ones(2),
         "data": None, "steps": 3, "rate": 0.02, "slope_tolerance": 1e-3},
    ),
    "design.Problem.solve": (_solved, {"starts": 1, "seed": 0, "max_steps": 2, "tolerance": 1e-8}),
    "Steering": (
        _law,
        {"noise": 0.01, "momentum": None, "momentum_std": 0.0, "drag_std": 0.0, "parameters": (),
         "parameters_std": (), "wander": 1e-3, "tau": 5e-3, "settle": 2e-2, "largest": 0.6, "samples": 4,
         "weights": None, "left": 0.1, "steps": 0, "goal": None, "clearance": None},
    ),
    "Steering.step": (_read, {"time": 0.0, "theta": np.zeros(3), "rotation": np.eye(3), "taken": 0.0}),
}  # fmt: skip

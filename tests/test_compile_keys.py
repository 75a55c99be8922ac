"""What is compiled for one robot serves all of its tree: names are in no compile key, and numbers such as 1 neither."""

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
import pytest

import reojax
from reojax import RE_MAX_17, Release, Robot, design, robots

DURATIONS = np.array([0.3, 0.5, 0.3, 0.5])
LOOP = reojax.manoeuvre_a(1.0, 0.8)
EVENT = "/jax/core/compile/backend_compile_duration"


def motion(robot: Robot) -> reojax.Trajectory:
    return reojax.along(LOOP, "quintic", DURATIONS)


def steered(robot: Robot) -> Any:
    law = reojax.Steering(robot, motion(robot), noise=0.01, samples=8, parameters=("mass[1]",), parameters_std=(1e-3,))
    return law.step(law.start(), reojax.Reading(0.1, np.zeros(3), np.eye(3), 0.1))


def righted(robot: Robot) -> Any:
    return reojax.righting(robot, TARGET, momentum=np.zeros(3), duration=1.0)


def calibrated(robot: Robot) -> Any:
    found = reojax.simulate(robot, LOOP, durations=DURATIONS, samples=16)
    capture = reojax.make_capture(found.time, found.theta, rotation=found.rotation)
    return reojax.calibrate(robot, capture, ["mass[1]"]).values


def clear_plan(robot: Robot) -> Any:
    kept = {"twist_limit": 1.0, "bend_limit": 0.9, "max_manoeuvres": 1, "clearance": 0.001}
    return reojax.plan(robot, TARGET, **kept)


TARGET = np.asarray(reojax.so3.exp(np.array([0.1, 0.0, 0.2])))
THETA = np.array([0.1, 0.2, 0.3])

ENTRIES: dict[str, Callable[[Robot], Any]] = {
    "momentum_matrices": lambda robot: reojax.momentum_matrices(robot, THETA),
    "centre_of_mass": lambda robot: reojax.centre_of_mass(robot, THETA),
    "curvature": lambda robot: reojax.curvature(robot, THETA),
    "inverse_dynamics": lambda robot: reojax.inverse_dynamics(robot, THETA, THETA, THETA),
    "forward_dynamics": lambda robot: reojax.forward_dynamics(robot, THETA, THETA, THETA),
    "net_rotation": lambda robot: reojax.net_rotation(robot, LOOP),
    "rotation_history": lambda robot: reojax.rotation_history(robot, LOOP, samples=4),
    "certify": lambda robot: reojax.certify(robot, LOOP),
    "controllable_directions": lambda robot: reojax.controllable_directions(robot, THETA),
    "clearance": lambda robot: reojax.clearance(robot, THETA),
    "path_clearance": lambda robot: reojax.path_clearance(robot, LOOP),
    "simulate": lambda robot: reojax.simulate(robot, LOOP, durations=DURATIONS, motors=RE_MAX_17, samples=8),
    "released": lambda robot: reojax.released(robot, motion(robot), Release(momentum=np.array([0.0, 0.0, 1e-3]))),
    "release_spread": lambda robot: reojax.release_spread(
        robot, motion(robot), Release(momentum=np.full(3, 1e-4)), jax.random.key(0), draws=4
    ),
    "minimum_time": lambda robot: reojax.minimum_time(robot, LOOP, RE_MAX_17),
    "minimum_stretch": lambda robot: reojax.minimum_stretch(robot, motion(robot), RE_MAX_17),
    "track": lambda robot: reojax.track(robot, motion(robot), RE_MAX_17, reojax.gains(robot, 3.0)),
    "correction_gains": lambda robot: reojax.correction_gains(robot, LOOP, samples=9),
    "Steering": steered,
    "righting": righted,
    "calibrate": calibrated,
    "sensitivities": lambda robot: design.sensitivities(robot, LOOP),
    "plan": lambda robot: reojax.plan(robot, TARGET, twist_limit=1.0, bend_limit=0.9, max_manoeuvres=1),
    "free_path": lambda robot: reojax.free_path(robot, TARGET, lower=-1.5, upper=1.5),
    "plan with clearance": clear_plan,
}
TURNED = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
"""As other tests of fastest motions have it, so that what they compile is kept for all."""


class Numbers(NamedTuple):
    """What problems of one kind differ by."""

    robot: Robot
    motors: reojax.Motor
    path: reojax.Path
    target: Any
    theta: np.ndarray


def numbers(robot: Robot, share: float) -> Numbers:
    """A robot, motors, a path, a target and a posture that are all `share` of some others."""
    scaled = robot.replace(mass=share * np.asarray(robot.mass), inertia=share * np.asarray(robot.inertia))
    motors, path = RE_MAX_17._replace(supply=12.0 * share), reojax.polygon(share * np.asarray(TURNED.waypoints))
    return Numbers(scaled, motors, path, np.asarray(reojax.so3.exp(np.array([0, 0, np.pi * share]))), share * THETA)


def moved(given: Numbers) -> reojax.Trajectory:
    return reojax.along(given.path, "quintic", DURATIONS)


def spread_of(given: Numbers) -> Any:
    return design.spread(given.robot, given.path, {"mass": 1e-3}, draws=4)


KINDS: dict[str, Callable[[Numbers], Any]] = {
    "clearance": lambda given: reojax.clearance(given.robot, given.theta),
    "path_clearance": lambda given: reojax.path_clearance(given.robot, given.path),
    "simulate": lambda given: reojax.simulate(
        given.robot, given.path, durations=DURATIONS, motors=given.motors, samples=8
    ),
    "minimum_time": lambda given: reojax.minimum_time(given.robot, given.path, given.motors),
    "track": lambda given: reojax.track(given.robot, moved(given), given.motors, reojax.gains(given.robot, 3.0)),
    "spread": spread_of,
    "correction_gains": lambda given: reojax.correction_gains(given.robot, given.path, samples=9),
    "overlap": lambda given: reojax.overlap(given.robot, given.path, given.motors),
    "free_law": lambda given: reojax.free_law(given.robot, given.path, given.motors, points=1),
    "fastest_loop": lambda given: reojax.fastest_loop(
        given.robot, given.target, given.motors, given.path, knots=5, starts=1
    ),
}
QUICK = {"net_rotation", "clearance", "simulate", "minimum_time", "plan"}


def compiled(work: Callable[[], Any]) -> int:
    """How many programs are compiled, or read from a store, while `work` is done."""
    found = []

    def count(event: str, *_: Any, **__: Any) -> None:
        found.append(event) if event == EVENT else None

    jax.monitoring.register_event_duration_secs_listener(count)
    try:
        jax.block_until_ready(work())
    finally:
        jax.monitoring.unregister_event_duration_listener(count)
    return len(found)


def renamed(robot: Robot) -> Robot:
    links = tuple(f"part {k}" for k in range(robot.links))
    joints = tuple(f"hinge {k}" for k in range(robot.joints))
    return dataclasses.replace(robot, name="another", link_names=links, joint_names=joints, notes=("a note",))


@pytest.fixture(scope="module")
def robot() -> Robot:
    return robots.prototype()


def test_compilations_are_counted(robot):
    assert compiled(lambda: reojax.net_rotation(robot, LOOP, steps=7)) > 0
    assert compiled(lambda: reojax.net_rotation(robot, LOOP, steps=7)) == 0


@pytest.mark.parametrize("entry", [pytest.param(e, marks=[pytest.mark.slow] * (e not in QUICK)) for e in ENTRIES])
def test_the_same_robot_renamed_compiles_nothing(entry, robot):
    ENTRIES[entry](robot)
    assert compiled(lambda: ENTRIES[entry](renamed(robot))) == 0


@pytest.mark.parametrize("entry", [pytest.param(e, marks=[pytest.mark.slow] * (e not in QUICK)) for e in KINDS])
def test_other_numbers_compile_nothing(entry, robot):
    """The same kind of problem with other masses, motors, path and target: all numbers are arguments of programs."""
    KINDS[entry](numbers(robot, 1.0))
    assert compiled(lambda: KINDS[entry](numbers(robot, 0.95))) == 0


@pytest.mark.parametrize("entry", ["net_rotation", "simulate", "minimum_time"])
def test_gear_ratio_one_compiles_nothing(entry, robot, monkeypatch):
    geared = RE_MAX_17._replace(gear_ratio=1.0)
    ENTRIES[entry](robot)
    monkeypatch.setitem(globals(), "RE_MAX_17", geared)
    one = reojax.with_motors(robot, geared)
    assert (np.asarray(one.gear_ratio) == 1).all()
    assert compiled(lambda: ENTRIES[entry](one)) == 0

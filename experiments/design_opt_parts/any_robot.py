"""Least travel of a robot of any kind, and what lighter or heavier ends and other gears would change.

With motors also how fast: every edge by a quintic from rest to rest within what the motors can do behind the gears
chosen. Then ends and gears are chosen for least travel in no more time than the robot takes as it is, and for least
time.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from common.proof import prove
from common.tables import summary
from common.types import Array

import reojax
from design_opt_parts.in_time import SLOPE, in_time, least_time, times_of, total
from reojax import Motor, design, robots, so3
from reojax.design import Loops, Problem, Solution, Variable
from reojax.design.outcome import Measure

ENDS, GEARS = (0.5, 2.0), (0.5, 2.0)
"""Inertia of the end links about their joints, and gear ratios, over those of the robot as it is."""
AS_IT_IS = {"ends": 1.0, "gears": 1.0}
_FEW = 4
"""Up to so many joints, loops have five free corners, else three."""
_GOING_ON = 6
"""Best answers from which the problems with motors start."""


class Case(NamedTuple):
    """What is asked of a robot."""

    robot: reojax.Robot
    target: np.ndarray
    """(3,) rotation vector."""
    clearance: float | None
    """[m]"""
    motors: Motor | None
    start: np.ndarray
    """(j,) posture in which loops begin and end [rad]."""


def robot_of(name: str) -> reojax.Robot:
    """A robot by name, or from a file."""
    return robots.by_name(name) if name in robots.NAMES else reojax.load_robot(Path(name))


def case_of(
    robot: reojax.Robot,
    target: np.ndarray,
    clearance: float | None,
    motors: Motor | None = None,
    start: np.ndarray | None = None,
) -> Case:
    """What is asked; by default from the posture nearest to zero."""
    robot = limited(robot)
    rest = np.clip(np.zeros(robot.joints), robot.lower, robot.upper) if start is None else start
    return Case(robot, target, clearance, motors, rest)


def changed(robot: reojax.Robot, ends: Array, gears: Array) -> reojax.Robot:
    """The robot with the inertia of its end links about their joints, and its gear ratios, times a factor each."""
    leaves = sorted(set(range(1, robot.links)) - set(robot.parent))
    other = robot.replace(gear_ratio=gears * jnp.asarray(robot.gear_ratio))
    for link in leaves:
        joint = link - 1
        across = np.eye(3) - np.outer(robot.axis[joint], robot.axis[joint])
        com = np.asarray(robot.com[link])
        own = robot.axis[joint] @ robot.inertia[link] @ robot.axis[joint] + robot.mass[link] * (com @ across @ com)
        if own > 0:
            other = design.with_joint_inertia(other, joint, ends * float(own))
    return other


def loop_of(case: Case) -> Loops:
    """Polygons with as many corners as can be afforded."""
    return design.polygons(case.robot, 5 if case.robot.joints <= _FEW else 3, start=case.start)


def limited(robot: reojax.Robot) -> reojax.Robot:
    """The robot with half a turn either way where a joint has no limit, which loops need."""
    low, high = np.asarray(robot.lower), np.asarray(robot.upper)
    return robot.replace(lower=np.where(np.isfinite(low), low, -np.pi), upper=np.where(np.isfinite(high), high, np.pi))


class _Designs:
    """The problems of one case, and the rows of their answers."""

    def __init__(self, case: Case) -> None:
        self.case, self.loop = case, loop_of(case)
        self.apart = [] if case.clearance is None else [design.clear_by(case.clearance)]

    def problem(self, aim: Measure, conditions: Sequence[Measure] = (), more: Sequence[Variable] = ()) -> Problem:
        target = Variable("target", [-7.0] * 3, [7.0] * 3, "rad")
        return Problem(
            lambda values: (
                changed(self.case.robot, values["ends"], values["gears"]),
                self.loop.path(values["loop"]),
            ),
            [self.loop, Variable("ends", *ENDS), Variable("gears", *GEARS), target, *more],
            objective=aim,
            equality=[design.turned_to("target")],
            inequality=[*self.apart, *conditions],
        )

    def row(self, name: str, problem: Problem, found: Solution) -> dict[str, Any]:
        """Figures and certificate of the best answer."""
        case = self.case
        values = problem.space.named(found.value[found.best])
        outcome = problem.outcome(found.value[found.best])
        path = np.asarray(outcome.path.waypoints)
        turn = np.asarray(so3.exp(case.target))
        margin = -np.inf if case.clearance is None else case.clearance
        return {
            "case": name,
            "converged": int(found.converged.sum()),
            "status": found.message[found.best],
            "starts": len(found.cost),
            "travel_deg": float(np.rad2deg(np.abs(np.diff(path, axis=0)).sum())),
            "ends": float(values["ends"]),
            "gears": float(values["gears"]),
            "time_s": None if case.motors is None else float(least_time(outcome, case.motors).duration),
            "waypoints": path.tolist(),
            "certificate": prove(outcome.robot, path, 1, turn, margin),
        }


def solve(case: Case, *, quick: bool = False) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """What each choice of ends and gears takes, and the robot's own best loop."""
    designs = _Designs(case)
    travel = designs.problem(design.travel(designs.loop))
    geared = case.motors is not None or bool((np.asarray(case.robot.rotor_inertia * case.robot.gear_ratio) != 0).any())
    free = {"ends free": {"gears": 1.0}} | ({"gears free": {"ends": 1.0}, "both free": {}} if geared else {})
    starts = travel.starts(8 if quick else 32, seed=1)
    rows, own, found = [], {}, None
    for name, held in ({"as it is": AS_IT_IS} | free).items():
        found = travel.solve(starts, hold={**held, "target": case.target}, max_steps=100, progress=name)
        if name == "as it is":
            own = summary(travel, designs.loop, found, case.target, steps=4)
        rows.append(designs.row(name, travel, found))
        # the best so far is a start for what is freer
        starts = np.concatenate([found.value[[found.best]], starts[:-1]])
    assert found is not None
    if case.motors is not None:
        rows += _with_motors(designs, found, rows[0], quick=quick)
    return rows, own


def _with_motors(designs: _Designs, found: Solution, own: dict[str, Any], *, quick: bool) -> list[dict[str, Any]]:
    """What is chosen with an eye on the time, from the best answers of least travel."""
    motors, edges, unit = designs.case.motors, len(own["waypoints"]) - 1, own["time_s"]
    assert motors is not None
    needs, times = in_time(motors, unit), [times_of(edges)]
    as_fast = lambda outcome: total(outcome) - 1
    cases = (
        ("both free, no slower", designs.problem(design.travel(designs.loop), [needs, as_fast], times), {}),
        ("least time, as it is", fastest := designs.problem(total, [needs], times), AS_IT_IS),
        ("least time, both free", fastest, {}),
    )
    order = np.argsort(np.where(found.converged, found.cost, np.inf))[: 2 if quick else _GOING_ON]
    starts = np.pad(found.value[order], ((0, 0), (0, edges)), constant_values=2 / edges)
    rows = []
    for name, problem, held in cases[-1:] if quick else cases:
        hold = {**held, "target": designs.case.target}
        answer = problem.solve(starts, hold=hold, max_steps=100, slope_tolerance=SLOPE, progress=name)
        rows.append(designs.row(name, problem, answer))
    return rows

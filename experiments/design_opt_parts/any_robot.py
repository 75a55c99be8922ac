"""Least travel of a robot of any kind, and what lighter or heavier ends and other gears would change."""

from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from common.tables import summary
from common.types import Array

import reojax
from reojax import design, robots, so3
from reojax.design import Loops, Outcome, Problem, Variable

ENDS, GEARS = (0.5, 2.0), (0.5, 2.0)
"""Inertia of the end links about their joints, and gear ratios, over those of the robot as it is."""
_FEW = 4
"""Up to so many joints, loops have five free corners, else three."""
_TARGET = Variable("target", [-7.0] * 3, [7.0] * 3, "rad")


def robot_of(name: str) -> reojax.Robot:
    """A robot by name, or from a file."""
    return robots.by_name(name) if name in robots.NAMES else reojax.load_robot(Path(name))


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


def loop_of(robot: reojax.Robot) -> Loops:
    """Polygons from the posture nearest to zero, with as many corners as can be afforded."""
    start = np.clip(np.zeros(robot.joints), robot.lower, robot.upper)
    return design.polygons(robot, 5 if robot.joints <= _FEW else 3, start=start)


def limited(robot: reojax.Robot) -> reojax.Robot:
    """The robot with half a turn either way where a joint has no limit, which loops need."""
    low, high = np.asarray(robot.lower), np.asarray(robot.upper)
    return robot.replace(lower=np.where(np.isfinite(low), low, -np.pi), upper=np.where(np.isfinite(high), high, np.pi))


def solve(
    robot: reojax.Robot, target: np.ndarray, clearance: float | None, *, quick: bool
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """What each choice of ends and gears takes, and the robot's own best loop; `target` a rotation vector."""
    robot = limited(robot)
    loop = loop_of(robot)

    def turned(outcome: Outcome) -> Any:
        return design.turned_to("target")(outcome)

    problem = Problem(
        lambda values: (changed(robot, values["ends"], values["gears"]), loop.path(values["loop"])),
        [loop, Variable("ends", *ENDS), Variable("gears", *GEARS), _TARGET],
        objective=design.travel(loop),
        equality=[turned],
        inequality=[] if clearance is None else [design.clear_by(clearance)],
    )
    geared = bool((np.asarray(robot.rotor_inertia * robot.gear_ratio) != 0).any())
    starts = problem.starts(8 if quick else 32, seed=1)
    rows, own = [], {}
    for name, held in (
        ("as it is", {"ends": 1.0, "gears": 1.0}),
        ("ends free", {"gears": 1.0}),
        *((("gears free", {"ends": 1.0}), ("both free", {})) if geared else ()),
    ):
        found = problem.solve(starts, hold={**held, "target": target}, max_steps=100, progress=name)
        values = problem.space.named(found.value[found.best])
        if name == "as it is":
            own = summary(problem, loop, found, target, steps=4)
        outcome = problem.outcome(found.value[found.best])
        apart = float(outcome.clearance.distance)
        rows.append(
            {
                "case": name,
                "converged": int(found.converged.sum()),
                "starts": len(found.cost),
                "travel_deg": float(np.rad2deg(found.cost[found.best])),
                "ends": float(values["ends"]),
                "gears": float(values["gears"]),
                "clearance_mm": 1e3 * apart if np.isfinite(apart) else None,
                "miss_rad": float(so3.angle(np.asarray(so3.exp(target)).T @ np.asarray(outcome.rotation))),
            }
        )
        # the best so far is a start for what is freer
        starts = np.concatenate([found.value[[found.best]], starts[:-1]])
    return rows, own

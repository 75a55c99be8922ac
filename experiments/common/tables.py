"""What the design experiments share: the problem of least travel to a target, replays, and how starts are counted."""

import importlib.util
from collections.abc import Sequence
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import reojax
from common.types import Array
from reojax import design, interop, so3
from reojax.design import Loops, Problem, Solution, Variable
from reojax.design.outcome import Measure
from reojax.session import LEAST_COMPILE

TARGET = Variable("target", [-7.0] * 3, [7.0] * 3, "rad")
"""Rotation vector to reach; held, so that one program serves all targets."""


def least_travel(robot: reojax.Robot, loop: Loops, *, steps: int = 4, inequality: Sequence[Measure] = ()) -> Problem:
    """Least joint travel of a loop that turns the base to "target", all three components."""
    return Problem(
        lambda values: (robot, loop.path(values["loop"])),
        [loop, TARGET],
        objective=design.travel(loop),
        equality=[design.turned_to("target")],
        inequality=inequality,
        steps=steps,
    )


def at_best(found: Solution, *, share: float = 1e-6) -> int:
    """How many starts converged to the best cost."""
    least = found.cost[found.best]
    return int((found.converged & (found.cost <= least + share * abs(least))).sum()) if found.converged.any() else 0


def summary(problem: Problem, loop: Loops, found: Solution, target: np.ndarray, *, steps: int) -> dict[str, Any]:
    """Numbers of the best answer, its replay by Pinocchio among them (None without Pinocchio)."""
    values = problem.space.named(found.value[found.best])
    path = loop.path(values["loop"])
    robot = problem.outcome(found.value[found.best]).robot
    rotation = np.asarray(reojax.net_rotation(robot, path, steps=2 * steps))
    miss = np.asarray(so3.log(np.asarray(so3.exp(target)).T @ rotation))
    axis = target / np.linalg.norm(target)
    again = replay(robot, np.asarray(path.waypoints))
    return {
        "loop": loop.name,
        "starts": len(found.cost),
        "starts_converged": int(found.converged.sum()),
        "starts_at_best": at_best(found),
        "best_converged": bool(found.converged[found.best]),
        "travel_deg": float(np.rad2deg(reojax.joint_travel(path))),
        "residual_rad": float(found.residual[found.best]),
        "slope": float(found.slope[found.best]),
        "miss_along_rad": float(miss @ axis),
        "miss_off_axis_rad": float(np.linalg.norm(miss - (miss @ axis) * axis)),
        "replay_rad": None if again is None else float(so3.angle(again.T @ rotation)),
        "peak_deg": np.rad2deg(np.abs(np.asarray(path.waypoints)).max(0)).tolist(),
        "waypoints_deg": np.rad2deg(np.asarray(path.waypoints)).tolist(),
    }


def replay(robot: reojax.Robot, waypoints: np.ndarray, *, longest: float = 0.01) -> np.ndarray | None:
    """Net rotation by Pinocchio's momentum matrices, steps of `longest` rad of travel; None without Pinocchio.

    Magnus method of fourth order (two Gauss nodes a step): nothing of reojax's mechanics or integration is used.
    """
    if importlib.util.find_spec("pinocchio") is None:
        return None
    foreign = interop.pinocchio_model(robot)
    rotation, still, eye = np.eye(3), np.zeros(3), np.eye(3)

    def turn(theta: np.ndarray, move: np.ndarray) -> np.ndarray:
        inertia, coupling, _ = interop.split(interop.pinocchio_momentum(foreign, theta, still, eye), eye)
        return np.linalg.solve(inertia, coupling @ move)

    for start, end in zip(waypoints[:-1], waypoints[1:], strict=True):
        count = max(1, int(np.ceil(np.abs(end - start).sum() / longest)))
        move = (end - start) / count
        for k in range(count):
            first, second = (turn(start + (k + 0.5 + side * np.sqrt(3) / 6) * move, move) for side in (-1, 1))
            both = 0.5 * (first + second) + np.sqrt(3) / 12 * np.cross(first, second)
            angle = np.linalg.norm(both)
            hat = np.array([[0, -both[2], both[1]], [both[2], 0, -both[0]], [-both[1], both[0], 0]])
            share = (np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2 * np.pi)) ** 2)
            rotation = rotation @ (eye + share[0] * hat + share[1] * hat @ hat)
    return rotation


def gradient_error(robot: reojax.Robot, paths: list[np.ndarray], *, steps: int) -> list[float]:
    """Largest difference between derivatives of the net rotation by corners and central differences, per loop.

    Of the turn [rad per rad], along twelve random directions of all corners; all paths are padded to one length.
    """
    longest = max(len(path) for path in paths)
    padded = np.stack([np.concatenate([p, np.repeat(p[-1:], longest - len(p), axis=0)]) for p in paths])
    directions = np.random.default_rng(0).normal(size=(12, *padded.shape[1:]))

    @partial(jax.jit, compiler_options=LEAST_COMPILE)
    def both(points: Array) -> tuple[Array, Array]:
        nominal = reojax.net_rotation(robot, reojax.polygon(points), steps=steps)

        def turn(points: Array) -> Array:
            return so3.log(reojax.net_rotation(robot, reojax.polygon(points), steps=steps) @ nominal.T)

        slopes = jax.vmap(lambda direction: jax.jvp(turn, (points,), (direction,))[1])(jnp.asarray(directions))
        step = 1e-3
        one, two = (
            jax.vmap(lambda d, k=k: turn(points + k * step * d) - turn(points - k * step * d))(jnp.asarray(directions))
            for k in (1, 2)
        )
        return slopes, (8 * one - two) / (12 * step)

    return [float(np.abs(np.subtract(*both(jnp.asarray(points)))).max()) for points in padded]


def table(columns: list[str], rows: list[list[Any]], *, width: int = 13) -> None:
    """Print a table, first column to the left."""
    print("".join([f"{columns[0]:30}", *(f"{c:>{width}}" for c in columns[1:])]))
    for row in rows:
        cells = [
            f"{'missing' if v is None else v if isinstance(v, str) else format(v, '.7g'):>{width}}" for v in row[1:]
        ]
        print(f"{row[0]:30}" + "".join(cells))

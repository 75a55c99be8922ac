"""The fastest motions the motors allow for a net rotation: free time laws, overlapped edges, free paths (thesis 1.8).

`minimum_time` runs a given path by a given law. Here law and path give way: the duration is minimised by gradients,
with every motor within its torque-speed curve and every joint within its limits at the samples, and the net rotation
held where it is wanted. Answers are local optima near their starts.
"""

import sys
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike
from tqdm import tqdm

from reojax import so3
from reojax._arrays import Array, as_numbers
from reojax.design.solver import optimise
from reojax.dynamics import joint_load
from reojax.holonomy import net_rotation
from reojax.minimum_time import instants, minimum_stretch, minimum_time
from reojax.motion import net_rotation_of, orientation_along
from reojax.motor import Motor, check_motors, demand, no_load_speed, per_joint, stall_torque
from reojax.path import Path
from reojax.robot import Robot
from reojax.time_law import Law, quintic, trapezoid
from reojax.trajectory import Trajectory, along, overlapped, stretched, through

_SAMPLES = 6
"""Steps per piece while optimising; the answer is measured with more."""


class Fastest(NamedTuple):
    """A motion of least duration, and how well it is what it should be."""

    trajectory: Trajectory
    """The motion, no motor beyond its torque-speed curve."""
    duration: Float[Array, ""]
    """How long it takes [s]."""
    error: Float[Array, ""]
    """Angle between its net rotation and the one wanted [rad]."""
    beyond: Float[Array, ""]
    """Farthest that a joint goes beyond its limits [rad], 0 for none."""
    converged: Bool[Array, ""]
    """Whether the optimiser says that nothing near is faster."""


def overlap(
    robot: Robot,
    path: Path,
    motors: Motor | Sequence[Motor],
    law: Law | None = None,
    *,
    max_steps: int = 100,
    progress: str | None = None,
) -> Fastest:
    """Run a path with its edges overlapped: each joint's move in each edge gets a time of its own.

    Corners become smooth, which changes the net rotation; so the joints' amplitudes change too, each joint by one
    factor, such that the net rotation of `path` is kept.

    Args:
        robot: the robot; its rotor inertias and gear ratios hold, and its limits.
        path: the path in shape space, with numbers that can be read: not under `jit`.
        motors: motors of the joints, one for all or one for each.
        law: the time law of every move; default `quintic()`.
        max_steps: most steps of the optimiser.
        progress: what to write before a bar on stderr; default no bar.

    Raises:
        ValueError: as `minimum_time`.
    """
    law = quintic() if law is None else law
    least = minimum_time(robot, path, motors, law)
    corners = np.asarray(path.waypoints, float)
    moves = tuple((int(e), int(k)) for e, k in np.argwhere(np.diff(corners, axis=0) != 0))
    edge = np.array(moves)[:, 0]
    durations = np.asarray(least.durations, float)
    total = float(durations.sum())
    start = np.concatenate([[0.0], np.cumsum(durations)])[edge]
    count = len(moves)
    follows = [(a, b) for a in range(count) for b in range(a + 1, count) if moves[a][1] == moves[b][1]]
    follows = np.array([(a, b) for a, b in follows if not any((a, c) in follows for c in range(a + 1, b))], int)
    follows = follows.reshape(-1, 2)

    def build(x: Array) -> Trajectory:
        share = x[2 * count : -1]
        return overlapped(jnp.asarray(corners) * share[None], law, x[:count], x[count : 2 * count], moves)

    def order(x: Array) -> Array:
        begin, end = x[:count], x[:count] + x[count : 2 * count]
        return jnp.concatenate([end - x[-1], end[follows[:, 0]] - begin[follows[:, 1]]])

    joints = robot.joints
    first = np.concatenate([start, durations[edge], np.ones(joints), [total]])
    low = np.concatenate([np.zeros(count), np.full(count, 0.05 * total / path.edges), np.full(joints + 1, 0.2)])
    high = np.concatenate([np.full(2 * count, 1.5 * total), np.full(joints, 2.0), [1.5 * total]])
    low[-1] = 0.2 * total
    scale = np.concatenate([np.full(2 * count, 0.2 * total), np.full(joints, 0.3), [total]])
    task = _Task(robot, check_motors(motors, robot), net_rotation(robot, path), build, lambda x: x[-1], order)
    return _fastest(task, first[None], low, high, scale, max_steps, progress)


def free_law(
    robot: Robot,
    path: Path,
    motors: Motor | Sequence[Motor],
    *,
    points: int = 5,
    max_steps: int = 100,
    progress: str | None = None,
) -> Fastest:
    """Run a path, corners and all, by the fastest time law of each edge: a spline through `points` free points.

    Arguments and errors as for `overlap`; the path and so the net rotation stay.
    """
    least = minimum_time(robot, path, motors, trapezoid())
    edges = path.edges
    corners = np.asarray(path.waypoints, float)
    law = trapezoid()
    place = np.array([_value(law, u) for u in np.arange(1, points + 1) / (points + 1)])

    def build(x: Array) -> Trajectory:
        inner = jnp.concatenate([jnp.zeros((edges, 1)), x[edges:].reshape(edges, points), jnp.ones((edges, 1))], 1)
        parts = [
            through(Path(corners[e] + inner[e][:, None] * (corners[e + 1] - corners[e])[None]), x[e] / (points + 1))
            for e in range(edges)
        ]
        return joined(parts)

    durations = 1.2 * np.asarray(least.durations, float)
    first = np.concatenate([durations, np.tile(place, edges)])
    low = np.concatenate([0.2 * durations, np.full(edges * points, -0.2)])
    high = np.concatenate([3 * durations, np.full(edges * points, 1.2)])
    scale = np.concatenate([0.5 * durations, np.full(edges * points, 0.3)])
    cost = lambda x: x[:edges].sum()
    task = _Task(robot, check_motors(motors, robot), None, build, cost, lambda x: x[:0])
    return _fastest(task, first[None], low, high, scale, max_steps, progress, net_rotation(robot, path))


def fastest_loop(
    robot: Robot,
    target: ArrayLike,
    motors: Motor | Sequence[Motor],
    near: Path,
    *,
    knots: int = 10,
    starts: int = 3,
    seed: int = 0,
    max_steps: int = 200,
    progress: str | None = None,
) -> Fastest:
    """The fastest closed motion with a given net rotation: a spline of free knots at free times, at rest at both ends.

    Args:
        robot: the robot; its rotor inertias and gear ratios hold, and its limits.
        target: (3, 3) the net rotation wanted.
        motors: motors of the joints, one for all or one for each.
        near: a closed path to start from; the first start is it, the others are strewn around it.
        knots: intervals of the spline, 3 or more.
        starts: how many starts.
        seed: seed of the starts.
        max_steps: most steps of the optimiser.
        progress: what to write before a bar on stderr; default no bar.

    Raises:
        ValueError: as `minimum_time`, and for a target that is no rotation.
    """
    goal = _rotation(target)
    motors = check_motors(motors, robot)
    least = minimum_time(robot, near, motors)
    law, joints = quintic(), robot.joints
    begun = along(near, law, np.asarray(least.durations))
    total = 1.2 * float(least.duration)
    places = np.array([np.asarray(begun.at(t).theta) for t in np.linspace(0, float(least.duration), knots + 1)])
    ends = jnp.asarray(places[[0]])

    def build(x: Array) -> Trajectory:
        inner = x[knots:].reshape(knots - 1, joints)
        return through(Path(jnp.concatenate([ends, inner, ends])), x[:knots])

    rng = np.random.default_rng(seed)
    reach = np.minimum(np.asarray(robot.upper), np.pi) - np.maximum(np.asarray(robot.lower), -np.pi)
    first = np.tile(np.concatenate([np.full(knots, total / knots), places[1:-1].ravel()]), (starts, 1))
    first[1:, knots:] += 0.05 * rng.normal(size=(starts - 1, first.shape[1] - knots)) * np.tile(reach, knots - 1)
    low = np.concatenate([np.full(knots, 0.1 * total / knots), np.tile(np.asarray(robot.lower, float), knots - 1)])
    high = np.concatenate([np.full(knots, 3 * total / knots), np.tile(np.asarray(robot.upper, float), knots - 1)])
    scale = np.concatenate([np.full(knots, total / knots), np.tile(0.3 * reach, knots - 1)])
    task = _Task(robot, motors, goal, build, lambda x: x[:knots].sum(), lambda x: x[:0])
    return _fastest(task, np.clip(first, low, high), low, high, scale, max_steps, progress)


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """One trajectory after the other; each must begin where the one before it ends."""
    begin = jnp.cumsum(jnp.stack([jnp.zeros_like(parts[0].duration), *(part.duration for part in parts)]))
    breaks = [part.breaks[:-1] + start for part, start in zip(parts, begin[:-1], strict=True)]
    return Trajectory(jnp.concatenate([*breaks, begin[-1:]]), jnp.concatenate([part.coefficients for part in parts]))


class _Task(NamedTuple):
    robot: Robot
    motors: Motor
    goal: Array | None
    build: Callable[[Array], Trajectory]
    cost: Callable[[Array], Array]
    order: Callable[[Array], Array]
    """Further numbers that must not be positive."""


def _fastest(
    task: _Task,
    starts: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    scale: np.ndarray,
    max_steps: int,
    progress: str | None,
    goal: Array | None = None,
) -> Fastest:
    robot = jax.tree.map(lambda leaf: jnp.asarray(leaf, float), task.robot)
    motors = per_joint(task.motors, np.dtype(float))
    soft = 0.02 * float(np.max(np.asarray(stall_torque(motors) * no_load_speed(motors))))
    bounded = [(k, sign) for sign in (1, -1) for k in range(robot.joints) if np.isfinite(_limit(task.robot, k, sign))]

    def needs(theta: Array, theta_dot: Array, theta_ddot: Array) -> Array:
        load = joint_load(robot, theta, theta_dot, theta_ddot)
        a, b, c = demand(robot, motors, theta_dot, load, soft=soft)
        return jnp.abs(a + b.sum(0) + c) / motors.supply - 1

    def within(x: Array) -> Array:
        _, state = instants(task.build(x), _SAMPLES)
        asked = jax.vmap(jax.vmap(needs))(*state).ravel()
        past = [(sign * (state.theta[..., k] - _limit(task.robot, k, sign))).ravel() for k, sign in bounded]
        return jnp.concatenate([asked, *past, task.order(x) / scale[0]])

    def miss(x: Array) -> Array:
        return so3.log(jnp.asarray(task.goal).T @ net_rotation_of(robot, task.build(x), _SAMPLES))

    if task.goal is None:  # many rows and no curved ones: what the batched solver is better at
        found = optimise(
            task.cost, starts, lower=lower, upper=upper, scale=scale, inequality=within,
            tolerance=1e-7, slope_tolerance=1e-4, max_steps=max_steps, progress=progress,
        )  # fmt: skip
        best, converged = found.value[found.best], bool(found.converged[found.best])
    else:

        def everything(unit: Array) -> Array:
            x = unit * scale
            return jnp.concatenate([task.cost(x)[None], miss(x), -within(x)])

        best, converged = _least(everything, starts, (lower, upper, scale), max_steps, progress)
    trajectory = task.build(jnp.asarray(best))
    trajectory = stretched(trajectory, minimum_stretch(task.robot, trajectory, task.motors))
    finer = jax.jit(lambda trajectory: orientation_along(robot, trajectory, jnp.zeros(3), 4 * _SAMPLES))
    rotation, _, state = finer(trajectory)
    wanted = jnp.asarray(goal if task.goal is None else task.goal)
    past = jnp.maximum(state.theta - task.robot.upper[None], task.robot.lower[None] - state.theta).max()
    return Fastest(
        trajectory=trajectory,
        duration=trajectory.duration,
        error=so3.angle(wanted.T @ rotation[-1]),
        beyond=jnp.maximum(past, 0),
        converged=jnp.asarray(converged),
    )


def _least(
    everything: Callable[[Array], Array],
    starts: np.ndarray,
    box: tuple[np.ndarray, np.ndarray, np.ndarray],
    max_steps: int,
    progress: str | None,
) -> tuple[np.ndarray, bool]:
    """Least first number of `everything` with the next three zero and the rest not negative (SciPy's SLSQP).

    One small program with all derivatives is compiled, where the batched solver of `design` would compile for minutes.
    """
    from scipy.optimize import minimize

    lower, upper, scale = box
    program = jax.jit(lambda x: (everything(x), jax.jacfwd(everything)(x)))
    known: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def at(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        key = x.tobytes()
        if key not in known:
            known.clear()
            value, slope = program(x)
            known[key] = np.asarray(value), np.asarray(slope)
        return known[key]

    def part(kind: str, rows: slice) -> dict[str, Any]:
        return {"type": kind, "fun": lambda x: at(x)[0][rows], "jac": lambda x: at(x)[1][rows]}

    constraints = [part("eq", slice(1, 4)), part("ineq", slice(4, None))]
    found = []
    total = max_steps * len(starts)
    with tqdm(total=total, desc=progress, unit="step", file=sys.stderr, disable=progress is None) as bar:
        for start in starts:
            answer = minimize(
                lambda x: at(x)[0][0], start / scale, jac=lambda x: at(x)[1][0], method="SLSQP",
                bounds=list(zip(lower / scale, upper / scale, strict=True)), constraints=constraints,
                options={"maxiter": max_steps, "ftol": 1e-6}, callback=lambda _: bar.update(1),
            )  # fmt: skip
            value = at(answer.x)[0]
            off = max(np.abs(value[1:4]).max(), -value[4:].min())
            found.append((not (answer.success and off < 1e-5), value[0] if off < 1e-4 else np.inf, answer.x * scale))
    failed, _, best = min(found, key=lambda item: item[:2])
    return best, not failed


def _limit(robot: Robot, joint: int, sign: int) -> float:
    return float((robot.upper if sign > 0 else robot.lower)[joint])


def _value(law: Law, u: float) -> float:
    piece = int(np.clip((np.asarray(law.breaks) <= u).sum() - 1, 0, len(law.coefficients) - 1))
    return float(np.polyval(np.asarray(law.coefficients)[piece][::-1], u - np.asarray(law.breaks)[piece]))


def _rotation(target: ArrayLike) -> Array:
    matrix = np.asarray(as_numbers("target", target), float)
    if matrix.shape != (3, 3) or not np.allclose(matrix.T @ matrix, np.eye(3), atol=1e-6) or np.linalg.det(matrix) < 0:
        raise ValueError(f"`target` is {matrix.tolist()}; it must be a rotation matrix (3, 3).")
    return jnp.asarray(matrix)

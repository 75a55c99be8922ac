"""The fastest motions the motors allow for a net rotation: free time laws, overlapped edges, free paths (thesis 1.8).

`minimum_time` runs a given path by a given law. Here law and path give way: the duration is minimised by gradients,
with every motor within its torque-speed curve and every joint within its limits at the samples, and the net rotation
held where it is wanted. Answers are local optima near their starts.
"""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.precision import as_double, in_double
from reojax.collision.refusal import check_clearance
from reojax.mechanics.holonomy import net_rotation
from reojax.motion._optimal_control import Fastest as Fastest, least_duration
from reojax.motion._parametrisation import EdgeNumbers, FreeLaws, OverlappedEdges, SplineLoop
from reojax.motion._transcription import Apart, Task, UnknownBox
from reojax.motion.least_time import minimum_time
from reojax.motion.motor import Motor, check_motors
from reojax.motion.time_laws import Law, check_law, quintic, trapezoid
from reojax.motion.trajectory import along
from reojax.path import Path
from reojax.robot import Robot


@in_double
def overlap(
    robot: Robot,
    path: Path,
    motors: Motor | Sequence[Motor],
    law: Law | str = "quintic",
    *,
    clearance: float | None = None,
    max_steps: int = 100,
    progress: bool | str = False,
) -> Fastest:
    """Run a path with its edges overlapped: each joint's move in each edge gets a time of its own.

    Corners become smooth, which changes the net rotation; so the joints' amplitudes change too, each joint by one
    factor, such that the net rotation of `path` is kept.

    Args:
        robot: the robot; its rotor inertias and gear ratios hold, and its limits.
        path: the path in shape space, with numbers that can be read: not under `jit`.
        motors: motors of the joints, one for all or one for each.
        law: the time law of every move, or its name.
        clearance: least distance between the robot's parts, from 0 up, that is proven to be kept at all times [m];
            default not asked. Both ends of the path must have it.
        max_steps: most steps of the optimiser.
        progress: whether to show a bar on stderr, or what to write before it.

    Raises:
        ValueError: as `minimum_time`, for a path that stays where it is, and for ends that do not have the clearance.
    """
    law = check_law(law)
    checks.whole("max_steps", max_steps)
    _check_moves(path)
    least = minimum_time(robot, path, motors, law)
    corners = np.asarray(path.waypoints, float)
    apart = _apart(robot, clearance, {"the start of the path": corners[0], "the end of the path": corners[-1]})
    moves = tuple((int(e), int(k)) for e, k in np.argwhere(np.diff(corners, axis=0) != 0))
    edge = np.array(moves)[:, 0]
    durations = np.asarray(least.durations, float)
    total = float(durations.sum())
    start = np.concatenate([[0.0], np.cumsum(durations)])[edge]
    count = len(moves)
    # beginnings, lengths, factors, duration: as the edges one after another, and how far from that
    joints = robot.joints
    first = np.concatenate([start, durations[edge], np.ones(joints), [total]])
    low = np.concatenate([np.zeros(count), np.full(count, 0.05 * total / path.edges), np.full(joints + 1, 0.2)])
    high = np.concatenate([np.full(2 * count, 1.5 * total), np.full(joints, 2.0), [1.5 * total]])
    low[-1] = 0.2 * total
    scale = np.concatenate([np.full(2 * count, 0.2 * total), np.full(joints, 0.3), [total]])
    goal = net_rotation(*as_double((robot, path)))
    numbers = EdgeNumbers(corners, law)
    task = Task(robot, check_motors(motors, robot), goal, OverlappedEdges(moves), numbers, apart)
    return least_duration(task, first[None], UnknownBox(low, high, scale), max_steps, progress)


@in_double
def free_law(
    robot: Robot,
    path: Path,
    motors: Motor | Sequence[Motor],
    *,
    points: int = 5,
    clearance: float | None = None,
    max_steps: int = 100,
    progress: bool | str = False,
) -> Fastest:
    """Run a path, corners and all, by the fastest time law of each edge: a spline through `points` free points.

    The path and so the net rotation stay.

    Args:
        robot: the robot; its rotor inertias and gear ratios hold, and its limits.
        path: the path in shape space, with numbers that can be read: not under `jit`.
        motors: motors of the joints, one for all or one for each.
        points: free points of each edge's law, 1 or more.
        clearance: least distance between the robot's parts, from 0 up, that is proven to be kept at all times [m];
            default not asked. The path must have it.
        max_steps: most steps of the optimiser.
        progress: whether to show a bar on stderr, or what to write before it.

    Raises:
        ValueError: as `overlap`, and for `points` that is no positive integer.
    """
    checks.whole("points", points)
    checks.whole("max_steps", max_steps)
    _check_moves(path)
    least = minimum_time(robot, path, motors, trapezoid(), clearance=clearance)
    have = np.full(len(robot.collision_pairs), np.inf if least.clearance is None else float(least.clearance))
    apart = None if clearance is None else Apart(float(clearance), have)  # every law passes the whole path
    # each edge's law to begin with: a trapezoid's places at even times
    edges = path.edges
    corners = np.asarray(path.waypoints, float)
    edge = along(Path(np.array([[0.0], [1.0]])), trapezoid(), np.ones(1))
    place = np.array([float(edge.at(u).theta[0]) for u in np.arange(1, points + 1) / (points + 1)])

    # durations and places
    durations = 1.2 * np.asarray(least.durations, float)
    first = np.concatenate([durations, np.tile(place, edges)])
    low = np.concatenate([0.2 * durations, np.full(edges * points, -0.2)])
    high = np.concatenate([3 * durations, np.full(edges * points, 1.2)])
    scale = np.concatenate([0.5 * durations, np.full(edges * points, 0.3)])
    goal = net_rotation(*as_double((robot, path)))
    task = Task(robot, check_motors(motors, robot), goal, FreeLaws(edges, points), corners, apart)
    return least_duration(task, first[None], UnknownBox(low, high, scale), max_steps, progress)


@in_double
def fastest_loop(
    robot: Robot,
    target: ArrayLike,
    motors: Motor | Sequence[Motor],
    near: Path,
    *,
    knots: int = 10,
    starts: int = 3,
    seed: int = 0,
    clearance: float | None = None,
    max_steps: int = 200,
    progress: bool | str = False,
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
        clearance: least distance between the robot's parts, from 0 up, that is proven to be kept at all times [m];
            default not asked. The posture where `near` begins must have it.
        max_steps: most steps of the optimiser.
        progress: whether to show a bar on stderr, or what to write before it.

    Raises:
        ValueError: as `minimum_time`, for a target that is no rotation, fewer than 3 `knots`, no `starts`, or a path
            that is not closed or stays where it is.
    """
    goal = jnp.asarray(checks.rotations("target", target))
    checks.whole("knots", knots, 3)
    checks.whole("starts", starts)
    checks.whole("max_steps", max_steps)
    checks.whole("seed", seed, 0)
    _check_moves(near, "near")
    if not np.allclose(near.waypoints[0], near.waypoints[-1], rtol=0, atol=1e-9):
        raise ValueError("`near` does not end where it begins; it must be a closed path.")
    motors = check_motors(motors, robot)
    least = minimum_time(robot, near, motors)
    apart = _apart(robot, clearance, {"the start of `near`": np.asarray(near.waypoints[0], float)})
    # the path to start from, by even times, and starts strewn around it
    begun = along(near, quintic(), np.asarray(least.durations))
    total = 1.2 * float(least.duration)
    places = np.array([np.asarray(begun.at(t).theta) for t in np.linspace(0, float(least.duration), knots + 1)])
    rng = np.random.default_rng(checks.seed(seed))
    reach = np.minimum(np.asarray(robot.upper), np.pi) - np.maximum(np.asarray(robot.lower), -np.pi)
    first = np.tile(np.concatenate([np.full(knots, total / knots), places[1:-1].ravel()]), (starts, 1))
    first[1:, knots:] += 0.05 * rng.normal(size=(starts - 1, first.shape[1] - knots)) * np.tile(reach, knots - 1)
    # times between the knots, and postures at them
    low = np.concatenate([np.full(knots, 0.1 * total / knots), np.tile(np.asarray(robot.lower, float), knots - 1)])
    high = np.concatenate([np.full(knots, 3 * total / knots), np.tile(np.asarray(robot.upper, float), knots - 1)])
    scale = np.concatenate([np.full(knots, total / knots), np.tile(0.3 * reach, knots - 1)])
    task = Task(robot, motors, goal, SplineLoop(knots), places[0], apart)
    return least_duration(task, np.clip(first, low, high), UnknownBox(low, high, scale), max_steps, progress)


def _apart(robot: Robot, margin: float | None, postures: dict[str, np.ndarray]) -> Apart | None:
    """The clearance to keep, if one is asked for, and what the postures have that every motion passes."""
    if margin is None:
        return None
    return Apart(*check_clearance(robot, margin, postures))


def _check_moves(path: Path, entry: str = "path") -> None:
    corners = np.asarray(checks.instance(entry, path, Path, "polygon(...)").waypoints)
    if np.issubdtype(corners.dtype, np.floating) and len(corners) > 1 and not np.diff(corners, axis=0).any():
        raise ValueError(f"`{entry}` stays where it is; there is no motion to be made fast.")

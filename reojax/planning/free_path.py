"""Free paths: one polygon within the joint limits of any robot that ends on a target, with little joint travel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import jax
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax._internal.precision import as_double
from reojax.collision.refusal import check_clearance
from reojax.manoeuvres import Layout, fold_angles
from reojax.planning import quaternions
from reojax.planning.answers import first_of
from reojax.planning.checks import a_robot, key_of, robot_and_layout
from reojax.planning.clear_paths import Clear
from reojax.planning.free_paths_result import FreePaths, outcome
from reojax.planning.free_polygons import polygons_of
from reojax.planning.free_search import Search, apart
from reojax.planning.freedom import Freedom, freedom_of
from reojax.planning.polygon_table import table_of
from reojax.planning.reach import reach_of
from reojax.planning.repeats import MOST_REPEATS, least_repeats, polygons_by_runs
from reojax.planning.words import box_of
from reojax.robot import Robot

_CORNERS = ((4, 8), (8, 6), (10**9, 5))
"""Free corners by default, up to so many moving joints. Three make a rectangle; each further one costs as many
variables as joints move, and robots of many joints have loops enough of few corners."""

_AGAIN = 3
"""How often more clearance is asked for at the samples, where the path between them comes too near."""


def free_path(
    robot: Robot,
    target: Float[Array, "3 3"] | ArrayLike,
    *,
    start: ArrayLike | None = None,
    end: ArrayLike | None = None,
    joints: Sequence[int | str] | None = None,
    lower: ArrayLike | None = None,
    upper: ArrayLike | None = None,
    repeats: int | Literal["least"] = 1,
    clearance: float | None = None,
    twist_limit: float | None = None,
    bend_limit: float | None = None,
    layout: Layout | None = None,
    corners: int | None = None,
    starts: int = 4,
    tolerance: float = 1e-9,
    max_steps: int = 100,
    seed: int = 0,
    progress: bool | str = False,
    momentum: ArrayLike | None = None,
) -> FreePaths:
    """Find a joint path of little travel after which the base has turned by `target` (3, 3); any tree robot.

    At zero angular momentum; for a robot that already spins there is `reojax.righting`.

    `free_paths` for one target: arguments and errors are explained there.
    """
    checks.no_momentum(momentum, "free_path")
    many = free_paths(
        robot,
        checks.rotations("target", target, (3, 3))[None],
        start=start,
        end=end,
        joints=joints,
        lower=lower,
        upper=upper,
        repeats=repeats,
        clearance=clearance,
        twist_limit=twist_limit,
        bend_limit=bend_limit,
        layout=layout,
        corners=corners,
        starts=starts,
        tolerance=tolerance,
        max_steps=max_steps,
        seed=seed,
        progress=progress,
    )
    return first_of(many)


def free_paths(
    robot: Robot,
    targets: Float[Array, "m 3 3"] | ArrayLike,
    *,
    start: ArrayLike | None = None,
    end: ArrayLike | None = None,
    joints: Sequence[int | str] | None = None,
    lower: ArrayLike | None = None,
    upper: ArrayLike | None = None,
    repeats: int | Literal["least"] = 1,
    clearance: float | None = None,
    twist_limit: float | None = None,
    bend_limit: float | None = None,
    layout: Layout | None = None,
    corners: int | None = None,
    starts: int = 4,
    tolerance: float = 1e-9,
    max_steps: int = 100,
    seed: int = 0,
    progress: bool | str = False,
    momentum: ArrayLike | None = None,
) -> FreePaths:
    """Find joint paths of little travel after which the base has turned by the targets; any tree robot.

    The path is a polygon with `corners` free corners between two postures. Coupled joints follow their drivers; all
    joints stay within their limits at the corners and so along the straight edges between them. Local: more `starts`
    find less travel. Computes in float64 on the host, whatever JAX's default, many polygons side by side.

    Args:
        robot: the robot.
        targets: (m, 3, 3) rotations of the base after all runs, final base components to initial ones.
        start: (j,) posture before the path [rad]; default zero. Joints that may not move stay there.
        end: (j,) posture after it [rad]; default `start`.
        joints: numbers or names of the joints that may move; default all.
        lower: number or (j,), lower limits narrower than the robot's own [rad]. A joint without any limit stays
            within half a turn of its angles at `start` and `end`.
        upper: number or (j,), upper limits, likewise.
        repeats: how often the path is run, from 1 to 1 000 000; or "least" for the least number of runs that is found
            to reach the target. More than one run needs a closed path.
        clearance: least distance between the robot's parts, from 0 up, that is proven to be kept along the whole path
            [m]; default not asked. The two postures must have it.
        twist_limit: with `bend_limit`, in place of `joints`, `lower` and `upper`, for robots with a layout: largest
            angle of the distal joints, either way [rad]. Only they and the centre joint move, feet folded meanwhile.
        bend_limit: largest angle of the centre joint, either way [rad].
        layout: which joints twist, bend and fold, for these two limits; default the robot's own.
        corners: number of free corners, at least 2; more find less travel and take longer. Default 8 for up to 4
            moving joints, 6 for up to 8, else 5.
        starts: polygons to start from for each target; up to six times as many if it is not reached.
        tolerance: angle to the target that counts as reached [rad].
        max_steps: most steps of the solver.
        seed: of the random polygons.
        progress: whether to show a bar on stderr, or what to write before it.
        momentum: to be left out: these paths are for zero angular momentum; with one there is `righting`.

    Returns:
        The paths. Where a target is not reached, the closest path found, with `converged` False and the reason in
        `status`. The identity gives the path that stays put, where `end` is `start`.

    Raises:
        ValueError: naming the entry, if a target is no rotation, a posture is outside of the limits, a joint unknown,
            or an option makes no sense.
    """
    a_robot(robot)
    given = checks.rotations("targets", targets, (-1, 3, 3))
    tolerance, max_steps = checks.positive("tolerance", tolerance), checks.whole("max_steps", max_steps)
    starts, seed = checks.whole("starts", starts), checks.whole("seed", seed, 0)
    if corners is not None:
        corners = checks.whole("corners", corners, 2)
    if repeats != "least" or not isinstance(repeats, str):
        repeats = checks.whole("repeats", repeats, 1, MOST_REPEATS)
    if twist_limit is None and bend_limit is None and layout is None:
        before = np.zeros((0, robot.joints))
        freedom = freedom_of(robot, start=start, end=end, joints=joints, lower=lower, upper=upper)
    else:
        others = {"start": start, "end": end, "joints": joints, "lower": lower, "upper": upper}
        before, freedom = _by_layout(robot, layout, twist_limit, bend_limit, others)
    if repeats != 1 and not freedom.closed:
        raise ValueError(f"`repeats` is {repeats!r} and `end` is not `start`; only a closed path can be run again.")

    with jax.enable_x64(True):
        robot = as_double(robot)
        clear = None
        if clearance is not None:
            postures = {"the posture at the start": freedom.start, "the posture at the end": freedom.end}
            clear = Clear(robot, *check_clearance(robot, clearance, postures))
        options = (repeats, corners, starts, tolerance, max_steps, seed, progress, clear)
        return _solve(robot, given, freedom, before, *options)


def _solve(
    robot: Robot,
    targets: np.ndarray,
    freedom: Freedom,
    before: np.ndarray,
    repeats: int | str,
    corners: int | None,
    starts: int,
    tolerance: float,
    max_steps: int,
    seed: int,
    progress: bool | str,
    clear: Clear | None,
) -> FreePaths:
    count = len(freedom.joints)
    corners = corners or corners_for(count)
    polygons = polygons_of(robot, freedom, corners)
    table = table_of(polygons, freedom, key_of(robot), seed, clear)
    reach = reach_of(robot, freedom, polygons, table.turns)
    fold = _fold_rotation(polygons, before, corners)
    wanted = quaternions.to_matrices(quaternions.from_matrices(targets))
    inside = fold.T @ wanted @ fold
    possible = reach.closest(inside)
    still = apart(np.broadcast_to(reach.straight, inside.shape), possible) <= tolerance

    x, runs = np.zeros((len(inside), corners * count + 1)), np.ones(len(inside), int)
    moving = np.flatnonzero(~still)
    if len(moving):
        search = Search(polygons, table, freedom, starts, max_steps, tolerance, clear)
        with search.bar(progress):
            if repeats == "least":
                x[moving], runs[moving] = least_repeats(search, possible[moving])
            else:
                runs[moving] = repeats
                x[moving] = polygons_by_runs(search, possible[moving], runs[moving])
            _clear_again(search, x, runs, possible, moving)
    paths = polygons.paths(x, freedom)
    paths[still] = np.where(np.arange(corners + 2)[:, None] <= corners, freedom.start, freedom.end)
    one = quaternions.from_matrices(polygons.rotations(paths))
    rotation = fold @ quaternions.to_matrices(quaternions.power(one, runs)) @ fold.T
    rotation[still] = fold @ reach.straight @ fold.T
    error = apart(rotation, wanted)
    beyond = apart(possible, inside)
    ends = (np.repeat(part[None], len(paths), 0) for part in (before, before[::-1]))
    paths = np.concatenate([next(ends), paths, next(ends)], axis=1)
    if len(before):
        paths[still] = 0.0
    proven = None if clear is None else clear.proven(paths)
    kept = np.full(len(paths), True) if clear is None or proven is None else proven >= clear.margin
    return FreePaths(
        waypoints=paths,
        rotation=rotation,
        error=error,
        travel=np.abs(np.diff(paths, axis=1)).sum((1, 2)) * runs,
        repeats=runs,
        converged=(error <= tolerance) & kept,
        status=np.array([outcome(*row, tolerance, reach) for row in zip(error, beyond, kept, strict=True)]),
        clearance=proven,
    )


def corners_for(joints: int) -> int:
    """Free corners by default, of paths on which so many joints move."""
    return next(number for most, number in _CORNERS if joints <= most)


def _clear_again(search: Search, x: np.ndarray, runs: np.ndarray, targets: np.ndarray, moving: np.ndarray) -> None:
    """Solve again what came too near between the samples, with more clearance asked for at them; changes `x`."""
    if search.clear is None:
        return
    search.rounds = 1  # from where they are
    for _ in range(_AGAIN):
        near = moving[~search.clear.keeps(search.polygons.paths(x[moving], search.freedom))]
        if not len(near):
            return
        search.spare = 2 * search.spare + 1e-4
        x[near] = polygons_by_runs(search, targets[near], runs[near], x[near][:, None])


def _fold_rotation(polygons: Any, before: np.ndarray, corners: int) -> np.ndarray:
    """Rotation of the base while the feet fold, before the polygon."""
    if not len(before):
        return np.eye(3)
    folding = np.concatenate([before, np.repeat(before[-1:], corners, axis=0)])
    return polygons.rotations(folding[None])[0]


def _by_layout(
    robot: Robot,
    layout: Layout | None,
    twist_limit: float | None,
    bend_limit: float | None,
    others: dict[str, Any],
) -> tuple[np.ndarray, Freedom]:
    """Corners before the polygon, and its freedom, where the limits are those of the parts of a layout."""
    for entry, value in others.items():
        if value is not None:
            raise ValueError(f"`{entry}` is given with `twist_limit`, `bend_limit` or `layout`; give one or the other.")
    for entry, value in (("twist_limit", twist_limit), ("bend_limit", bend_limit)):
        if value is None:
            raise ValueError(f"`{entry}` is missing: limits by layout need both `twist_limit` and `bend_limit`.")
    layout = robot_and_layout(robot, layout)
    twist, bend = checks.positive("twist_limit", twist_limit), checks.positive("bend_limit", bend_limit)
    box = box_of(robot, layout, "R", twist, bend)
    lower, upper = np.full(robot.joints, -np.inf), np.full(robot.joints, np.inf)
    moving = [layout.twist[0], layout.bend, layout.twist[1]]
    lower[moving], upper[moving] = box.low[0], box.high[0]
    rest = fold_angles(layout)
    before = np.stack([0 * rest, rest])[:-1] if layout.fold else np.zeros((0, robot.joints))
    return before, freedom_of(robot, start=rest, end=None, joints=moving, lower=lower, upper=upper)

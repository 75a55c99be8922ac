"""How far one closed path turns the base about an axis, within joint limits and clear of the robot itself."""

from __future__ import annotations

from collections.abc import Sequence

import jax
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.precision import as_double
from reojax.collision.refusal import check_clearance
from reojax.planning import quaternions
from reojax.planning.checks import a_robot, key_of
from reojax.planning.clear_paths import Clear
from reojax.planning.free_path import corners_for
from reojax.planning.free_paths_result import FreePaths
from reojax.planning.free_polygons import Polygons, polygons_of
from reojax.planning.free_search import Search, apart
from reojax.planning.freedom import Freedom, freedom_of
from reojax.planning.polygon_table import PolygonTable, table_of
from reojax.planning.reach import Reach, reach_of
from reojax.robot import Robot

_LOOKED_AT = 512
"""Random polygons that turn far, of which those that are clear at a few samples come first."""
_SHARES = (1.0, 0.9999, 0.999, 0.99, 0.95)
"""Shares of a turn that the coarse steps of the search find, at which the true one is looked for, in turn: no turn is
larger than the largest, and what the coarse steps miss may be out of reach."""


def farthest_turn(
    robot: Robot,
    axis: Float[np.ndarray, "3"] | ArrayLike,
    *,
    start: ArrayLike | None = None,
    joints: Sequence[int | str] | None = None,
    lower: ArrayLike | None = None,
    upper: ArrayLike | None = None,
    clearance: float | None = None,
    corners: int | None = None,
    starts: int = 4,
    tolerance: float = 1e-9,
    max_steps: int = 100,
    seed: int = 0,
    progress: bool | str = False,
) -> FreePaths:
    """Find the closed path that turns the base farthest about an axis, up to 3 rad; any tree robot.

    At zero angular momentum. The path is a polygon, as those of `free_path`. Local: the turn is the largest that was
    found, not proven to be the largest; more `starts` find more. Where 3 rad are found, one path makes any turn about
    the axis. Computes in float64 on the host, whatever JAX's default.

    Args:
        robot: the robot.
        axis: (3,) axis of the turn in the base frame at the start, of any length; the turn is positive about it.
        start: (j,) posture before and after the path [rad]; default zero. Joints that may not move stay there.
        joints: numbers or names of the joints that may move; default all.
        lower: number or (j,), lower limits narrower than the robot's own [rad], as for `free_path`.
        upper: number or (j,), upper limits, likewise.
        clearance: least distance between the robot's parts, from 0 up, that is proven to be kept along the whole path
            [m]; default not asked. The posture at the start must have it.
        corners: number of free corners, at least 2; default as for `free_path`.
        starts: polygons to start from; with a clearance those that are clear come first.
        tolerance: angle besides the turn about the axis up to which it counts as reached [rad].
        max_steps: most steps of the solver.
        seed: of the random polygons.
        progress: whether to show a bar on stderr, or what to write before it.

    Returns:
        The path. `rotation` is the turn, and `so3.angle(rotation)` how far it is [rad]; `error` is the angle from it to
        the nearest turn about the axis. Where no path was found, the one that stays put, with `converged` False and the
        reason in `status`.

    Raises:
        ValueError: naming the entry, if the axis has no direction, a posture is outside of the limits or has not the
            clearance, a joint is unknown, or an option makes no sense.
    """
    a_robot(robot)
    direction = checks.numbers("axis", axis, (3,))
    if not (size := float(np.linalg.norm(direction))) > 0:
        raise ValueError(f"`axis` is {checks.shorten(direction.tolist())}; it must have a direction.")
    tolerance, max_steps = checks.positive("tolerance", tolerance), checks.whole("max_steps", max_steps)
    starts, seed = checks.whole("starts", starts), checks.whole("seed", seed, 0)
    freedom = freedom_of(robot, start=start, end=None, joints=joints, lower=lower, upper=upper)
    count = corners_for(len(freedom.joints)) if corners is None else checks.whole("corners", corners, 2)
    with jax.enable_x64(True):
        robot = as_double(robot)
        clear = None
        if clearance is not None:
            clear = Clear(robot, *check_clearance(robot, clearance, {"the posture at the start": freedom.start}))
        polygons = polygons_of(robot, freedom, count)
        table = table_of(polygons, freedom, key_of(robot), seed, clear)
        reach = reach_of(robot, freedom, polygons, table.turns)
        unit = direction / size
        if not _possible(reach, unit):
            return _stay(polygons, freedom, clear, f"unreachable: {reach.explain()}")
        table = _clear_first(table, unit, starts)
        search = Search(polygons, table, freedom, starts, max_steps, tolerance, clear)
        with search.bar(progress):
            x = _farthest(search, unit)
        if x is None:
            return _stay(
                polygons, freedom, clear,
                "not found: no path about this axis was found, which proves nothing; more starts or corners, wider "
                "limits, or less clearance, may find one",
            )  # fmt: skip
        return _answer(polygons, freedom, clear, x, unit)


def _possible(reach: Reach, axis: np.ndarray) -> bool:
    """Whether any closed path turns the base about an axis and nothing else."""
    return reach.rank == 3 or (reach.rank == 1 and abs(abs(float(reach.axes[0] @ axis)) - 1) < 1e-9)


def _clear_first(table: PolygonTable, axis: np.ndarray, starts: int) -> PolygonTable:
    """The polygons to start from where a clearance is asked for: a search out of deep contact gets nowhere."""
    if table.clear is None:
        return table
    rows = table.farthest_rows(axis, max(_LOOKED_AT, 2 * starts))
    rows = rows[np.argsort(~table.clear[rows], kind="stable")][: 2 * starts]
    return PolygonTable(table.x[rows], table.turns[:, rows], table.lengths[rows])


def _farthest(search: Search, axis: np.ndarray) -> np.ndarray | None:
    """The polygon (1, n) that truly turns farthest about the axis and no other, and keeps the clearance."""
    found, _ = search.farthest(axis[None])
    turns = _turns(search, found[0], axis)
    order = np.argsort(-turns)
    x, turns = found[0, order], turns[order]
    for share in _SHARES:
        able = np.flatnonzero(turns > 0)
        if not len(able):
            return None
        wanted = _rotations(axis, share * turns[able])
        moved = search.onto(x[able], wanted)
        paths = search.polygons.paths(moved, search.freedom)
        kept = np.full(len(able), True) if search.clear is None else search.clear.keeps(paths)
        on = kept & (apart(search.polygons.rotations(paths), wanted) <= search.tolerance)
        if on.any():
            return moved[[np.flatnonzero(on)[0]]]
    return None


def _turns(search: Search, x: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """True turns (m,) of polygons (m, n) about an axis [rad], the short way round."""
    w, *v = quaternions.from_matrices(search.polygons.rotations(search.polygons.paths(x, search.freedom)))
    along = axis @ np.stack(v)
    return 2 * np.arctan2(np.where(w < 0, -along, along), np.abs(w))


def _rotations(axis: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Rotations (m, 3, 3) about an axis by angles (m,)."""
    return quaternions.to_matrices(np.concatenate([np.cos(angles / 2)[None], axis[:, None] * np.sin(angles / 2)]))


def _answer(polygons: Polygons, freedom: Freedom, clear: Clear | None, x: np.ndarray, axis: np.ndarray) -> FreePaths:
    paths = polygons.paths(x, freedom)
    rotation = polygons.rotations(paths)
    w, *v = quaternions.from_matrices(rotation)
    turn = 2 * np.arctan2(axis @ np.stack(v), w)
    return FreePaths(
        waypoints=paths[0],
        rotation=rotation[0],
        error=apart(rotation, _rotations(axis, turn))[0],
        travel=np.asarray(np.abs(np.diff(paths[0], axis=0)).sum()),
        repeats=np.asarray(1),
        converged=np.asarray(True),
        status="converged",
        clearance=None if clear is None else clear.proven(paths)[0],
    )


def _stay(polygons: Polygons, freedom: Freedom, clear: Clear | None, status: str) -> FreePaths:
    """The path that stays at the start."""
    path = np.repeat(freedom.start[None], polygons.corners + 2, axis=0)
    return FreePaths(
        waypoints=path,
        rotation=np.eye(3),
        error=np.asarray(0.0),
        travel=np.asarray(0.0),
        repeats=np.asarray(1),
        converged=np.asarray(False),
        status=status,
        clearance=None if clear is None else clear.proven(path[None])[0],
    )

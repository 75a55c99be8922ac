"""Any orientation: sequences of manoeuvres within the joint limits that end on a target (thesis 2.9)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax._internal.precision import as_double
from reojax._internal.progress import label
from reojax.collision.refusal import check_clearance
from reojax.manoeuvres import Layout, fold_angles
from reojax.mechanics.controllable import controllable_directions
from reojax.planning import quaternions
from reojax.planning.cache import Cache
from reojax.planning.candidates import Context, context, join
from reojax.planning.checks import OBJECTIVES, key_of, robot_and_layout
from reojax.planning.clear_boxes import clear_boxes
from reojax.planning.clear_paths import Clear
from reojax.planning.fewest import BestWords, cheapest, fewest, rotation_from_folded
from reojax.planning.reach import Reach
from reojax.planning.result import Plan, first_plan, plans
from reojax.planning.words import VOCABULARIES, box_of
from reojax.robot import Robot

_BATCH = 4096
"""Targets solved together, between two reports of progress."""
_KEPT = 8
"""Robots and limits whose tables are kept."""
_WIDEST = 4 * np.pi
"""Largest limit of a joint [rad]. What loops beyond two turns do is not worth the table, and no motor's cables bear it;
a larger number is mostly one of degrees."""
_SPARE = 5e-4
"""Clearance asked for in excess where loops are looked up, so that those between them keep it too [m]."""
_TOO_NEAR = (
    "not found: the plan does not keep the clearance, which proves nothing; other limits, less clearance or "
    "`free_path` may reach it"
)
_scenes: Cache[Context] = Cache(_KEPT)


def plan(
    robot: Robot,
    target: ArrayLike,
    *,
    twist_limit: float,
    bend_limit: float,
    max_manoeuvres: int,
    objective: str = "count",
    vocabulary: str = "manoeuvres",
    layout: Layout | None = None,
    clearance: float | None = None,
    tolerance: float = 1e-9,
    momentum: ArrayLike | None = None,
) -> Plan:
    """Find a sequence of manoeuvres within joint limits after which the base has turned by `target`.

    At zero angular momentum; for a robot that already spins there is `reojax.righting`.

    Args:
        robot: the robot.
        target: (3, 3) rotation of the base, final base components to initial ones.
        twist_limit: largest angle of the distal joints, either way [rad]. The robot's own joint limits hold too.
        bend_limit: largest angle of the centre joint, either way [rad].
        max_manoeuvres: how many manoeuvres are allowed.
        objective: "count" for the fewest manoeuvres, and of those little travel; "travel" for the least
            joint travel that is found with up to `max_manoeuvres` (at most 5).
        vocabulary: "manoeuvres" for A and B; "rectangles" for loops whose distal joints have amplitudes of their own.
        layout: which joints twist, bend and fold; default the robot's own.
        clearance: least distance between the robot's parts, from 0 up, that is proven to be kept along the whole path
            [m]; default not asked. Where some loops would come nearer, others are used.
        tolerance: angle to the target that counts as reached [rad].
        momentum: none, or zero: any other is refused, and `reojax.righting` named.

    Returns:
        The plan. If the target is not reached, the closest plan found, with `converged` False and the reason in
        `status`. The identity gives the plan without manoeuvres. Computed in float64, whatever JAX's default.

    Raises:
        ValueError: naming the entry, if the target is no rotation or an option makes no sense.
    """
    checks.no_momentum(momentum, "plan")
    targets = checks.rotations("target", target, (3, 3))[None]
    limits = {"twist_limit": twist_limit, "bend_limit": bend_limit, "max_manoeuvres": max_manoeuvres}
    choices = {"objective": objective, "vocabulary": vocabulary, "layout": layout, "tolerance": tolerance}
    choices["clearance"] = clearance
    return first_plan(_plans(robot, targets, **limits, **choices))


def plan_many(
    robot: Robot,
    targets: Float[Array, "m 3 3"] | ArrayLike,
    *,
    twist_limit: float,
    bend_limit: float,
    max_manoeuvres: int,
    objective: str = "count",
    vocabulary: str = "manoeuvres",
    layout: Layout | None = None,
    clearance: float | None = None,
    tolerance: float = 1e-9,
    progress: bool | str = False,
    momentum: ArrayLike | None = None,
) -> Plan:
    """Plan for many targets (m, 3, 3): `plan` with a leading axis m on every field of the answer.

    Runs on the host in batches; with `progress`, a bar on stderr counts the targets. Arguments and errors as for
    `plan`, but for:

    Args:
        robot: the robot.
        targets: (m, 3, 3) rotations of the base, final base components to initial ones.
        twist_limit: as for `plan` [rad], and so are all that follow.
        bend_limit: [rad].
        max_manoeuvres: how many manoeuvres each plan may have.
        objective: "count" or "travel".
        vocabulary: "manoeuvres" or "rectangles".
        layout: which joints twist, bend and fold.
        clearance: proven along every path [m].
        tolerance: angle to the target that counts as reached [rad].
        progress: whether to show a bar on stderr, or what to write before it.
        momentum: none, or zero.

    Raises:
        ValueError: naming the entry, if a target is no rotation or an option makes no sense.
    """
    checks.no_momentum(momentum, "plan_many")
    targets = checks.rotations("targets", targets, (-1, 3, 3))
    limits = {"twist_limit": twist_limit, "bend_limit": bend_limit, "max_manoeuvres": max_manoeuvres}
    choices = {"objective": objective, "vocabulary": vocabulary, "layout": layout, "tolerance": tolerance}
    return _plans(robot, targets, **limits, **choices, clearance=clearance, progress=progress)


def _plans(
    robot: Robot, targets: np.ndarray, *, twist_limit: float, bend_limit: float, max_manoeuvres: int, objective: str,
    vocabulary: str, layout: Layout | None, clearance: float | None, tolerance: float, progress: bool | str = False,
) -> Plan:  # fmt: skip
    """Check all but the targets, (m, 3, 3), which are known to be rotations; and plan."""
    layout = robot_and_layout(robot, layout)
    twist_limit, bend_limit = _limit("twist_limit", twist_limit), _limit("bend_limit", bend_limit)
    most = checks.whole("max_manoeuvres", max_manoeuvres)
    tolerance = checks.positive("tolerance", tolerance)
    search = {"count": fewest, "travel": cheapest}[checks.one_of("objective", objective, OBJECTIVES)]
    letters = VOCABULARIES[checks.one_of("vocabulary", vocabulary, tuple(VOCABULARIES))]
    with jax.enable_x64(True):
        robot = as_double(robot)
        wanted, clear = quaternions.from_matrices(targets), None
        if clearance is not None:
            rest = fold_angles(layout)
            postures = {"the posture at rest": 0 * rest} | ({"the folded posture": rest} if layout.fold else {})
            clear = Clear(robot, *check_clearance(robot, clearance, postures))
        with _bar(wanted.shape[1], progress) as bar:
            found = _solve(
                _scene(robot, layout, letters, twist_limit, bend_limit, clear), wanted, search, most, tolerance, bar
            )
        return found if clear is None else _prove(found, clear)


def _solve(
    scene: Context, wanted: np.ndarray, search: Callable[..., BestWords], most: int, tolerance: float, bar: Any
) -> Plan:
    """Plans for targets (4, m) in batches."""
    seen = rotation_from_folded(scene, wanted)
    parts = []
    for first in range(0, wanted.shape[1], _BATCH):
        batch = seen[:, first : first + _BATCH]
        parts.append(search(scene, batch, most, tolerance).rows)
        bar.update(batch.shape[1])
    rows = join(parts)
    found = plans(scene, rows._replace(owner=np.arange(len(rows.owner))), wanted, tolerance)
    return found if found.converged.all() else _explain(scene, found, seen, tolerance)


def _prove(found: Plan, clear: Clear) -> Plan:
    """Prove the clearance of plans; one that does not keep it is not found."""
    proven = clear.proven(found.waypoints)
    kept = proven >= clear.margin
    status = np.where(kept | ~found.converged, found.status, _TOO_NEAR)
    return found._replace(clearance=proven, converged=found.converged & kept, status=status)


def _limit(entry: str, value: float) -> float:
    limit = checks.positive(entry, value)
    if limit > _WIDEST:
        raise ValueError(f"`{entry}` is {limit:.9g} rad, more than two turns; is it in degrees?")
    return limit


def _explain(scene: Context, found: Plan, seen: np.ndarray, tolerance: float) -> Plan:
    """Say which targets no loop of these joints reaches, as seen between the folded ends."""
    layout = scene.layout
    moving = (*layout.twist, layout.bend)
    axes = controllable_directions(scene.robot, fold_angles(layout), joints=moving)
    reach = Reach(axes.rank, axes.axes, np.eye(3))
    closest = quaternions.from_matrices(reach.closest(quaternions.to_matrices(seen)))
    beyond = quaternions.angles(quaternions.product(quaternions.inverse(closest), seen))
    status = np.array(found.status, object)
    for row in np.flatnonzero(~found.converged & (beyond > tolerance)):
        status[row] = f"unreachable: {reach.explain()}; {np.rad2deg(beyond[row]):.6g} deg are left at the least"
    return found._replace(status=status.astype(str))


def replan(
    robot: Robot,
    target: ArrayLike,
    measured: ArrayLike,
    *,
    twist_limit: float,
    bend_limit: float,
    max_manoeuvres: int,
    objective: str = "count",
    vocabulary: str = "manoeuvres",
    layout: Layout | None = None,
    clearance: float | None = None,
    tolerance: float = 1e-9,
) -> Plan:
    """Plan from a measured orientation: feedback between manoeuvres (thesis 1.9).

    Args:
        robot: the robot, joints at zero.
        target: (3, 3) orientation to end in, base components to inertial ones.
        measured: (3, 3) orientation now, likewise.
        twist_limit: this and all others as for `plan`.
        bend_limit: as for `plan`.
        max_manoeuvres: as for `plan`.
        objective: as for `plan`.
        vocabulary: as for `plan`.
        layout: as for `plan`.
        clearance: as for `plan`.
        tolerance: as for `plan`.

    Returns:
        The plan for the rotation left, `measured^T target`; its rotation and error are those of that rotation.

    Raises:
        ValueError: as `plan`.
    """
    wanted = checks.rotations("target", target, (3, 3))
    now = checks.rotations("measured", measured, (3, 3))
    return plan(
        robot,
        now.T @ wanted,
        twist_limit=twist_limit,
        bend_limit=bend_limit,
        max_manoeuvres=max_manoeuvres,
        objective=objective,
        vocabulary=vocabulary,
        layout=layout,
        clearance=clearance,
        tolerance=tolerance,
    )


def _scene(
    robot: Robot, layout: Layout, letters: str, twist_limit: float, bend_limit: float, clear: Clear | None
) -> Context:
    """Compute what plans of one robot within one box share, or find it among the last few."""

    def make() -> Context:
        box = box_of(robot, layout, letters, twist_limit, bend_limit)
        if clear is not None:
            box = clear_boxes(layout, box, clear._replace(margin=float(clear.with_spare(_SPARE).min())))
        return context(robot, layout, box)

    key = key_of(robot), layout, letters, twist_limit, bend_limit
    return _scenes.get((*key, None if clear is None else clear.margin), make)


def _bar(total: int, show: bool | str) -> Any:
    from tqdm import tqdm

    return tqdm(total=total, disable=not show, unit=" targets", desc=label(show) or "plan")

"""Any orientation: sequences of manoeuvres within the joint limits that end on a target (thesis 2.9)."""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

import jax
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax.manoeuvres import Layout
from reojax.planning import quaternions
from reojax.planning.candidates import Context, context, join
from reojax.planning.checks import OBJECTIVES, key_of, robot_and_layout
from reojax.planning.fewest import cheapest, fewest, rotation_from_folded
from reojax.planning.result import Plan, first_of, plans
from reojax.planning.words import VOCABULARIES, box_of
from reojax.robot import Robot

_BATCH = 4096
"""Targets solved together, between two reports of progress."""
_KEPT = 8
"""Robots and limits whose tables are kept."""
_scenes: OrderedDict[Any, Context] = OrderedDict()


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
    tolerance: float = 1e-9,
) -> Plan:
    """Find a sequence of manoeuvres within joint limits after which the base has turned by `target`.

    Args:
        robot: the robot.
        target: (3, 3) rotation of the base, final base components to initial ones.
        twist_limit: largest angle of the distal joints, either way [rad]. The robot's own joint limits hold too.
        bend_limit: largest angle of the centre joint, either way [rad].
        max_manoeuvres: how many manoeuvres are allowed.
        objective: "count" for the fewest manoeuvres, and of those little travel; "travel" for the least
            joint travel that is found with up to `max_manoeuvres` (at most 5).
        vocabulary: "manoeuvres" for A and B; "rectangles" for loops whose distal joints have amplitudes of their own.
        layout: which joints twist, bend and fold; default by the robot's number of joints.
        tolerance: angle to the target that counts as reached [rad].

    Returns:
        The plan. If the target is not reached, the closest plan found, with `converged` False. The identity gives
        the plan without manoeuvres.

    Raises:
        ValueError: naming the entry, if the target is no rotation or an option makes no sense.
    """
    targets = checks.rotations("target", target, (3, 3))[None]
    limits = {"twist_limit": twist_limit, "bend_limit": bend_limit, "max_manoeuvres": max_manoeuvres}
    choices = {"objective": objective, "vocabulary": vocabulary, "layout": layout, "tolerance": tolerance}
    return first_of(plan_many(robot, targets, **limits, **choices))


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
    tolerance: float = 1e-9,
    progress: bool = False,
) -> Plan:
    """Plan for many targets (m, 3, 3): `plan` with a leading axis m on every field of the answer.

    Runs on the host in batches; with `progress`, a bar on stderr counts the targets.
    """
    layout = robot_and_layout(robot, layout)
    targets = checks.rotations("targets", targets, (-1, 3, 3))
    twist_limit, bend_limit = checks.positive("twist_limit", twist_limit), checks.positive("bend_limit", bend_limit)
    most = checks.whole("max_manoeuvres", max_manoeuvres)
    tolerance = checks.positive("tolerance", tolerance)
    search = {"count": fewest, "travel": cheapest}[checks.one_of("objective", objective, OBJECTIVES)]
    letters = VOCABULARIES[checks.one_of("vocabulary", vocabulary, tuple(VOCABULARIES))]
    here = _scene(robot, layout, letters, twist_limit, bend_limit)
    wanted = quaternions.from_matrices(targets)
    seen = rotation_from_folded(here, wanted)
    parts = []
    with _bar(wanted.shape[1], progress) as bar:
        for first in range(0, wanted.shape[1], _BATCH):
            batch = seen[:, first : first + _BATCH]
            parts.append(search(here, batch, most, tolerance).rows)
            bar.update(batch.shape[1])
    return plans(here, join(parts), wanted, tolerance)


def replan(robot: Robot, target: ArrayLike, measured: ArrayLike, **options: Any) -> Plan:
    """Plan from a measured orientation: feedback between manoeuvres (thesis 1.9).

    Args:
        robot: the robot, joints at zero.
        target: (3, 3) orientation to end in, base components to inertial ones.
        measured: (3, 3) orientation now, likewise.
        **options: as for `plan`.

    Returns:
        The plan for the rotation left, `measured^T target`; its rotation and error are those of that rotation.
    """
    wanted = checks.rotations("target", target, (3, 3))
    now = checks.rotations("measured", measured, (3, 3))
    return plan(robot, now.T @ wanted, **options)


def _scene(robot: Robot, layout: Layout, letters: str, twist_limit: float, bend_limit: float) -> Context:
    """Compute what plans of one robot within one box share, or find it among the last few."""
    key = (key_of(robot), layout, letters, twist_limit, bend_limit, jax.dtypes.canonicalize_dtype(float))
    if key not in _scenes:
        _scenes[key] = context(robot, layout, box_of(robot, layout, letters, twist_limit, bend_limit))
        if len(_scenes) > _KEPT:
            _scenes.popitem(last=False)
    _scenes.move_to_end(key)
    return _scenes[key]


def _bar(total: int, show: bool) -> Any:
    from tqdm import tqdm

    return tqdm(total=total, disable=not show, unit=" targets", desc="plan")

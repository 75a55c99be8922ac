"""Aerial righting: joint motions that turn a robot that already has angular momentum, in the time of its fall.

With angular momentum `H` the turn depends on the time as well as on the path, `R' = R hat(A^-1 (B theta' + R^T H))`
(thesis 1.9; a cat dropped upside down, or one that already spins). The joints go along a spline of least jerk, at rest
at both ends; its points are found by Newton steps of little effort that end on the target, with multipliers for what
the joints' limits, the motors and the clearance allow. Several starts run side by side.
"""

from __future__ import annotations

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.precision import in_double
from reojax.collision.clearance import clearance as clearances
from reojax.mechanics.dynamics import joint_inertia
from reojax.mechanics.own_units import without_names
from reojax.motion.motor import Motor, check_motors, per_joint
from reojax.robot import Robot
from reojax.steering.asked import posture, reasonable
from reojax.steering.limits import RightingTask
from reojax.steering.result import Righting
from reojax.steering.search import LANES, Search, least_durations

_SPARE = 1e-3
"""Clearance that is kept at the nodes beyond what is asked, for what lies between them [m]."""
PIECES, FEW_PIECES, MANY_JOINTS = 7, 4, 6
"""Pieces of the spline, and of that of a robot of so many joints or more, which has more ways to turn."""


@in_double
def righting(
    robot: Robot,
    target: ArrayLike,
    *,
    momentum: ArrayLike,
    duration: float | None,
    start: ArrayLike | None = None,
    end: ArrayLike | None = None,
    motors: Motor | Sequence[Motor] | None = None,
    clearance: float | None = None,
    weights: ArrayLike | None = None,
    pieces: int | None = None,
    starts: int = 24,
    tolerance: float = 1e-6,
    max_steps: int = 40,
    seed: int = 0,
    shorten: bool = True,
    about: ArrayLike | None = None,
) -> Righting:
    """Find a joint motion after which a robot with angular momentum has the target orientation and posture.

    Args:
        robot: the robot; its joint limits hold.
        target: (3, 3) orientation at the end, base frame to inertial frame; the base starts at the identity.
        momentum: (3,) angular momentum about the centre of mass, inertial frame [kg m^2/s].
        duration: of the motion [s]; None with motors: the shortest that is found.
        start: (j,) posture at the start [rad]; default zero.
        end: (j,) posture at the end; default `start`. The joints are at rest at both.
        motors: whose torque-speed lines must hold, as for `simulate`; default none.
        clearance: least distance of the robot's collision pairs, proven along the whole motion [m]; default not asked.
        weights: (j,) price of each joint's mean square acceleration; default the square of its inertia at the start.
        pieces: pieces of the spline, at least 3; default 7, and 4 from six joints on.
        starts: motions to start from, at most.
        tolerance: angle to the target that counts as reached [rad].
        max_steps: Newton steps from each start, at most.
        seed: of the random motions among which starts are looked for.
        shorten: whether to look for `least_duration` where the motors cannot do it, which takes many searches.
        about: (3,) axis, base frame, about which the robot may be turned in any way at the end: `[0, 0, 1]` where it
            has to land on its feet and may face anywhere. `error` is then the angle to the nearest end that will do.
            Default: about none.

    Returns:
        The motion of least effort of those that converged first; where none did, the best, with `converged` False, and
        with motors the least duration that does (`least_duration`), if one was found.

    Raises:
        ValueError: naming the entry, its value and the rule; also for a momentum that implies a body rate or turns
            beyond reason, which is likely in another unit.
    """
    goal = checks.rotations("target", target)
    momenta = checks.numbers("momentum", momentum, (3,))[None]
    many = _righting(robot, goal[None], momenta, duration, start, end, motors, clearance, weights, pieces, starts,
                     tolerance, max_steps, seed, shorten, about)  # fmt: skip
    return Righting(*(field[0] for field in many))


@in_double
def righting_many(
    robot: Robot,
    targets: ArrayLike,
    *,
    momenta: ArrayLike,
    duration: float | None,
    start: ArrayLike | None = None,
    end: ArrayLike | None = None,
    motors: Motor | Sequence[Motor] | None = None,
    clearance: float | None = None,
    weights: ArrayLike | None = None,
    pieces: int | None = None,
    starts: int = 24,
    tolerance: float = 1e-6,
    max_steps: int = 40,
    seed: int = 0,
    shorten: bool = True,
    about: ArrayLike | None = None,
) -> Righting:
    """`righting` for many releases side by side: `targets` (m, 3, 3) or one for all, `momenta` (m, 3).

    Every field of the result has a leading axis m. Other arguments and errors as for `righting`.
    """
    given = checks.numbers("momenta", momenta, (-1, 3))
    if checks.rank(targets) == 2:
        goals = np.broadcast_to(checks.rotations("targets", targets), (len(given), 3, 3))
    else:
        goals = checks.rotations("targets", targets, (-1, 3, 3))
    return _righting(robot, goals, given, duration, start, end, motors, clearance, weights, pieces, starts, tolerance,
                     max_steps, seed, shorten, about)  # fmt: skip


def _righting(robot, goals, momenta, duration, start, end, motors, clearance, weights, pieces, starts, tolerance,
              max_steps, seed, shorten, about) -> Righting:  # fmt: skip
    """Check everything, search, and where the motors cannot do it, look for the least duration."""
    starts = checks.whole("starts", starts)
    tolerance, max_steps = checks.positive("tolerance", tolerance), checks.whole("max_steps", max_steps)
    seed = checks.whole("seed", seed, 0)
    if duration is None and motors is None:
        raise ValueError("`duration` is None, the shortest that is found; without `motors` there is none.")
    seconds = 0.5 if duration is None else checks.positive("duration", duration, "s")
    h = momenta
    if len(h) != len(goals):
        raise ValueError(f"`momenta` has {len(h)} rows for {len(goals)} targets.")
    task, pieces = task_of(robot, h, seconds, start, end, motors, clearance, weights, pieces, about)
    look = Search(task, pieces, starts, tolerance, max_steps, seed, 2 if len(h) == 1 else min(LANES, len(h)))
    found = look(goals, h, np.full(len(h), seconds))
    if duration is not None and (motors is None or not shorten or found.converged.all()):
        return found
    return least_durations(look, found, goals, h, keep=duration is not None)


def task_of(
    robot, momenta, seconds, start, end, motors, clearance, weights, pieces, about=None
) -> tuple[RightingTask, int]:
    """What all motions of a search share, checked, and the pieces of their splines."""
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    checks.on_host("robot", robot, "righting")
    if pieces is None:
        pieces = PIECES if robot.joints < MANY_JOINTS else FEW_PIECES
    pieces = checks.whole("pieces", pieces, 3)
    first = posture(robot, "start", np.zeros(robot.joints) if start is None else start)
    last = first if end is None else posture(robot, "end", end)
    reasonable(robot, first, momenta, seconds)
    if weights is None:
        price = np.diagonal(np.asarray(joint_inertia(robot, first))) ** 2
    else:
        price = np.asarray(checks.numbers("weights", weights, (robot.joints,)))
        if not (price > 0).all():
            raise ValueError(f"`weights` is {price.tolist()}; each must be positive.")
    if clearance is not None and not robot.collision_pairs:
        raise ValueError(f"`clearance` is {clearance}, but {robot.name!r} has no collision pairs.")
    axis = np.zeros(3)
    if about is not None:
        axis = np.asarray(checks.numbers("about", about, (3,)))
        if not (size := np.linalg.norm(axis)) > 0:
            raise ValueError(f"`about` is {axis.tolist()}; it must have a direction.")
        axis = axis / size
    known = None if motors is None else check_motors(motors, robot)
    least, spare = None, np.zeros(())
    if clearance is not None:
        least = np.asarray(checks.number("clearance", clearance, unit="m"))
        kept = {entry: float(np.asarray(clearances(robot, p)).min()) for entry, p in (("start", first), ("end", last))}
        for entry, own in kept.items():
            if own < least:
                raise ValueError(f"`clearance` is {clearance} m; the posture at the {entry} has only {own:.4g} m.")
        spare = np.minimum(_SPARE, min(kept.values()) - least)
    plain = without_names(robot, shapes=least is not None, couplings=True)  # one program for all robots of this tree
    task = RightingTask(plain, None if known is None else per_joint(known, np.dtype(float)), least, spare, first, last,
                price / price.mean(), axis)  # fmt: skip
    return jax.tree.map(lambda x: jnp.asarray(x, float), task), pieces

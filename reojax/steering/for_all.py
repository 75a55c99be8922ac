"""Righting for an uncertain release: one motion that is good for all momenta of a set or a covariance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.precision import in_double
from reojax.motion.motor import Motor
from reojax.optimisation.status import Status
from reojax.robot import Robot
from reojax.steering.clear_motion import proven_clearance
from reojax.steering.end import basis
from reojax.steering.least_squares import cubature, solve_for_all
from reojax.steering.limits import FEASIBLE
from reojax.steering.result import Righting, trajectory_through
from reojax.steering.righting import righting_many, task_of


class RightingForAll(NamedTuple):
    """One motion for many momenta."""

    motion: Righting
    """The motion; its `error`, `rotation` and `omega` at the mean momentum, `beyond` the worst of all. `converged` says
    that the limits hold; there is no knowing whether another motion misses less."""
    momenta: Float[np.ndarray, "k 3"]
    """For which it is made [kg m^2/s]."""
    shares: Float[np.ndarray, " k"]
    """How much each counts; their sum is 1."""
    miss: Float[np.ndarray, " k"]
    """Angle left to the target with each of them [rad]."""
    rms: Float[np.ndarray, ""]
    """Root of the mean square of `miss` [rad]."""
    rms_for_mean: Float[np.ndarray, ""]
    """The same of the motion that `righting` finds for the mean momentum alone, the best of those tried [rad]."""


@in_double
def righting_for_all(
    robot: Robot,
    target: ArrayLike,
    *,
    momentum: ArrayLike,
    duration: float,
    covariance: ArrayLike | None = None,
    start: ArrayLike | None = None,
    end: ArrayLike | None = None,
    motors: Motor | Sequence[Motor] | None = None,
    clearance: float | None = None,
    weights: ArrayLike | None = None,
    pieces: int | None = None,
    tries: int = 4,
    max_steps: int = 40,
    seed: int = 0,
) -> RightingForAll:
    """Find one motion whose mean square miss of the target, over all momenta that a release may leave, is least.

    Starts are the motions that `righting` finds for the mean momentum; from each, Levenberg-Marquardt steps go down,
    and back by so much that the limits hold.
    What momentum does cannot be undone without knowing it: `integral of R A^-1 R^T` is positive definite, so a spread
    always leaves a miss, which a motion in wide postures makes small. To take back the rest, there is `Steering`.

    Args:
        robot: the robot.
        target: (3, 3) orientation at the end.
        momentum: (k, 3) a set, each counting the same; or (3,) the mean, with `covariance` [kg m^2/s].
        duration: of the motion [s].
        covariance: (3, 3) of the momentum, inertial frame: six momenta with this mean and covariance are taken.
        start: as for `righting`, like `end`, `motors`, `clearance`, `weights` and `pieces`.
        end: see there.
        motors: see there; they must do for each of the momenta.
        clearance: see there.
        weights: see there.
        pieces: see there.
        tries: motions to start from.
        max_steps: most steps from each.
        seed: of the random motions that the first of them starts from.

    Raises:
        ValueError: naming the entry, its value and the rule.
    """
    goal = checks.rotations("target", target)
    if covariance is None:
        momenta = np.asarray(checks.numbers("momentum", momentum, (-1, 3)))
        shares = np.full(len(momenta), 1 / len(momenta))
    else:
        spread = np.asarray(checks.numbers("covariance", covariance, (3, 3)))
        if np.abs(spread - spread.T).max() > 1e-9 * np.abs(spread).max() or np.linalg.eigvalsh(spread).min() < (
            -1e-9 * np.abs(spread).max()
        ):
            raise ValueError(f"`covariance` is {spread.tolist()}; it must be symmetric, with no negative eigenvalue.")
        momenta, shares = cubature(np.asarray(checks.numbers("momentum", momentum, (3,))), spread)
    tries, max_steps = checks.whole("tries", tries), checks.whole("max_steps", max_steps)
    seconds = checks.positive("duration", duration, "s")
    task, pieces = task_of(robot, momenta, seconds, start, end, motors, clearance, weights, pieces)
    mean = shares @ momenta
    first = [
        righting_many(robot, goal, momenta=mean[None], duration=seconds, start=start, end=end, motors=motors,
                      clearance=clearance, weights=weights, pieces=pieces, seed=seed + k).points[0]
        for k in range(tries)
    ]  # fmt: skip
    asked = (jnp.asarray(x) for x in (np.stack(first), goal, momenta, shares, np.asarray(seconds)))
    start_points, *rest = asked
    _, before = solve_for_all(task, pieces, 0, start_points, *rest)
    answers, angles = jax.tree.map(np.asarray, solve_for_all(task, pieces, max_steps, start_points, *rest))
    rms = np.sqrt(angles**2 @ shares)
    good = answers.beyond <= FEASIBLE
    k = int(np.lexsort((rms, ~good))[0])
    own = basis(pieces, 16).nodes[:, 0] @ answers.points[k]
    nothing = np.asarray(np.nan)
    clear, ok = nothing, bool(good[k])
    if clearance is not None:
        clear = np.asarray(proven_clearance(robot, trajectory_through(answers.points[k], seconds)))
        ok &= bool(clearance - clear <= FEASIBLE)
    motion = Righting(
        points=answers.points[k],
        duration=np.asarray(seconds),
        momentum=mean,
        rotation=answers.rotation[k],
        omega=answers.omega[k],
        error=answers.error[k],
        beyond=answers.beyond[k],
        margin=nothing if motors is None else answers.margin[k],
        effort=answers.effort[k],
        travel=np.abs(np.diff(own, axis=0)).sum(),
        converged=np.asarray(ok),
        status=np.asarray(Status.CONVERGED if ok else Status.INFEASIBLE),
        steps=answers.steps[k],
        least_duration=nothing,
        clearance=clear,
    )
    return RightingForAll(motion, momenta, shares, angles[k], rms[k], np.sqrt((np.asarray(before) ** 2 @ shares).min()))

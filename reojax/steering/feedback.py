"""Feedback in flight: what is wrong with a release is estimated while the motion runs, and the rest takes it back.

An extended Kalman filter on the rotation group (F. L. Markley, J. Guid. Control Dyn. 26, 2003) holds the orientation,
the angular momentum, a wire's drag and chosen parameters of the robot. It goes along the joint angles that are read,

    R' = R hat(A^-1 (B theta' + R^T H)),      H' = -drag R omega,

and an orientation that comes late is compared at the time when it was taken. What the estimate says of the end of the
motion is taken back by the least change of the joints that does (`reojax.steering.prediction`); with `steps=0` it goes
to the law of `correction_gains` instead, as it runs on board (`reojax.steering.onboard`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import as_numbers, common_float
from reojax.captures.parameters import Parameter, parameter
from reojax.mechanics.own_units import without_names
from reojax.motion.trajectory import Trajectory
from reojax.robot import Robot
from reojax.steering.clear_of_itself import keep_of
from reojax.steering.drift import drift_of
from reojax.steering.estimator import Model
from reojax.steering.gains import correction_gains, spread
from reojax.steering.law import SteeringLaw
from reojax.steering.least_change import Effort
from reojax.steering.prediction import bias_of
from reojax.steering.tables import gain_table

_BUMPS = 20
"""Bumps at least, where they are not asked for."""


def Steering(
    robot: Robot,
    trajectory: Trajectory,
    *,
    noise: float = np.deg2rad(1.0),
    momentum: ArrayLike | None = None,
    momentum_std: ArrayLike = 0.0,
    drag_std: float = 0.0,
    parameters: Sequence[Parameter | str] = (),
    parameters_std: Sequence[float] = (),
    wander: float = 1e-3,
    tau: float = 5e-3,
    settle: float = 1e-2,
    largest: float = 0.6,
    samples: int = 32,
    weights: ArrayLike | None = None,
    left: float = 0.1,
    steps: int = 20,
    bumps: int | None = None,
    price: float = 3e-4,
    goal: ArrayLike | None = None,
    clearance: float | None = None,
) -> SteeringLaw:
    """Estimator and corrector of one motion: readings in, joint angles out, all state explicit.

    `state = law.start()`, then `state, told = law.step(state, Reading(time, theta, rotation, taken))` at each reading.

    Args:
        robot: the robot as it is believed to be.
        trajectory: the motion of its joints.
        noise: standard deviation of the read orientation, about each axis [rad].
        momentum: (3,) angular momentum that the motion was planned for, inertial frame [kg m^2/s]; default zero.
        momentum_std: (3,) or one number, standard deviation of what the release adds to it [kg m^2/s].
        drag_std: standard deviation of the wires' moment per angular velocity of the base [N m s/rad].
        parameters: numbers of the robot that are estimated too: names as for `calibrate`, or `Parameter`s.
        parameters_std: standard deviation of each.
        wander: what the orientation goes astray beyond all this, per root of time [rad/s^(1/2)].
        tau: time constant of the filter that smooths corrections [s].
        settle: time over which a correction is made [s].
        largest: largest change of a joint [rad]; the robot's limits hold too.
        samples: of each piece of the trajectory, for the tables.
        weights: (j,) price of changing each joint, as for `correction_gains`.
        left: damping of the linear law, in shares of the authority at the start.
        steps: steps of the prediction of the end by the estimated robot, at each reading; 0 takes the linear law of
            `reojax.steering.onboard` instead, which is cheaper and holds for small errors.
        bumps: smooth changes in time of which, for each joint, a correction is made; default five a piece, at least
            20. The more there are, the later something can still be taken back, and the faster the joints go.
        price: square of an error that is worth a change of a joint by a radian [rad^2]: the more, the smaller the
            changes, and the slower they follow what is estimated.
        goal: (3, 3) orientation to end in, the base starting at the identity; default where the motion ends.
        clearance: least distance between the robot's parts, from 0 up, that every posture which the joints are told is
            proven to keep [m]; default not asked. The motion must keep it. A correction that would come nearer goes
            only part of its way, and what it leaves is corrected later, if there is time.

    Raises:
        ValueError: naming the entry, its value and the rule.
    """
    h = np.zeros(3) if momentum is None else momentum
    gains = correction_gains(robot, trajectory, samples=samples, weights=weights, left=left, momentum=h)
    numbers = {"noise": noise, "wander": wander, "tau": tau, "settle": settle, "largest": largest}
    numbers |= {"drag_std": drag_std, "price": price}
    for entry, value in numbers.items():
        single = np.asarray(as_numbers(entry, value))
        if (
            single.shape
            or not np.isfinite(single)
            or single < 0
            or (single == 0 and entry not in ("wander", "drag_std"))
        ):
            raise ValueError(f"`{entry}` is {checks.shorten(value)}; it must be one positive number.")
    listed = checks.listing("parameters", parameters, "names and `Parameter`s")
    chosen = tuple(parameter(robot, p) if isinstance(p, str) else p for p in listed)
    if not all(isinstance(p, Parameter) for p in chosen):
        raise ValueError(f"`parameters` is {checks.shorten(parameters)}; each must be a name or a Parameter.")
    own = checks.numbers("parameters_std", parameters_std, (-1,))
    if len(own) != len(chosen):
        raise ValueError(f"`parameters_std` has {len(own)} numbers for {len(chosen)} parameters.")
    one = checks.rank(momentum_std) == 0
    momenta = np.broadcast_to(checks.numbers("momentum_std", momentum_std, () if one else (3,)), (3,))
    std = np.concatenate([np.zeros(3), momenta, [drag_std], own])
    if not (np.isfinite(std) & (std >= 0)).all():
        raise ValueError(f"standard deviations must be finite and not negative; they are {std[3:].tolist()}.")
    keep = None if clearance is None else keep_of(robot, trajectory, clearance)
    steps = checks.whole("steps", steps, 0)
    bumps = max(_BUMPS, 5 * trajectory.pieces) if bumps is None else checks.whole("bumps", bumps)
    aim = gains.rotation[-1] if goal is None else checks.rotations("goal", goal)
    dtype = common_float(robot, trajectory)
    one = partial(jnp.asarray, dtype=dtype)
    plain = without_names(
        robot, couplings=True, shapes=keep is not None
    )  # one compiled step serves all robots of this tree
    robot, trajectory, h = jax.tree.map(one, (plain, trajectory, np.asarray(h, float)))
    table = {name: one(value) for name, value in gain_table(gains).items()} | {"momentum": h, "to_end": gains.to_end}
    table["drift"] = drift_of(robot, chosen, gains, h)
    if steps:
        table["bias"] = bias_of(robot, trajectory, table, one(gains.rotation), steps, bumps)
    each = jnp.ones(robot.joints, dtype) if weights is None else one(np.asarray(weights, float))
    return SteeringLaw(
        model=Model(robot, trajectory, one(noise), one(wander), chosen),
        table=table,
        goal=one(aim),
        frame=jnp.eye(3, dtype=dtype),
        effort=Effort(spread(robot, each), one(price)),
        steps=steps,
        bumps=bumps,
        start_covariance=jnp.diag(one(std) ** 2),
        tau=one(tau),
        settle=one(settle),
        largest=one(largest),
        keep=keep,
    )

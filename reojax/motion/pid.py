"""PID control of joints: its gains, by bandwidth. What they make of a motion is `closed_loop`.

    M = (Kp e + Ki int e + Kd de/dt) / N

with the joint's error `e` and its gear ratio `N`, in torques of the motors.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array, as_numbers, is_concrete
from reojax.mechanics.dynamics import joint_inertia
from reojax.robot import Robot


class Gains(NamedTuple):
    """Gains of a PID controller at the joints; each one number, or one for each joint (j,)."""

    proportional: float | Array
    """[N m/rad]"""
    integral: float | Array
    """[N m/(rad s)]"""
    derivative: float | Array
    """[N m s/rad]"""


PID_BANDWIDTH, FEEDFORWARD_BANDWIDTH = 320.0, 65.0
"""Tuned bandwidths [rad/s] of the prototype's controllers, PID alone and on top of precomputed torques.

By `experiments/drop_tower_parts/tracking.py`: of 13 from 25 to 400 rad/s, the least one whose RMS error of the joints
over manoeuvres A and B at 270/120 degrees in 0.62 s is within 2 % of the best (rounded): RE-max 17 at 12 V with
friction, 1 ms, 512 counts.
"""


def gains(robot: Robot, bandwidth: ArrayLike, theta: ArrayLike | None = None) -> Gains:
    """Gains that put all three poles of every joint at `-bandwidth`, each joint taken alone.

    On an inertia `J` (the diagonal of `joint_inertia`): `Kp = 3 J p^2`, `Ki = J p^3`, `Kd = 3 J p`.

    Args:
        robot: the robot.
        bandwidth: `p` [rad/s], one number or (j,); may be traced.
        theta: (j,) shape at which the inertia is taken [rad]; default all zero.

    Raises:
        ValueError: if `bandwidth` is not positive and finite, or has another shape.
    """
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    p = as_numbers("bandwidth", bandwidth)
    if p.shape not in ((), (robot.joints,)):
        raise ValueError(f"`bandwidth` has shape {p.shape}; it must be one number or ({robot.joints},).")
    if is_concrete(p) and not (np.isfinite(p) & (np.asarray(p) > 0)).all():
        raise ValueError(f"`bandwidth` is {np.asarray(p).tolist()}; it must be positive and finite.")
    shape = np.zeros(robot.joints) if theta is None else as_numbers("theta", theta)
    if shape.shape != (robot.joints,) or (is_concrete(shape) and not np.isfinite(shape).all()):
        raise ValueError(f"`theta` is {checks.shorten(theta)}; it must be {robot.joints} finite angles.")
    inertia = jnp.diagonal(joint_inertia(robot, shape))
    return Gains(3 * inertia * p**2, inertia * p**3, 3 * inertia * p)


def check_gains(gains: Gains, robot: Robot) -> Gains:
    """Return gains (j,) each, checked."""
    if not isinstance(gains, Gains):
        raise ValueError(f"`gains` is a {type(gains).__name__}; it must be Gains.")
    columns = []
    for field, value in gains._asdict().items():
        array = as_numbers(f"gains.{field}", value)
        if array.shape not in ((), (robot.joints,)):
            raise ValueError(f"gains.{field} has shape {array.shape}; it must be one number or ({robot.joints},).")
        if is_concrete(array) and not (np.isfinite(array) & (np.asarray(array) >= 0)).all():
            raise ValueError(f"gains.{field} is {np.asarray(array).tolist()}; it must be zero or positive, and finite.")
        columns.append(jnp.broadcast_to(array, (robot.joints,)))
    return Gains(*columns)

"""Motors of which no more is known than their torque-speed lines at the joints."""

from collections.abc import Sequence

import numpy as np

import reojax
from reojax import Motor


def motors_of(robot: reojax.Robot, stall: float | Sequence[float], free: float | Sequence[float]) -> Motor:
    """Motors of 1 V with such lines behind the robot's own gears, with its own rotors.

    `stall` is the torque at standstill [N m] and `free` the speed without a load [rad/s], both at the joints, gears
    included; one number, or one for each joint.
    """
    ratio = np.where(np.asarray(robot.gear_ratio) == 0, 1.0, np.asarray(robot.gear_ratio))
    constant = 1 / (ratio * np.broadcast_to(free, ratio.shape))
    torque = np.broadcast_to(stall, ratio.shape) / ratio
    return Motor(
        supply=np.ones_like(ratio),
        resistance=constant / torque,
        torque_constant=constant,
        rotor_inertia=np.asarray(robot.rotor_inertia),
        gear_ratio=ratio,
    )

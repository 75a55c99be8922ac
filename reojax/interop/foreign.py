"""A robot in somebody else's model: rotors as bodies of their own, and how all velocities follow from the robot's.

Nothing of reojax's rotor formula is repeated there: the part of a link that is the rotor is taken out of the link and
put back as a body that turns on a hinge of its own. A matrix `drive` ties the hinges together: all velocities of the
foreign model are `drive @ [v, omega, theta_dot]` with the base's linear velocity (in the foreign model's frame), the
base's angular velocity in the base frame, and the joint rates.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from reojax.robot import Robot


class Rotor(NamedTuple):
    """The rotor of joint `joint`, a part of link `link`, turning `spin` times as fast as the joint."""

    joint: int
    link: int
    axis: np.ndarray
    inertia: float
    spin: float


class Foreign(NamedTuple):
    """A robot in a foreign model, and how its velocities follow from the robot's."""

    model: Any
    drive: np.ndarray
    """(nv, 6 + j); see the module's first lines."""
    angles: np.ndarray
    """(nv - 6, j): all hinge angles, in the order of the model, per joint angle."""


def rotors(robot: Robot) -> Iterator[Rotor]:
    """The rotors of a robot that have any inertia."""
    for k, (parent, side) in enumerate(zip(robot.parent, robot.rotor_on, strict=True)):
        if robot.rotor_inertia[k] > 0:
            on_parent = side == "parent"
            ratio = float(robot.gear_ratio[k])
            yield Rotor(
                joint=k,
                link=parent if on_parent else k + 1,
                axis=np.asarray(robot.axis[k]),
                inertia=float(robot.rotor_inertia[k]),
                spin=ratio if on_parent else -ratio,
            )


def tie_hinges(robot: Robot, model: Any, first: dict[int, int], geared: list[tuple[int, Rotor]]) -> Foreign:
    """`first[k]`: velocity index of joint k; `geared`: velocity index of each rotor."""
    drive = np.zeros((model.nv, 6 + robot.joints))
    drive[:6, :6] = np.eye(6)
    for k, index in first.items():
        drive[index, 6 + k] = 1.0
    for index, rotor in geared:
        drive[index, 6 + rotor.joint] = rotor.spin
    return Foreign(model, drive, drive[6:, 6:])


def configuration(foreign: Foreign, base: list, theta: np.ndarray, neutral: np.ndarray) -> np.ndarray:
    """Coordinates of the foreign model: the base's, then all hinges for joint angles `theta` (j,)."""
    q = np.concatenate([*base, foreign.angles @ theta])
    if q.shape != neutral.shape:
        raise ValueError(f"the model has {neutral.shape} coordinates; the robot gives {q.shape}.")
    return q


def split(momentum: np.ndarray, rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`A` (3, 3), `B` (3, j) and the effect of the base's linear velocity (3, 3), all in the base frame [kg m^2, kg m].

    Args:
        momentum: (3 or 6, 6 + j) momentum per base velocity and joint rates, inertial frame, the angular one last.
        rotation: (3, 3) of the base, base components to inertial ones.
    """
    momentum = rotation.T @ momentum[-3:]
    return momentum[:, 3:6], -momentum[:, 6:], momentum[:, :3]

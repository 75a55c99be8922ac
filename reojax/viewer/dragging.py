"""A robot whose joints are dragged by hand: the base turns as the momentum equation says, move by move."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from reojax.mechanics.holonomy import rotation_history
from reojax.path import Path
from reojax.robot import Robot

SAMPLES = 8
"""Samples of a move, for the track; the net rotation does not depend on them."""


class Dragging:
    """Posture and orientation while joints are moved; at zero momentum, so only the way counts and not its speed."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        lower, upper = np.asarray(robot.lower, float), np.asarray(robot.upper, float)
        self.theta: Float[np.ndarray, " j"] = couple(robot, np.clip(np.zeros(robot.joints), lower, upper))
        """Joint angles now [rad]."""
        self.rotation: Float[np.ndarray, "3 3"] = np.eye(3)
        """Orientation of the base now."""
        self.track: list[Float[np.ndarray, "3 3"]] = [self.rotation]
        """Orientations so far."""

    def move(self, theta: Float[np.ndarray, " j"]) -> None:
        """Go straight to other joint angles: `R' = R hat(A^-1 B theta_dot)` along the edge between them."""
        there = couple(self.robot, np.asarray(theta, float))
        if np.array_equal(there, self.theta):
            return
        edge = Path(np.stack([self.theta, there]))
        turns = np.asarray(rotation_history(self.robot, edge, samples=SAMPLES), float)
        self.track += list(self.rotation @ turns[1:])
        self.theta, self.rotation = there, self.track[-1]

    def forget(self) -> None:
        """Take the present orientation as the one to start from."""
        self.rotation = np.eye(3)
        self.track = [self.rotation]


def couple(robot: Robot, theta: Float[np.ndarray, " j"]) -> Float[np.ndarray, " j"]:
    """Joint angles with those of coupled joints as their drivers say."""
    whole = theta.copy()
    for (joint, driver), ratio, offset in zip(
        robot.couplings, np.asarray(robot.coupling_ratio), np.asarray(robot.coupling_offset), strict=True
    ):
        whole[joint] = ratio * theta[driver] + offset
    return whole

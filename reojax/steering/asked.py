"""The door of `righting`: what is asked for must make sense."""

from __future__ import annotations

from typing import Any

import numpy as np

from reojax._internal import checks
from reojax.mechanics.momentum import momentum_matrices
from reojax.robot import Robot

_FASTEST = 100.0
"""Body rate that a momentum may imply [rad/s]; more is a wrong unit."""
_TURNS = 20.0
"""Turns during the motion that a momentum may imply."""


def posture(robot: Robot, entry: str, value: Any) -> np.ndarray:
    """A posture (j,) within the joint limits, coupled joints where their drivers put them [rad].

    Raises:
        ValueError: naming `entry`, the joint, its angle and the rule.
    """
    angles = np.asarray(checks.numbers(entry, value, (robot.joints,)))
    low, high = np.asarray(robot.lower), np.asarray(robot.upper)
    out = (angles < low - 1e-9) | (angles > high + 1e-9)
    if out.any():
        k = int(np.argmax(out))
        raise ValueError(
            f"{entry}[{k}] is {angles[k]:g} rad; joint {robot.joint_names[k]!r} goes from {low[k]:g} to {high[k]:g}."
        )
    for number, (joint, driver) in enumerate(robot.couplings):
        own = float(robot.coupling_ratio[number]) * angles[driver] + float(robot.coupling_offset[number])
        if abs(own - angles[joint]) > 1e-6:
            raise ValueError(
                f"{entry}[{joint}] is {angles[joint]:g} rad; joint {robot.joint_names[joint]!r} follows "
                f"{robot.joint_names[driver]!r}, which puts it at {own:g}."
            )
    return angles


def reasonable(robot: Robot, start: np.ndarray, momenta: np.ndarray, duration: float) -> None:
    """Ask about momenta (m, 3) [kg m^2/s] that imply, in the posture `start` (j,), a body rate or turns beyond reason.

    The body rate is `A^-1 H`; the turns are what it makes in the `duration` [s].

    Raises:
        ValueError: naming the largest, and what it implies.
    """
    inertia = np.asarray(momentum_matrices(robot, start).A)
    rates = np.linalg.norm(np.linalg.solve(inertia, momenta.T), axis=0)
    worst = int(np.argmax(rates))
    if rates[worst] > _FASTEST or rates[worst] * duration > 2 * np.pi * _TURNS:
        raise ValueError(
            f"`momentum` is {momenta[worst].tolist()} kg m^2/s, which implies a body rate of {rates[worst]:.4g} rad/s "
            f"in the start posture, {rates[worst] * duration / (2 * np.pi):.3g} turns in {duration:g} s; is it in "
            "another unit, or an angular velocity?"
        )

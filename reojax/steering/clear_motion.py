"""Clearance of a smooth motion, all along: that of a fine polygon through it, less what lies between."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from reojax.collision.chains import chains_of, geometry_of, levers, structure_of, unit_axes
from reojax.collision.path_clearance import least_clearance
from reojax.motion.trajectory import Trajectory
from reojax.robot import Robot

_INTERVALS = 64
"""Of each piece."""


def proven_clearance(robot: Robot, trajectory: Trajectory) -> float:
    """Distance that no collision pair comes nearer than, anywhere along a trajectory of quintics [m].

    `path_clearance` proves it for the polygon through 64 points of each piece. Between two of them, h apart, joint k
    leaves its chord by `h^2 / 8 max |theta_k''|` at most (of a cubic: no more than its Bernstein coefficients), which
    moves no point of a pair further than that times the joint's lever (`reojax.collision.chains`). 0.1 mm is allowed.
    """
    breaks, coefficients = np.asarray(trajectory.breaks), np.asarray(trajectory.coefficients)
    width = np.diff(breaks)
    share = np.arange(_INTERVALS + 1) / _INTERVALS
    powers = np.arange(coefficients.shape[1])
    values = (width[:, None] * share)[:, :, None] ** powers @ coefficients
    points = np.concatenate([values[:, :-1].reshape(-1, robot.joints), values[-1:, -1]])
    least = float(least_clearance(robot, jnp.asarray(points), 1e-4).distance)
    # second derivatives at four points of each interval, as Bernstein coefficients
    inside = (share[:-1, None] + np.arange(4) / 3 / _INTERVALS) * width[:, None, None]
    second = inside[..., None] ** np.maximum(powers - 2, 0) * (powers * (powers - 1)) @ coefficients[:, None]
    f0, f1, f2, f3 = np.moveaxis(second, 2, 0)
    corners = f0, (-5 * f0 + 18 * f1 - 9 * f2 + 2 * f3) / 6, (2 * f0 - 9 * f1 + 18 * f2 - 5 * f3) / 6, f3
    bend = np.abs(np.stack(corners)).max(0)  # (pieces, intervals, j)
    leaving = (width[:, None, None] / _INTERVALS) ** 2 / 8 * bend
    structure, geometry = structure_of(robot), unit_axes(geometry_of(robot), np.dtype(float))
    joint, lever = chains_of(structure).joint, np.asarray(levers(structure, geometry))
    moved = np.where(joint >= 0, leaving.reshape(-1, robot.joints)[:, joint], 0) * lever
    return least - float(moved.sum((2, 3)).max(initial=0.0))

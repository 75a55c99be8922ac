"""What a robot can reach in principle, however long its path: decided by its controllable directions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from reojax.mechanics.controllable import controllable_directions
from reojax.planning import quaternions
from reojax.planning.free_polygons import FINE, Polygons
from reojax.planning.freedom import Freedom
from reojax.robot import Robot

_SUSPECT = 1e-4
"""Share of the largest spread of random paths' rotations below which another direction is looked into exactly. It costs
a program to compile, which a robot that plainly turns every way need not wait for."""


class Reach(NamedTuple):
    """The rotations that paths from one posture to another can make: a rotation, then any about the axes."""

    rank: int
    """0: one rotation alone; 1: those about one axis; 3: all."""
    axes: Float[np.ndarray, "rank 3"]
    """Axes that loops turn the base about, base frame at the start."""
    straight: Float[np.ndarray, "3 3"]
    """Rotation after the straight path from the start to the end."""

    def closest(self, targets: Float[np.ndarray, "m 3 3"]) -> Float[np.ndarray, "m 3 3"]:
        """The rotations that can be reached, closest to the targets."""
        if self.rank == 3:
            return targets
        if self.rank == 0:
            return np.broadcast_to(self.straight, targets.shape).copy()
        # exp(axis f) straight is closest to the target for tan(f / 2) = axis . v / w, (w, v) of target straight^T
        w, *v = quaternions.from_matrices(targets @ self.straight.T)
        half = np.arctan2(self.axes[0] @ np.stack(v), w)
        turn = np.concatenate([np.cos(half)[None], np.sin(half) * self.axes[0][:, None]])
        return quaternions.to_matrices(turn) @ self.straight

    def explain(self) -> str:
        """Why some rotations cannot be reached, in words."""
        if self.rank == 0:
            return "no loop of the joints that move turns the base"
        x, y, z = self.axes[0].round(6) + 0.0
        return f"loops of the joints that move turn the base about the axis ({x:g}, {y:g}, {z:g}) only"


def reach_of(robot: Robot, freedom: Freedom, polygons: Polygons, turns: Float[np.ndarray, "4 m"]) -> Reach:
    """What can be reached; `turns` are the rotations of many random paths."""
    ends = np.stack([freedom.start, freedom.end])
    path = np.concatenate([ends[:1], np.repeat(ends[1:], polygons.corners + 1, axis=0)])
    straight = np.eye(3) if freedom.closed else polygons.rotations(path[None], FINE)[0]
    if len(freedom.joints) >= 2:
        away = np.stack(quaternions.product(turns, quaternions.inverse(quaternions.from_matrices(straight[None]))))
        spread = np.sqrt(np.maximum(np.linalg.eigvalsh(away[1:] @ away[1:].T), 0.0))
        if spread[0] > _SUSPECT * spread[2]:
            return Reach(3, np.eye(3), straight)
    found = controllable_directions(robot, freedom.start, joints=freedom.joints)
    return Reach(found.rank, found.axes, straight)

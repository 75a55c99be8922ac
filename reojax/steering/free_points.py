"""The points of a spline as numbers that a search may change: inner ones, of the joints that no other drives."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax.robot import Robot


class FreePoints(NamedTuple):
    """How `x` (n,), the free joints at the inner points, becomes the points of a motion."""

    ends: Float[Array, "p+1 j"]
    """The first and the last point, which stay."""
    carry: Float[Array, "j f"]
    """How all joints follow the free ones."""
    offset: Float[Array, " j"]

    def of(self, x: Float[Array, " n"]) -> Float[Array, "p+1 j"]:
        """All points."""
        inner = x.reshape(-1, self.carry.shape[1]) @ self.carry.T
        return jnp.asarray(self.ends).at[1:-1].set(inner + self.offset[None])

    def slopes(self, rows: Float[Array, "k o p+1"]) -> Float[Array, "k o j n"]:
        """How the joints at the nodes change with `x`, where `rows` gives them from the points."""
        lift = jnp.einsum("kop,jf->kojpf", rows[:, :, 1:-1], self.carry)
        return lift.reshape(*lift.shape[:3], -1)


def free_points(robot: Robot, points: Float[Array, "p+1 j"]) -> tuple[FreePoints, Float[Array, " n"]]:
    """What of a spline's points may change, and its values here."""
    coupled = {joint: (driver, number) for number, (joint, driver) in enumerate(robot.couplings)}
    free = [k for k in range(robot.joints) if k not in coupled]
    carry = np.zeros((robot.joints, len(free)))
    carry[free, np.arange(len(free))] = 1
    carry, offset = jnp.asarray(carry, points.dtype), jnp.zeros(robot.joints, points.dtype)
    for joint, (driver, number) in coupled.items():
        carry = carry.at[joint, free.index(driver)].set(robot.coupling_ratio[number])
        offset = offset.at[joint].set(robot.coupling_offset[number])
    ends = jnp.zeros_like(points).at[0].set(points[0]).at[-1].set(points[-1])
    return FreePoints(ends, carry, offset), points[1:-1][:, np.array(free)].ravel()

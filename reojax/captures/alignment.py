"""Clocks and frames of a capture and a motion brought together by least squares."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax.captures.capture import Capture

_SHIFTS_PER_MOTION = 200
_LONGEST = 100
"""Largest ratio of the capture's duration to the motion's in which the motion is looked for."""


class Simulated(Protocol):
    """What a capture is compared with, such as a `Motion`: at rest before its first and after its last time."""

    @property
    def time(self) -> Float[Array, " k"]:
        """Times [s], increasing."""
        ...

    @property
    def theta(self) -> Float[Array, "k j"]:
        """Joint angles [rad]."""
        ...

    @property
    def rotation(self) -> Float[Array, "k 3 3"]:
        """Orientation of the base."""
        ...


def align(capture: Capture, motion: Simulated) -> tuple[float, bool]:
    """Time of the capture [s] at which the motion's clock is zero, by least squares.

    Of the joint angles if they were measured, else of the orientation, whose frame is then free. All shifts by which
    motion and capture overlap are tried, 200 to a duration of the motion; the best is refined without regard to frames.

    Returns:
        The time, and whether it is a minimum inside the range of shifts (not its edge, nor a capture at rest).

    Raises:
        ValueError: if the capture is more than 100 times as long as the motion.
    """
    from scipy.optimize import minimize_scalar

    cost = _joint_cost(capture, motion) if capture.theta is not None else _turn_cost(capture, motion)
    first, last = float(motion.time[0]), float(motion.time[-1])
    low, high = capture.time[0] - last, capture.time[-1] - first
    if high - low > (_LONGEST + 1) * (last - first):
        raise ValueError(
            f"the capture lasts {np.ptp(capture.time):.4g} s and the motion {last - first:.4g} s; "
            f"cut the capture to the part around the motion, or give `offset`."
        )
    # all shifts by which they overlap, coarsely; then between the neighbours of the best
    shifts = np.linspace(low, high, 1 + int(np.ceil((high - low) / (last - first) * _SHIFTS_PER_MOTION)))
    costs = np.array([cost(shift) for shift in shifts])
    best = int(np.argmin(costs))
    around = (shifts[max(best - 1, 0)], shifts[min(best + 1, len(shifts) - 1)])
    fine = minimize_scalar(cost, bounds=around, method="bounded", options={"xatol": 1e-9})
    offset = float(fine.x if fine.fun <= costs[best] else shifts[best])
    inside = 0 < best < len(shifts) - 1
    return offset, bool(inside and costs[best] < 0.5 * max(costs[0], costs[-1]))


def align_frames(measured: Float[np.ndarray, "m 3 3"], simulated: Float[np.ndarray, "m 3 3"]) -> np.ndarray:
    """Rotation `G` for which `measured = G simulated` fits best, by least squares of the matrices."""
    # the rotation nearest to the sum of `measured simulated^T` (Kabsch)
    u, _, v = np.linalg.svd(np.einsum("mab,mcb->ac", measured, simulated))
    return u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v


def _joint_cost(capture: Capture, motion: Simulated) -> Callable[[float], float]:
    seen = capture.seen_theta
    measured = [(capture.time[s], np.asarray(capture.theta)[s, k], k) for k, s in enumerate(seen.T)]
    joints = [np.asarray(motion.theta)[:, k] for k in range(seen.shape[1])]
    count = max(1, seen.sum())

    def cost(shift: float) -> float:
        return sum(((np.interp(t - shift, motion.time, joints[k]) - x) ** 2).sum() for t, x, k in measured) / count

    return cost


def _turn_cost(capture: Capture, motion: Simulated) -> Callable[[float], float]:
    seen = capture.seen_rotation
    time, measured = capture.time[seen], np.asarray(capture.rotation)[seen]
    at = interpolate(np.asarray(motion.time, float), np.asarray(motion.rotation, float))

    def cost(shift: float) -> float:
        """Mean of `1 - cos(angle)`, about half the square of the angle, with the best frame of the cameras."""
        # trace of G^T (mean of measured simulated^T) is largest at the sum of singular values (Kabsch)
        together = np.einsum("mab,mcb->ac", measured, at(time - shift)) / len(time)
        u, s, v = np.linalg.svd(together)
        return float(3 - s[0] - s[1] - s[2] * np.linalg.det(u @ v)) / 2

    return cost


def interpolate(time: np.ndarray, rotation: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Orientation as a function of time, at rest before the first and after the last one."""
    from scipy.spatial.transform import Rotation, Slerp

    turn = Slerp(time, Rotation.from_matrix(rotation))
    return lambda when: turn(np.clip(when, time[0], time[-1])).as_matrix()

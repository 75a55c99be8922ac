"""What a free path may do: which joints move, from where to where, and how far; checked, or a `ValueError`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax.mechanics.controllable import independent_moves
from reojax.robot import Robot

_ROUNDING = 1e-9
"""How far beyond a limit a posture may be [rad]: what rounding does to limits in degrees."""
_COUPLED = 1e-6
"""How far a posture given may be from its couplings [rad]; it is then put on them exactly."""

_WIDEST = 2 * np.pi
"""How far a joint goes from its postures at most [rad], where its limits would allow more: what the steps resolve."""


class Freedom(NamedTuple):
    """The independent joints that move, k of them, and what the others do meanwhile."""

    joints: tuple[int, ...]
    """Their numbers."""
    moves: Float[np.ndarray, "j k"]
    """How all joints move with each: 1 for itself, the ratio for a joint that is coupled to it."""
    start: Float[np.ndarray, " j"]
    """Posture before the path [rad]."""
    end: Float[np.ndarray, " j"]
    """Posture after it [rad]."""
    low: Float[np.ndarray, " k"]
    """Smallest angles of the independent joints [rad]."""
    high: Float[np.ndarray, " k"]
    """Largest angles [rad]."""

    @property
    def base(self) -> Float[np.ndarray, " j"]:
        """Posture with the moving joints at zero: `theta = base + moves @ angles`."""
        return self.start - self.moves @ self.start[list(self.joints)]

    @property
    def closed(self) -> bool:
        """Whether the path ends where it starts, so that it can be run again."""
        return bool((self.start == self.end).all())


def freedom_of(
    robot: Robot,
    *,
    start: ArrayLike | None,
    end: ArrayLike | None,
    joints: Sequence[int | str] | None,
    lower: ArrayLike | None,
    upper: ArrayLike | None,
) -> Freedom:
    """Read postures, joints and limits.

    A joint without a limit stays within a half turn of its postures, one of very wide limits within a turn.

    Raises:
        ValueError: naming the joint that is outside of its limits, contradicts its coupling, or would have to stay and
            to move.
    """
    coupled = {joint: (driver, k) for k, (joint, driver) in enumerate(robot.couplings)}
    named = range(robot.joints) if joints is None else checks.indices_of("joints", joints, robot.joint_names, "joint")
    for joint in named:
        if joints is not None and joint in coupled and coupled[joint][0] not in named:
            follower, driver = robot.joint_names[joint], robot.joint_names[coupled[joint][0]]
            raise ValueError(f"`joints` has {follower!r}, which follows {driver!r}: name {driver!r} too.")
    moving = tuple(sorted(joint for joint in named if joint not in coupled))
    moves = independent_moves(robot, moving)
    turns = np.asarray(moves.any(1))
    low, high = _limits(robot, lower, upper, turns)
    first = _posture(robot, "start", start, low, high)
    last = first if end is None else _posture(robot, "end", end, low, high)
    for joint in np.flatnonzero((first != last) & ~turns):
        raise ValueError(
            f"joint {robot.joint_names[joint]!r} goes from {first[joint]:.6g} to {last[joint]:.6g} rad "
            "from `start` to `end`, but is not among the `joints` that move."
        )
    # limits of what moves independently, no wider than a reasonable path needs, both ends within
    reach = [_own_range(robot, joint, coupled, low, high) for joint in moving]
    box = np.array(reach).reshape(-1, 2).T
    ends = np.stack([first, last])[:, list(moving)]
    half = np.where(np.isfinite(box[1] - box[0]), _WIDEST, np.pi)
    box = np.clip(box, ends.min(0) - half, ends.max(0) + half)
    return Freedom(moving, moves, first, last, np.minimum(box[0], ends.min(0)), np.maximum(box[1], ends.max(0)))


def _limits(
    robot: Robot, lower: ArrayLike | None, upper: ArrayLike | None, moving: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The robot's limits (j,), narrower ones where a joint moves."""
    low, high = np.asarray(robot.lower, float), np.asarray(robot.upper, float)
    if lower is not None:
        low = np.where(moving, np.maximum(low, _per_joint(robot, "lower", lower)), low)
    if upper is not None:
        high = np.where(moving, np.minimum(high, _per_joint(robot, "upper", upper)), high)
    for joint in np.flatnonzero(~(low <= high)):
        raise ValueError(
            f"joint {robot.joint_names[joint]!r} is left nothing: from {low[joint]:.6g} to {high[joint]:.6g} rad, "
            "by its own limits and those given."
        )
    return low, high


def _per_joint(robot: Robot, entry: str, value: ArrayLike) -> np.ndarray:
    shape = () if checks.rank(value) == 0 else (robot.joints,)
    return np.broadcast_to(checks.numbers(entry, value, shape, finite=False), (robot.joints,))


def _posture(robot: Robot, entry: str, value: ArrayLike | None, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """A posture (j,) within the limits and on the couplings; by default zero."""
    given = value is not None
    theta = checks.numbers(entry, value, (robot.joints,)) if given else np.zeros(robot.joints)
    theta = theta + 0.0
    for k, (joint, driver) in enumerate(robot.couplings):
        follows = float(robot.coupling_ratio[k]) * theta[driver] + float(robot.coupling_offset[k])
        if given and abs(theta[joint] - follows) > _COUPLED:
            name, other = robot.joint_names[joint], robot.joint_names[driver]
            raise ValueError(
                f"`{entry}` has joint {name!r} at {theta[joint]:.6g} rad; it follows {other!r}, to {follows:.6g} rad."
            )
        theta[joint] = follows
    for joint in np.flatnonzero((theta < low - _ROUNDING) | (theta > high + _ROUNDING)):
        rule = f"its limits are {low[joint]:.6g} to {high[joint]:.6g} rad"
        name = robot.joint_names[joint]
        if given:
            raise ValueError(f"`{entry}` has joint {name!r} at {theta[joint]:.6g} rad; {rule}.")
        raise ValueError(f"joint {name!r} cannot be at zero: {rule}. Pass `{entry}=`, a posture within the limits.")
    return theta


def _own_range(
    robot: Robot, joint: int, coupled: dict[int, tuple[int, int]], low: np.ndarray, high: np.ndarray
) -> tuple[float, float]:
    """Range of an independent joint in which those that follow it stay within their limits too."""
    least, most = low[joint], high[joint]
    for follower, (driver, k) in coupled.items():
        ratio, offset = float(robot.coupling_ratio[k]), float(robot.coupling_offset[k])
        if driver == joint and ratio:
            ends = sorted([(low[follower] - offset) / ratio, (high[follower] - offset) / ratio])
            least, most = max(least, ends[0]), min(most, ends[1])
    return least, most

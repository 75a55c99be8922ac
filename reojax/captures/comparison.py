"""Measured against simulated motion: clocks and frames aligned, errors in the thesis's terms (figures 1.9, 2.13).

A capture's clock starts anywhere, and its cameras have a frame of their own. So the simulated motion is first
shifted in time to where it fits best, by less than a frame too, and then both orientations are told from where
the robot starts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import as_numbers
from reojax._internal.checks import instance, number
from reojax._internal.precision import in_double
from reojax.captures.alignment import Simulated, align, align_frames, interpolate
from reojax.captures.capture import Capture
from reojax.captures.mistakes import LARGE, suspects
from reojax.captures.orientation import fill_gaps, orientations
from reojax.mechanics.attitude import tilt_and_roll, zxz_beside, zxz_without_jumps
from reojax.robot import Robot

_AT_REST = 0.02
"""Turn of the base within which it counts as not having started [rad]."""


class Sampled(NamedTuple):
    """A motion known at some times."""

    time: Float[np.ndarray, " k"]
    theta: Float[np.ndarray, "k j"]
    rotation: Float[np.ndarray, "k 3 3"]


class Comparison(NamedTuple):
    """A capture beside a simulation, frame by frame; NaN where something was not seen.

    Orientations are told from the start of the simulated motion. ZXZ angles are counted on where they jump, and of
    the measured ones those nearest to the simulated are taken; tilt and roll (`R = exp((tilt_x, tilt_y, 0)) Rz(roll)`)
    have no jumps anyway.
    """

    offset: float
    """Time of the capture at which the simulation's clock is zero [s]."""
    offset_found: bool
    """Whether the offset is one that fits best, inside the times that were tried, and not given or at their edge."""
    time: Float[np.ndarray, " m"]
    """Times of the frames on the simulation's clock [s]."""
    measured_theta: Float[np.ndarray, "m j"]
    simulated_theta: Float[np.ndarray, "m j"]
    measured_rotation: Float[np.ndarray, "m 3 3"]
    simulated_rotation: Float[np.ndarray, "m 3 3"]
    measured_zxz: Float[np.ndarray, "m 3"]
    simulated_zxz: Float[np.ndarray, "m 3"]
    measured_tilt_roll: Float[np.ndarray, "m 3"]
    """Tilt about x, tilt about y, roll about z [rad]."""
    simulated_tilt_roll: Float[np.ndarray, "m 3"]
    theta_rms: Float[np.ndarray, " j"]
    """RMS difference of each joint angle [rad]; NaN without measured joints."""
    zxz_rms: Float[np.ndarray, "3"]
    """RMS difference of each ZXZ angle [rad]; NaN without measured orientation."""
    tilt_roll_rms: Float[np.ndarray, "3"]
    angle_rms: float
    """RMS angle between the two orientations [rad]."""
    hint: str = ""
    """Where the error is above 20 degrees: the usual mistake in the capture without which it would fit, if there is."""

    @property
    def worst_rms(self) -> float:
        """The larger one of `angle_rms` and the joints' RMS, of those that there are [rad]."""
        there = [error for error in (self.angle_rms, *self.theta_rms) if np.isfinite(error)]
        return float(max(there, default=np.nan))


@in_double
def joints_simulated(robot: Robot, capture: Capture) -> Sampled:
    """Motion that follows from the measured joint angles: the base's orientation by `A omega = B theta_dot`.

    Gaps of a joint are filled by monotone cubics (PCHIP) between the frames in which it was seen, and held at the ends.

    Args:
        robot: the robot.
        capture: what was measured, `m` frames with joint angles.

    Returns:
        Times [s], angles (m, j) [rad] without gaps, and rotations (m, 3, 3) of the base, base frame to inertial, the
        identity at first.

    Raises:
        ValueError: if the capture has no joint angles, other ones than the robot's, a joint was never seen, or goes
            more than 32 rad between two frames.
    """
    _check_joints(robot, capture)
    if capture.theta is None:
        raise ValueError("the capture has no joint angles, so its orientation cannot be simulated from them.")
    theta = fill_gaps(capture)
    return Sampled(capture.time, theta, orientations(robot, theta))


@in_double
def compare(
    robot: Robot, capture: Capture, motion: Simulated | None = None, *, offset: float | None = None
) -> Comparison:
    """Compare a capture with a simulated motion, or with what follows from its own joint angles.

    Args:
        robot: the robot.
        capture: what was measured.
        motion: what was planned, such as a `Motion`; default the measured joint motion with the orientation that
            the momentum equation gives for it (`joints_simulated`).
        offset: time of the capture at which the motion starts [s]; default the one at which joint angles (for a
            planned motion) or else orientations fit best.

    Raises:
        ValueError: if capture and robot or motion do not fit together, or there is nothing to compare.
    """
    _check_joints(robot, capture)
    if motion is None and not capture.seen_rotation.any():
        raise ValueError("the capture has no orientation, and no motion is given: there is nothing to compare.")
    if motion is not None:
        motion = _as_sampled(motion)
        if motion.theta.shape[1] != robot.joints:
            raise ValueError(f"`motion` has {motion.theta.shape[1]} joints; {robot.name!r} has {robot.joints}.")
    if offset is not None:
        offset = float(number("offset", offset, unit="s"))
    found = _compare(robot, capture, motion, offset)
    return found._replace(hint=_hint(robot, capture, motion, offset, found.worst_rms))


def _compare(robot: Robot, capture: Capture, motion: Sampled | None, offset: float | None) -> Comparison:
    """The comparison, of checked input."""
    simulated = joints_simulated(robot, capture) if motion is None else motion
    if motion is None:
        capture = capture._replace(theta=None)
    best, found = align(capture, simulated) if offset is None else (offset, False)
    return _comparison(capture, simulated, best, found)


def _hint(robot: Robot, capture: Capture, motion: Sampled | None, offset: float | None, error: float) -> str:
    """The mistake without which the error is least, if it is small then and at most a third of what it was.

    The first one that leaves less than a tenth is taken at once.
    """
    if not error > LARGE:
        return ""
    least, hint = min(LARGE, error / 3), ""
    for what, mended in suspects(capture):
        try:
            left = _compare(robot, mended, motion, offset).worst_rms
        except ValueError:  # angles that are far too large when mended
            continue
        if left < least:
            least = left
            hint = f"{what}; then the RMS error is {np.rad2deg(left):.3g} degrees instead of {np.rad2deg(error):.3g}"
        if left < error / 10:
            break
    return hint


def _as_sampled(motion: Simulated) -> Sampled:
    """The motion as arrays.

    Raises:
        ValueError: if it is none: no time, angles and orientations that go together.
    """
    if not all(hasattr(motion, field) for field in Sampled._fields):
        kind = type(motion).__name__
        raise ValueError(f"`motion` is a {kind}; it must have time, theta and rotation, as a Motion has.")
    arrays = [np.asarray(as_numbers(f"motion.{field}", getattr(motion, field)), float) for field in Sampled._fields]
    time, theta, rotation = arrays
    frames = len(time) if time.ndim == 1 else 0
    if frames < 2 or theta.shape[:1] != (frames,) or theta.ndim != 2 or rotation.shape != (frames, 3, 3):
        shapes = ", ".join(str(array.shape) for array in arrays)
        raise ValueError(f"`motion` has time, theta and rotation of shapes {shapes}; they do not go together.")
    if not all(np.isfinite(array).all() for array in arrays) or (np.diff(time) < 0).any():
        raise ValueError("`motion` has numbers that are not finite, or times that go back.")
    return Sampled(*arrays)


def _check_joints(robot: Robot, capture: Capture) -> None:
    instance("robot", robot, Robot, "`make_robot` makes")
    if not isinstance(capture, Capture):
        kind = type(capture).__name__
        raise ValueError(f"`capture` is a {kind}; it must be a Capture, such as `read_capture` returns.")
    if capture.theta is not None and capture.theta.shape[1] != robot.joints:
        raise ValueError(f"the capture has {capture.theta.shape[1]} joints; {robot.name!r} has {robot.joints}.")


def _comparison(capture: Capture, motion: Sampled, offset: float, found: bool) -> Comparison:
    time = capture.time - offset
    frames = len(time)
    # the motion at the capture's times, from its own start
    simulated = interpolate(motion.time, motion.rotation)(time)
    start = motion.rotation[0]
    simulated = start.T @ simulated
    theta = np.stack([np.interp(time, motion.time, column) for column in motion.theta.T], axis=1)
    # what the cameras saw, in the frame of the robot's start
    seen = capture.seen_rotation
    measured = np.full((frames, 3, 3), np.nan) if capture.rotation is None else np.array(capture.rotation)
    measured[~seen] = np.nan
    if seen.any():
        measured = _frame(measured[seen], simulated[seen]).T @ measured
    # angles of both, the measured ones brought next to the simulated
    zxz, angles = zxz_without_jumps(simulated), tilt_and_roll(simulated)
    measured_angles = np.full((frames, 3), np.nan)
    if seen.any():
        measured_angles[seen] = tilt_and_roll(measured[seen])
        turns = np.round(np.nanmedian(measured_angles[:, 2] - angles[:, 2]) / (2 * np.pi))
        measured_angles[:, 2] -= 2 * np.pi * turns
    measured_zxz = zxz_beside(measured, zxz)
    joints = np.full_like(theta, np.nan) if capture.theta is None else np.asarray(capture.theta)
    # cosine of the angle between both, by the trace
    between = 0.5 * (np.einsum("mab,mab->m", measured, simulated) - 1)
    return Comparison(
        offset=offset,
        offset_found=found,
        time=time,
        measured_theta=joints,
        simulated_theta=theta,
        measured_rotation=measured,
        simulated_rotation=simulated,
        measured_zxz=measured_zxz,
        simulated_zxz=zxz,
        measured_tilt_roll=measured_angles,
        simulated_tilt_roll=angles,
        theta_rms=_rms(joints - theta),
        zxz_rms=_rms(measured_zxz - zxz),
        tilt_roll_rms=_rms(measured_angles - angles),
        angle_rms=float(_rms(np.arccos(np.clip(between, -1, 1))[:, None])[0]),
    )


def _frame(measured: np.ndarray, simulated: np.ndarray) -> np.ndarray:
    """Turn from the robot's start to the cameras' frame: the mean over the first frames, before it has turned."""
    turned = np.arccos(np.clip(0.5 * (np.trace(simulated[0].T @ simulated, axis1=1, axis2=2) - 1), -1, 1))
    still = int(np.argmax(turned > _AT_REST)) or len(turned)
    return align_frames(measured[:still], simulated[:still])


def _rms(differences: np.ndarray) -> np.ndarray:
    """Of each column, over what is there; NaN where nothing is."""
    seen = np.isfinite(differences)
    total = np.where(seen, differences, 0.0)
    with np.errstate(invalid="ignore"):
        return np.sqrt((total**2).sum(axis=0) / seen.sum(axis=0))

"""What is shown moves: joint angles and orientation of the base on one clock, out of whatever holds a motion."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax.captures.comparison import Comparison
from reojax.collision.nearest import Nearest, nearest_parts
from reojax.mechanics.certificate import DEFAULT_SAMPLES, Certificate, certify_rotation
from reojax.mechanics.holonomy import DEFAULT_STEPS, rotation_history
from reojax.mechanics.kinematics import link_poses
from reojax.mechanics.own_units import without_names
from reojax.motion.simulation import Motion, simulate
from reojax.motion.trajectory import Trajectory
from reojax.path import Path, polygon
from reojax.robot import Robot
from reojax.session import LEAST_COMPILE

MOST = 1200
"""Most samples of one motion in a page; motions of more are thinned."""
_PER_EDGE = 64
"""Most samples of an edge: 4 degrees of the longest twist each."""
_CERTIFIED = 48
"""Most edges of a path whose certificate is measured without being asked for."""
_ANOTHER = 1e-2
"""Share of the momenta in a motion by which their sum may change, by rounding, before it is another robot's."""


class NearestOnClock(NamedTuple):
    """Where the robot's parts come nearest to each other along a clip."""

    place: Nearest
    clock: float
    """When, on the clip's clock."""
    own: Float[np.ndarray, "2 3"]
    """The two nearest points, each in its link's frame [m]."""


class Clip(NamedTuple):
    """A motion at `m` samples of its clock."""

    clock: Float[np.ndarray, " m"]
    """Time [s], or edges along the path where there is no time."""
    theta: Float[np.ndarray, "m j"]
    """Joint angles [rad]."""
    rotation: Float[np.ndarray, "m 3 3"]
    """Orientation of the base, base components to inertial ones."""
    timed: bool
    """Whether the clock is time."""
    corners: Float[np.ndarray, " c"]
    """Clock at the corners of the path, for curves; none of a motion in time."""
    travel: float
    """Sum over all joints of the angle that each one moves through [rad]."""
    certificate: Certificate | None = None
    motion: Motion | None = None
    """Torques and motors, where they are known."""
    notes: tuple[str, ...] = ()
    """What the reader of the page should know, such as that it was thinned."""
    nearest: NearestOnClock | None = None
    """Where the robot's parts come nearest to each other, if that was asked for."""


def clip_of(robot: Robot, motion: Any, *, entry: str = "motion", certificate: bool | None = None) -> Clip:
    """Samples of a path, a plan, a trajectory, or of anything that has `time`, `theta` and `rotation`.

    Args:
        robot: the robot that moves.
        motion: a `Path`, `Plan` or `FreePaths` of one target, a `Trajectory` or `Fastest`, or a `Motion`, `Tracking`,
            `Sampled`, ...
        entry: what a message calls it.
        certificate: whether to measure the certificate of a path; default if it has at most 48 edges.

    Raises:
        ValueError: if it is none of these, is not finite, or is a motion of another robot.
    """
    if isinstance(motion, Path):
        return _along(robot, motion, entry, certificate)
    if hasattr(motion, "waypoints"):
        corners = np.asarray(motion.waypoints, float)
        if corners.ndim != 2:
            raise ValueError(f"`{entry}` holds paths to many targets; show one at a time, such as its waypoints[0].")
        return _along(robot, polygon(corners), entry, certificate)
    if isinstance(getattr(motion, "trajectory", None), Trajectory):  # of `fastest_loop`, `overlap`, `free_law`
        motion = motion.trajectory
    if isinstance(motion, Trajectory):
        _check_joints(robot, motion.joints, entry)
        motion = simulate(robot, motion)
    if not all(hasattr(motion, name) for name in ("time", "theta", "rotation")):
        raise ValueError(
            f"`{entry}` is a {type(motion).__name__}; it must be a Path, a Plan, a Trajectory, or hold `time`, `theta` "
            "and `rotation` as a Motion does."
        )
    return _by_time(robot, motion, entry)


def nearest_on_clock(robot: Robot, clip: Clip) -> NearestOnClock:
    """Find where the parts come nearest to each other, proven along the straight ways between the clip's samples.

    Raises:
        ValueError: for a robot without pairs of shapes.
    """
    place = nearest_parts(robot, Path(clip.theta))
    rotation, origin = (np.asarray(part, float) for part in link_poses(robot, place.theta))
    links = list(place.links)
    own = np.einsum("kji,kj->ki", rotation[links], place.points - origin[links])
    return NearestOnClock(place, float(np.interp(place.at, np.arange(len(clip.clock)), clip.clock)), own)


def clips_of_comparison(robot: Robot, comparison: Comparison) -> tuple[Clip, Clip]:
    """Simulated motion of a comparison, and the measured one where something was seen; else it goes as simulated."""
    c = comparison
    theta = np.where(np.isfinite(c.measured_theta), c.measured_theta, c.simulated_theta)
    turned = np.asarray(np.isfinite(c.measured_rotation).all(axis=(1, 2)))
    angled = np.isfinite(c.measured_theta).all(axis=1)
    seen = turned if turned.any() else angled
    if not seen.any():
        raise ValueError("`motion` compares with a capture in which nothing was seen.")
    notes = [f"Measured: orientation in {turned.sum()} of {len(turned)} frames, all joints in {angled.sum()}."]
    if not angled.all():
        notes.append("Where a joint was not seen, the measured robot has the simulated angle.")
    if not turned.any():
        notes.append("No orientation was measured: the measured robot turns as the simulated one.")
    rotation = c.measured_rotation if turned.any() else c.simulated_rotation
    measured = _Samples(c.time[seen] - c.time[0], theta[seen], rotation[seen])
    simulated = _Samples(c.time - c.time[0], c.simulated_theta, c.simulated_rotation)
    clips = [_by_time(robot, part, "motion", start=0.0) for part in (simulated, measured)]
    return clips[0], clips[1]._replace(notes=(*clips[1].notes, *notes))


class _Samples(NamedTuple):
    time: np.ndarray
    theta: np.ndarray
    rotation: np.ndarray


def _along(robot: Robot, path: Path, entry: str, certified: bool | None) -> Clip:
    """A path without time: its clock counts edges, every one equally long."""
    _check_joints(robot, path.joints, entry)
    corners = np.asarray(path.waypoints, float)
    certificate, notes = None, ()
    travel = float(np.abs(np.diff(corners, axis=0)).sum())
    if not path.edges:
        still = np.broadcast_to(np.eye(3), (2, 3, 3))
        return Clip(np.arange(2.0), np.repeat(corners, 2, axis=0), still, False, np.arange(2.0), travel)
    samples = int(np.clip(MOST // path.edges, 1, _PER_EDGE))
    if certified or (certified is None and path.edges <= _CERTIFIED):
        samples = 1 << (samples.bit_length() - 1)  # of those of the certificate's own motion
        finer = DEFAULT_SAMPLES // samples
        certificate, _, history = jax.tree.map(np.asarray, _certified(without_names(robot), path))
    else:
        if certified is None:
            notes = (f"The certificate of a path of {path.edges} edges was not measured (ask with certificate=True).",)
        finer = -(-DEFAULT_STEPS // samples) if path.edges <= MOST else 1
        history = np.asarray(rotation_history(robot, path, samples=samples * finer))
    if history.dtype == np.float32:
        notes = (*notes, "Computed in single precision (float32): angles are known to some 1e-6 rad.")
    rotation = history.astype(float)[::finer]
    clock = np.arange(len(rotation)) / samples
    theta = np.stack([np.interp(clock, np.arange(len(corners)), angle) for angle in corners.T], axis=1)
    clip = Clip(clock, theta, rotation, False, np.arange(len(corners), dtype=float), travel, certificate, notes=notes)
    return _thin(clip, "corners", len(corners))


@partial(jax.jit, compiler_options=LEAST_COMPILE)
def _certified(robot: Robot, path: Path) -> tuple[Certificate, Array, Array]:
    """Certificate, net rotation and the motion that it is about: one program, which is mostly run once."""
    return certify_rotation(robot, path)


def _by_time(robot: Robot, motion: Any, entry: str, start: float | None = None) -> Clip:
    """A motion by time; the clock is zero at `start`, default its first sample."""
    time = checks.numbers(f"{entry}.time", np.asarray(motion.time), (-1,))
    theta = checks.numbers(f"{entry}.theta", np.asarray(motion.theta), (-1, -1))
    _check_joints(robot, theta.shape[1], entry)
    rotation = checks.rotations(f"{entry}.rotation", motion.rotation, (-1, 3, 3), tolerance=1e-3)
    if not len(time) == len(theta) == len(rotation):
        raise ValueError(f"`{entry}` has {len(time)} times, {len(theta)} postures and {len(rotation)} rotations.")
    if (np.diff(time) < 0).any():
        raise ValueError(f"{entry}.time goes back at entry {int(np.argmax(np.diff(time) < 0)) + 1}; it must rise.")
    whole = motion if isinstance(motion, Motion) else None
    if whole is not None:
        _check_robot(robot, whole, entry)
    travel = float(np.abs(np.diff(theta, axis=0)).sum())
    start = time[0] if start is None else start
    return _thin(Clip(time - start, theta, rotation, True, np.zeros(0), travel, motion=whole), "samples", len(time))


def _thin(clip: Clip, what: str, count: int) -> Clip:
    """At most `MOST` samples, first and last among them, and a note that says so."""
    if len(clip.clock) <= MOST + 1:
        return clip
    kept = np.unique(np.round(np.linspace(0, len(clip.clock) - 1, MOST)).astype(int))
    note = f"Thinned: {len(kept)} of {len(clip.clock)} samples are shown (the motion has {count} {what})."
    corners = clip.corners if len(clip.corners) <= 41 else clip.corners[[0, -1]]
    fields = {name: getattr(clip, name)[kept] for name in ("clock", "theta", "rotation")}
    return clip._replace(**fields, corners=corners, notes=(*clip.notes, note))


def _check_joints(robot: Robot, joints: int, entry: str) -> None:
    if joints != robot.joints:
        raise ValueError(
            f"`{entry}` moves {joints} joints, so it is a motion of another robot than {robot.name!r}, "
            f"which has {robot.joints}: {checks.shorten(', '.join(robot.joint_names))[1:-1]}."
        )


def _check_robot(robot: Robot, motion: Motion, entry: str) -> None:
    """Refuse a motion along which the robot's angular momentum `R (A omega - B theta_dot)` would not keep."""
    from reojax.mechanics.momentum import momentum_matrices

    every = np.unique(np.linspace(0, len(motion.time) - 1, 64).astype(int))
    theta, rate, omega, rotation = (
        np.asarray(x, float)[every] for x in (motion.theta, motion.theta_dot, motion.omega, motion.rotation)
    )
    A, B = (np.asarray(x, float) for x in jax.vmap(lambda angles: momentum_matrices(robot, angles))(theta))
    of_base, of_joints = np.einsum("mij,mj->mi", A, omega), np.einsum("mij,mj->mi", B, rate)
    momentum = np.einsum("mij,mj->mi", rotation, of_base - of_joints)
    scale = np.linalg.norm(of_base, axis=1) + np.linalg.norm(of_joints, axis=1)
    change = np.linalg.norm(momentum - momentum[0], axis=1).max()
    if change > _ANOTHER * scale.max():
        raise ValueError(
            f"`{entry}` is not a motion of {robot.name!r}: along it this robot's angular momentum would change by "
            f"{change / scale.max():.0%} of what its parts exchange, and in free fall it keeps."
        )

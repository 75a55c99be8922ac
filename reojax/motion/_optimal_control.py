"""The optimiser behind the fastest motions: least duration, motors within their curves, joints within their limits."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from reojax._internal.arrays import Array
from reojax._internal.result_text import printed_as
from reojax.collision.constraint import with_spare
from reojax.motion._feasibility import beyond, ends_of, restore_feasibility
from reojax.motion._transcription import (
    Apart,
    Numbers,
    Programs,
    Task,
    Transcription,
    UnknownBox,
    numbers_of,
    programs_of,
)
from reojax.motion.least_time import minimum_stretch
from reojax.motion.trajectory import Trajectory, stretch
from reojax.motion.trajectory_clearance import trajectory_clearance
from reojax.optimisation.optimise import Solution, optimise_together
from reojax.optimisation.status import Status, message_of_status

_EXACT = 1e-8
"""Largest error of an answer's net rotation that counts as converged [rad]."""
_TOLERANCE, _SLOPE = 1e-7, 1e-5
"""Of the optimiser: largest violation (rad, and shares of the supply), and slope."""
_AGAIN = 2
"""How often a motion is solved again whose clearance turns out to be too little between the samples."""
_ROUNDING = 1e-12
"""What a joint may be beyond its limit by rounding [rad]."""


class Fastest(NamedTuple):
    """A motion of least duration, and how well it is what it should be."""

    trajectory: Trajectory
    """The motion, no motor beyond its torque-speed curve."""
    duration: Float[Array, ""]
    """How long it takes [s]."""
    error: Float[Array, ""]
    """Angle between its net rotation and the one wanted [rad]."""
    beyond: Float[Array, ""]
    """Farthest that a joint goes beyond its limits at any time [rad], 0 for none."""
    converged: Bool[Array, ""]
    """Whether the optimiser says that nothing near is faster, and `error` is below 1e-8 and `beyond` zero."""
    status: Int[Array, ""]
    """Why the optimiser ended, a `reojax.optimisation.status.Status`; `message` says it in words. `NOT_FOUND` where the
    motion does not keep the clearance asked for."""
    clearance: Float[Array, ""] | None = None
    """Least distance of the robot's parts at any time, proven [m]; None if it was not asked for."""

    @property
    def value(self) -> Trajectory:
        """The motion, under the name that all solvers' results have."""
        return self.trajectory

    @property
    def cost(self) -> Float[Array, ""]:
        """Its duration [s]."""
        return self.duration

    @property
    def violation(self) -> Float[Array, ""]:
        """Farthest that a joint goes beyond its limits [rad]."""
        return self.beyond

    message = message_of_status
    """Why the optimiser ended, in words."""
    __str__ = printed_as(
        lambda found: (
            f"{float(found.duration):.6g} s, error {float(found.error):.1e} rad, beyond limits by "
            f"{float(found.beyond):.1e} rad; {found.message}"
        ),
        "duration",
    )


class _Answer(NamedTuple):
    """Where the optimiser ended, and the best of it."""

    found: Solution
    unknowns: Float[np.ndarray, " n"]
    """Of the best, after feasibility restoration."""
    trajectory: Trajectory
    """Its motion, run as fast as the motors allow."""
    clearance: Array | float = np.inf
    """Proven [m], if any was asked for."""


class _Programs(NamedTuple):
    """A task, and its conditions with its numbers put in."""

    task: Task
    box: UnknownBox
    conditions: Transcription
    compiled: Programs
    numbers: Numbers

    def build(self, x: Array) -> Trajectory:
        return self.compiled.build(x, self.numbers)

    def rotation_left(self, trajectory: Trajectory) -> Array:
        return self.compiled.rotation_left(trajectory, self.numbers)


def least_duration(task: Task, starts: np.ndarray, box: UnknownBox, max_steps: int, progress: bool | str) -> Fastest:
    """Solve a task from several starts, (m, n); the best answer is restored, and run as fast as its motors allow."""
    conditions = Transcription(task.parametrisation, ends_of(task.robot), task.apart is not None)
    programs = _Programs(task, box, conditions, programs_of(conditions), numbers_of(task, box))
    if task.apart is None:
        answer = _solve(programs, starts, np.zeros(0), max_steps, progress)
    else:
        answer = _solve_apart(programs, task.apart, starts, max_steps, progress)
    found, trajectory = answer.found, answer.trajectory
    kept = task.apart is None or bool(answer.clearance >= task.apart.margin)
    error, past = jnp.linalg.norm(programs.rotation_left(trajectory)), beyond(task.robot, trajectory)
    past = past if past > _ROUNDING else 0.0  # a corner of a path may lie on a limit
    good = bool(found.converged[found.best]) and past == 0 and float(error) < _EXACT and kept
    return Fastest(
        trajectory=trajectory,
        duration=trajectory.duration,
        error=error,
        beyond=jnp.asarray(past),
        converged=jnp.asarray(good),
        status=jnp.asarray(found.status[found.best] if kept else Status.NOT_FOUND),
        clearance=None if task.apart is None else jnp.asarray(answer.clearance),
    )


def _solve(
    programs: _Programs, starts: np.ndarray, wanted: np.ndarray, max_steps: int, progress: bool | str
) -> _Answer:
    """Optimise from all starts, restore the best, and stretch it to what the motors give."""
    task, box, conditions, compiled, numbers = programs
    found = optimise_together(
        conditions, starts, lower=box.lower, upper=box.upper, scale=box.scale,
        data=np.tile(wanted, (len(starts), 1)), shared=numbers, tolerance=_TOLERANCE, slope_tolerance=_SLOPE,
        max_steps=max_steps, progress=progress,
    )  # fmt: skip
    best = np.asarray(found.value[found.best], float)
    if not task.parametrisation.keeps_rotation or beyond(task.robot, programs.build(best)) > _ROUNDING:
        linearisation = lambda x, share: compiled.linearisation(x, share, wanted, numbers)
        limits = box.lower, box.upper, box.scale
        best = restore_feasibility(linearisation, programs.build, programs.rotation_left, best, limits)
    trajectory = programs.build(best)
    return _Answer(found, best, stretch(trajectory, minimum_stretch(task.robot, trajectory, task.motors)))


def _solve_apart(
    programs: _Programs, apart: Apart, starts: np.ndarray, max_steps: int, progress: bool | str
) -> _Answer:
    """Solve with a clearance at the samples, and again with more where the proof finds too little between them."""
    spare = 0.02 * apart.margin + 1e-4

    def attempt(starts: np.ndarray) -> _Answer:
        answer = _solve(programs, starts, with_spare(apart.margin, spare, apart.have), max_steps, progress)
        return answer._replace(clearance=trajectory_clearance(programs.task.robot, answer.trajectory).distance)

    answer = attempt(starts)
    for _ in range(_AGAIN):
        if answer.clearance >= apart.margin:
            break
        spare = 2 * spare + apart.margin - float(answer.clearance)
        answer = attempt(np.tile(answer.unknowns, (len(starts), 1)))  # as many as before: nothing more is compiled
    return answer

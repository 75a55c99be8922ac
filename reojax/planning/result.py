"""What planning gives back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from reojax.planning import quaternions
from reojax.planning.answers import corners_as_value, first_of, no_violation, status_as_message, travel_as_cost
from reojax.planning.candidates import Candidates, Context
from reojax.planning.table import true_rotations
from reojax.planning.words import last_twist, word_corners


class Plan(NamedTuple):
    """A sequence of manoeuvres, or of `plan_many` one for each target, with a leading axis m and padding at the end."""

    word: tuple[str, ...] | np.ndarray
    """(k,) names of the manoeuvres, first one run first; of many plans an array (m, k), padded with ""."""
    twist: Float[np.ndarray, "*m k"]
    """Amplitude of the first distal joint in each [rad]; padded with 0."""
    bend: Float[np.ndarray, "*m k"]
    """Amplitude of the centre joint in each [rad]; padded with 0."""
    last_twist: Float[np.ndarray, "*m k"]
    """Amplitude of the last distal joint in each [rad]: -twist in A, twist in B, free in R; padded with 0."""
    waypoints: Float[np.ndarray, "*m v j"]
    """Corners of the whole joint path [rad], for `polygon`; padded by repeating the last one."""
    rotation: Float[np.ndarray, "*m 3 3"]
    """Net rotation of the base after the path."""
    error: Float[np.ndarray, "*m"]
    """Angle left to the target [rad]."""
    travel: Float[np.ndarray, "*m"]
    """Sum over all joints of the angle each one moves through [rad]."""
    manoeuvres: Int[np.ndarray, "*m"]
    """Number of manoeuvres."""
    converged: Bool[np.ndarray, "*m"]
    """Whether `error` is within the tolerance."""
    status: Any
    """In words: converged; not found, which proves nothing; or unreachable in principle. Array (m,) of many plans."""
    clearance: Any
    """Least distance of the robot's parts along the path, proven [m], (m,) of many; None if it was not asked for."""

    value = corners_as_value
    """The corners, under the name that all solvers' results have."""
    cost = travel_as_cost
    """Joint travel [rad]."""
    violation = no_violation
    """How far a joint passes its limits [rad]: 0, as no answer ever leaves its box."""
    message = status_as_message
    """How it ended: `status`, under the name that all solvers' results have."""

    def __str__(self) -> str:
        """The word with its amplitudes, and how it ends; of many plans how many are reached."""
        if np.ndim(self.error):
            return f"{len(self.error)} plans, {int(np.sum(self.converged))} of them reach their targets"
        loops = [
            f"{name}({np.rad2deg(twist):.4f}, {np.rad2deg(bend):.4f})"
            for name, twist, bend in zip(self.word, self.twist, self.bend, strict=True)
        ]
        word = " ".join(loops) if len(loops) <= 12 else f"{' '.join(loops[:12])} ... ({len(loops)} manoeuvres)"
        figures = f"error {self.error:.1e} rad, joint travel {np.rad2deg(self.travel):.1f} deg"
        return f"{word or 'nothing to do'} [deg]: {figures}; {self.status}"


def plans(scene: Context, rows: Candidates, targets: np.ndarray, tolerance: float) -> Plan:
    """Write out words for targets (4, m) as a plan for many, with true rotations by twice the default steps."""
    box, layout = scene.box, scene.layout
    m = len(rows.owner)
    twisted = last_twist(box.letters, rows.letter, rows.x)
    moving = (rows.letter >= 0) & (rows.x[1] != 0) & ((rows.x[0] != 0) | (twisted != 0))
    true = np.zeros((4, *rows.letter.shape))
    true[0] = 1
    true[:, moving] = true_rotations(scene.robot, layout, np.stack([rows.x[0], rows.x[1], twisted])[:, moving])
    turned = scene.fold[:, None]
    for slot in range(rows.letter.shape[0]):
        turned = np.stack(quaternions.product(turned, quaternions.power(true[:, slot], rows.runs[slot])))
    turned = np.stack(quaternions.product(turned, quaternions.inverse(scene.fold[:, None])))
    turned = turned / np.sqrt((turned * turned).sum(0))
    error = quaternions.angles(quaternions.product(quaternions.inverse(targets), turned))

    repeats = np.where(moving, rows.runs, 0).astype(int).T
    length = repeats.sum(1)
    flat = [np.repeat(field.T.ravel(), repeats.ravel()) for field in (rows.letter, rows.x[0], rows.x[1], twisted)]
    ends = np.cumsum(length)[:-1]
    letter, twist, bend, last = (np.split(field, ends) for field in flat)
    names = np.array([*box.letters])
    corners = [word_corners(layout, *parts) for parts in zip(twist, bend, last, strict=True)]
    return Plan(
        word=_stack([names[row] for row in letter], ""),
        twist=_stack(twist, 0.0),
        bend=_stack(bend, 0.0),
        last_twist=_stack(last, 0.0),
        waypoints=_stack(corners, None),
        rotation=quaternions.to_matrices(turned),
        error=error,
        travel=np.array([np.abs(np.diff(path, axis=0)).sum() for path in corners]).reshape(m),
        manoeuvres=length,
        converged=error <= tolerance,
        status=np.array([status_of(*row) for row in zip(error <= tolerance, error, length, strict=True)]),
        clearance=None,
    )


def status_of(converged: bool, error: float, manoeuvres: int) -> str:
    """How a search for words ended, in words."""
    if converged:
        return "converged"
    return (
        f"not found: the closest plan, of {manoeuvres} manoeuvres, leaves {np.rad2deg(error):.6g} deg, which proves "
        "nothing; more manoeuvres, wider limits or `free_path` may reach it"
    )


def first_plan(many: Plan) -> Plan:
    """Return the one plan of many."""
    one = first_of(many)
    return one._replace(word=tuple(map(str, one.word)))


def _stack(rows: Sequence[np.ndarray], fill: str | float | None) -> np.ndarray:
    """Stack rows of different lengths, filled up at the end; with None by the row's last entry."""
    longest = max((len(row) for row in rows), default=0)

    def fill_row(row: np.ndarray) -> np.ndarray:
        if len(row) == longest:
            return row
        missing = longest - len(row)
        rest = row[-1:].repeat(missing, 0) if fill is None else np.full(missing, fill, row.dtype)
        return np.concatenate([row, rest])

    return np.array([fill_row(row) for row in rows])

"""What every system is asked: net rotations of the prototype after manoeuvre A, with four variables a loop.

The variables are both amplitudes, the inertia of the end links about their joints, and the gear ratio, drawn from the
ranges of the thesis. Where a gradient is asked, it is that of `sum(WEIGHTS * R)`.
"""

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import reojax
from reojax import Robot
from reojax.robots import prototype, with_end_inertia, with_gear_ratio

from ._measure import compiled

LOWER = np.array([np.deg2rad(60), np.deg2rad(30), 10e-6, 1.0])
UPPER = np.array([np.deg2rad(270), np.deg2rad(120), 190e-6, 48.0])
WEIGHTS = np.array([[0.3, -1.0, 0.6], [0.8, 0.2, -0.5], [-0.7, 0.4, 0.9]])
SEED = 2019
TOLERANCE = 1e-6
"""Error that every system aims at [rad], for 95 of 100 loops."""
REFERENCE_STEPS = 40


class Loops(NamedTuple):
    """Manoeuvres A on designs of the prototype; one of each field, or (n,) of them."""

    twist: Any
    """[rad]"""
    bend: Any
    """[rad]"""
    inertia: Any
    """Of either end link about its joint's axis [kg m^2]."""
    ratio: Any
    """Gear ratio."""

    def first(self, count: int) -> "Loops":
        """Return the first `count` loops."""
        return Loops(*(field[:count] for field in self))

    def each(self) -> Iterator["Loops"]:
        """Return the loops one by one, as Python numbers."""
        for values in zip(*(np.asarray(field).tolist() for field in self), strict=True):
            yield Loops(*values)


def random_loops(count: int) -> Loops:
    """Draw uniformly from the ranges; the first ones are the same for any `count`."""
    unit = np.random.default_rng(SEED).uniform(size=(count, 4))
    return Loops(*np.ascontiguousarray((LOWER + (UPPER - LOWER) * unit).T))


def robot_of(loop: Loops) -> Robot:
    """Return the design of one loop; its fields may be traced."""
    return with_gear_ratio(with_end_inertia(prototype(), loop.inertia), loop.ratio)


def path_of(loop: Loops) -> reojax.Path:
    """Return the path of one loop in shape space."""
    return reojax.manoeuvre_a(loop.twist, loop.bend)


def net_rotation(loop: Loops, steps: int) -> Any:
    """Return the net rotation (3, 3) after one loop, by reojax."""
    return reojax.net_rotation(robot_of(loop), path_of(loop), steps=steps)


def objective(rotation: Any) -> Any:
    """Return the number whose gradient is asked: `sum(WEIGHTS * rotation)` of one rotation, or of (n, 3, 3)."""
    return (jnp.asarray(WEIGHTS, rotation.dtype) * rotation).sum((-2, -1))


class Task(NamedTuple):
    """The loops, and what tells how good an answer is."""

    loops: Loops
    """As many as the fastest systems take at once."""
    checked: int
    """How many of them, from the first on, the errors are about."""
    quick: bool
    seconds: float
    """How long to time one call, in all its repetitions."""
    magnus_steps: int
    """Steps an edge that take the fourth-order Magnus method to the tolerance."""
    reference: "Reference"

    def error(self, rotations: np.ndarray) -> float:
        """Error of the `rotations` (m, 3, 3) of the first loops, see `Reference.error`."""
        return self.reference.error(rotations)

    def gradient_error(self, gradients: np.ndarray, variables: Sequence[str] = Loops._fields) -> float:
        """95th percentile of the error of the gradients of the first loops, over the median size of a gradient.

        Args:
            gradients: (m, 4), or the columns of some variables.
            variables: which ones.
        """
        columns = [Loops._fields.index(name) for name in variables]
        exact, unit = self.reference.gradient[: len(gradients)][:, columns], (UPPER - LOWER)[columns]
        missed = np.linalg.norm((gradients[: len(exact)] - exact) * unit, axis=1)
        return float(np.quantile(missed, 0.95) / np.median(np.linalg.norm(exact * unit, axis=1)))


class Reference:
    """What the first `count` loops come to, by reojax with many steps."""

    def __init__(self, loops: Loops, count: int) -> None:
        self.loops = loops.first(count)

    @cached_property
    def rotation(self) -> np.ndarray:
        """(m, 3, 3) net rotations."""
        call, _ = compiled(jax.vmap(lambda loop: net_rotation(loop, REFERENCE_STEPS)), self.loops)
        return np.asarray(call(self.loops))

    def error(self, rotations: np.ndarray) -> float:
        """95th percentile of the angle between `rotations` (m, 3, 3) of the first loops and these [rad]."""
        return float(np.quantile(angles(rotations, self.rotation[: len(rotations)]), 0.95))

    @cached_property
    def gradient(self) -> np.ndarray:
        """(m, 4) gradients of the objective."""
        gradient = jax.vmap(jax.grad(lambda loop: objective(net_rotation(loop, REFERENCE_STEPS))))
        call, _ = compiled(gradient, self.loops)
        return np.stack(call(self.loops), axis=1)


def angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles between rotations (m, 3, 3) and (m, 3, 3) [rad], right for small ones too."""
    chord = np.linalg.norm(np.asarray(a, float) - np.asarray(b, float), axis=(1, 2))
    return 2 * np.arcsin(np.minimum(1.0, chord / np.sqrt(8)))


def edges(loop: Loops) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Start and change of the joint angles (3,) on each edge of one loop."""
    corners = np.asarray(path_of(loop).waypoints)
    yield from zip(corners[:-1], np.diff(corners, axis=0), strict=True)

"""Least time of a design, and the condition that its edges take no less than the motors need.

The least time of an edge is the largest of what its joints need, and has kinks where another joint needs most. So the
edges' times are variables, "times", none of them less than what any joint needs.
"""

from typing import Any

import jax.numpy as jnp

import reojax
from reojax import Motor
from reojax.design import Outcome, Variable
from reojax.design.outcome import Measure

SLOPE = 1e-4
"""Slope at which a search with motors ends."""
_SAMPLES = 64
"""Instants of an edge at which the motors are looked at."""


def least_time(outcome: Outcome, motors: Motor) -> reojax.LeastTime:
    """Least times of a design's edges by quintics from rest to rest, with the motors behind the gears of the design."""
    ratio, rotor = (jnp.asarray(part) for part in (outcome.robot.gear_ratio, outcome.robot.rotor_inertia))
    geared = motors._replace(gear_ratio=ratio, rotor_inertia=rotor)
    return reojax.minimum_time(outcome.robot, outcome.path, geared, "quintic", samples=_SAMPLES)


def times_of(edges: int) -> Variable:
    """The edges' times, in units that are chosen with `in_time`."""
    return Variable("times", [0.0] * edges, [20.0] * edges)


def total(outcome: Outcome) -> Any:
    """Time of all edges, in the same units."""
    return outcome.values["times"].sum()


def in_time(motors: Motor, unit: float) -> Measure:
    """What the joints need beyond the edges' times; a unit of these is so many seconds."""

    def needs(outcome: Outcome) -> Any:
        return (least_time(outcome, motors).needs / unit - outcome.values["times"][:, None]).reshape(-1)

    return needs

"""Quantities of a design that are wanted small, or must hold: each makes a function of an `Outcome`."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from reojax import so3
from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax._internal.checks import numbers
from reojax.design.loops import Loops
from reojax.design.outcome import Measure, Outcome
from reojax.design.self_clearance import ClearBy
from reojax.path import joint_travel


def turned_to(target: ArrayLike | str) -> Measure:
    """Rotation vector (3,) from the target to the net rotation [rad], for an equality: all three components.

    Smooth near the target, half turns included: it is taken relative to the target.

    Args:
        target: (3, 3) rotation; or the name of a variable (3,) that is its rotation vector, to be held: then one
            compiled problem serves all targets.

    Raises:
        ValueError: if it is not a rotation.
    """
    if isinstance(target, str):
        name = target
        return lambda outcome: so3.log(so3.exp(_value(outcome, name)).T @ outcome.rotation)
    matrix = checks.rotations("target", target)

    def measure(outcome: Outcome) -> Array:
        return so3.log(jnp.asarray(matrix.T, outcome.rotation.dtype) @ outcome.rotation)

    return measure


def turned_about(axis: ArrayLike, angle: float) -> Measure:
    """Turn about `axis` less `angle` [rad], for an equality: the twist of the net rotation about that axis alone.

    Args:
        axis: (3,) in the base frame, not zero.
        angle: wanted turn, right-handed [rad].

    Raises:
        ValueError: if the axis is no direction, or the angle no number.
    """
    unit, angle = _unit(axis), checks.number("angle", angle, unit="rad")
    half = np.array([np.cos(angle / 2), *(-np.sin(angle / 2) * unit)])

    def measure(outcome: Outcome) -> Array:
        q = so3.to_quaternion(outcome.rotation)
        along = jnp.asarray(unit, q.dtype) @ q[1:]
        # the twist's quaternion (w, along) less half the angle, on the side that is near
        cosine, sine = q[0] * np.cos(angle / 2) + along * np.sin(angle / 2), along * half[0] - q[0] * np.sin(angle / 2)
        side = jnp.where(cosine < 0, -1.0, 1.0)
        return 2 * jnp.arctan2(side * sine, side * cosine)

    return measure


def off_axis_within(axis: ArrayLike, angle: float) -> Measure:
    """Whether the net rotation tips `axis` by less than `angle`, for an inequality: squared half sines, ratio less 1.

    Args:
        axis: (3,) in the base frame, not zero.
        angle: largest tilt of the axis, above 0 [rad].

    Raises:
        ValueError: if the axis is no direction, or the angle is not between 0 and pi.
    """
    unit = _unit(axis)
    if not 0 < checks.number("angle", angle, unit="rad") < np.pi:
        raise ValueError(f"`angle` is {angle!r}; it must be between 0 and pi.")

    def measure(outcome: Outcome) -> Array:
        vector = so3.to_quaternion(outcome.rotation)[1:]
        across = vector - (vector @ jnp.asarray(unit, vector.dtype)) * jnp.asarray(unit, vector.dtype)
        return (across @ across) / np.sin(angle / 2) ** 2 - 1

    return measure


def travel(loop: Loops | None = None) -> Measure:
    """Joint travel [rad]: of a family of loops, smooth in its coefficients; or of any path, with kinks at rest.

    Args:
        loop: the family whose coefficients are variables of the problem; None for the outcome's path.
    """
    if loop is None:
        return lambda outcome: joint_travel(outcome.path)
    return lambda outcome: loop.travel(outcome.values[loop.variable.name])


def loop_area(outcome: Outcome) -> Array:
    """Area of the loop in shape space [rad^2]: size of the vector of its projections onto the planes of two joints.

    With two joints it is the enclosed area, with sign left out. It is a measure itself: `objective=loop_area`.

    Args:
        outcome: of the design; its path is read.
    """
    points = jnp.asarray(outcome.path.waypoints)
    middle, step = 0.5 * (points[1:] + points[:-1]), points[1:] - points[:-1]
    moment = middle.T @ step
    tiny = jnp.finfo(points.dtype).tiny
    return jnp.sqrt(0.125 * ((moment - moment.T) ** 2).sum() + tiny)


def clear_by(margin: float, *, samples: int | None = None) -> Measure:
    """Whether the robot stays clear of itself by `margin` along the whole loop, for an inequality.

    The clearance of all pairs at samples, and as much more as a point of a capsule may come nearer between them. Then
    `Problem.solve` proves its answers along the whole loop: what falls short is solved again with more asked for at the
    samples, and is not `converged` if it still does. `Outcome.clearance` has what an answer keeps.

    Args:
        margin: least distance between any two parts of the robot [m].
        samples: per edge; default 256 for the whole loop. More of them cost less clearance where edges are long.

    Raises:
        ValueError: if the margin is not one finite number, or `samples` not a positive integer.
    """
    wanted = checks.number("margin", margin, unit="m")
    return ClearBy(wanted, None if samples is None else checks.whole("samples", samples))


def bend_within(joint: int | str, name: str) -> Measure:
    """Whether the joint's angle stays within plus and minus the variable `name` [rad], for an inequality.

    Least peak bend is smooth this way: let `name` be a variable, and make it the objective.

    Args:
        joint: name or number of the joint.
        name: of the variable, in SI [rad].

    Raises:
        ValueError: when the measure is taken, if there is no such joint or variable.
    """

    def measure(outcome: Outcome) -> Array:
        number = checks.index_of("joint", joint, outcome.robot.joint_names, "joint")
        angle, most = jnp.asarray(outcome.path.waypoints)[:, number], _value(outcome, name)
        return jnp.concatenate([angle - most, -angle - most])

    return measure


def value_of(name: str) -> Measure:
    """The variable `name` itself, in SI.

    Raises:
        ValueError: when the measure is taken, if there is no such variable.
    """
    return lambda outcome: _value(outcome, name)


def weighted(parts: Mapping[Measure, float]) -> Measure:
    """Sum of measures, each times its weight.

    Raises:
        ValueError: if `parts` is no mapping of functions to finite numbers.
    """
    if not isinstance(parts, Mapping) or not all(map(callable, parts)):
        raise ValueError(f"`parts` is {checks.shorten(parts)}; it must map measures, which are functions, to weights.")
    parts = {part: checks.number("a weight of `parts`", weight) for part, weight in parts.items()}

    def measure(outcome: Outcome) -> Array:
        return sum((weight * part(outcome) for part, weight in parts.items()), start=jnp.zeros(()))

    return measure


def _value(outcome: Outcome, name: str) -> Array:
    if name not in outcome.values:
        known = ", ".join(outcome.values)
        raise ValueError(f"there is no variable {checks.shorten(name)}; the variables are {known}.")
    return outcome.values[name]


def _unit(axis: ArrayLike) -> np.ndarray:
    vector = numbers("axis", axis, (3,))
    if not vector.any():
        raise ValueError("`axis` is zero; it must be a direction.")
    return vector / np.sqrt(vector @ vector)

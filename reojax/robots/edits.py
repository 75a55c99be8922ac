"""Changed copies of a robot: the thesis's three design parameters (figures 2.8 and 2.9), limits and shapes."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import jax
import numpy as np
from numpy.typing import ArrayLike

from reojax._internal.arrays import as_numbers, is_concrete, kind_of_arrays
from reojax._internal.capsule_checks import check_capsules, check_pairs, default_pairs
from reojax._internal.checks import index_of, instance, refuse, shorten
from reojax._internal.robot_checks import ask_for_degrees
from reojax.capsules import Capsule
from reojax.robot import Robot


def with_end_inertia(robot: Robot, inertia: ArrayLike) -> Robot:
    """Return the prototype with another inertia of its end links about their distal joints (thesis figure 2.8).

    The mass of each end link is moved straight towards or away from its joint axis, all of it by the same factor
    `sqrt(inertia / present inertia)`: a foot of another length with the same steel insert. Mass and heights along
    the axis stay, capsules go along, and the result is a possible rigid body at any positive inertia. The identity at
    the present one.

    Args:
        robot: the prototype, or a changed copy of it.
        inertia: inertia of either end link about its distal joint's axis [kg m^2]; may be traced.

    Raises:
        ValueError: if the robot has not four links, or `inertia` is not one positive, finite number.
    """
    _one(robot)
    if robot.links != 4:
        raise ValueError(f"{robot.name!r} has {robot.links} links; end links are defined for the four-link robot.")
    as_numbers("inertia", inertia)
    xp, cast = kind_of_arrays(robot, inertia)
    wanted = cast(inertia)
    if wanted.shape or (is_concrete(wanted) and not 0 < wanted < np.inf):
        raise ValueError(f"`inertia` is {_text(wanted)}; it must be one positive, finite number, in kg m^2.")
    mass, com, moment, axes, anchor = map(
        kind_of_arrays(robot)[1], (robot.mass, robot.com, robot.inertia, robot.axis, robot.anchor)
    )

    start, end = (kind_of_arrays(robot)[1](x) for x in (robot.capsule_start, robot.capsule_end))

    def stretch(link: int, axis: Any, point: Any) -> tuple[Any, Any, Any]:
        """Centre of mass and inertia, polynomials in the factor by which the mass moves; and the capsules' ends."""
        # parts of the centre of mass along the axis, which stay, and across it, which move
        along = axis[:, None] * axis[None, :]
        across = np.eye(3, dtype=com.dtype) - along
        lever = com[link] - point
        still, moving = point + along @ lever, across @ lever
        # the inertia about the axis, e . I e + m |across|^2, goes with the square of the factor
        factor = xp.sqrt(wanted / cast((along * moment[link]).sum() + mass[link] * (moving @ moving)))

        def inertia(left: Any, right: Any) -> Any:
            """Share of `left @ spread @ right` in the inertia, `spread` being the second moments of the mass."""
            part = left @ (moment[link].trace() / 2 * np.eye(3, dtype=com.dtype) - moment[link]) @ right
            return cast(part.trace() * np.eye(3, dtype=com.dtype) - part)

        # the link's own capsules go with the mass
        own = np.array([on == link for on in robot.capsule_link], bool)[:, None]
        shapes = [xp.where(own, (factor - 1) * cast((x - point[None]) @ across), 0) for x in (start, end)]
        mixed = inertia(along, across) + inertia(across, along)
        return (
            cast(still) + factor * cast(moving),
            inertia(along, along) + factor * (mixed + factor * inertia(across, across)),
            shapes,
        )

    with jax.default_matmul_precision("highest"):  # or a GPU takes 10 bits of float32
        first, last = stretch(0, axes[0], anchor[0]), stretch(3, axes[2], np.zeros(3, com.dtype))
    return robot.replace(
        com=xp.stack([first[0], *cast(com[1:3]), last[0]]),
        inertia=xp.stack([first[1], *cast(moment[1:3]), last[1]]),
        capsule_start=cast(start) + first[2][0] + last[2][0],
        capsule_end=cast(end) + first[2][1] + last[2][1],
    )


def with_gear_ratio(robot: Robot, ratio: ArrayLike | Mapping[str | int, ArrayLike]) -> Robot:
    """Return a copy of any robot with another gear ratio (thesis figure 2.9).

    Args:
        robot: the robot.
        ratio: rotor turns per joint turn, one for all joints or (j,); or joint, by name or number -> ratio, the others
            as they are. May be traced.

    Raises:
        ValueError: if `ratio` has another shape or is not finite, or names no joint.
    """
    _one(robot)
    return robot.replace(gear_ratio=_per_joint(robot, "ratio", ratio, robot.gear_ratio))


def with_rotor_inertia(robot: Robot, inertia: ArrayLike | Mapping[str | int, ArrayLike]) -> Robot:
    """Return a copy of any robot with another rotor inertia (thesis figure 2.9).

    Only the rotors' spin counts: the links' own inertias stay as they are.

    Args:
        robot: the robot.
        inertia: inertia of a rotor about its spin axis [kg m^2], one for all joints or (j,); or joint, by name or
            number -> inertia, the others as they are. May be traced.

    Raises:
        ValueError: if `inertia` has another shape, is negative or not finite, or names no joint.
    """
    _one(robot)
    return robot.replace(rotor_inertia=_per_joint(robot, "inertia", inertia, robot.rotor_inertia, least=0.0))


def with_limits(
    robot: Robot,
    lower: ArrayLike | Mapping[str | int, ArrayLike] | None = None,
    upper: ArrayLike | Mapping[str | int, ArrayLike] | None = None,
) -> Robot:
    """Return a copy of any robot with other joint limits.

    Args:
        robot: the robot.
        lower: lower limits [rad], one for all joints or (j,); or joint, by name or number -> limit, the others as they
            are. Infinite for none; default as they are.
        upper: upper limits, likewise.

    Raises:
        ValueError: naming the joint whose limits leave no room; or another shape, or a name that no joint has.
    """
    _one(robot)
    low, high = (
        present if given is None else _per_joint(robot, entry, given, present, finite=False)
        for entry, given, present in (("lower", lower, robot.lower), ("upper", upper, robot.upper))
    )
    if is_concrete((low, high)):
        refuse(
            "lower", np.asarray(low), ~(np.asarray(low) < high), "it must be below `upper`", " rad", robot.joint_names
        )
        ask_for_degrees(np.asarray(low), np.asarray(high), robot.joint_names)
    return robot.replace(lower=low, upper=high)


def with_capsules(robot: Robot, capsules: Sequence[Capsule], collision_pairs: Any = None) -> Robot:
    """Return a copy of any robot with other shapes.

    Args:
        robot: the robot.
        capsules: all shapes of its links; links by number or name.
        collision_pairs: pairs of numbers of capsules that must stay clear; default as `make_robot` chooses them.

    Raises:
        ValueError: naming the capsule or pair, and the rule it breaks.
    """
    _one(robot)
    shapes = check_capsules(capsules, robot.link_names)
    if collision_pairs is None:
        placed = {"parent": robot.parent, "anchor": np.asarray(robot.anchor), **shapes}
        pairs, _ = default_pairs(placed)
    else:
        pairs = check_pairs(collision_pairs, shapes["capsule_link"])
    return dataclasses.replace(robot, **shapes, collision_pairs=pairs)


def _one(robot: Robot) -> None:
    """Refuse what is no robot, or several in one: of those `jax.vmap` takes one at a time."""
    instance("robot", robot, Robot, "`make_robot` makes")
    if np.shape(robot.gear_ratio) != (robot.joints,):
        raise ValueError(
            f"`robot.gear_ratio` has shape {np.shape(robot.gear_ratio)}; of one robot of this tree it must be "
            f"({robot.joints},); for a stack of robots use jax.vmap."
        )


def _per_joint(
    robot: Robot, entry: str, value: Any, present: Any, *, least: float = -np.inf, finite: bool = True
) -> Any:
    for number in value.values() if isinstance(value, Mapping) else (value,):
        as_numbers(entry, number)
    if isinstance(value, Mapping):
        xp, cast = kind_of_arrays(robot, *value.values())
        chosen = {index_of(f"a key of {entry}", key, robot.joint_names, "joint"): v for key, v in value.items()}
        value = xp.stack([cast(chosen.get(k, present[k])) for k in range(robot.joints)])
    xp, cast = kind_of_arrays(robot, value)
    array = cast(value)
    if array.shape not in ((), (robot.joints,)):
        raise ValueError(f"`{entry}` has shape {array.shape}; it must be one number or ({robot.joints},).")
    if is_concrete(array) and not ((np.isfinite(array) | (not finite)) & (array >= least)).all():
        rule = "finite" if least == -np.inf else "finite and not negative"
        raise ValueError(f"`{entry}` is {_text(array)}; it must be {rule}.")
    return xp.broadcast_to(array, (robot.joints,))


def _text(array: Any) -> str:
    return shorten(array.tolist() if is_concrete(array) else array)

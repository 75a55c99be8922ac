"""Changes of a robot's links that keep every link a possible rigid body; arguments may be traced.

A body's second moments of mass `P = tr(I)/2 - I` (about its centre) are positive semidefinite. Stretching the body by a
matrix S takes P to S P S^T, which still is, so that `I = tr(P) - P` belongs to a body again. Links and joints are given
by number or by name.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import as_numbers, is_concrete
from reojax.robot import Robot

_MOST = 1e100
"""Largest mass, factor or inertia; squares of larger ones are no numbers."""


def with_mass(robot: Robot, link: int | str, mass: ArrayLike) -> Robot:
    """Another mass [kg] of the same shape: the link's inertia is scaled with it.

    Args:
        robot: the robot.
        link: name or number of the link.
        mass: its mass [kg]; may be traced.

    Raises:
        ValueError: if there is no such link, or `mass` is not one positive number.
    """
    index, wanted = _number(robot, "link", link), _positive("mass", mass)
    share = wanted / robot.mass[index]
    return robot.replace(
        mass=_set_link(robot.mass, index, wanted), inertia=_set_link(robot.inertia, index, share * robot.inertia[index])
    )


def with_com_offset(robot: Robot, link: int | str, offset: ArrayLike) -> Robot:
    """Centre of mass moved by `offset` (3,) [m] in the link's frame, the inertia about it as before.

    Args:
        robot: the robot.
        link: name or number of the link.
        offset: (3,) what is added to its `com`, link frame [m]; may be traced.

    Raises:
        ValueError: if there is no such link, or `offset` is not of shape (3,) or not finite.
    """
    index, move = _number(robot, "link", link), as_numbers("offset", offset)
    if move.shape != (3,):
        raise ValueError(f"`offset` has shape {move.shape}; it must be (3,), in m.")
    if is_concrete(move) and not np.isfinite(move).all():
        raise ValueError(f"`offset` is {np.asarray(move).tolist()}; it must be finite, in m.")
    return robot.replace(com=_set_link(robot.com, index, robot.com[index] + move))


def with_length(robot: Robot, link: int | str, factor: ArrayLike, *, along: ArrayLike | None = None) -> Robot:
    """The link stretched by `factor` from its frame's origin, mass kept: its shape, and the joints that it carries.

    Args:
        robot: the robot.
        link: number or name of the link.
        factor: new length over old.
        along: (3,) direction of the stretch in the link's frame; default every direction.

    Raises:
        ValueError: if there is no such link, `factor` is not one positive number, or `along` is no direction.
    """
    index, scale = _number(robot, "link", link), _positive("factor", factor)
    share = np.eye(3)
    if along is not None:
        direction = np.asarray(as_numbers("along", along), float)
        if direction.shape != (3,) or not direction.any() or not np.isfinite(direction).all():
            raise ValueError(f"`along` is {checks.shorten(along)}; it must be (3,), finite and not zero.")
        share = np.outer(direction, direction) / (direction @ direction)
    # the body about its frame's origin, and the anchors of what it carries
    stretch = jnp.eye(3, dtype=jnp.result_type(scale)) + (scale - 1) * share
    robot = _stretch(robot, index, stretch, jnp.zeros(3, stretch.dtype))
    carried = np.array([parent == index for parent in robot.parent])[:, None]
    return robot.replace(anchor=jnp.where(carried, robot.anchor @ stretch, robot.anchor))


def with_joint_inertia(robot: Robot, joint: int | str, inertia: ArrayLike) -> Robot:
    """The link that a joint carries with another inertia about that joint's axis [kg m^2], mass and heights kept.

    All its mass is moved straight towards or away from the axis by one factor, as in `robots.with_end_inertia`.

    Args:
        robot: the robot.
        joint: number or name of the joint.
        inertia: wanted inertia about the joint's axis [kg m^2]; may be traced.

    Raises:
        ValueError: if there is no such joint, or `inertia` is not one positive number.
    """
    number = _number(robot, "joint", joint)
    wanted, link = _positive("inertia", inertia), number + 1
    axis, com = robot.axis[number], robot.com[link]
    along = axis[:, None] * axis[None, :]
    across = np.eye(3, dtype=along.dtype) - along
    # e . I e + m |across|^2 goes with the square of the factor
    present = (along * robot.inertia[link]).sum() + robot.mass[link] * (com @ across @ com)
    return _stretch(robot, link, jnp.sqrt(wanted / present) * across + along, jnp.zeros_like(com))


def _stretch(robot: Robot, link: int, stretch: jax.Array, fixed: jax.Array) -> Robot:
    """Stretch a link's body about the point `fixed`."""
    # second moments of the mass, tr(I) / 2 - I, go with the stretch from both sides; inertia again, tr(S) - S
    inertia = robot.inertia[link]
    spread = 0.5 * jnp.trace(jnp.asarray(inertia)) * jnp.eye(3, dtype=inertia.dtype) - inertia
    spread = stretch @ spread @ stretch.T
    after = jnp.trace(spread) * jnp.eye(3, dtype=spread.dtype) - spread
    return robot.replace(
        com=_set_link(robot.com, link, fixed + stretch @ (robot.com[link] - fixed)),
        inertia=_set_link(robot.inertia, link, after),
    )


def _set_link(array: Any, index: int, value: Any) -> jax.Array:
    return jnp.asarray(array).at[index].set(value)


def _number(robot: Robot, kind: str, value: int | str) -> int:
    """Number of a link or joint of what has to be a robot."""
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    if np.shape(robot.mass) != (robot.links,):
        raise ValueError(
            f"`robot.mass` has shape {np.shape(robot.mass)}; of one robot of this tree it must be ({robot.links},); "
            "for a stack of robots use jax.vmap."
        )
    return checks.index_of(kind, value, robot.link_names if kind == "link" else robot.joint_names, kind)


def _positive(entry: str, value: ArrayLike) -> Any:
    number = as_numbers(entry, value)
    if number.shape or (is_concrete(number) and not 0 < number < _MOST):
        raise ValueError(f"`{entry}` is {checks.shorten(value)}; it must be one positive number below {_MOST:g}.")
    return number

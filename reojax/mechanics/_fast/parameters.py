"""A robot's parameters, as arrays and as scalars with the zeros and frame axes that are known before tracing.

Most entries of a real robot's axes, products of inertia and anchors are zero. Where an array is not being
traced, the places of its zeros become part of the compiled program (and of its cache key), and so do joint axes along
an axis of the frame; all other values stay data: robots that differ in values alone share one program.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from reojax._internal.arrays import is_concrete
from reojax.mechanics._fast.scalar import Scalar, Symmetric, Vector
from reojax.mechanics.kinematics import unit_axes
from reojax.mechanics.momentum import rotor_spin
from reojax.mechanics.own_units import in_own_units
from reojax.robot import Robot

_UNKNOWN = 2
_PRODUCTS = ((0, 1), (0, 2), (1, 2))
"""Rows and columns of the products of inertia."""

Pattern: TypeAlias = bytes
"""Of flattened `Parameters`: what an entry is known to be, 0, 1 or -1, one byte for each, or `_UNKNOWN`."""


class Parameters(NamedTuple):
    """What the mechanics read, in the robot's own units: arrays; also in a row, each flattened, in this order."""

    mass: Any
    """(n,)"""
    moment: Any
    """(n, 3), mass times centre of mass, link frame."""
    inertia: Any
    """(n, 6), about the link frame's origin: xx, yy, zz, xy, xz, yz."""
    axis: Any
    """(j, 3), at unit length, so that the robot's array may be varied in any direction."""
    anchor: Any
    """(j, 3)"""
    rotor_momentum: Any
    """(j,), per joint rate, along the joint axis, signed by the link that carries the stator."""


Known = tuple[int | None, ...]
"""Entries of flattened `Parameters` that are known while tracing, `None` for the ones that are data."""


class RobotScalars(NamedTuple):
    """`Parameters` as scalars, link by link and joint by joint, in the same order."""

    mass: Sequence[Scalar]
    moment: Sequence[Vector]
    inertia: Sequence[Symmetric]
    axis: Sequence[Vector]
    anchor: Sequence[Vector]
    rotor_momentum: Sequence[Scalar]
    parent: tuple[int, ...]

    @property
    def axes_known(self) -> bool:
        """Whether all axes are known to be the frame's own."""
        return all(isinstance(c, int) for axis in self.axis for c in axis)


def parameters(robot: Robot) -> Parameters:
    """Parameters of `robot`, whose fields are JAX arrays of one dtype."""
    robot = in_own_units(robot)
    x, y, z = (robot.com[:, i] for i in range(3))
    mass, inertia = robot.mass, robot.inertia
    about_origin = [  # the parallel axis theorem
        inertia[:, 0, 0] + mass * (y * y + z * z),
        inertia[:, 1, 1] + mass * (x * x + z * z),
        inertia[:, 2, 2] + mass * (x * x + y * y),
        *(
            0.5 * (inertia[:, a, b] + inertia[:, b, a]) - mass * (robot.com[:, a] * robot.com[:, b])
            for a, b in _PRODUCTS
        ),
    ]
    return Parameters(
        mass=mass,
        moment=mass[:, None] * robot.com,
        inertia=jnp.stack(about_origin, axis=1),
        axis=unit_axes(robot),
        anchor=robot.anchor,
        rotor_momentum=robot.rotor_inertia * rotor_spin(robot),
    )


def pattern_of(robot: Robot) -> Pattern:
    """What of `parameters(robot)` follows from zeros of arrays that can be read now; whatever their other entries."""
    com, inertia, axis, anchor = (_zeros(x) for x in (robot.com, robot.inertia, robot.axis, robot.anchor))
    products = [inertia[:, a, b] & inertia[:, b, a] & (com[:, a] | com[:, b]) for a, b in _PRODUCTS]
    never = np.zeros(robot.links, bool)
    zero = Parameters(
        mass=never,
        moment=com,
        inertia=np.stack([never, never, never, *products], axis=1),
        axis=axis & ~axis.all(1, keepdims=True),  # an axis of zeros has no direction: NaN
        anchor=anchor,
        rotor_momentum=never[1:],
    )
    known = zero._replace(axis=np.where(zero.axis, 0, _signs(robot.axis, axis)))
    known = [np.where(field, 0, _UNKNOWN) if field.dtype == bool else field for field in known]
    return np.concatenate([field.ravel() for field in known]).astype(np.int8).tobytes()


def _zeros(array: Any) -> np.ndarray:
    return np.asarray(array) == 0 if is_concrete(array) else np.zeros(np.shape(array), bool)


def _signs(axis: Any, zero: np.ndarray) -> np.ndarray:
    """1 or -1 where an axis is that of the frame: its entry is not zero, and the two others are."""
    alone = ~zero & (zero.sum(1, keepdims=True) == 2)
    if not alone.any():
        return np.full(zero.shape, _UNKNOWN)
    axis = np.asarray(axis)
    return np.where(alone & np.isfinite(axis), np.where(axis < 0, -1, 1), _UNKNOWN)


def known_parameters(pattern: Pattern) -> Known:
    """Read a pattern."""
    return tuple(None if k == _UNKNOWN else k for k in np.frombuffer(pattern, np.int8).tolist())


def flatten(arrays: Sequence[jax.Array]) -> jax.Array:
    """Put the entries of all arrays in a row."""
    return jnp.concatenate([array.reshape(-1) for array in arrays])


def split(numbers: jax.Array) -> list[jax.Array]:
    """Take an array apart into scalars."""
    # `split`, unlike indexing, has a cheap transpose: one concatenation
    return [x.reshape(()) for x in jax.lax.split(numbers, (1,) * numbers.size)] if numbers.size else []


def components(numbers: Sequence[Scalar], parent: tuple[int, ...]) -> RobotScalars:
    """Name the entries of flattened `Parameters`."""
    rest = iter(numbers)
    joints, links = len(parent), len(parent) + 1

    def vectors(count: int, size: int) -> list[tuple[Scalar, ...]]:
        return [tuple(next(rest) for _ in range(size)) for _ in range(count)]

    return RobotScalars(
        mass=[next(rest) for _ in range(links)],
        moment=vectors(links, 3),
        inertia=vectors(links, 6),
        axis=vectors(joints, 3),
        anchor=vectors(joints, 3),
        rotor_momentum=[next(rest) for _ in range(joints)],
        parent=parent,
    )

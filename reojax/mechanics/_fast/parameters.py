"""A robot's parameters, as arrays and as scalars with the zeros and ones that are known before tracing.

Most entries of a real robot's axes, products of inertia and anchors are zero. Where an array is not being
traced, the places of its zeros and ones become part of the compiled program (and of its cache key), the other
values stay data: robots that differ in values alone share one program.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from reojax._internal.arrays import is_concrete
from reojax.mechanics._fast.scalar import Scalar, Symmetric, Vector
from reojax.robot import Robot

_FIELDS = ("mass", "com", "inertia", "axis", "anchor", "rotor_inertia", "gear_ratio")
_UNKNOWN = 2

Pattern = tuple[bytes | None, ...]


class Parameters(NamedTuple):
    """What the mechanics read, arrays; also in a row, each flattened, in this order."""

    mass: Any
    """(b,)"""
    moment: Any
    """(b, 3), mass times centre of mass, link frame."""
    inertia: Any
    """(b, 6), about the link frame's origin: xx, yy, zz, xy, xz, yz."""
    axis: Any
    """(j, 3), at unit length, so that the robot's array may be varied in any direction."""
    anchor: Any
    """(j, 3)"""
    rotor_spin: Any
    """(j,), rotor momentum per joint rate, along the joint axis, signed by the link that carries it."""


Known = tuple[float | None, ...]
"""Entries of flattened `Parameters` that are known while tracing, `None` for the ones that are data."""


class RobotScalars(NamedTuple):
    """`Parameters` as scalars, link by link and joint by joint."""

    mass: Sequence[Scalar]
    moment: Sequence[Vector]
    inertia: Sequence[Symmetric]
    axis: Sequence[Vector]
    anchor: Sequence[Vector]
    rotor_spin: Sequence[Scalar]
    parent: tuple[int, ...]

    @property
    def axes_known(self) -> bool:
        """Whether all axes are known to be the frame's own."""
        return all(isinstance(c, int) for axis in self.axis for c in axis)


def pattern_of(robot: Robot) -> Pattern:
    """Where each array of `robot` holds 0, 1 or -1, as far as it can be known now; hashable."""
    return tuple(_pattern(getattr(robot, field)) for field in _FIELDS)


def _pattern(leaf: Any) -> bytes | None:
    if not is_concrete(leaf):
        return None
    values = np.asarray(leaf)
    known = (values == 0) | (values == 1) | (values == -1)
    return np.where(known, values, _UNKNOWN).astype(np.int8).tobytes()


def parameters(robot: Robot) -> Parameters:
    """Parameters of `robot`, whose fields are JAX arrays of one dtype."""
    return _parameters([getattr(robot, field) for field in _FIELDS], robot.rotor_on, jnp)


def _parameters(fields: Sequence[Any], rotor_on: Sequence[str], xp: Any) -> Parameters:
    mass, com, inertia, axis, anchor, rotor, gear = fields
    x, y, z = (com[:, i] for i in range(3))
    length = xp.sqrt(axis[:, 0] ** 2 + axis[:, 1] ** 2 + axis[:, 2] ** 2)
    about_origin = (
        inertia[:, 0, 0] + mass * (y * y + z * z),
        inertia[:, 1, 1] + mass * (x * x + z * z),
        inertia[:, 2, 2] + mass * (x * x + y * y),
        0.5 * (inertia[:, 0, 1] + inertia[:, 1, 0]) - mass * (x * y),
        0.5 * (inertia[:, 0, 2] + inertia[:, 2, 0]) - mass * (x * z),
        0.5 * (inertia[:, 1, 2] + inertia[:, 2, 1]) - mass * (y * z),
    )
    signs = np.array([1 if side == "parent" else -1 for side in rotor_on], gear.dtype)
    return Parameters(
        mass=mass,
        moment=mass[:, None] * com,
        inertia=xp.stack(about_origin, axis=1),
        axis=axis / length[:, None],
        anchor=anchor,
        rotor_spin=signs * rotor * gear,
    )


def known_parameters(robot: Robot, pattern: Pattern) -> Known:
    """Find the parameters that follow from the zeros and ones of `pattern` alone: they do not change with the rest."""
    shapes = [np.shape(getattr(robot, field)) for field in _FIELDS]

    def flat(seed: int) -> np.ndarray:
        rest = np.random.default_rng(seed)
        fields = []
        for shape, bytes_ in zip(shapes, pattern, strict=True):
            marks = np.full(shape, _UNKNOWN) if bytes_ is None else np.frombuffer(bytes_, np.int8).reshape(shape)
            fields.append(np.where(marks == _UNKNOWN, rest.uniform(1, 2, shape), marks))
        with np.errstate(invalid="ignore"):  # an axis of zeros
            return np.concatenate([array.ravel() for array in _parameters(fields, robot.rotor_on, np)])

    with_some, with_others = flat(0), flat(1)
    return tuple(
        (int(a) if a == int(a) else a) if a == b else None
        for a, b in zip(with_some.tolist(), with_others.tolist(), strict=True)
    )


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

    def vectors(count: int, size: int) -> list[tuple[Scalar, ...]]:
        return [tuple(next(rest) for _ in range(size)) for _ in range(count)]

    joints = len(parent)
    links = joints + 1
    return RobotScalars(
        mass=[next(rest) for _ in range(links)],
        moment=vectors(links, 3),
        inertia=vectors(links, 6),
        axis=vectors(joints, 3),
        anchor=vectors(joints, 3),
        rotor_spin=[next(rest) for _ in range(joints)],
        parent=parent,
    )

"""A robot's arrays as scalars, with the zeros and ones that are known before tracing.

Most entries of a real robot's axes, products of inertia and anchors are zero. Where an array is not being
traced, the places of its zeros and ones become part of the compiled program (and of its cache key), the other
values stay data: robots that differ in values alone share one program.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from reojax._arrays import is_concrete
from reojax._fast.scalar import Scalar, Symmetric, Vector, dot, mul, plus, point_inertia, times
from reojax.robot import Robot

_FIELDS = ("mass", "com", "inertia", "axis", "anchor", "rotor_inertia", "gear_ratio")
_UNKNOWN = 2

Pattern = tuple[bytes | None, ...]


class Components(NamedTuple):
    """What the recursion of `omega` reads, link by link and joint by joint."""

    mass: Sequence[Scalar]
    moment: Sequence[Vector]
    """Mass times centre of mass."""
    inertia: Sequence[Symmetric]
    """About the link frame's origin."""
    axis: Sequence[Vector]
    anchor: Sequence[Vector]
    rotor_spin: Sequence[Scalar]
    """Rotor momentum per joint rate, along the joint axis, signed by the link that carries it."""
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


def components(robot: Robot, pattern: Pattern, dtype: np.dtype) -> Components:
    """Take the arrays of `robot` apart, in `dtype`, with the places of `pattern` as Python numbers."""
    mass, com, inertia, axis, anchor, rotor, gear = (
        _scalars(jnp.asarray(getattr(robot, field), dtype), known)
        for field, known in zip(_FIELDS, pattern, strict=True)
    )
    signs = [1 if side == "parent" else -1 for side in robot.rotor_on]
    about_com = [_symmetric_part(rows) for rows in inertia]
    return Components(
        mass=mass,
        moment=[times(m, c) for m, c in zip(mass, com, strict=True)],
        inertia=[plus(i, point_inertia(m, c)) for i, m, c in zip(about_com, mass, com, strict=True)],
        axis=[_unit(e) for e in axis],
        anchor=anchor,
        rotor_spin=[mul(sign, mul(j, n)) for sign, j, n in zip(signs, rotor, gear, strict=True)],
        parent=robot.parent,
    )


def _scalars(leaf: jax.Array, known: bytes | None) -> Any:
    """Nested tuples of the entries of `leaf`: Python numbers where known, traced scalars elsewhere."""
    if known is None:
        marks = np.full(leaf.shape, _UNKNOWN)
    else:
        marks = np.frombuffer(known, np.int8).reshape(leaf.shape)

    # `split`, unlike indexing, has a cheap transpose: one concatenation
    pieces = jax.lax.split(leaf.reshape(-1), (1,) * leaf.size) if leaf.size else []
    entries = [
        piece.reshape(()) if mark == _UNKNOWN else int(mark) for piece, mark in zip(pieces, marks.flat, strict=True)
    ]
    for size in reversed(leaf.shape[1:]):
        entries = [tuple(entries[i : i + size]) for i in range(0, len(entries), size)]
    return entries


def _unit(axis: Vector) -> Vector:
    """Return the axis at unit length, so that its array may be varied in any direction."""
    if all(isinstance(c, int) for c in axis):
        return axis
    length = jnp.sqrt(dot(axis, axis))
    return tuple(0 if isinstance(c, int) and c == 0 else c / length for c in axis)


def _symmetric_part(rows: Any) -> Symmetric:
    def mean(a: Scalar, b: Scalar) -> Scalar:
        return a if isinstance(a, int) and isinstance(b, int) and a == b else 0.5 * (a + b)

    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rows
    return (xx, yy, zz, mean(xy, yx), mean(xz, zx), mean(yz, zy))

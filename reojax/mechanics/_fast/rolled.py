"""The passes over the tree as loops over joints, for long robots: one joint to compile, however many there are.

Same equations as in `recursion`, `momentum_jvp` and `momentum_vjp`, whose functions for one joint they call. What all
links have is kept in arrays (n, nodes), one for each component, which the loops read and write link by link. Zeros of
the robot's data are not left out here, so short robots are faster unrolled.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from reojax.mechanics._fast.materialize import materialize
from reojax.mechanics._fast.momentum_jvp import body_momentum, onto_parent, outward
from reojax.mechanics._fast.momentum_vjp import body_slopes, joint_slopes
from reojax.mechanics._fast.nodes import NODES, per_step, sum_over_nodes
from reojax.mechanics._fast.parameters import Parameters
from reojax.mechanics._fast.recursion import Base, Subtree, about_centre, hand_on, joint_rotation, keep
from reojax.mechanics._fast.scalar import Vector, add, cross, plus, scale
from reojax.mechanics._fast.sincos import sincos

Columns = tuple[Any, ...]
"""Components of something that every link has, (n, nodes) each."""


class JointMotion(NamedTuple):
    """Angles and rates of all joints at all nodes, (j, nodes) each."""

    sine: jax.Array
    cosine: jax.Array
    rate: jax.Array


class RolledSlopes(NamedTuple):
    """Derivatives of `mu . L`, see `momentum_vjp`."""

    robot: Parameters
    """Summed over nodes."""
    theta: jax.Array
    """(j, nodes)"""
    rate: jax.Array
    """(j, nodes)"""


def unflatten(numbers: jax.Array, joints: int) -> Parameters:
    """Take flattened `Parameters` apart into arrays."""
    links = joints + 1
    shapes = Parameters((links,), (links, 3), (links, 6), (joints, 3), (joints, 3), (joints,))
    parts = jnp.split(numbers, np.cumsum([np.prod(shape, dtype=int) for shape in shapes])[:-1])
    return Parameters(*(part.reshape(shape) for part, shape in zip(parts, shapes, strict=True)))


def motion_at_nodes(points: jax.Array, steps: int) -> JointMotion:
    """`path_nodes` and the angles' sine and cosine, for all joints at once."""
    rate = (points[1:] - points[:-1]).T[:, :, None] / steps
    start = points[:-1].T[:, :, None] + rate * jnp.arange(steps, dtype=points.dtype)[None, None, :]
    theta = start[..., None] + rate[..., None] * jnp.asarray(NODES, points.dtype)[None, None, None, :]
    rates = jnp.broadcast_to(rate[..., None], theta.shape)
    return JointMotion(*(x.reshape(points.shape[1], -1) for x in (*sincos(theta), rates)))


def to_points(theta: jax.Array, rate: jax.Array, steps: int) -> jax.Array:
    """Transpose of the motion's dependence on the points: cotangents (j, nodes) of angles and rates to (v, j)."""
    along = ((np.arange(steps)[:, None] + NODES) / steps).reshape(-1, 1)
    of_theta, of_rate = np.hstack([1 - along, along]), np.tile([[-1 / steps, 1 / steps]], (len(along), 1))
    ends = per_step(theta.reshape(-1, len(along)), of_theta) + per_step(rate.reshape(-1, len(along)), of_rate)
    ends = ends.reshape(theta.shape[0], -1, 2)
    return (jnp.pad(ends[..., 0], ((0, 0), (0, 1))) + jnp.pad(ends[..., 1], ((0, 0), (1, 0)))).T


def inward(robot: Parameters, parent: tuple[int, ...], motion: JointMotion) -> Base:
    """`recursion.inward`."""
    # push, spin, moment, inertia of each link alone: one array (links, nodes) for each component
    nodes = motion.rate.shape[1]
    zeros = (jnp.zeros((len(parent) + 1, nodes), motion.rate.dtype),) * 6
    of_links = (*zeros, *_columns(robot.moment, nodes), *_columns(robot.inertia, nodes))
    mass = _subtree_masses(robot.mass, parent)

    def joint(columns: Columns, x: Any) -> tuple[Columns, None]:
        (link, before), (s, c, rate), e, a, rotor, m = x
        link = _subtree(m, _read(columns, link))
        handed = keep(hand_on(link, joint_rotation(e, s, c), e, a, rate, rotor))
        return _add(columns, before, (*handed.push, *handed.spin, *handed.moment, *handed.inertia)), None

    every = (_places(parent), motion, _split(robot.axis), _split(robot.anchor), robot.rotor_momentum, mass[1:])
    columns, _ = jax.lax.scan(joint, of_links, every, reverse=True)
    return about_centre(_subtree(mass[0], tuple(x[0] for x in columns)))


def _subtree(mass: Any, columns: Columns) -> Subtree:
    return Subtree(mass, columns[6:9], columns[9:], columns[:3], columns[3:6])


def angular_momentum(
    robot: Parameters, parent: tuple[int, ...], motion: JointMotion, omega: Vector, velocity: Vector, centre: Vector
) -> Vector:
    """`momentum_jvp.angular_momentum`."""
    # outward, then each link alone, then inward
    motions = _outward(robot, parent, motion, (*omega, *velocity), moving=True)
    momenta = _momenta_of_bodies(robot, motions)

    def joint(columns: Columns, x: Any) -> tuple[Columns, None]:
        (link, before), (s, c, rate), e, a, rotor = x
        p, h = _halves(_read(columns, link))
        nothing = (0, 0, 0)
        handed = onto_parent(joint_rotation(e, s, c), a, (nothing, nothing), (p, h), scale(rate * rotor, e))
        return _add(columns, before, materialize((*handed[0], *handed[1]))), None

    every = (_places(parent), motion, _split(robot.axis), _split(robot.anchor), robot.rotor_momentum)
    columns, _ = jax.lax.scan(joint, momenta, every, reverse=True)
    p, h = _halves(tuple(x[0] for x in columns))
    return plus(h, scale(-1, cross(centre, p)))


def slopes(
    robot: Parameters,
    parent: tuple[int, ...],
    motion: JointMotion,
    omega: Vector,
    velocity: Vector,
    centre: Vector,
    mu: Vector,
) -> RolledSlopes:
    """`momentum_vjp.slopes`, sums over nodes included."""
    # both motions outward, and both momenta of each link alone
    actual = _outward(robot, parent, motion, (*omega, *velocity), moving=True)
    virtual = _outward(robot, parent, motion, (*mu, *cross(centre, mu)), moving=False)
    momenta = _momenta_of_bodies(robot, actual)
    likewise = _momenta_of_bodies(robot, virtual)

    def joint(columns: tuple[Columns, Columns], x: Any) -> tuple[tuple[Columns, Columns], Any]:
        (link, before), (s, c, rate), e, a, rotor = x
        of_link = [_read(column, link) for column in (*columns, actual, virtual)]
        momentum, momentum_, motion_, virtual_ = (_halves(values) for values in of_link)
        E = joint_rotation(e, s, c)
        w_before = _read(virtual, before)[:3]
        found = joint_slopes(E, e, (s, c), rate, rotor, momentum, momentum_, motion_, virtual_, w_before)
        # both momenta onto the link before
        nothing = (0, 0, 0)
        handed = onto_parent(E, a, (nothing, nothing), momentum, scale(rate * rotor, e))
        handed_ = onto_parent(E, a, (nothing, nothing), momentum_, nothing)
        columns = (
            _add(columns[0], before, materialize((*handed[0], *handed[1]))),
            _add(columns[1], before, materialize((*handed_[0], *handed_[1]))),
        )
        # by the path at every node, by the robot summed over nodes
        theta, rate_ = materialize((found.theta, found.rate))
        sums = sum_over_nodes(list(found.axis)), sum_over_nodes([*found.anchor, found.rotor_momentum])
        return columns, (theta, rate_, *(jnp.stack(of) for of in sums))

    every = (_places(parent), motion, _split(robot.axis), _split(robot.anchor), robot.rotor_momentum)
    _, (theta, rate, axis, rest) = jax.lax.scan(joint, (momenta, likewise), every, reverse=True)

    def link(columns: tuple[Columns, Columns]) -> tuple[jax.Array, jax.Array]:
        (w, v), (w_, v_) = (_halves(values) for values in columns)
        mass, moment, inertia = body_slopes((w, v), (w_, v_))
        return jnp.stack(sum_over_nodes([mass, *moment])), jnp.stack(sum_over_nodes(list(inertia)))

    point, inertia = jax.lax.map(link, (actual, virtual))
    of = Parameters(
        mass=point[:, 0],
        moment=point[:, 1:],
        inertia=inertia,
        axis=axis,
        anchor=rest[:, :3],
        rotor_momentum=rest[:, 3],
    )
    return RolledSlopes(of, theta, rate)


def _outward(robot: Parameters, parent: tuple[int, ...], motion: JointMotion, base: Vector, *, moving: bool) -> Columns:
    """Angular velocity and velocity of the origin of every link, its own frame; with the joints at rest or `moving`."""
    first = tuple(
        jnp.zeros((len(parent) + 1, motion.rate.shape[1]), motion.rate.dtype).at[0].set(component) for component in base
    )

    def joint(columns: Columns, x: Any) -> tuple[Columns, None]:
        (link, before), (s, c, rate), e, a = x
        w, v = outward(joint_rotation(e, s, c), a, _halves(_read(columns, before)))
        w = plus(w, scale(rate, e)) if moving else w
        return _write(columns, link, materialize((*w, *v))), None

    every = (_places(parent), motion, _split(robot.axis), _split(robot.anchor))
    return jax.lax.scan(joint, first, every)[0]


def _momenta_of_bodies(robot: Parameters, motions: Columns) -> Columns:
    """Linear and angular momentum of each link alone."""

    def link(x: Any) -> Columns:
        (m, f, J), columns = x
        p, h = body_momentum(m, f, J, *_halves(columns))
        return materialize((*p, *h))

    return jax.lax.map(link, ((robot.mass, _split(robot.moment), _split(robot.inertia)), motions))


def _places(parent: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Of each joint: the link that it carries, and the one before."""
    return np.arange(1, len(parent) + 1, dtype=np.int32), np.array(parent, np.int32)


def _subtree_masses(mass: jax.Array, parent: tuple[int, ...]) -> jax.Array:
    beyond = np.eye(len(parent) + 1)
    for k in reversed(range(len(parent))):
        beyond[parent[k]] += beyond[k + 1]
    return jnp.matmul(jnp.asarray(beyond, mass.dtype), mass, precision="highest")


def _split(vectors: jax.Array) -> tuple[jax.Array, ...]:
    return tuple(vectors[:, i] for i in range(vectors.shape[1]))


def _columns(vectors: jax.Array, nodes: int) -> Columns:
    return tuple(jnp.broadcast_to(x[:, None], (x.shape[0], nodes)) for x in _split(vectors))


def _halves(six: Sequence[Any]) -> tuple[Vector, Vector]:
    return tuple(six[:3]), tuple(six[3:])


def _read(columns: Columns, link: jax.Array) -> Columns:
    return tuple(jax.lax.dynamic_index_in_dim(x, link, keepdims=False) for x in columns)


def _write(columns: Columns, link: jax.Array, values: Sequence[Any]) -> Columns:
    pairs = zip(columns, values, strict=True)
    return tuple(jax.lax.dynamic_update_index_in_dim(x, value, link, 0) for x, value in pairs)


def _add(columns: Columns, link: jax.Array, values: Sequence[Any]) -> Columns:
    pairs = zip(_read(columns, link), values, strict=True)
    return _write(columns, link, [add(x, value) for x, value in pairs])

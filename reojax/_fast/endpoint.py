"""Rotation of the base after a polygon, with its derivative.

The derivative of the end rotation is a sum over the path: a change `d omega(s)` of the angular velocity turns
the end by `R(s) d omega(s)` seen from the start, so `dR R^T = hat(integral of R d omega)`. And since
`L(theta, theta_dot, omega) = 0` along the path, `d omega = -A^-1 dL` with `dL` the change of the angular momentum
at a fixed motion of the base: nothing of the inverse has to be differentiated. The linear momentum of that fixed
motion being zero, its reference point and velocity may stay fixed too (their first-order effects cancel).
The sum uses the nodes and values of the solution itself.
Reverse mode is the transpose of this, which JAX finds: one constant vector turned into each node's frame, `A^-1`,
and one pass through the momentum.
"""

from functools import partial

import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero

from reojax._fast.components import Components, Pattern, components
from reojax._fast.momentum import angular_momentum
from reojax._fast.nodes import path_nodes, to_nodes
from reojax._fast.omega import Base, inward, solve
from reojax._fast.product import Triple, ordered_products, rotate, times, to_matrix
from reojax._fast.scalar import cross, plus, times as scale
from reojax._fast.sincos import sincos
from reojax._fast.steps import Step, mean_over_step, step_rotations
from reojax._fast.store import keeper
from reojax.robot import Robot


def steps_of_path(robot: Robot, points: jax.Array, steps: int, pattern: Pattern) -> Step:
    """Rotation over each of the `steps` steps of each edge, in order."""
    theta, rate = path_nodes(points, steps)
    base = inward(components(robot, pattern, points.dtype), [sincos(a) for a in theta], rate)
    return step_rotations(_at_nodes(solve(base.inertia, scale(-1, base.momentum)), theta[0]))


def _at_nodes(vector, like: jax.Array) -> Triple:
    return tuple(jnp.broadcast_to(jnp.asarray(c, like.dtype), like.shape) for c in vector)


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def end_rotation(steps: int, pattern: Pattern, robot: Robot, points: jax.Array) -> jax.Array:
    """Rotation (3, 3) after the polygon `points` (v, j), v >= 2; all arrays of one dtype."""
    total, _ = ordered_products(steps_of_path(robot, points, steps, pattern).rotation)
    return to_matrix(total)


@partial(end_rotation.defjvp, symbolic_zeros=True)
def _end_rotation_jvp(steps, pattern, primals, tangents):
    robot, points = primals
    theta, rate = path_nodes(points, steps)
    keep = keeper(theta[0])
    sine_cosine = [keep(sincos(angle)) for angle in theta]
    base = inward(components(robot, pattern, points.dtype), sine_cosine, rate)
    base = Base(*(keep(part) for part in base))
    omega = _at_nodes(solve(base.inertia, scale(-1, base.momentum)), theta[0])
    step = step_rotations(omega)
    total, before = ordered_products(step.rotation)
    rotation = to_matrix(total)

    velocity = scale(-1, plus(base.drift, cross(omega, base.centre)))
    leaves, structure = jax.tree.flatten((robot, points))
    changes = jax.tree.leaves(tangents, is_leaf=lambda t: isinstance(t, SymbolicZero))
    varied = [i for i, change in enumerate(changes) if not isinstance(change, SymbolicZero)]
    if not varied:
        return rotation, jnp.zeros_like(rotation)

    def momentum(values):
        now = list(leaves)
        for i, value in zip(varied, values, strict=True):
            now[i] = value
        robot, points = jax.tree.unflatten(structure, now)
        theta, rate = path_nodes(points, steps)
        parts = _spread_components(components(robot, pattern, points.dtype), theta[0])
        of_all = angular_momentum(parts, [sincos(a) for a in theta], rate, omega, velocity, base.centre, keep)
        return _at_nodes(of_all, theta[0])

    _, change = jax.jvp(momentum, ([leaves[i] for i in varied],), ([changes[i] for i in varied],))
    change_of_omega = _at_nodes(solve(base.inertia, scale(-1, change)), theta[0])
    in_step = mean_over_step(step.inside(keep(change_of_omega), keep))
    x, y, z = (c.sum() for c in rotate(times(before, step.half), in_step))
    turn = jnp.stack([x, y, z])
    return rotation, jnp.cross(turn[:, None], rotation, axis=0)


def _spread_components(robot: Components, like: jax.Array) -> Components:
    def at_nodes(value):
        return value if isinstance(value, int) else to_nodes(value, like)

    arrays = robot._replace(parent=())
    return jax.tree.map(at_nodes, arrays)._replace(parent=robot.parent)

"""Net rotation (holonomy) of the base after a path in shape space, at zero angular momentum.

At zero momentum `omega = A^-1 B theta_dot` is linear in the joint rates, so the rotation after a path
depends on the path alone, not on how fast it is run (thesis 2.4). Along each straight edge
`R' = R hat(omega)` is solved on the rotation group, from the identity.
"""

from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Float

from reojax._arrays import Array, common_float
from reojax._fast.components import Pattern, components, pattern_of
from reojax._fast.omega import omega
from reojax._fast.product import Quaternion, cumulative_product, ordered_product
from reojax._fast.steps import NODES, step_rotation
from reojax.path import Path
from reojax.robot import Robot

DEFAULT_STEPS = 5
"""Steps per edge that bring every named robot's manoeuvres within 1e-9 rad (30 evaluations of omega an edge)."""


def net_rotation(robot: Robot, path: Path, *, steps: int = DEFAULT_STEPS) -> Float[Array, "3 3"]:
    """Rotation of the base after `path`, at zero angular momentum (thesis 2.5).

    Takes base components at the end to base components at the start (inertial components, if the base
    starts aligned). Magnus method on the rotation group, in a frame that turns with the mean of omega over a
    step, with six Gauss nodes a step: all nodes are evaluated at once, and the error falls at least with
    the tenth power of the step while the solution is resolved. Compare `steps` with `2 * steps` for an
    estimate of the error.

    Args:
        robot: the robot.
        path: the path in shape space; closed or open, any number of corners.
        steps: steps per edge, static. A sampled curve with many short edges is well served by 1.

    Raises:
        ValueError: if the path's joints do not match the robot's, or `steps` is not a positive integer.
    """
    _check(robot, path, "steps", steps)
    return _net_rotation(robot, path.waypoints, steps, pattern_of(robot))


def rotation_history(robot: Robot, path: Path, *, samples: int) -> Float[Array, "m 3 3"]:
    """Rotations of the base along `path`, at `samples` equally spaced points per edge and at the start.

    Entry `e * samples + i` is the rotation after `i / samples` of edge `e`; the first is the identity, the
    last is `net_rotation`. Every sample is reached by a step of `net_rotation`'s method of its own, and by
    more where `samples` is smaller than its default number of steps.

    Args:
        robot: the robot.
        path: the path in shape space.
        samples: samples per edge, static.

    Raises:
        ValueError: if the path's joints do not match the robot's, or `samples` is not a positive integer.
    """
    _check(robot, path, "samples", samples)
    return _rotation_history(robot, path.waypoints, samples, pattern_of(robot))


def _check(robot: Robot, path: Path, entry: str, count: int) -> None:
    if not isinstance(path, Path):
        raise ValueError(f"`path` is {path!r}; it must be a Path, such as `polygon(waypoints)` makes.")
    if path.joints != robot.joints:
        raise ValueError(
            f"`path` has waypoints of {path.joints} joint angles; {robot.name!r} has {robot.joints} joints."
        )
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise ValueError(f"`{entry}` is {count!r}; it must be a positive integer.")


@partial(jax.jit, static_argnums=(2, 3))
def _net_rotation(robot: Robot, waypoints: Array, steps: int, pattern: Pattern) -> jax.Array:
    if waypoints.shape[0] == 1 or not robot.joints:
        return jnp.eye(3, dtype=common_float(robot, waypoints))
    return _matrix(ordered_product(_step_rotations(robot, waypoints, steps, pattern)))


@partial(jax.jit, static_argnums=(2, 3))
def _rotation_history(robot: Robot, waypoints: Array, samples: int, pattern: Pattern) -> jax.Array:
    start = jnp.eye(3, dtype=common_float(robot, waypoints))[None]
    edges = waypoints.shape[0] - 1
    if not robot.joints or not edges:
        return jnp.tile(start, (edges * samples + 1, 1, 1))
    finer = -(-DEFAULT_STEPS // samples)
    turned = cumulative_product(_step_rotations(robot, waypoints, samples * finer, pattern))
    history = jax.vmap(_matrix)(tuple(q[finer - 1 :: finer] for q in turned))
    return jnp.concatenate([start, history])


def _step_rotations(robot: Robot, waypoints: Array, steps: int, pattern: Pattern) -> Quaternion:
    """Rotation over each of the `steps` steps of each edge, in order."""
    dtype = common_float(robot, waypoints)
    points = jnp.asarray(waypoints, dtype)
    change = points[1:] - points[:-1]
    fraction = jnp.asarray((jnp.arange(steps)[:, None] + NODES) / steps, dtype)
    shape = (change.shape[0] * steps, len(NODES))
    theta, rate = [], []
    for k in range(robot.joints):
        start, by = points[:-1, k, None, None], change[:, k, None, None]
        theta.append((start + by * fraction[None]).reshape(shape))
        rate.append(jnp.broadcast_to(by / steps, (*by.shape[:1], *fraction.shape)).reshape(shape))
    return step_rotation(omega(components(robot, pattern, dtype), theta, rate))


def _matrix(q: Quaternion) -> jax.Array:
    w, x, y, z = q
    return jnp.stack(
        [
            1 - 2 * (y * y + z * z),
            2 * (x * y - w * z),
            2 * (x * z + w * y),
            2 * (x * y + w * z),
            1 - 2 * (x * x + z * z),
            2 * (y * z - w * x),
            2 * (x * z - w * y),
            2 * (y * z + w * x),
            1 - 2 * (x * x + y * y),
        ]
    ).reshape(3, 3)

"""Net rotation (holonomy) of the base after a path in shape space, at zero angular momentum.

At zero momentum `omega = A^-1 B theta_dot` is linear in the joint rates, so the rotation after a path
depends on the path alone, not on how fast it is run (thesis 2.4). Along each straight edge
`R' = R hat(omega)` is solved on the rotation group, from the identity.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array, cast, common_float
from reojax.mechanics._fast.net_rotation import net_rotation as fast_net_rotation, steps_of_path
from reojax.mechanics._fast.parameters import Pattern, pattern_of
from reojax.mechanics._fast.quaternions import products_up_to, to_matrix
from reojax.mechanics.input_checks import check_path, check_robot, check_steps, warn_if_unresolved
from reojax.mechanics.own_units import without_names
from reojax.path import Path
from reojax.robot import Robot

DEFAULT_STEPS = 4
"""Steps per edge that bring every named robot's manoeuvres within 1e-9 rad (32 evaluations of omega an edge)."""


RESOLVED_EDGE = np.deg2rad(270)
"""Largest change of a joint angle on an edge for which the default steps and samples are meant [rad]."""


def refinement(longest: float) -> int:
    """How many times the default steps or samples an edge takes that changes a joint angle by `longest` [rad]."""
    return max(1, int(np.ceil(longest / RESOLVED_EDGE - 1e-9)))


def net_rotation(robot: Robot, path: Path, *, steps: int = DEFAULT_STEPS) -> Float[Array, "3 3"]:
    """Rotation of the base after `path`, at zero angular momentum (thesis 2.5).

    Takes base components at the end to base components at the start (inertial components, if the base
    starts aligned). Magnus method on the rotation group, in a frame that turns with the mean of omega over a
    step, with eight Gauss nodes a step: all nodes are evaluated at once, and the error falls at least with
    the tenth power of the step while the solution is resolved. Compare `steps` with `2 * steps` for an
    estimate of the error.

    Args:
        robot: the robot.
        path: the path in shape space; closed or open, any number of corners.
        steps: steps per edge, static. A sampled curve with many short edges is well served by 1.

    Raises:
        ValueError: if the path's joints do not match the robot's, or `steps` is not a positive integer.

    Warns:
        UserWarning: if an edge turns a joint by more than 1.2 rad a step, which `steps` does not resolve (270 degrees
            in the default 4 steps are within). Not under `jit`, `vmap` or `grad`, where angles cannot be read.
    """
    check_path(check_robot(robot), path)
    steps = check_steps("steps", steps)
    warn_if_unresolved(path, steps, "steps")
    return _net_rotation(without_names(robot), path.waypoints, steps, pattern_of(robot))


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

    Warns:
        UserWarning: as `net_rotation`.
    """
    check_path(check_robot(robot), path)
    samples = check_steps("samples", samples)
    steps = samples * -(-DEFAULT_STEPS // samples)
    warn_if_unresolved(path, steps, "samples")
    return _rotation_history(without_names(robot), path.waypoints, samples, pattern_of(robot))


@partial(jax.jit, static_argnums=(2, 3))
def _net_rotation(robot: Robot, waypoints: Array, steps: int, pattern: Pattern) -> jax.Array:
    robot, points = _as_arrays(robot, waypoints)
    if points.shape[0] == 1 or not robot.joints:
        return jnp.eye(3, dtype=points.dtype)
    return fast_net_rotation(robot, pattern, points, steps)


@partial(jax.jit, static_argnums=(2, 3))
def _rotation_history(robot: Robot, waypoints: Array, samples: int, pattern: Pattern) -> jax.Array:
    robot, points = _as_arrays(robot, waypoints)
    edges = points.shape[0] - 1
    if not robot.joints or not edges:
        return jnp.tile(jnp.eye(3, dtype=points.dtype), (edges * samples + 1, 1, 1))
    # more steps than samples where these are few, and of their products those at the samples
    finer = -(-DEFAULT_STEPS // samples)
    step = steps_of_path(robot, pattern, points, samples * finer)
    ends = tuple(q[finer - 1 :: finer] for q in products_up_to(step.rotation))
    return jnp.concatenate([jnp.eye(3, dtype=points.dtype)[None], jax.vmap(to_matrix)(ends)])


def _as_arrays(robot: Robot, waypoints: Array) -> tuple[Robot, Any]:
    return cast((robot, waypoints), common_float(robot, waypoints))

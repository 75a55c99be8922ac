"""Clearance at one posture: how far apart the capsules of each pair are."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array, as_numbers, common_float, is_concrete
from reojax.collision.chains import Geometry, Structure, geometry_of, structure_of, unit_axes
from reojax.collision.placement import pair_ends
from reojax.collision.segments import segment_distance
from reojax.mechanics.input_checks import check_robot
from reojax.robot import Robot


def clearance(robot: Robot, theta: ArrayLike) -> Float[Array, " p"]:
    """Signed distance between the two capsules of each pair of `robot.collision_pairs` at joint angles `theta` [m].

    The distance between the centre lines less both radii, exact for capsules and spheres; negative where two of them
    overlap, by as much as the surfaces are past each other. Has derivatives of any order wherever they exist, and 0
    for the first where two centre lines cross.

    Args:
        robot: the robot; one without pairs has no distances, (0,).
        theta: (j,) joint angles [rad].

    Raises:
        ValueError: if `theta` has the wrong shape or is not finite.
    """
    check_robot(robot)
    angles = as_numbers("theta", theta)
    if angles.shape != (robot.joints,):
        raise ValueError(
            f"`theta` has shape {angles.shape}; {robot.name!r} has {robot.joints} joints: it must be ({robot.joints},)."
        )
    if is_concrete(angles) and not np.isfinite(angles).all():
        raise ValueError(f"`theta` is {np.asarray(angles).tolist()}; it must be finite.")
    return clearances(robot, angles[None])[:, 0]


def clearances(robot: Robot, thetas: Float[Array, "s j"]) -> Float[Array, "p s"]:
    """Clearances of all pairs at many postures, unchecked and in one pass [m]."""
    return _clearances(geometry_of(robot), thetas, structure_of(robot), common_float(geometry_of(robot), thetas))


@partial(jax.jit, static_argnums=(2, 3))
def _clearances(geometry: Geometry, thetas: Array, structure: Structure, dtype: np.dtype) -> jax.Array:
    theta, geometry = jnp.asarray(thetas, dtype).T, unit_axes(geometry, dtype)
    if not structure.pairs:
        return jnp.zeros((0, theta.shape[1]), dtype)
    return segment_distance(*pair_ends(structure, geometry, theta)) - radii(structure, geometry)[:, None]


def radii(structure: Structure, geometry: Geometry) -> Float[Array, " p"]:
    """Sum of the two radii of each pair [m]."""
    return geometry.radius[np.array(structure.pairs, int).reshape(-1, 2)].sum(1)


def pair_name(robot: Robot, pair: int) -> str:
    """Names of the two links of a pair, by its number in `robot.collision_pairs`; capsules where a link has several."""

    def name(capsule: int) -> str:
        link = robot.capsule_link[capsule]
        alone = robot.capsule_link.count(link) == 1
        return robot.link_names[link] if alone else f"{robot.link_names[link]} (capsule {capsule})"

    first, second = robot.collision_pairs[pair]
    return f"{name(first)} and {name(second)}"


def without_pairs(robot: Robot) -> str:
    """Why a robot has nothing to keep apart, and what would help, in words."""
    text = f"{robot.name!r} has no pairs of shapes to keep apart"
    if not robot.capsule_link:
        return f"{text}: give it `capsules`."
    return f"{text}: its capsules are on one link, on links joined directly, or touch at rest; give `collision_pairs`."

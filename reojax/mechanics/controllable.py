"""Controllable directions: about which axes closed loops of the joints can turn the base at all.

The rotations that closed paths from a shape lead to form a group, and its Lie algebra is spanned by the curvature of
the local connection at all shapes, each carried back along a path from the shape in question (W. Ambrose and I. M.
Singer, Trans. AMS 75, 1953, 428-443). For an analytic connection, which a robot's is, shapes near by are enough; their
Taylor series are the curvature's covariant derivatives along the joints. A subalgebra of so(3) has dimension 0, 1 or 3:
two directions bring their bracket with them.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax._internal.precision import as_double
from reojax.mechanics.curvature import curvature_terms
from reojax.mechanics.input_checks import check_motion
from reojax.mechanics.integrators import GAUSS, magnus6
from reojax.mechanics.own_units import without_names
from reojax.robot import Robot

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_RAYS, _REACH = 4, 0.2
"""Straight paths to shapes near by, and how far each joint turns on them [rad]."""
_STEPS = 4
"""Steps of the transport along each ray: an error near 1e-12 of the curvature, far below the tolerance."""
_TOLERANCE = {8: 1e-9, 4: 1e-4}
"""Share of its own terms from which a component counts, by the bytes of the robot's numbers. Rounding leaves 1e-15 of
float64 and 1e-7 of float32 terms; a robot of public numbers turns an axis that it has by 1e-6 at the least."""


class ControllableDirections(NamedTuple):
    """Axes about which closed loops of the joints turn the base, as seen from the base at the start of the loops."""

    rank: int
    """0: no loop turns it; 1: about one axis only; 3: any rotation, if the loop is run often enough."""
    axes: Float[np.ndarray, "rank 3"]
    """Orthonormal, base frame; of rank 3 the directions of strongest to weakest curvature near the shape."""


def controllable_directions(
    robot: Robot, theta: Float[Array, " j"] | ArrayLike, *, joints: Sequence[int | str] | None = None
) -> ControllableDirections:
    """Directions that the base can be turned about by closed loops of the joints near a shape.

    They span the curvature `F_ik`, its covariant derivatives `d_l F_ik + Gamma_l x F_ik` along the joints, and their
    brackets. Rank 3: the base can reach every orientation. A planar robot has rank 1, a single joint rank 0, and so has
    a robot without joints: every loop retraces itself. Coupled joints move with their drivers and count as one joint.
    Limits play no part.

    Decided in numbers: a component counts from 1e-9 of the terms that it is a sum of (1e-4 of a robot in float32).
    Runs on the host.

    Args:
        robot: the robot.
        theta: (j,) joint angles [rad].
        joints: numbers or names of the joints that may move; default all.

    Raises:
        ValueError: if `theta` has the wrong shape or is not finite, or there is no such joint.
    """
    checks.on_host("robot` or `theta", (robot, theta), "what decides a rank")
    check_motion(robot, theta=theta)
    theta = np.asarray(theta, float)
    chosen = range(robot.joints) if joints is None else checks.indices_of("joints", joints, robot.joint_names, "joint")
    moves = independent_moves(robot, chosen)
    count = moves.shape[1]
    if count < 2:
        return ControllableDirections(0, np.zeros((0, 3)))
    tolerance = _TOLERANCE[min(np.result_type(leaf).itemsize for leaf in (robot.mass, robot.com, robot.axis))]

    # the connection, its slope and its curvature at nodes along rays from the shape, and at the rays' ends
    ray = np.random.default_rng(0).uniform(-_REACH, _REACH, (_RAYS, count))
    shares = np.append((np.arange(_STEPS)[:, None] + np.array(GAUSS)) / _STEPS, 1.0)
    shapes = np.concatenate([np.zeros((1, count)), (shares[:, None, None] * ray).reshape(-1, count)])
    with jax.enable_x64(True):
        double = as_double(without_names(robot))
        terms = _terms(double, theta + shapes @ moves.T)
    gamma, slope, field = (np.asarray(part) for part in terms)
    # by the independent joints alone, every pair once; and how large the terms are that each component is a sum of
    gamma, i, k = gamma @ moves, *np.triu_indices(count, 1)
    field = np.einsum("ki,pakl,lj->paij", moves, field, moves)[:, :, i, k]
    size = np.einsum("ki,pkl,lj->pij", np.abs(moves), np.sqrt((slope**2).sum(1)), np.abs(moves))
    length = np.sqrt((gamma**2).sum(1))
    size = (size + size.swapaxes(1, 2) + length[:, :, None] * length[:, None, :])[:, i, k]

    # curvature at the shape and at the ends of the rays, these carried back: R F
    from scipy.spatial.transform import Rotation

    omega = np.einsum("nrak,rk->rna", gamma[1:].reshape(-1, _RAYS, 3, count)[:-1], ray)
    turned = [Rotation.identity(), *(_rotation(rates.reshape(_STEPS, 3, 3)) for rates in omega)]
    places = np.append(0, np.arange(len(field) - _RAYS, len(field)))
    here, size = field[places].swapaxes(1, 2), size[places]
    carried = np.stack([turn.apply(vectors) for turn, vectors in zip(turned, here, strict=True)])
    seen = np.sqrt((carried**2).sum(2)) > tolerance * size
    if not seen.any():
        return ControllableDirections(0, np.zeros((0, 3)))
    if _turns_across(here, seen, np.stack([turn.as_rotvec() for turn in turned]), tolerance):
        return ControllableDirections(3, _principal(carried[seen]))
    return _span(carried[seen], size[seen], tolerance)


def independent_moves(robot: Robot, joints: Sequence[int]) -> Float[np.ndarray, "j k"]:
    """How all joints move with each independent one of `joints`: 1 for itself, its ratio for one coupled to it."""
    coupled = {joint: (driver, k) for k, (joint, driver) in enumerate(robot.couplings)}
    free = [joint for joint in joints if joint not in coupled]
    moves = np.zeros((robot.joints, len(free)))
    moves[free, range(len(free))] = 1.0
    for joint, (driver, k) in coupled.items():
        if driver in free:
            moves[joint, free.index(driver)] = float(robot.coupling_ratio[k])
    return moves


@jax.jit
def _terms(robot: Robot, shapes: Array) -> tuple[Array, Array, Array]:
    return jax.vmap(partial(curvature_terms, robot))(shapes)


def _rotation(omega: Float[np.ndarray, "n 3 3"]) -> Rotation:
    """Rotation over n steps of `R' = R hat(omega)`, three Gauss nodes each, by `magnus6`."""
    from scipy.spatial.transform import Rotation

    turned = Rotation.identity()
    for nodes in omega / len(omega):
        turned = turned * Rotation.from_rotvec(magnus6(*nodes))
    return turned


def _turns_across(vectors: np.ndarray, seen: np.ndarray, turn: np.ndarray, tolerance: float) -> bool:
    """Whether the base turns across a curvature whose direction stays, `Gamma x F` without a `d F` against it.

    However little: reaction wheels on a heavy bus have a constant connection, of 1e-6 and less.
    """
    unit = vectors / np.maximum(np.sqrt((vectors**2).sum(2, keepdims=True)), np.finfo(float).tiny)
    across = np.sqrt((np.cross(turn[1:, None], unit[1:]) ** 2).sum(2))
    change = np.sqrt(((unit[1:] - unit[:1]) ** 2).sum(2))
    length = np.sqrt((turn[1:] ** 2).sum(1))[:, None]
    return bool((seen[1:] & seen[:1] & (across > 10 * change) & (across > tolerance * length)).any())


def _span(vectors: np.ndarray, size: np.ndarray, tolerance: float) -> ControllableDirections:
    """The algebra that vectors (m, 3) generate, each known to rounding of the terms of `size` (m,)."""
    length = np.sqrt((vectors**2).sum(1))
    unit, share = vectors / length[:, None], length / size
    surest = unit[share.argmax()]
    across = np.sqrt((np.cross(unit, surest) ** 2).sum(1))
    if (across > tolerance * np.maximum(1.0, 1.0 / share)).any():
        return ControllableDirections(3, _principal(vectors))
    return ControllableDirections(1, surest[None])


def _principal(vectors: np.ndarray) -> np.ndarray:
    """Orthonormal axes (3, 3), those along which vectors (m, 3) are longest first."""
    return np.linalg.svd(vectors.T @ vectors)[2]

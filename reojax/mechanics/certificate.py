"""Evidence that a net rotation is right, measured without the equation that was solved for it.

`net_rotation` solves `A omega = B theta_dot`. Here the motion is looked at from outside: the links' poses
in the inertial frame, joint angles and base rotation together, are differentiated numerically along the
path, and the angular momentum of bodies and rotors that move like this is added up. It must vanish. No
Jacobian, no `A`, no `B` and no angular velocity of the solver's enters, only poses, masses and inertias, so
a mistake in any of those shows.
"""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from math import prod
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array, cast, common_float
from reojax._internal.precision import warn_if_single
from reojax.mechanics.holonomy import DEFAULT_STEPS, net_rotation, rotation_history
from reojax.mechanics.input_checks import check_path, check_robot
from reojax.mechanics.kinematics import kinematics
from reojax.mechanics.own_units import in_own_units, without_names
from reojax.path import Path
from reojax.robot import Robot

DEFAULT_SAMPLES = 128
"""Samples per edge for the momentum: enough for edges of 270 degrees."""
WINDOW = 11
"""Samples in a difference formula, and the fewest that an edge may have, both ends counted."""


class Certificate(NamedTuple):
    """How well a net rotation is known. Levels are for float64, named robots, edges of 10 to 270 degrees."""

    momentum: Float[Array, ""]
    """Largest angular momentum along the path, relative, as `momentum_residual` has it; some 1e-11, by rounding.

    It is the rounding of the differences: 1e-12 rad per edge, whatever the path's size."""
    orthogonality: Float[Array, ""]
    """Largest entry of `R^T R - I` of the result; about 1e-14 (rounding)."""
    halving: Float[Array, ""]
    """Angle between the results with `steps` and `2 * steps` steps per edge [rad]."""
    endpoint: Float[Array, ""]
    """Angle between the result and the end of the motion whose momentum was measured [rad]; as `halving`."""


def certify(robot: Robot, path: Path, *, steps: int = DEFAULT_STEPS, samples: int = DEFAULT_SAMPLES) -> Certificate:
    """Measure how well `net_rotation(robot, path, steps=steps)` is known.

    All four figures must be small. `momentum` says that the motion given by `rotation_history` is one of
    zero angular momentum, `endpoint` that the result is where this motion ends, `halving` that the step is
    fine enough, `orthogonality` that the result is a rotation.

    Args:
        robot: the robot.
        path: the path in shape space.
        steps: steps per edge of the result, static.
        samples: samples per edge for the momentum, static. The truncation of the differences falls with the
            tenth power of the angle between samples; their rounding grows with `samples`.

    Raises:
        ValueError: if the path's joints do not match the robot's, `steps` is not a positive integer, or
            `samples` is not an integer of at least `WINDOW - 1`.

    Warns:
        UserWarning: in float32, where `momentum` is some 0.01 by the rounding of the differences.
    """
    check_path(check_robot(robot), path)
    warn_if_single("the levels of a certificate are not reached", common_float(robot, path))
    return certify_rotation(robot, path, steps=steps, samples=samples)[0]


def certify_rotation(
    robot: Robot, path: Path, *, steps: int = DEFAULT_STEPS, samples: int = DEFAULT_SAMPLES
) -> tuple[Certificate, Float[Array, "3 3"], Float[Array, "m 3 3"]]:
    """Return the certificate with the net rotation and the history that it is about; see `certify`."""
    history = rotation_history(robot, path, samples=samples)
    momentum = momentum_residual(robot, path, history)
    points = jnp.asarray(path.waypoints)
    middles = 0.5 * (points[:-1] + points[1:])
    halved = jnp.concatenate([jnp.stack([points[:-1], middles], 1).reshape(2 * path.edges, path.joints), points[-1:]])
    padded = jnp.concatenate([points, jnp.tile(points[-1:], (path.edges, 1))])
    both = jnp.stack([padded, halved])  # of one shape, so that one program is compiled and not two
    result, finer = jax.vmap(lambda waypoints: net_rotation(robot, Path(waypoints), steps=steps))(both)
    gap = jnp.matmul(result.T, result, precision="highest") - jnp.eye(3, dtype=result.dtype)
    certificate = Certificate(
        momentum=momentum,
        orthogonality=jnp.abs(gap).max(),
        halving=_distance(result, finer),
        endpoint=_distance(result, history[-1]),
    )
    return certificate, result, history


def momentum_residual(robot: Robot, path: Path, rotations: Float[Array, "m 3 3"]) -> Float[Array, ""]:
    """Largest angular momentum of a motion along `path`, as a share of the momenta that its links exchange.

    The links' poses are differentiated along each edge by formulas over `WINDOW` samples. Of the motion in
    which every edge takes one unit of time,

        max |h| / max s,    h = sum of l,  s = sum of |l|,    both maxima over all samples,

    `l` being the momenta about the centre of mass of each link's turn, of its centre's motion, and of each
    rotor. So 1 is as wrong as can be, and edges on which little moves count little. A path that stays put
    has 0.

    Args:
        robot: the robot.
        path: the path in shape space.
        rotations: rotations of the base at equally spaced samples of every edge, laid out as
            `rotation_history` does; from any source.

    Raises:
        ValueError: if `rotations` does not fit the path, or has too few samples per edge.
    """
    check_path(check_robot(robot), path)
    edges = path.edges
    shape = jnp.shape(rotations)
    samples = (shape[0] - 1) // edges if edges and shape else 0
    if shape != (edges * samples + 1, 3, 3):
        raise ValueError(
            f"`rotations` has shape {shape}; for a path of {edges} edges it must be "
            f"(samples per edge * {edges} + 1, 3, 3)."
        )
    if edges and samples < WINDOW - 1:
        raise ValueError(f"`rotations` has {samples} samples per edge; differences need {WINDOW - 1} or more.")
    return _residual(without_names(robot), path.waypoints, rotations, samples)


@partial(jax.jit, static_argnums=3)
def _residual(robot: Robot, waypoints: Array, rotations: Array, samples: int) -> jax.Array:
    dtype = common_float(robot, waypoints, rotations)
    robot, points, turned = cast((robot, waypoints, rotations), dtype)
    robot = in_own_units(robot)  # the result is relative
    if points.shape[0] == 1 or not robot.joints:
        return jnp.zeros((), dtype)
    first = turned[:-1].reshape(-1, samples, 3, 3)
    along = jnp.concatenate([first, turned[samples::samples, None]], axis=1)

    def edge(ends: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        net, exchanged = edge_momentum(robot, *ends)
        return jnp.sqrt((net * net).sum(1).max()), exchanged.max()

    net, exchanged = jax.lax.map(edge, (points[:-1], points[1:], along))
    scale = exchanged.max()
    still = scale == 0  # and not where it is NaN: then so is the result
    return jnp.where(still, 0, net.max() / jnp.where(still, 1, scale))


def edge_momentum(
    robot: Robot, start: Float[Array, " j"], end: Float[Array, " j"], rotations: Float[Array, "m 3 3"]
) -> tuple[Float[Array, "m 3"], Float[Array, " m"]]:
    """Angular momentum along one edge run in unit time, inertial frame, and the sum of its parts' lengths.

    About the centre of mass [kg m^2/s]. The rotations are at `m` equally spaced samples, `m >= WINDOW`.
    """
    rate = jnp.asarray(end - start)
    fraction = jnp.linspace(0, 1, rotations.shape[0], dtype=rotations.dtype)
    pose = jax.vmap(lambda theta: kinematics(robot, theta))(start[None] + rate[None] * fraction[:, None])
    # pose of every link in the inertial frame; the base's own motion is in the rotations alone
    turn = _product("sab,sibc->siac", rotations, pose.rotation)
    place = _product("sab,sib->sia", rotations, pose.com)
    axis = _product("sab,skb->ska", rotations, pose.axis)
    # angular velocity of each link, by differences of its rotation: hat(omega) = R^T R'
    spinning = _product("siba,sibc->siac", turn, _derivative(turn))  # hat of the angular velocity, link frame
    omega = 0.5 * jnp.stack([spinning[..., i, k] - spinning[..., k, i] for i, k in ((2, 1), (0, 2), (1, 0))], -1)
    # R I omega, about the link's own centre of mass
    spin = _product("siab,ibc,sic->sia", turn, robot.inertia, omega)
    # m p x p', about the common centre of mass, which rests
    orbit = robot.mass[None, :, None] * jnp.cross(place, _derivative(place))
    # J N theta_dot of each rotor, relative to its stator
    side = np.array([1 if side == "parent" else -1 for side in robot.rotor_on], rotations.dtype)
    rotor = (robot.rotor_inertia * robot.gear_ratio * side * rate)[None, :, None] * axis
    parts = jnp.concatenate([spin, orbit, rotor], axis=1)
    return parts.sum(1), jnp.sqrt((parts * parts).sum(-1)).sum(1)


def _product(subscripts: str, *factors: Array) -> jax.Array:
    return jnp.einsum(subscripts, *(jnp.asarray(factor) for factor in factors), precision="highest")


@jax.jit  # where numbers are traced, so3 passes NaN on: a certificate of NaN is NaN
def _distance(first: Array, second: Array) -> Array:
    return so3.angle(jnp.matmul(first.T, second, precision="highest"))


def _derivative(values: jax.Array) -> jax.Array:
    """Derivative over the unit interval of equally spaced samples (axis 0, both ends); 0 of a constant."""
    samples = values.shape[0] - 1
    flat = (values - values[:1]).reshape(samples + 1, -1)
    weights = np.asarray(_WEIGHTS * samples, values.dtype)
    half, inner = WINDOW // 2, samples + 2 - WINDOW
    middle = jnp.stack([weights[half, k] * flat[k : k + inner] for k in range(WINDOW)]).sum(0)
    head = jnp.matmul(weights[:half], flat[:WINDOW], precision="highest")
    tail = jnp.matmul(weights[half + 1 :], flat[-WINDOW:], precision="highest")
    return jnp.concatenate([head, middle, tail]).reshape(values.shape)


def _difference_weights(width: int) -> np.ndarray:
    """Row p: weights of values at 0, ..., width - 1 in the derivative at p of their polynomial (Lagrange)."""
    nodes = range(width)
    weights = np.zeros((width, width))
    for p in nodes:
        for k in nodes:
            if k != p:
                above = prod(p - i for i in nodes if i not in (k, p))
                weights[p, k] = Fraction(above, prod(k - i for i in nodes if i != k))
        weights[p, p] = -weights[p].sum()
    return weights


_WEIGHTS = _difference_weights(WINDOW)

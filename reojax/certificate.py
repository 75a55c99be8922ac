"""Evidence that a net rotation is right, measured without the equation that was solved for it.

`net_rotation` solves `A omega = B theta_dot`. Here the motion is looked at from outside: the links' poses in the
inertial frame, joint angles and base rotation together, are differentiated numerically along the path, and the
angular momentum of the bodies and rotors that move like this is added up. It must vanish. No Jacobian, no
`A`, no `B` and no angular velocity of the solver's enters, only poses, masses and inertias, so a mistake in
any of those shows.
"""

from fractions import Fraction
from math import prod
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._arrays import Array, common_float
from reojax.holonomy import DEFAULT_STEPS, net_rotation, rotation_history
from reojax.momentum import kinematics
from reojax.path import Path
from reojax.robot import Robot

DEFAULT_SAMPLES = 128
"""Samples per edge for the momentum: enough for edges of 270 degrees."""
WINDOW = 11
"""Samples in a difference formula, and the fewest that an edge may have, both ends counted."""


class Certificate(NamedTuple):
    """How well a net rotation is known. Levels are for float64, the named robots and edges of up to 270 degrees."""

    momentum: Float[Array, ""]
    """Largest angular momentum along the path, as `momentum_residual` has it; about 1e-11 (rounding in the differences)."""
    orthogonality: Float[Array, ""]
    """Largest entry of `R^T R - I` of the result; about 1e-15 (rounding)."""
    halving: Float[Array, ""]
    """Angle between the results with `steps` and `2 * steps` steps per edge [rad]; below 1e-9 at the default."""
    endpoint: Float[Array, ""]
    """Angle between the result and the end of the motion whose momentum was measured [rad]; below 1e-9 at the default."""


def certify(
    robot: Robot, path: Path, *, steps: int = DEFAULT_STEPS, samples: int = DEFAULT_SAMPLES
) -> Certificate:
    """Measure how well `net_rotation(robot, path, steps=steps)` is known.

    All four figures must be small. `momentum` says that the motion given by `rotation_history` is one of zero
    angular momentum, `endpoint` that the result is where this motion ends, `halving` that the step is fine enough,
    `orthogonality` that the result is a rotation.

    Args:
        robot: the robot.
        path: the path in shape space.
        steps: steps per edge of the result, static.
        samples: samples per edge for the momentum, static. The truncation of the differences falls with the tenth
            power of the angle between samples; their rounding grows with `samples`.

    Raises:
        ValueError: if the path's joints do not match the robot's, or a count is not an integer that is large enough.
    """
    return certified_rotation(robot, path, steps=steps, samples=samples)[0]


def certified_rotation(
    robot: Robot, path: Path, *, steps: int = DEFAULT_STEPS, samples: int = DEFAULT_SAMPLES
) -> tuple[Certificate, Float[Array, "3 3"], Float[Array, "m 3 3"]]:
    """Return the certificate, the net rotation and the history that it speaks of; all arguments as for `certify`."""
    points = jnp.asarray(path.waypoints)
    middles = 0.5 * (points[:-1] + points[1:])
    halved = jnp.concatenate([jnp.stack([points[:-1], middles], 1).reshape(-1, path.joints), points[-1:]])
    padded = jnp.concatenate([points, jnp.tile(points[-1:], (path.edges, 1))])
    both = jnp.stack([padded, halved])  # of one shape, so that one program is compiled and not two
    result, finer = jax.vmap(lambda waypoints: net_rotation(robot, Path(waypoints), steps=steps))(both)
    history = rotation_history(robot, path, samples=samples)
    gap = jnp.matmul(result.T, result, precision="highest") - jnp.eye(3, dtype=result.dtype)
    certificate = Certificate(
        momentum=momentum_residual(robot, path, history),
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

    `l` being the momenta about the centre of mass of each link's turn, of its centre's motion, and of each rotor.
    So 1 is as wrong as can be, and edges on which little moves count little. A path that stays put has 0.

    Args:
        robot: the robot.
        path: the path in shape space.
        rotations: rotations of the base at equally spaced samples of every edge, laid out as `rotation_history`
            does; from any source.

    Raises:
        ValueError: if `rotations` does not fit the path, or has too few samples per edge.
    """
    edges, count = path.edges, jnp.shape(rotations)[0] - 1 if jnp.ndim(rotations) else -1
    samples = count // edges if edges else 0
    if jnp.shape(rotations) != (edges * samples + 1, 3, 3):
        raise ValueError(
            f"`rotations` has shape {jnp.shape(rotations)}; for a path of {edges} edges it must be "
            f"(samples per edge * {edges} + 1, 3, 3)."
        )
    if edges and samples < WINDOW - 1:
        raise ValueError(f"`rotations` has {samples} samples per edge; the momentum needs {WINDOW - 1} or more.")
    return _residual(robot, path.waypoints, rotations, samples)


@jax.jit(static_argnums=3)
def _residual(robot: Robot, waypoints: Array, rotations: Array, samples: int) -> jax.Array:
    dtype = common_float(robot, waypoints, rotations)
    if waypoints.shape[0] == 1:
        return jnp.zeros((), dtype)
    robot, points, turned = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), (robot, waypoints, rotations))
    first = turned[:-1].reshape(-1, samples, 3, 3)
    along = jnp.concatenate([first, turned[samples::samples, None]], axis=1)

    def edge(ends: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        net, exchanged = edge_momentum(robot, *ends)
        return jnp.sqrt((net * net).sum(1).max()), exchanged.max()

    net, exchanged = jax.lax.map(edge, (points[:-1], points[1:], along))
    scale = exchanged.max()
    return jnp.where(scale > 0, net.max() / jnp.where(scale > 0, scale, 1), 0)


def edge_momentum(
    robot: Robot, start: Float[Array, " j"], end: Float[Array, " j"], rotations: Float[Array, "m 3 3"]
) -> tuple[Float[Array, "m 3"], Float[Array, " m"]]:
    """Angular momentum along one edge run in unit time, inertial frame, and the sum of its parts' lengths.

    About the centre of mass [kg m^2/s]. The rotations are at `m` equally spaced samples, `m >= WINDOW`.
    """
    samples = rotations.shape[0] - 1
    fraction = jnp.arange(samples + 1, dtype=rotations.dtype)[:, None] / samples
    rate = end - start
    pose = jax.vmap(lambda theta: kinematics(robot, theta))(start[None] + rate[None] * fraction)
    turn = _product("sab,sibc->siac", rotations, pose.rotation)
    place = _product("sab,sib->sia", rotations, pose.centre)
    axis = _product("sab,skb->ska", rotations, pose.axis)
    body_rate = _product("siba,sibc->siac", turn, _derivative(turn))  # hat of the angular velocity, link's frame
    omega = 0.5 * jnp.stack([body_rate[..., i, k] - body_rate[..., k, i] for i, k in ((2, 1), (0, 2), (1, 0))], -1)
    spin = _product("siab,ibc,sic->sia", turn, robot.inertia, omega)
    orbit = robot.mass[None, :, None] * jnp.cross(place, _derivative(place))
    side = np.array([1.0 if side == "parent" else -1.0 for side in robot.rotor_on])
    rotor = (robot.rotor_inertia * robot.gear_ratio * side * rate)[None, :, None] * axis
    parts = jnp.concatenate([spin, orbit, rotor], axis=1)
    return parts.sum(1), jnp.sqrt((parts * parts).sum(-1)).sum(1)


def _product(subscripts: str, *operands: jax.Array) -> jax.Array:
    return jnp.einsum(subscripts, *operands, precision="highest")


def _distance(first: jax.Array, second: jax.Array) -> jax.Array:
    return so3.angle(jnp.matmul(first.T, second, precision="highest"))


def _derivative(values: jax.Array) -> jax.Array:
    """Derivative over the unit interval of equally spaced samples (axis 0, ends included); exactly 0 of a constant."""
    samples = values.shape[0] - 1
    flat = (values - values[:1]).reshape(samples + 1, -1)
    weights = np.asarray(_WEIGHTS * samples, values.dtype)
    half, shifts = WINDOW // 2, samples + 2 - WINDOW
    middle = sum(weights[half, k] * flat[k : k + shifts] for k in range(WINDOW))
    head = jnp.matmul(weights[:half], flat[:WINDOW], precision="highest")
    tail = jnp.matmul(weights[half + 1 :], flat[-WINDOW:], precision="highest")
    return jnp.concatenate([head, middle, tail]).reshape(values.shape)


def _difference_weights(width: int) -> np.ndarray:
    """Row p: weights of the values at 0, 1, ..., width - 1 in the derivative at p of their polynomial (Lagrange)."""
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

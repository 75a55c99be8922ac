"""Correction gains: how the rest of a joint motion takes back an error of the orientation, as a table over time."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array, as_numbers, common_float, is_concrete
from reojax._internal.linalg import solve_symmetric3
from reojax.mechanics.dynamics import base_velocity
from reojax.mechanics.input_checks import MOST_STEPS, check_robot
from reojax.mechanics.momentum import connection
from reojax.mechanics.own_units import without_names
from reojax.mechanics.variation import turn_per_change
from reojax.motion.simulation import Motion
from reojax.motion.trajectory import Trajectory
from reojax.path import Path
from reojax.robot import Robot
from reojax.steering.nodes import Nodes, nodes_of

DEFAULT_SAMPLES = 16
"""Samples of each edge or piece."""
DEFAULT_WINDOW = 0.1
"""Share of the motion over which a change starts and ends."""
DEFAULT_LEFT = 0.1
"""Share of an error that is left at the end, about the axis that is hardest to turn about."""
LINEAR = 0.5
"""Change of a joint up to which the first variation is taken to hold, for `reach` [rad]."""


class CorrectionGains(NamedTuple):
    """What takes back an error of the orientation, at `m` samples of a motion.

    The error `e` (3,) is a rotation vector seen from the start (inertial frame): the base is at `exp(e) R` where the
    motion has it at `R`; what the base reads in its own frame as `R exp(delta)` is `e = R delta`. Where the joints are
    at `theta + p` instead of `theta`, it is against `R exp(connection p)` that the error is taken.
    """

    at: Float[Array, " m"]
    """Time [s] of a trajectory or motion; parameter of a path, a unit for each edge."""
    theta: Float[Array, "m j"]
    """Joint angles of the motion [rad]."""
    theta_dot: Float[Array, "m j"]
    """Their rates by `at`; at a corner of a path, of the edge that begins."""
    rotation: Float[Array, "m 3 3"]
    """Orientation of the base, from the identity."""
    omega: Float[Array, "m 3"]
    """Angular velocity of the base by `at`, base frame."""
    connection: Float[Array, "m 3 j"]
    """Local connection."""
    gain: Float[Array, "m j 3"]
    """The law: change of the joints `p = -gain e` for the error `e` at the same instant [rad/rad],
    `gain = direction (gramian + rest)^-1 to_end`."""
    authority: Float[Array, " m"]
    """Least eigenvalue of `gramian`: the more, the smaller the change that an error about the worst axis takes."""
    reach: Float[Array, " m"]
    """Largest error, about the worst axis, that the rest takes back with every joint within its limits and changed by
    0.5 rad at most, where the first variation holds [rad]."""
    direction: Float[Array, "m j 3"]
    """`window W^-1 G^T`, with `G` the turn of the end per change of the joints (`reojax.mechanics.variation`)."""
    gramian: Float[Array, "m 3 3"]
    """`integral of G direction` from here to the end: what the rest of the motion can turn; 0 at the end."""
    to_end: Float[Array, "m 3 3"]
    """What an error here is at the end, if nothing is done: the identity unless there is angular momentum."""
    rest: Float[Array, ""]
    """What the law adds to the Gramian's diagonal, so that gains stay finite at the end, where nothing can be done."""
    momentum: Float[Array, "3"]
    """Angular momentum that they are made for, inertial frame [kg m^2/s]."""

    def change(self, start: int, error: ArrayLike) -> Float[Array, "m j"]:
        """Least change of the joints from sample `start` on that takes back an error known there, and only there.

        `p(s) = -direction(s) (gramian(start) + rest)^-1 to_end(start) e`. The law `p = -gain e` comes to the same
        where nothing else disturbs, as the error then goes down as the Gramian does. A change that starts inside the
        motion starts with a jump: `Steering` smooths it.

        Args:
            start: number of the sample.
            error: (3,) as above [rad].
        """
        dtype = self.gain.dtype
        stiff = self.gramian[start] + self.rest * jnp.eye(3, dtype=dtype)
        steer = solve_symmetric3(stiff, self.to_end[start] @ jnp.asarray(error, dtype)[:, None])[:, 0]
        later = np.arange(self.at.shape[0]) >= start
        return jnp.where(later[:, None], -jnp.asarray(self.direction) @ steer, 0)


def correction_gains(
    robot: Robot,
    motion: Path | Trajectory | Motion,
    *,
    samples: int = DEFAULT_SAMPLES,
    weights: ArrayLike | None = None,
    window: float = DEFAULT_WINDOW,
    left: float = DEFAULT_LEFT,
    momentum: ArrayLike | None = None,
) -> CorrectionGains:
    """Gains of the least correction of the remaining joint path that takes back an error of the orientation.

    A change `p` of the joints turns the end by `integral of G p`, `G = R F(., theta')` with the connection's curvature
    `F`. Of all changes that turn it by `-e`, the one with the least `integral of p W p / window` is

        p(s) = -window W^-1 G^T [integral_s^1 of G window W^-1 G^T]^-1 e,

    the regulator of least effort for the error (J. T. Wen and K. Kreutz-Delgado, IEEE Trans. Autom. Control 36, 1991,
    for attitude; the open question of thesis 1.9). The bracket, the Gramian, is what the remaining motion can turn.
    Near the end the bracket vanishes, and `rest` bounds the gains. Coupled joints follow their drivers. With momentum,
    the error's own growth is accounted for. This is the first variation: a correction of some tenths of a radian leaves
    its square, which `Steering` solves for and which the law of `reojax.steering.onboard` sees in the next readings.

    Args:
        robot: the robot; of its joint limits only `reach` knows.
        motion: a path, a trajectory, or a motion that `simulate` made, which keeps its samples and its momentum. On a
            path, whose direction jumps at its corners, the change vanishes at each of them.
        samples: of each edge or piece, static.
        weights: (j,) price of changing each joint, positive; infinite for one that must not. Default 1.
        window: share of the whole, at its start and at its end, over which the change starts and ends smoothly.
        left: `rest` in shares of the authority at the start: about the share of an error that is left at the end, about
            the axis that is hardest to turn about. The more, the smaller the changes.
        momentum: (3,) angular momentum, inertial frame, of a trajectory [kg m^2/s]; default zero.

    Raises:
        ValueError: naming the entry, if anything does not fit the robot, is not finite or out of its range.
    """
    _check(robot, motion, samples, window, left)
    price = np.ones(robot.joints) if weights is None else as_numbers("weights", weights)
    if price.shape != (robot.joints,):
        raise ValueError(f"`weights` has shape {price.shape}; {robot.name!r} has {robot.joints} joints.")
    if is_concrete(price) and not (np.asarray(price) > 0).all():
        raise ValueError(f"`weights` is {np.asarray(price).tolist()}; each must be positive (infinite holds a joint).")
    if momentum is not None and not isinstance(motion, Trajectory):
        raise ValueError("`momentum` goes with a trajectory: a path takes none, and a simulated motion has its own.")
    start = np.zeros(3) if momentum is None else as_numbers("momentum", momentum)
    if start.shape != (3,) or (is_concrete(start) and not np.isfinite(start).all()):
        raise ValueError(f"`momentum` is {momentum}; it must be 3 finite numbers, in the inertial frame [kg m^2/s].")
    return _gains(without_names(robot, couplings=True), motion, price, start, (window, left), int(samples))


def _check(robot: Robot, motion: Path | Trajectory | Motion, samples: int, window: float, left: float) -> None:
    check_robot(robot)
    if not isinstance(motion, Path | Trajectory | Motion):
        raise ValueError(f"`motion` is a {type(motion).__name__}; it must be a Path, a Trajectory or a Motion.")
    joints = motion.theta.shape[1] if isinstance(motion, Motion) else motion.joints
    if joints != robot.joints:
        raise ValueError(f"`motion` moves {joints} joints; {robot.name!r} has {robot.joints}.")
    if isinstance(motion, Path) and not motion.edges:
        raise ValueError("`motion` is a path of one waypoint; nothing can be corrected where nothing moves.")
    checks.whole("samples", samples, 2, MOST_STEPS)
    checks.number("window", window, least=0.0, most=0.5)
    checks.positive("left", left, unit="")


@partial(jax.jit, static_argnums=5)
def _gains(
    robot: Robot, motion: Path | Trajectory | Motion, price: Array, momentum: Array, shares: tuple[Array, ...], n: int
) -> CorrectionGains:
    dtype = common_float(robot, motion, momentum)
    robot, motion, price, momentum, (window, left) = jax.tree.map(
        lambda leaf: jnp.asarray(leaf, dtype), (robot, motion, price, momentum, shares)
    )
    nodes = nodes_of(robot, motion, momentum, n)
    g, growth = _over_nodes(partial(turn_per_change, robot), nodes, nodes.momentum)
    to_end = _transitions(nodes, growth)
    g = to_end @ g
    weight = nodes.shape * _ramp(nodes.at, window)
    direction = weight[:, :, None, None] * (spread(robot, price) @ g.swapaxes(2, 3))
    gramian = integral_to_end(nodes, g @ direction)
    # an error about the hardest axis shrinks to `left`; the rest is rounding where no joint can turn it at all
    full = gramian[0]
    rest = left * jnp.maximum(least_eigenvalue(full), 1e-6 * jnp.trace(full))
    rest = jnp.maximum(rest, jnp.finfo(dtype).tiny ** 0.25)

    def first(values: Array) -> Array:
        return jnp.concatenate([values[:, 0], values[-1:, 2]])

    own = nodes.theta, nodes.rate, nodes.rotation
    direction, to_end, theta, rate, rotation = map(first, (direction, to_end, *own))
    stiff = gramian + rest * jnp.eye(3, dtype=dtype)[None]
    gain = direction @ jax.vmap(solve_symmetric3)(stiff, to_end)
    gamma, omega = jax.vmap(partial(_connection_and_rate, robot, nodes.momentum))(theta, rate, rotation)
    authority = jax.vmap(least_eigenvalue)(gramian)
    room = jnp.clip(jnp.minimum(robot.upper[None] - theta, theta - robot.lower[None]), 0, LINEAR)
    reach = _reach(direction, gramian, to_end, room, authority > rest)
    return CorrectionGains(
        at=first(nodes.at),
        theta=theta,
        theta_dot=rate,
        rotation=rotation,
        omega=omega,
        connection=gamma,
        gain=gain,
        authority=authority,
        reach=reach,
        direction=direction,
        gramian=gramian,
        to_end=to_end,
        rest=rest,
        momentum=nodes.momentum,
    )


def spread(robot: Robot, price: Float[Array, " j"]) -> Float[Array, "j j"]:
    """`W^-1` (j, j) of the joints that are free, with those that are coupled to them carried along; `price` is `W`."""
    carry = jnp.eye(robot.joints, dtype=price.dtype)
    for number, (joint, driver) in enumerate(robot.couplings):
        carry = carry.at[joint, joint].set(0).at[joint, driver].set(robot.coupling_ratio[number])
    moves = carry != 0
    whole = jnp.where(moves, carry**2 * jnp.where(moves, price[:, None], 1), 0).sum(0)
    return (carry * jnp.where(whole > 0, 1 / jnp.where(whole > 0, whole, 1), 0)[None]) @ carry.T


def integral_to_end(nodes: Nodes, values: Float[Array, "m 3 a b"]) -> Float[Array, "m+1 a b"]:
    """Integral of `values` from each sample to the end, by Simpson's rule."""
    length = nodes.at[:, 2] - nodes.at[:, 0]
    part = (length / 6)[:, None, None] * (values[:, 0] + 4 * values[:, 1] + values[:, 2])
    total = jnp.cumsum(part[::-1], axis=0)[::-1]
    return jnp.concatenate([total, jnp.zeros_like(total[:1])])


def least_eigenvalue(matrix: Float[Array, "3 3"]) -> Float[Array, ""]:
    """Least eigenvalue of a symmetric matrix, from the angle of its characteristic cubic; 0 rather than negative."""
    mean = jnp.trace(matrix) / 3
    off = matrix - mean * jnp.eye(3, dtype=matrix.dtype)
    size = (off * off).sum() / 6
    safe = jnp.where(size > 0, size, 1)
    x, y, z = off
    cosine = jnp.where(size > 0, jnp.dot(x, jnp.cross(y, z)) / (2 * safe * jnp.sqrt(safe)), 1)
    inside = jnp.clip(cosine, -1 + 1e-15, 1 - 1e-15)
    angle = jnp.arccos(inside) / 3
    return jnp.maximum(mean + jnp.where(size > 0, 2 * jnp.sqrt(safe), 0) * jnp.cos(angle + 2 * jnp.pi / 3), 0)


def _over_nodes(function, nodes: Nodes, momentum: Array) -> tuple[Array, Array]:
    """Values of `function` at all nodes, (m, 3, ...)."""
    flat = [leaf.reshape(-1, *leaf.shape[2:]) for leaf in (nodes.theta, nodes.rate, nodes.rotation)]
    values = jax.vmap(function, (0, 0, 0, None))(*flat, momentum)
    return jax.tree.map(lambda leaf: leaf.reshape(-1, 3, *leaf.shape[1:]), values)


def _transitions(nodes: Nodes, growth: Float[Array, "m 3 3 3"]) -> Float[Array, "m 3 3 3"]:
    """`Phi(end, s)` at all nodes: `Phi' = -Phi N`, backward from the identity, Runge-Kutta of fourth order."""

    def back(after: Array, inputs: tuple[Array, Array]) -> tuple[Array, Array]:
        h, n = inputs
        slope = [after @ n[2]]
        for node, share in ((1, 0.5), (1, 0.5), (0, 1.0)):
            slope.append((after + share * h * slope[-1]) @ n[node])
        before = after + h / 6 * (slope[0] + 2 * slope[1] + 2 * slope[2] + slope[3])
        middle = (before + after) / 2 - h / 8 * (before @ n[0] - after @ n[2])
        return before, jnp.stack([before, middle, after])

    length = nodes.at[:, 2] - nodes.at[:, 0]
    return jax.lax.scan(back, jnp.eye(3, dtype=growth.dtype), (length, growth), reverse=True)[1]


def _connection_and_rate(
    robot: Robot, momentum: Array, theta: Array, rate: Array, rotation: Array
) -> tuple[Array, Array]:
    """Connection and angular velocity of the base."""
    gamma = connection(robot, theta)
    return gamma, gamma @ rate + base_velocity(robot, theta, jnp.zeros_like(rate), momentum=rotation.T @ momentum)


def _reach(direction: Array, gramian: Array, to_end: Array, room: Array, able: Array) -> Array:
    """Largest error that can be taken back from each sample on, about the worst axis."""
    eye = jnp.eye(3, dtype=room.dtype)
    number = jnp.arange(room.shape[0])

    def one(inputs: tuple[Array, Array, Array, Array]) -> Array:
        k, gramian, to_end, able = inputs
        steer = solve_symmetric3(jnp.where(able, gramian, eye), to_end)
        size = jnp.sqrt(((direction @ steer) ** 2).sum(2))
        moves = (size > 0) & (number >= k)[:, None]
        return jnp.where(able, jnp.where(moves, room / jnp.where(moves, size, 1), jnp.inf).min(), 0)

    return jax.lax.map(one, (number, gramian, to_end, able))


def _ramp(at: Array, window: Array) -> Array:
    """1 inside, falling smoothly to 0 over `window` of the whole at each end."""
    share = (at - at[0, 0]) / (at[-1, -1] - at[0, 0])
    u = jnp.minimum(share, 1 - share) / jnp.where(window > 0, window, 1)
    u = jnp.where(window > 0, jnp.clip(u, 0, 1), 1)
    return u**3 * (10 - 15 * u + 6 * u * u)

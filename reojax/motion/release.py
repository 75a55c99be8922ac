"""What an imperfect release does: leftover angular momentum, and a wire that pulls, along a given joint motion.

With the total angular momentum `H` about the centre of mass in inertial components, the base turns by

    R' = R hat(A^-1 (B theta_dot + R^T H)),      H' = (R r) x F - c R omega,

`r` from the centre of mass to where a wire is tied to the base. The wire pulls with a constant force `F` (its weight,
or the air that it catches) and resists turning with a moment `c` per angular velocity of the base. With neither wire
nor momentum this is thesis eq. 2.14, and time does not matter; with them it does.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array, as_numbers, cast, common_float, is_concrete
from reojax.mechanics.integrators import RK4, runge_kutta_step
from reojax.mechanics.kinematics import kinematics
from reojax.mechanics.momentum import velocity_by_momentum
from reojax.mechanics.own_units import without_names
from reojax.motion._resolution import (
    Resolution,
    error_by_halving,
    fill_up_half,
    orientations_found,
    over_nodes,
    quietly,
    refine,
    spin_bounds,
    start_count,
    status_by_resolution,
    target_error,
    told_by_resolution,
)
from reojax.motion.trajectory import Trajectory, polynomial
from reojax.optimisation.status import converged_by_status, message_of_status
from reojax.robot import Robot

DEFAULT_SAMPLES = 32
"""Samples of each piece of a trajectory."""
ORDER = 4
"""Of the integration."""


class Release(NamedTuple):
    """How a robot is let go; or, as standard deviations, how surely."""

    momentum: ArrayLike = (0.0, 0.0, 0.0)
    """(3,) angular momentum about the centre of mass at the start, inertial frame [kg m^2/s]."""
    pull: ArrayLike = (0.0, 0.0, 0.0)
    """(3,) force of the wire on the base, constant in the inertial frame [N]."""
    tied: ArrayLike = (0.0, 0.0, 0.0)
    """(3,) where the wire is tied, in the base frame [m]."""
    drag: ArrayLike = 0.0
    """Moment of the wire against the base's turning [N m s/rad]."""


class Released(NamedTuple):
    """A motion after a release."""

    time: Float[Array, " m"]
    """Time [s], from 0."""
    rotation: Float[Array, "m 3 3"]
    """Orientation of the base; the first is the identity."""
    momentum: Float[Array, "m 3"]
    """Angular momentum about the centre of mass, inertial frame [kg m^2/s]."""
    error: Float[Array, ""]
    """Estimate of how far any `rotation` may be wrong by the steps taken, not by the robot's numbers [rad]."""

    value = orientations_found
    """The orientations, under the name that all solvers' results have."""
    status = status_by_resolution
    """Converged where `error` is what steps that are chosen aim at; else out of steps, or not finite."""
    converged = converged_by_status
    """Whether `error` is below 1e-8 rad (1e-4 in float32)."""
    message = message_of_status
    """How it ended, in words."""
    __str__ = told_by_resolution


def released(
    robot: Robot,
    trajectory: Trajectory,
    release: Release | None = None,
    *,
    samples: int = DEFAULT_SAMPLES,
    substeps: int | None = None,
) -> Released:
    """Orientation and momentum of a robot that does a joint motion after a release.

    Args:
        robot: the robot.
        trajectory: its joints' motion, as `along` makes it from a path, a time law and durations.
        release: how it is let go; default perfectly.
        samples: samples of each piece of the trajectory, static.
        substeps: integration steps from one sample to the next, static, of fourth order. Default as many as bring
            `Released.error` below 1e-8 rad (1e-4 in float32), by how far the robot turns, and is braked, in a step; one
            where numbers are traced.

    Raises:
        ValueError: if anything does not fit the robot, or is not finite, or if the robot spins, or the wire brakes it,
            too fast for any number to come out.

    Warns:
        UserWarning: if the orientation is uncertain by more than 1e-3 rad with all the steps that are taken unasked.
    """
    given = check_release(robot, trajectory, Release() if release is None else release)
    samples = checks.whole("samples", samples)

    plain = without_names(given[0])

    def run(count: int) -> tuple[Released, Resolution]:
        return _simulate_release(plain, *given[1:], samples, count)

    if substeps is not None:
        return quietly(run, checks.whole("substeps", substeps))[0]
    if not is_concrete(given):
        return run(1)[0]
    least, most = turn_bounds(*given)
    return refine(
        run,
        first=start_count(1, 1, most / samples),
        hopeless=least / samples,
        steps=trajectory.pieces * samples,
        order=ORDER,
        target=target_error(given[2].dtype),
        what=f"{robot.name!r} after this release",
    )


def turn_bounds(robot: Robot, trajectory: Trajectory, release: Array) -> tuple[float, float]:
    """Bounds of the turn by the momentum at the start, and by the wire's braking, in the longest piece [rad]."""
    longest = float(np.diff(np.asarray(trajectory.breaks, float)).max())
    numbers = np.asarray(release, float)
    spin, drag = (spin_bounds(robot, part, longest) for part in (numbers[:3], numbers[9:]))
    return max(spin[0], drag[0]), spin[1] + drag[1]


def check_release(robot: Robot, trajectory: Trajectory, release: Release) -> tuple[Robot, Trajectory, Array]:
    """Everything as arrays of one dtype, the release as one vector of ten."""
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    if not isinstance(trajectory, Trajectory):
        raise ValueError(f"`trajectory` is a {type(trajectory).__name__}; it must be a Trajectory, as `along` makes.")
    if trajectory.joints != robot.joints:
        raise ValueError(f"`trajectory` moves {trajectory.joints} joints; {robot.name!r} has {robot.joints}.")
    if not isinstance(release, Release):
        raise ValueError(f"`release` is a {type(release).__name__}; it must be a Release.")
    numbers = {field: as_numbers(f"release.{field}", value) for field, value in release._asdict().items()}
    for field, value in numbers.items():
        shape = () if field == "drag" else (3,)
        if value.shape != shape:
            raise ValueError(f"release.{field} has shape {value.shape}; it must be {shape}.")
        if is_concrete(value) and not np.isfinite(value).all():
            raise ValueError(f"release.{field} is {np.asarray(value).tolist()}; it must be finite.")
    dtype = common_float(robot, trajectory, *numbers.values())
    vector = jnp.concatenate([jnp.asarray(value, dtype).reshape(-1) for value in numbers.values()])
    robot, trajectory = cast((robot, trajectory), dtype)
    return robot, trajectory, vector


class _Node(NamedTuple):
    """What the base's motion depends on at one time."""

    own: Array
    """(3,) angular velocity without momentum."""
    mobility: Array
    """(3, 3) angular velocity per momentum, both in the base frame."""
    middle: Array
    """(3,) centre of mass of the robot in the base frame [m]."""


@partial(jax.jit, static_argnums=(3, 4))
def _simulate_release(
    robot: Robot, trajectory: Trajectory, release: Array, samples: int, substeps: int
) -> tuple[Released, Resolution]:
    if samples * substeps % 2:  # the error is found by half the steps
        substeps *= 2
    time, length, nodes = nodes_of(robot, trajectory, samples * substeps)
    count = len(length)
    # all steps and half of them, side by side: start, middle and end of each
    double = jax.tree.map(fill_up_half, nodes_of_half(nodes))
    both = jax.tree.map(lambda *pair: jnp.stack(pair), nodes, double)
    integrate = jax.vmap(integrate_release, (0, 0, None))  # one loop, compiled once
    (fine, coarse), (momentum, _) = integrate(jnp.stack([length, fill_up_half(2 * length[::2])]), both, release)
    error = error_by_halving(fine, coarse[: count // 2 + 1], ORDER)
    # bound of the turn in a step: |A^-1 B theta_dot| + |A^-1| (|H| + drag)
    size, mobility = jnp.sqrt((momentum[:-1] ** 2).sum(-1)), jnp.sqrt((nodes.mobility**2).sum((-1, -2)).max(1))
    rate = jnp.sqrt((nodes.own**2).sum(-1).max(1)) + mobility * (jnp.where(jnp.isfinite(size), size, 0) + release[9])
    resolution = Resolution(error, jax.lax.stop_gradient((length * rate).max()))
    return Released(time[::substeps], fine[::substeps], momentum[::substeps], error), resolution


def nodes_of_half(nodes: _Node) -> _Node:
    """The nodes of steps of twice the length, out of those of all steps."""
    return jax.tree.map(lambda x: jnp.stack([x[::2, 0], x[::2, 2], x[1::2, 2]], axis=1), nodes)


def nodes_of(robot: Robot, trajectory: Trajectory, steps: int) -> tuple[Array, Array, _Node]:
    """Times, lengths of all steps, and what counts at the start, the middle and the end of each."""
    dtype = trajectory.breaks.dtype
    # start, middle and end of every step (p, s, 3)
    piece = jnp.diff(trajectory.breaks)
    share = (jnp.arange(steps, dtype=dtype)[:, None] + jnp.array([0, 0.5, 1], dtype)[None]) / steps
    within = share[None] * piece[:, None, None]
    state = jax.vmap(jax.vmap(jax.vmap(polynomial, (None, 0)), (None, 0)))(trajectory.coefficients, within)

    def node(theta: Array, theta_dot: Array) -> _Node:
        # A^-1 B theta_dot, A^-1, and where the base's centre lies from the robot's
        pose = kinematics(robot, theta)
        return _Node(*velocity_by_momentum(robot, pose, theta_dot), robot.com[0] - pose.com[0])

    nodes = over_nodes(node, *(leaf.reshape(within.size, robot.joints) for leaf in (state.theta, state.theta_dot)))
    count = trajectory.pieces * steps
    length = jnp.repeat(piece / steps, steps)
    time = jnp.append((trajectory.breaks[:-1, None] + within[:, :, 0]).ravel(), trajectory.breaks[-1])
    return time, length, jax.tree.map(lambda leaf: leaf.reshape(count, 3, *leaf.shape[1:]), nodes)


def integrate_release(length: Array, nodes: _Node, release: Array) -> tuple[Array, Array]:
    """Rotations (m, 3, 3) and momenta (m, 3): Runge-Kutta of order four on the rotation vector of each step."""
    momentum, pull, tied, drag = release[:3], release[3:6], release[6:9], release[9]

    def rates(rotation: Array, momentum: Array, node: _Node) -> tuple[Array, Array]:
        # omega = A^-1 (B theta_dot + R^T H);  H' = (R r) x F - c R omega
        omega = node.own + node.mobility @ (rotation.T @ momentum)
        return omega, jnp.cross(rotation @ (tied - node.middle), pull) - drag * (rotation @ omega)

    def step(state: tuple[Array, Array], inputs: tuple[Array, _Node]) -> tuple[tuple[Array, Array], tuple]:
        h, node = inputs
        end = runge_kutta_step(RK4, rates, h, *state, node)
        return end, end

    first = jnp.eye(3, dtype=momentum.dtype)
    _, (rotations, momenta) = jax.lax.scan(step, (first, momentum), (length, nodes))
    return jnp.concatenate([first[None], rotations]), jnp.concatenate([momentum[None], momenta])

"""How far an uncertain release spreads the net rotation: by derivatives, and by draws."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal import checks
from reojax._internal.arrays import Array, is_concrete
from reojax.mechanics.own_units import without_names
from reojax.motion._resolution import MOST, TURN, error_by_halving, start_count
from reojax.motion.release import ORDER, Release, check_release, integrate_release, nodes_of, nodes_of_half, turn_bounds
from reojax.motion.trajectory import Trajectory
from reojax.robot import Robot

DEFAULT_STEPS = 32
"""Steps of each piece of a trajectory."""


class ReleaseSpread(NamedTuple):
    """Net rotation after an uncertain release."""

    rotation: Float[Array, "3 3"]
    """Net rotation after the expected release."""
    sensitivity: Float[Array, "3 10"]
    """Derivative of the error `log(rotation^T R)` by momentum (3), pull (3), tied (3) and drag, in that order."""
    covariance: Float[Array, "3 3"]
    """Covariance of that error by the linear rule [rad^2]."""
    angle_rms: Float[Array, ""]
    """Root mean square of its angle by the linear rule [rad]."""
    drawn: Float[Array, "n 3"]
    """Errors of releases drawn at random [rad]."""
    drawn_covariance: Float[Array, "3 3"]
    """Their mean square products, about the expected release [rad^2]."""
    drawn_angle_rms: Float[Array, ""]
    """Root mean square of their angles [rad]."""
    error: Float[Array, ""]
    """Estimate of how far `rotation`, or the end of any draw, may be wrong by the steps taken [rad]."""


def release_spread(
    robot: Robot,
    trajectory: Trajectory,
    deviation: Release,
    key: jax.Array,
    *,
    expected: Release | None = None,
    draws: int = 256,
    steps: int | None = None,
) -> ReleaseSpread:
    """Net rotation and how far an uncertain release spreads it, by derivatives and by draws.

    All numbers of the release are taken as independent and normal.

    Args:
        robot: the robot.
        trajectory: its joints' motion.
        deviation: standard deviations of the numbers of the release.
        key: a key of `jax.random`, for the draws.
        expected: the release that is aimed at; default a perfect one.
        draws: number of draws, static.
        steps: steps of each piece of the trajectory, static; fourth order. Default 32, or more where the robot may
            turn, or be braked, by more than 0.1 rad in one (by three standard deviations).

    Raises:
        ValueError: if anything does not fit the robot, is not finite, or a deviation is negative, or the motion is too
            fast for the steps.
    """
    checks.whole("draws", draws)
    checks.key("key", key)
    if steps is not None:
        checks.whole("steps", steps)
    aim = Release() if expected is None else expected
    robot, trajectory, mean = check_release(robot, trajectory, aim)
    *_, spread = check_release(robot, trajectory, deviation)
    if is_concrete(spread) and (np.asarray(spread) < 0).any():
        raise ValueError(f"`deviation` is {checks.shorten(deviation)}; standard deviations must not be negative.")
    if steps is None:
        steps = DEFAULT_STEPS
        if is_concrete((robot, trajectory, mean, spread)):
            _, turn = turn_bounds(robot, trajectory, jnp.abs(mean) + 3 * spread)
            steps *= start_count(1, 1, 2 * turn / DEFAULT_STEPS)
            if trajectory.pieces * steps > MOST // 4:
                raise ValueError(
                    f"after this release {robot.name!r} turns, or is braked, by up to {turn:.3g} rad in a piece of the "
                    f"trajectory: more than {MOST // 4} steps of {TURN} rad would be taken. Give `steps` to take them."
                )
    found = _spread(without_names(robot), trajectory, mean, spread, key, int(draws), int(steps))
    if is_concrete(found) and not all(np.isfinite(leaf).all() for leaf in found):
        raise ValueError(f"after this release {robot.name!r} turns, or is braked, too fast for {steps} steps a piece.")
    return found


@partial(jax.jit, static_argnums=(5, 6))
def _spread(
    robot: Robot, trajectory: Trajectory, mean: Array, deviation: Array, key: jax.Array, draws: int, steps: int
) -> ReleaseSpread:
    steps *= 1 + steps % 2  # the error is found by half the steps
    _, length, nodes = nodes_of(robot, trajectory, steps)
    double = nodes_of_half(nodes)

    def end(release: Array) -> Array:
        return integrate_release(length, nodes, release)[0][-1]

    def rough_end(release: Array) -> Array:
        return integrate_release(2 * length[::2], double, release)[0][-1]

    # one program for everything: the expected release by each of its numbers, and the draws by none
    random = deviation[None] * jax.random.normal(key, (draws, mean.size), mean.dtype)
    along = jnp.concatenate([jnp.eye(mean.size, dtype=mean.dtype), jnp.zeros_like(random)])
    start = mean[None] + jnp.concatenate([jnp.zeros((mean.size, mean.size), mean.dtype), random])
    ends, slopes = jax.vmap(lambda release, by: jax.jvp(end, (release,), (by,)))(start, along)
    places = np.array([0, *range(mean.size, len(start))])
    error = error_by_halving(jnp.repeat(ends[places], 2, axis=0)[:-1], jax.vmap(rough_end)(start[places]), ORDER)
    # first order: J, and J diag(deviation^2) J^T
    rotation = ends[0]
    back = partial(jnp.matmul, rotation.T, precision="highest")
    sensitivity = jax.vmap(lambda slope: so3.vee(back(slope)))(slopes[: mean.size]).T
    scaled = sensitivity * deviation[None]
    covariance = jnp.matmul(scaled, scaled.T, precision="highest")
    # by draws, with nothing linear about it
    drawn = jax.vmap(lambda turned: so3.log(back(turned)))(ends[mean.size :])
    return ReleaseSpread(
        rotation=rotation,
        sensitivity=sensitivity,
        covariance=covariance,
        angle_rms=jnp.sqrt(jnp.trace(covariance)),
        drawn=drawn,
        drawn_covariance=jnp.matmul(drawn.T, drawn, precision="highest") / draws,
        drawn_angle_rms=jnp.sqrt((drawn**2).sum(axis=1).mean()),
        error=error,
    )

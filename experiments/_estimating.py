"""Where the base is, and what the robot is, from orientations measured at stops: the estimate that feedback needs.

A reading of the orientation is noisy, and a prediction of it is as wrong as the robot's numbers. Both are known in
size, so the most probable numbers follow from all readings together (least squares with a prior, Gauss-Newton steps):
with z the errors of the numbers in standard deviations, R_k(z) the orientation predicted at stop k and M_k the one
measured there, `|z|^2 + sum_k |log(R_k(z)^T M_k)|^2 / noise_k^2` is made least. The orientation at a stop is then
that of the corrected robot, R_k(z): early readings sharpen it, as every turn depends on the same numbers.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from reojax import so3
from reojax._arrays import Array, as_numbers, common_float, is_concrete
from reojax._smallmat import solve_positive
from reojax.holonomy import DEFAULT_STEPS, net_rotation
from reojax.path import Path
from reojax.robot import Robot

_GAUSS_NEWTON = 5
"""Most steps."""
_SMALL = 1e-6
"""Gain of the last step, relative to 1, that counts as the end."""


class Estimate(NamedTuple):
    """The most probable robot and orientations, and how well they are known."""

    robot: Robot
    """The robot with the most probable numbers."""
    errors: Float[Array, " n"]
    """Errors of the numbers, in their standard deviations before any reading."""
    covariance: Float[Array, "n n"]
    """Of `errors`; without a reading the identity."""
    orientation: Float[Array, "k 3 3"]
    """Base at each stop, its components to inertial ones; also at stops where nothing was measured."""
    scatter: Float[Array, "k 3 3"]
    """Covariance of the rotation vector from `orientation` to the true one, base frame [rad^2]."""
    misfit: Float[Array, ""]
    """Sum of squares that was made least. Much larger than 3 for every reading: model or noise are not as said."""
    converged: Bool[Array, ""]
    """Whether the last step gained nothing any more."""


def estimate(
    vary: Callable[[Array], Robot],
    count: int,
    legs: Float[Array, "k v j"] | ArrayLike,
    measured: Float[Array, "k 3 3"] | ArrayLike,
    *,
    noise: ArrayLike,
    start: ArrayLike | None = None,
    steps: int = DEFAULT_STEPS,
) -> Estimate:
    """Estimate a robot's numbers and its orientation from readings at stops (thesis 1.9: feedback between manoeuvres).

    Args:
        vary: the robot whose numbers are off by `z` (n,) standard deviations, independent of each other; for
            inertias known to 10 %: `lambda z: robot.replace(inertia=robot.inertia * exp(0.1 * z)[:, None, None])`.
        count: n, how many numbers.
        legs: corners of the joint path from each stop to the next, closed or not; pad short ones by repeating
            their last corner, which costs nothing in accuracy.
        measured: orientation at the end of each leg, base components to inertial ones.
        noise: standard deviation of a reading about each axis [rad], one number or (k,); infinite where nothing was
            measured. n readings at one stop are one of their mean, with noise / sqrt(n).
        start: (3, 3) orientation at the start, which is taken as known; default the identity.
        steps: steps per edge of `net_rotation`.

    Returns:
        The estimate. Pure: works under jit, and vmap over legs and readings of many runs.

    Raises:
        ValueError: for shapes that do not fit each other, or a noise that is not positive.
    """
    legs, measured = as_numbers("legs", legs), as_numbers("measured", measured)
    start = np.eye(3) if start is None else as_numbers("start", start)
    noise = _checked(count, legs, measured, noise, start)
    dtype = common_float(legs, measured)
    legs, measured, start = (jnp.asarray(array, dtype) for array in (legs, measured, start))
    weight = 1 / jnp.broadcast_to(jnp.asarray(noise, dtype), legs.shape[:1])

    def predicted(z: Array) -> jax.Array:
        robot = vary(z)
        turns = jax.vmap(lambda corners: net_rotation(robot, Path(corners), steps=steps))(legs)

        def follow(before: jax.Array, turn: jax.Array) -> tuple[jax.Array, jax.Array]:
            after = jnp.matmul(before, turn, precision="highest")
            return after, after

        return jax.lax.scan(follow, start, jnp.asarray(turns))[1]

    def residual(z: Array) -> tuple[jax.Array, jax.Array]:
        misses = jax.vmap(lambda r, m: so3.log(r.T @ m))(predicted(z), measured)
        value = jnp.concatenate([(weight[:, None] * misses).reshape(-1), z])
        return value, value

    slopes_of = jax.jacfwd(residual, has_aux=True)

    def step(state: Any, _: None) -> tuple[Any, None]:
        z, jacobian, value, damping, _ = state
        normal, slope = jacobian.T @ jacobian, jacobian.T @ value
        tried = z - solve_positive(normal + damping * jnp.eye(count, dtype=dtype), slope)
        tried_jacobian, tried_value = slopes_of(tried)
        gain = value @ value - tried_value @ tried_value
        better = gain >= 0
        state = jax.tree.map(
            lambda a, b: jnp.where(better, a, b), (tried, tried_jacobian, tried_value), (z, jacobian, value)
        )
        damping = jnp.where(better, 0.1 * damping, jnp.maximum(10 * damping, 1.0))
        return (*state, damping, jnp.abs(gain)), None

    z = jnp.zeros(count, dtype)
    zero = jnp.zeros((), dtype)
    state, _ = jax.lax.scan(step, (z, *slopes_of(z), zero, zero), None, length=_GAUSS_NEWTON)
    z, jacobian, value, _, gain = state
    covariance = solve_positive(jacobian.T @ jacobian, jnp.eye(count, dtype=dtype))
    orientation, effect = _turned(predicted, z)
    scatter = jnp.einsum("kin,nm,kjm->kij", effect, covariance, effect, precision="highest")
    misfit = value @ value
    return Estimate(vary(z), z, covariance, orientation, scatter, misfit, gain <= _SMALL * (1 + misfit))


def _turned(predicted: Callable[[Array], jax.Array], z: Array) -> tuple[jax.Array, jax.Array]:
    """Orientations, and the rotation vectors (k, 3, n) in the base frame by which z turns them."""

    def flat(z: Array) -> tuple[jax.Array, jax.Array]:
        rotations = predicted(z)
        return rotations, rotations

    slopes, rotations = jax.jacfwd(flat, has_aux=True)(z)
    spin = jnp.einsum("kai,kajn->kijn", rotations, slopes, precision="highest")
    lower = jnp.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    upper = jnp.stack([spin[:, 1, 2], spin[:, 2, 0], spin[:, 0, 1]], axis=1)
    return rotations, 0.5 * (lower - upper)


def _checked(count: Any, legs: Array, measured: Array, noise: ArrayLike, start: Array) -> Array:
    """Noise as numbers, once everything fits together."""
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
        raise ValueError(f"`count` is {count!r}; it must be a positive integer.")
    if legs.ndim != 3 or not legs.shape[0] or not legs.shape[1]:
        raise ValueError(f"`legs` has shape {legs.shape}; it must be (k, v, j), with at least one leg and corner.")
    if measured.shape != (legs.shape[0], 3, 3):
        raise ValueError(f"`measured` has shape {measured.shape}; for these legs it must be ({legs.shape[0]}, 3, 3).")
    if start.shape != (3, 3):
        raise ValueError(f"`start` has shape {start.shape}; it must be (3, 3).")
    for entry, array in (("legs", legs), ("measured", measured), ("start", start)):
        if is_concrete(array) and not np.isfinite(array).all():
            raise ValueError(f"`{entry}` has an entry that is not finite.")
    noise = as_numbers("noise", noise)
    if noise.shape not in ((), (legs.shape[0],)):
        raise ValueError(f"`noise` has shape {noise.shape}; it must be one number or ({legs.shape[0]},).")
    if is_concrete(noise) and not (np.asarray(noise) > 0).all():
        raise ValueError(f"`noise` is {noise}; it must be positive (infinite where nothing was measured).")
    return noise

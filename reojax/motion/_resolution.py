"""How fine a motion must be integrated: by what half the steps make of it, and by how far it turns in a step.

The estimate of the error compares orientations of a run with those of one of half the steps, whose nodes are among its
own. In the asymptotic regime of a method of order p the error is `1 / (2^p - 1)` of the difference; `SAFETY` times that
is told, and `SAFETY` times the difference itself where it is too large for that regime.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from reojax import so3
from reojax._internal.arrays import Array
from reojax._internal.result_text import printed_as
from reojax.optimisation.status import Status
from reojax.robot import Robot

SAFETY = 4.0
"""By how much the estimate is above the asymptotic one."""
_ASYMPTOTIC = 0.01
"""Difference below which the regime counts as asymptotic [rad]."""
TURN = 0.1
"""Turn in a step that a first guess allows [rad]."""
MOST = 2**16
"""Steps of a whole motion that are taken without being asked for."""
_AT_ONCE = 2**14
"""Nodes that are evaluated at once; more would fill the memory."""
_HOPELESS = 2.0
"""Turn in the shortest step from which on nothing is tried [rad]."""
_TOLD = 1e-3
"""Error from which a motion is told to be unresolved [rad]."""


class Resolution(NamedTuple):
    """How well a motion is resolved."""

    error: Float[Array, ""]
    """Estimate of the largest error of an orientation [rad]."""
    turn: Float[Array, ""]
    """Bound of the turn in a step [rad]."""


def target_error(dtype: np.dtype) -> float:
    """Error of an orientation that is aimed at [rad]."""
    return 1e-8 if dtype == np.float64 else 1e-4


@property
def orientations_found(motion: Any) -> Float[Array, "m 3 3"]:
    """The orientations: a property for classes of integrated motions, which have `rotation`."""
    return motion.rotation


@property
def status_by_resolution(motion: Any) -> Int[Array, ""]:
    """Out of steps where `motion.error` is more than is aimed at: a property for classes of integrated motions."""
    error, rotation = motion.error, motion.rotation
    if error is None:
        raise ValueError("this motion has no `error`: nothing is known of its accuracy.")
    fine = jnp.where(error <= target_error(np.dtype(rotation.dtype)), Status.CONVERGED, Status.OUT_OF_STEPS)
    return jnp.where(jnp.isfinite(rotation).all() & ~jnp.isnan(error), fine, Status.NOT_FINITE)


def _one_line(motion: Any) -> str:
    span = f"{len(motion.time)} samples over {float(motion.time[-1]):.6g} s"
    if motion.error is None:
        return f"{span}; nothing is known of its accuracy"
    turn = float(so3.angle(jnp.asarray(motion.rotation[-1])))
    return f"{span}, turned by {turn:.6g} rad in the end, within {float(motion.error):.1e} rad; {motion.message}"


told_by_resolution: Any = printed_as(_one_line, "time")
"""`__str__` for classes of integrated motions."""


def error_by_halving(fine: Float[Array, "s+1 3 3"], coarse: Float[Array, "s/2+1 3 3"], order: int) -> Float[Array, ""]:
    """Estimate of the largest error of the rotations `fine` by those of half the steps [rad].

    NaN where `fine` has a number that is none, infinite where only `coarse` has.
    """
    apart = jax.vmap(lambda a, b: so3.angle(jnp.matmul(a.T, b, precision="highest")))(fine[::2], coarse)
    # 1 / (2^p - 1) of the difference in the asymptotic regime, all of it beyond; and a margin
    most = apart.max()
    factor = jnp.where(most < _ASYMPTOTIC, SAFETY / (2**order - 1), SAFETY)
    error = jnp.where(jnp.isfinite(coarse).all(), jnp.minimum(factor * most, np.pi), jnp.inf)
    return jax.lax.stop_gradient(jnp.where(jnp.isfinite(fine).all(), error, jnp.nan))


def fill_up_half(values: Float[Array, "h ..."]) -> Float[Array, "2*h ..."]:
    """Values of half the steps, filled up with steps of no length: one loop runs these and all steps side by side."""
    return jnp.concatenate([values, jnp.zeros_like(values)])


def over_nodes(function: Callable[..., Any], *arrays: Array) -> Any:
    """`jax.vmap(function)(*arrays)`, so many nodes at a time that memory stays flat."""
    count = arrays[0].shape[0]
    if count <= _AT_ONCE:
        return jax.vmap(function)(*arrays)
    blocks = -(-count // _AT_ONCE)
    filled = (jnp.concatenate([x, jnp.repeat(x[-1:], blocks * _AT_ONCE - count, axis=0)]) for x in arrays)
    parts = tuple(x.reshape(blocks, _AT_ONCE, *x.shape[1:]) for x in filled)
    found = jax.lax.map(lambda block: jax.vmap(function)(*block), parts)
    return jax.tree.map(lambda x: x.reshape(blocks * _AT_ONCE, *x.shape[2:])[:count], found)


def refine(
    run: Callable[[int], tuple[Any, Resolution]],
    *,
    first: int,
    steps: int,
    order: int,
    target: float,
    hopeless: float,
    what: str,
) -> Any:
    """Run with more and more substeps until the error is small enough; return the last result.

    Args:
        run: gives the result and its resolution for a number of substeps.
        first: substeps to begin with.
        steps: steps of the whole motion with one substep.
        order: of the method.
        target: error that is small enough [rad].
        hopeless: turn in one of those steps that there is at least [rad].
        what: what is run, for messages.

    Raises:
        ValueError: if it would take more than `MOST` steps to keep numbers finite.
    """
    limit = max(1, MOST // steps)
    count = min(first, limit)
    if hopeless / limit > _HOPELESS:
        raise ValueError(
            f"{what} turns, or is braked, too fast to be resolved: with {limit * steps} steps a step still has "
            f"{hopeless / limit:.3g} rad. Run it in a shorter time, or with less momentum or drag."
        )
    while True:
        result, resolution = quietly(run, count)
        error, turn = float(resolution.error), float(resolution.turn)
        if error <= target:
            return result
        if count >= limit:
            break
        # how many times as many steps: by the turn in one, else by the error's order
        by_turn = turn / TURN if np.isfinite(turn) else limit
        by_error = (error / target) ** (1 / order) if np.isfinite(error) and by_turn < 4 else 1.0
        more = 2 ** int(np.ceil(np.log2(min(max(by_turn, by_error, 2.0), limit))))
        count = min(count * more, limit)
    if np.isnan(error):
        raise ValueError(
            f"{what} turns, or is braked, too fast to be resolved: with {count * steps} steps a step still has "
            f"{turn:.3g} rad, and no number comes out. Run it in a shorter time, or with less momentum or drag."
        )
    if error > _TOLD:
        warnings.warn(
            f"{what} turns too fast to be resolved: with {count * steps} steps its orientation is uncertain by about "
            f"{error:.1g} rad (`error`); run it in a shorter time, with less momentum, or with more `substeps`.",
            stacklevel=3,
        )
    return result


def quietly(run: Callable[[int], tuple[Any, Resolution]], count: int) -> tuple[Any, Resolution]:
    """Run without JAX's own complaints: what is not resolved is told by `Resolution`."""
    with jax.debug_nans(False), jax.debug_infs(False):
        return run(count)


def start_count(least: int, samples: int, turn: float) -> int:
    """Substeps to begin with: `least` steps of a piece at least, and no turn in a step beyond twice `TURN`."""
    wanted = max(least / samples, turn / (2 * TURN), 1.0)
    return 2 ** int(np.ceil(np.log2(min(wanted, 2.0**20)) - 1e-9))


def spin_bounds(robot: Robot, spin: Array, duration: float) -> tuple[float, float]:
    """Bounds of the turn that an angular momentum (or a drag) makes in a time [rad], whatever the joints do.

    The whole robot's moments of inertia are at least the sum of the links' least ones about their centres of mass, and
    at most what they would be with all links stretched out.
    """
    moments = np.linalg.eigvalsh(np.asarray(robot.inertia, float))
    least = moments[:, 0].clip(0).sum()
    # stretched out, no mass lies farther from the robot's centre than all anchors and a centre of mass in a row
    anchor, com = (np.linalg.norm(np.asarray(x, float), axis=1) for x in (robot.anchor, robot.com))
    most = moments[:, 2].sum() + float(np.asarray(robot.mass).sum()) * (anchor.sum() + com.max()) ** 2
    most += float((np.asarray(robot.rotor_inertia) * np.abs(np.asarray(robot.gear_ratio))).sum())
    size = float(np.linalg.norm(np.asarray(spin, float))) * duration
    return size / most if most > 0 else 0.0, size / least if least > 0 else 0.0

"""First-order descent in a box: Adam (optax), for costs with kinks, and for many variables without constraints."""

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax.optimisation.arguments import check_starts, check_tolerances
from reojax.optimisation.optimise import Solution
from reojax.optimisation.status import Status


def descend(
    cost: Callable[..., Any],
    starts: ArrayLike,
    *,
    lower: ArrayLike,
    upper: ArrayLike,
    data: Any = None,
    steps: int = 500,
    rate: float = 0.02,
    slope_tolerance: float = 1e-3,
) -> Solution:
    """Minimise `cost(x)` within bounds from every start by Adam, projected onto the box; no constraints.

    Steps are `rate` of each variable's range at first and fall to a thousandth of that along a cosine. The best point
    that each start has met is kept, so a cost that is not finite somewhere, or has kinks, does no harm. Where the
    cost is smooth `optimise` needs far fewer steps, and it meets constraints; this makes starts for it.

    Args:
        cost: as for `optimise`, and so are `starts`, `lower`, `upper` and `data`.
        starts: (n,) or (m, n).
        lower: number or (n,).
        upper: number or (n,).
        data: pytree with the starts in front, or None.
        steps: number of steps.
        rate: first step, as a fraction of each range.
        slope_tolerance: slope, as `Solution.slope`, within which a start counts as converged.

    Raises:
        ValueError: as `optimise`.
    """
    checks.function("cost", cost, *(("x",) if data is None else ("x", "data")))
    x, box = check_starts(starts, lower, upper, None, data)
    checks.whole("steps", steps)
    check_tolerances(rate=rate, slope_tolerance=slope_tolerance)
    data = jax.tree.map(jnp.asarray, data)
    bounds = tuple(np.asarray(part, x.dtype) for part in box)
    best, least, slope = (np.asarray(a) for a in _descend(cost, int(steps), float(rate), data is None, x, data, bounds))
    finite = np.isfinite(least)
    converged = finite & (slope <= slope_tolerance)
    return Solution(
        value=np.clip(best, box.lower, box.upper),
        cost=least,
        residual=np.where(finite, 0.0, np.inf),
        slope=slope,
        steps=np.full(len(best), steps),
        converged=converged,
        best=int(np.argmin(least)),
        status=np.where(converged, Status.CONVERGED, np.where(finite, Status.OUT_OF_STEPS, Status.NOT_FINITE)),
    )


@partial(jax.jit, static_argnums=(0, 1, 2, 3))
def _descend(
    cost: Callable[..., Any],
    steps: int,
    rate: float,
    alone: bool,
    x: Array,
    data: Any,
    bounds: tuple[Array, Array, Array],
) -> tuple[Array, Array, Array]:
    import optax

    size = jnp.asarray(bounds[2])
    low, high = bounds[0] / size[None], bounds[1] / size[None]
    optimiser = optax.adam(optax.cosine_decay_schedule(rate, steps, alpha=1e-3))

    def one(start: Array, low: Array, high: Array, data: Any) -> tuple[Array, Array, Array]:
        value = jax.value_and_grad(
            lambda x: jnp.asarray(cost(x * size) if alone else cost(x * size, data), start.dtype)
        )

        def step(carry: Any, _: None) -> tuple[Any, None]:
            x, memory, best, least, slope, first = carry
            # value and gradient; a gradient that is not finite does not count
            now, gradient = value(x)
            gradient = jnp.where(jnp.isfinite(gradient), gradient, 0.0)
            first = jnp.where(first > 0, first, jnp.abs(gradient).max())
            # stationarity: how far a gradient step would go within the box, by the first gradient's size
            inside = jnp.clip(x - gradient / jnp.where(first > 0, first, 1.0), low, high)
            pressed = jnp.abs(x - inside).max()
            # the best point so far
            better = now < least
            best = jnp.where(better, x, best)
            least, slope = jnp.where(better, now, least), jnp.where(better, pressed, slope)
            # Adam's step, projected onto the box
            change, memory = optimiser.update(gradient, memory)
            return (jnp.clip(x + change, low, high), memory, best, least, slope, first), None

        worst = jnp.asarray(jnp.inf, start.dtype)
        first = (start, optimiser.init(start), start, worst, worst, jnp.zeros((), start.dtype))
        (_, _, best, least, slope, _), _ = jax.lax.scan(step, first, None, length=steps + 1)
        return best * size, least, slope

    return jax.vmap(one)(x / size[None], low, high, data)

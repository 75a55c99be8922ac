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
from reojax.optimisation.optimise import Solution, check_starts


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
    x, bounds = check_starts(starts, lower, upper, None, data)
    checks.whole("steps", steps)
    for entry, number in (("rate", rate), ("slope_tolerance", slope_tolerance)):
        if not np.isfinite(number) or number <= 0:
            raise ValueError(f"`{entry}` is {number!r}; it must be a positive number.")
    data = jax.tree.map(jnp.asarray, data)
    best, least, slope = (np.asarray(a) for a in _descend(cost, int(steps), float(rate), data is None, x, data, bounds))
    finite = np.isfinite(least)
    return Solution(
        value=np.clip(best, bounds["lower"], bounds["upper"]),
        cost=least,
        residual=np.where(finite, 0.0, np.inf),
        slope=slope,
        steps=np.full(len(best), steps),
        converged=finite & (slope <= slope_tolerance),
        best=int(np.argmin(least)),
    )


@partial(jax.jit, static_argnums=(0, 1, 2, 3))
def _descend(
    cost: Callable[..., Any], steps: int, rate: float, alone: bool, x: Array, data: Any, bounds: dict[str, Array]
) -> tuple[Array, Array, Array]:
    import optax

    size = jnp.asarray(bounds["size"])
    low, high = bounds["lower"] / size, bounds["upper"] / size
    optimiser = optax.adam(optax.cosine_decay_schedule(rate, steps, alpha=1e-3))

    def one(start: Array, data: Any) -> tuple[Array, Array, Array]:
        value = jax.value_and_grad(
            lambda x: jnp.asarray(cost(x * size) if alone else cost(x * size, data), start.dtype)
        )

        def step(carry: Any, _: None) -> tuple[Any, None]:
            x, memory, best, least, slope, first = carry
            now, gradient = value(x)
            gradient = jnp.where(jnp.isfinite(gradient), gradient, 0.0)
            first = jnp.where(first > 0, first, jnp.abs(gradient).max())
            better = now < least
            pressed = jnp.abs(x - jnp.clip(x - gradient / jnp.where(first > 0, first, 1.0), low, high)).max()
            best, least, slope = (jnp.where(better, a, b) for a, b in ((x, best), (now, least), (pressed, slope)))
            change, memory = optimiser.update(gradient, memory)
            return (jnp.clip(x + change, low, high), memory, best, least, slope, first), None

        worst = jnp.asarray(jnp.inf, start.dtype)
        begin = (start, optimiser.init(start), start, worst, worst, jnp.zeros((), start.dtype))
        (_, _, best, least, slope, _), _ = jax.lax.scan(step, begin, None, length=steps + 1)
        return best * size, least, slope

    return jax.vmap(one)(x / size[None], data)

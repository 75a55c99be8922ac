"""Rows of a system that is a JAX function of one loop."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import numpy as np

from ._measure import CORES, compiled, measure
from ._rows import Row, row
from ._task import Loops, Task, objective


def rows(
    task: Task,
    system: str,
    rotation: Callable[[Loops], jax.Array],
    *,
    loops: int,
    steps: int | str,
    evaluations: float | None = None,
    dtype: Any = np.float64,
    forward: bool = False,
    variables: Sequence[str] = Loops._fields,
    note: str = "",
) -> Iterator[Row]:
    """Rows of the value, and of value and gradient.

    Args:
        task: what is asked.
        system: its name.
        rotation: the net rotation (3, 3) after one loop.
        loops: how many of them in one call.
        steps: of the rows.
        evaluations: of the rows.
        dtype: of the loops.
        forward: differentiate in forward mode; default in reverse mode.
        variables: what to differentiate with respect to.
        note: of the rows.
    """
    batch = Loops(*(field.astype(dtype) for field in task.loops.first(loops)))

    def number(moving: list[jax.Array], loop: Loops) -> jax.Array:
        return objective(rotation(loop._replace(**dict(zip(variables, moving, strict=True)))))

    def value_and_columns(moving: list[jax.Array], loop: Loops) -> tuple[jax.Array, list[jax.Array]]:
        slope, value = jax.jacfwd(lambda moving: (number(moving, loop),) * 2, has_aux=True)(moving)
        return value, slope

    def value_and_gradient(loop: Loops) -> tuple[jax.Array, list[jax.Array]]:
        both = value_and_columns if forward else jax.value_and_grad(number)
        return both([getattr(loop, name) for name in variables], loop)

    value, value_compile = compiled(jax.vmap(rotation), batch)
    gradient, gradient_compile = compiled(jax.vmap(value_and_gradient), batch)
    timed = measure([lambda: value(batch), lambda: gradient(batch)], task.seconds)
    shared = dict(loops=loops, threads=CORES, steps=steps, evaluations=evaluations, note=note)
    error = task.error(np.asarray(value(batch))[: task.checked])
    yield row(system, "value", timed[0], error=error, compile=value_compile, **shared)
    slopes = np.stack([np.asarray(slope, float) for slope in gradient(batch)[1]], axis=1)[: task.checked]
    yield row(
        system,
        f"value and gradient, {len(variables)} variables",
        timed[1],
        error=error,
        gradient_error=task.gradient_error(slopes, variables),
        compile=gradient_compile,
        value=timed[0],
        **shared,
    )

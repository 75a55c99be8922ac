"""Rows of a system that is a JAX function."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import numpy as np

from ._measure import CORES, compiled, measure
from ._rows import GRADIENT, Row, row
from ._task import Loops, Task, objective

Rotations = Callable[[Loops], jax.Array]
"""From loops (n,) to rotations (n, 3, 3)."""
Gradients = Callable[[Loops], tuple[jax.Array, Sequence[jax.Array]]]
"""From loops (n,) to their objectives (n,), and the gradients variable by variable, (n,) each."""


def under_vmap(rotation: Callable[[Loops], jax.Array], *, forward: bool = False) -> tuple[Rotations, Gradients]:
    """Make value and gradient for many loops of the rotation (3, 3) of one; derivative in reverse or forward mode."""

    def number(loop: Loops) -> jax.Array:
        return objective(rotation(loop))

    def by_columns(loop: Loops) -> tuple[jax.Array, Loops]:
        slope, value = jax.jacfwd(lambda loop: (number(loop),) * 2, has_aux=True)(loop)
        return value, slope

    return jax.vmap(rotation), jax.vmap(by_columns if forward else jax.value_and_grad(number))


def rows(
    task: Task,
    system: str,
    rotations: Rotations,
    gradients: Gradients,
    *,
    loops: int,
    steps: int | str,
    evaluations: float | None = None,
    dtype: Any = np.float64,
    variables: Sequence[str] = Loops._fields,
    note: str = "",
    place: Any = None,
) -> Iterator[Row]:
    """Rows of the value, and of value and gradient.

    Args:
        task: what is asked.
        system: its name.
        rotations: the value.
        gradients: the value of the objective and its gradient.
        loops: how many of them in one call.
        steps: of the rows.
        evaluations: of the rows.
        dtype: of the loops.
        variables: what the gradients are by.
        note: of the rows.
        place: device or sharding of the loops.
    """
    batch = jax.device_put(Loops(*(field.astype(dtype) for field in task.loops.first(loops))), place)
    value, value_compile = compiled(rotations, batch)
    gradient, gradient_compile = compiled(gradients, batch)
    timed = measure([lambda: value(batch), lambda: gradient(batch)], task.seconds)
    shared: dict[str, Any] = dict(loops=loops, threads=CORES, steps=steps, evaluations=evaluations, note=note)
    error = task.error(np.asarray(value(batch))[: task.checked])
    yield row(system, "value", timed[0], error=error, compile=value_compile, **shared)
    slopes = np.stack([np.asarray(slope, float) for slope in gradient(batch)[1]], axis=1)[: task.checked]
    yield row(
        system,
        f"{GRADIENT}, {len(variables)} variables",
        timed[1],
        error=error,
        gradient_error=task.gradient_error(slopes, variables),
        compile=gradient_compile,
        value=timed[0],
        **shared,
    )

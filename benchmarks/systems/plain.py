"""The definition, `reojax.mechanics.momentum`, under vmap: what a reader of the equations would write in JAX."""

from collections.abc import Iterator

import reojax

from . import _jax_rows, _magnus
from ._rows import Row
from ._task import Task, robot_of


def rows(task: Task) -> Iterator[Row]:
    """Rows of `reojax.connection` at all nodes, fourth-order Magnus method."""

    def rotation(loop, steps=task.magnus_steps):
        robot = robot_of(loop)
        return _magnus.rotation(lambda theta, rate: reojax.connection(robot, theta) @ rate, loop, steps)

    yield from _jax_rows.rows(
        task,
        "plain equations of reojax.momentum",
        *_jax_rows.under_vmap(rotation),
        loops=64 if task.quick else 256,
        steps=task.magnus_steps,
        evaluations=_magnus.evaluations(task.magnus_steps),
    )

"""reojax, through its public functions under `jax.jit(jax.vmap(...))`, and under `jax.shard_map` on several devices."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec as P

import reojax
from reojax import Robot
from reojax.mechanics._fast.nodes import NODES
from reojax.mechanics.holonomy import DEFAULT_STEPS

from . import _jax_rows
from ._measure import CORES, compiled, fewest, measure
from ._rows import GRADIENT, Row, row
from ._task import TOLERANCE, Task, net_rotation, objective, robot_of


def float64(task: Task) -> Iterator[Row]:
    """Rows in float64."""
    for label, steps in _steps(task).items():
        yield from _four_variables(task, f"reojax float64, {label}", steps, np.float64)
        yield from _every_array(task, f"reojax float64, {label}", steps)
        if CORES > 1 and len(task.loops.twist) % CORES == 0:
            yield from _four_variables(task, f"reojax float64, {label}, a device per core", steps, np.float64, CORES)


def float32(task: Task) -> Iterator[Row]:
    """Rows in float32, with the steps of float64."""
    for label, steps in _steps(task).items():
        yield from _four_variables(task, f"reojax float32, {label}", steps, np.float32)


def _steps(task: Task) -> dict[str, int]:
    """What the tolerance takes, and the default."""
    loops = task.reference.loops

    def error(steps: int) -> float:
        call, _ = compiled(jax.vmap(lambda loop: net_rotation(loop, steps)), loops)
        return task.error(np.asarray(call(loops)))

    return {f"{TOLERANCE:.0e} rad": fewest(error, TOLERANCE), "default": DEFAULT_STEPS}


def _four_variables(task: Task, system: str, steps: int, dtype: type, devices: int = 1) -> Iterator[Row]:
    mesh = Mesh(np.array(jax.devices()[:devices]), ("device",))
    spread = partial(jax.shard_map, mesh=mesh, in_specs=P("device"), out_specs=P("device"), check_vma=False)
    functions = _jax_rows.under_vmap(lambda loop: net_rotation(loop, steps))
    value, gradient = map(spread, functions) if devices > 1 else functions
    yield from _jax_rows.rows(
        task,
        system,
        value,
        gradient,
        loops=len(task.loops.twist),
        steps=steps,
        evaluations=4 * len(NODES) * steps,
        dtype=dtype,
        place=NamedSharding(mesh, P("device")),
    )


def _every_array(task: Task, system: str, steps: int) -> Iterator[Row]:
    """Rows with every array of the robot given loop by loop, and differentiated, with both amplitudes."""
    loops = task.loops
    robots = jax.jit(jax.vmap(lambda loop: jax.tree.map(jnp.asarray, robot_of(loop))))(loops)
    batch = jax.device_put((robots, loops.twist, loops.bend))

    def rotation(robot: Robot, twist: jax.Array, bend: jax.Array) -> Any:
        return reojax.net_rotation(robot, reojax.manoeuvre_a(twist, bend), steps=steps)

    def number(*design) -> jax.Array:
        return objective(rotation(*design))

    value, value_compile = compiled(jax.vmap(rotation), *batch)
    gradient, gradient_compile = compiled(jax.vmap(jax.value_and_grad(number, argnums=(0, 1, 2))), *batch)
    timed = measure([lambda: value(*batch), lambda: gradient(*batch)], task.seconds)
    shared: dict[str, Any] = dict(
        loops=len(loops.twist),
        threads=CORES,
        steps=steps,
        evaluations=4 * len(NODES) * steps,
        error=task.error(np.asarray(value(*batch))[: task.checked]),
    )
    yield row(system, "value, every array given", timed[0], compile=value_compile, **shared)
    by_robot, by_twist, by_bend = gradient(*batch)[1]
    chained = jax.jit(jax.vmap(lambda loop, slope: jax.vjp(robot_of, loop)[1](slope)[0]))(loops, by_robot)
    slopes = np.stack([by_twist, by_bend, chained.inertia, chained.ratio], axis=1)[: task.checked]
    yield row(
        system,
        f"{GRADIENT}, every array",
        timed[1],
        gradient_error=task.gradient_error(slopes),
        compile=gradient_compile,
        value=timed[0],
        **shared,
    )

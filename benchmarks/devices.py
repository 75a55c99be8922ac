"""How fast is a GPU or TPU? The task of `run.py` on every device at hand, and on the processors beside it.

    python benchmarks/devices.py            # some minutes; --quick: fewer sizes

Writes devices.json. The first device of every platform that JAX sees, batches of 1e3 to 1e6 loops, value and gradients,
both dtypes, default steps; times are wall times. Expected: the same results to the last few digits on all devices; on a
GPU, loops that cost less the more there are, until it is full; memory in proportion to the batch there, so that larger
batches go in parts (`reojax.sweeps` does that).
"""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from _command import machine, options, run, say
from systems._jax_rows import under_vmap
from systems._measure import compiled, measure
from systems._task import Loops, Reference, Task, net_rotation, objective, path_of, random_loops, robot_of

import reojax
from reojax.files import check_writable, write_json
from reojax.mechanics.holonomy import DEFAULT_STEPS

VALUE, GRADIENT, ALL = "value", "with gradient, 4 variables", "with gradient, every array"
SIZES = {VALUE: (10**3, 10**4, 10**5, 10**6), GRADIENT: (10**3, 10**4, 10**5), ALL: (10**3, 10**4)}
CHECKED = 512


class Measured(NamedTuple):
    """One function on one device."""

    device: str
    dtype: str
    what: str
    loops: int
    wall: float
    """Per loop, in the median [s]."""
    compile: float
    error: float | None
    """Of values: 95th percentile of the angle from the reference, which the CPU computes [rad]."""
    gradient_error: float | None
    memory: int | None
    """Bytes for intermediate values."""


def main(out: Path, *, quick: bool) -> None:
    """Measure, print and write."""
    result = check_writable(out / "devices.json")
    with jax.default_device(jax.devices("cpu")[0]):
        reference = Reference(random_loops(CHECKED), CHECKED)
        reference.rotation, reference.gradient  # noqa: B018 - computed here, once
    task = Task(reference.loops, CHECKED, quick, 0.2 if quick else 1.0, 0, reference)
    rows: list[Measured] = []
    failed: list[str] = []
    platforms: dict[str, jax.Device] = {}
    for device in (*jax.devices(), *jax.devices("cpu")):
        platforms.setdefault(device.platform, device)
    for device in platforms.values():
        for dtype in (np.float64, np.float32):
            for what, sizes in SIZES.items():
                for size in sizes[: 2 if quick else None]:
                    label = f"{device.device_kind}, {np.dtype(dtype).name}, {what}, {size}"
                    try:
                        rows.append(_measured(task, device, dtype, what, size))
                    except jax.errors.JaxRuntimeError as error:  # most likely out of memory
                        failed.append(f"{label}: {str(error).partition(chr(10))[0]}")
                        say(failed[-1])
                        break
                    say(f"{label}: {rows[-1].wall * 1e9:.4g} ns a loop")
                    about = {"machine": machine(), "steps": DEFAULT_STEPS, "failed": failed}
                    write_json(result, {**about, "rows": [row._asdict() for row in rows]})
    print("\n".join(_table(rows)))
    say(f"wrote {result}")


def _measured(task: Task, device: jax.Device, dtype: type, what: str, size: int) -> Measured:
    loops = Loops(*(field.astype(dtype) for field in random_loops(size)))
    with jax.default_device(device):
        function, arguments = _call(what, jax.device_put(loops, device))
        call, seconds = compiled(function, *arguments)
        [samples] = measure([partial(call, *arguments)], task.seconds)
        found = call(*arguments)
        error = task.error(np.asarray(found[:CHECKED])) if what == VALUE else None
        slopes = None if what == VALUE else found[1]
        if what == ALL:
            by_robot, by_twist, by_bend = jax.tree.map(lambda x: x[:CHECKED], slopes)
            chain = jax.jit(jax.vmap(lambda loop, slope: jax.vjp(robot_of, loop)[1](slope)[0]))
            by_design = chain(loops.first(CHECKED), by_robot)
            slopes = (by_twist, by_bend, by_design.inertia, by_design.ratio)
    columns = None if slopes is None else np.stack([np.asarray(x[:CHECKED], float) for x in slopes], axis=1)
    memory = call.memory_analysis()
    return Measured(
        device=device.device_kind,
        dtype=np.dtype(dtype).name,
        what=what,
        loops=size,
        wall=float(np.median(samples.wall)) / size,
        compile=seconds,
        error=error,
        gradient_error=None if columns is None else task.gradient_error(columns),
        memory=None if memory is None else memory.temp_size_in_bytes,
    )


def _rotation(loop: Loops) -> Any:
    return net_rotation(loop, DEFAULT_STEPS)


def _call(what: str, loops: Loops) -> tuple[Callable, tuple]:
    if what != ALL:
        return under_vmap(_rotation)[what == GRADIENT], (loops,)
    robots = jax.jit(jax.vmap(lambda loop: jax.tree.map(jax.numpy.asarray, robot_of(loop))))(loops)

    def number(robot: reojax.Robot, twist: Any, bend: Any) -> Any:
        path = path_of(Loops(twist, bend, None, None))
        return objective(reojax.net_rotation(robot, path, steps=DEFAULT_STEPS))

    return jax.vmap(jax.value_and_grad(number, argnums=(0, 1, 2))), (robots, loops.twist, loops.bend)


def _table(rows: list[Measured]) -> Iterator[str]:
    yield "| device | dtype | what | loops | ns/loop | loops/s | error | grad. err. | compile s | memory MB |"
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for row in rows:
        cells = (
            *(row.device, row.dtype, row.what, f"{row.loops:_}".replace("_", " "), f"{row.wall * 1e9:.3g}"),
            f"{1 / row.wall:.2g}",
            *("" if x is None else f"{x:.1e}" for x in (row.error, row.gradient_error)),
            *(f"{row.compile:.1f}", "" if row.memory is None else f"{row.memory / 1e6:.3g}"),
        )
        yield f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    run(main, options(__doc__))

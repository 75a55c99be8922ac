"""`sweep`: a function over a grid of designs, chunk by chunk."""

import logging
from collections.abc import Callable, Mapping
from typing import Any

import jax
import numpy as np
from numpy.typing import ArrayLike
from tqdm import tqdm

from reojax.sweep.chunks import Cut, compiled, cut
from reojax.sweep.devices import Devices, mesh_of
from reojax.sweep.engine import Chunk, run
from reojax.sweep.grid import Designs, check_axes, check_function
from reojax.sweep.outputs import Outputs, outputs_of
from reojax.sweep.table import Sweep

log = logging.getLogger("reojax")


def sweep(
    function: Callable[..., Any],
    axes: Mapping[str, ArrayLike],
    *,
    chunk_size: int | None = None,
    devices: Devices = None,
    progress: bool = True,
    units: Mapping[str, str] | None = None,
) -> Sweep:
    """Compute `function` for every design of a grid or a list.

    Args:
        function: takes the named scalars and returns a pytree of arrays; pure, traced by JAX.
        axes: 1-D arrays by name, for the full grid in this order; or `zipped(...)`, for a list of designs.
        chunk_size: designs of a call per device; default by the size of the sweep.
        devices: None for the default device, a number of this host's devices, or a list of devices.
        progress: whether to show progress on stderr.
        units: units of axes and results by name, for labels.

    Raises:
        ValueError: naming what is wrong with the arguments. A design that fails raises nothing: see `Sweep.bad`.
    """
    designs = check_axes(axes)
    check_function(function, designs)
    mesh = mesh_of(devices)
    outputs = outputs_of(function, designs)
    labels = _checked_units(units, designs, outputs)
    sizes = cut(designs.total, chunk_size, outputs.bytes_per_design, mesh.devices.flat[0].platform)
    memory = _Memory(outputs, sizes)
    program = compiled(function, designs, sizes, mesh)
    with tqdm(total=designs.total, unit=" designs", unit_scale=True, disable=not progress) as bar:
        for chunk in run(function, program, outputs, range(sizes.chunks)):
            memory.put(chunk)
            start, stop = sizes.bounds(chunk.number)
            bar.update(stop - start)
    result = Sweep(designs, labels, lambda: memory.results(designs), memory.failures)
    _report(result)
    return result


class _Memory:
    """Results of a sweep in memory."""

    def __init__(self, outputs: Outputs, sizes: Cut) -> None:
        self.outputs, self.sizes = outputs, sizes
        self.arrays = [np.empty((sizes.total, *output.shape), output.dtype) for output in outputs.arrays]
        self.failures: dict[int, str] = {}

    def put(self, chunk: Chunk) -> None:
        start, stop = self.sizes.bounds(chunk.number)
        for array, values in zip(self.arrays, chunk.results, strict=True):
            array[start:stop] = values
        self.failures |= chunk.bad

    def results(self, designs: Designs) -> Any:
        shaped = [array.reshape(designs.shape + array.shape[1:]) for array in self.arrays]
        return jax.tree.unflatten(self.outputs.structure, shaped)


def _checked_units(units: Mapping[str, str] | None, designs: Designs, outputs: Outputs) -> dict[str, str]:
    labels = dict(units or {})
    known = (*designs.axes, *outputs.names)
    for name, unit in labels.items():
        if name not in known or not isinstance(unit, str):
            names = ", ".join(known)
            raise ValueError(f"units[{name!r}] is {unit!r}; it must be the text of a unit, of one of {names}.")
    return labels


def _report(result: Sweep) -> None:
    """Say which designs are bad."""
    if not result.bad:
        return
    lines = [f"{len(result.bad)} of {np.prod(result.shape)} designs gave no finite result:"]
    for bad in result.bad[:5]:
        lines.append("  " + ", ".join(f"{name}={value:g}" for name, value in bad.design.items()) + f": {bad.reason}")
    log.warning("\n".join(lines + ["  ..."] * (len(result.bad) > 5)))

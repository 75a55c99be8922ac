"""`sweep`: a function over a grid of designs, chunk by chunk."""

import logging
import os
from collections.abc import Callable, Mapping, Sequence
from math import prod
from typing import Any

import jax
import numpy as np
from numpy.typing import ArrayLike

from reojax._internal.checks import shorten
from reojax._internal.interruption import noting
from reojax.sweeps.chunks import chunking, compile_chunk
from reojax.sweeps.devices import Devices, at_most, mesh_of
from reojax.sweeps.engine import run
from reojax.sweeps.grid import Designs, check_axes, check_function
from reojax.sweeps.identity import identity
from reojax.sweeps.memory import Memory
from reojax.sweeps.merge import assemble
from reojax.sweeps.outputs import Outputs, bytes_per_design, outputs_of
from reojax.sweeps.progress import Progress
from reojax.sweeps.result import Sweep
from reojax.sweeps.resume import complete
from reojax.sweeps.store import create

log = logging.getLogger("reojax")

_TOLD = 5
"""Bad designs that are told one by one."""


def sweep(
    function: Callable[..., Any],
    axes: Mapping[str, ArrayLike],
    *,
    chunk_size: int | None = None,
    store: str | os.PathLike[str] | None = None,
    devices: Devices = None,
    progress: bool | str = True,
    units: Mapping[str, str] | None = None,
    shard: tuple[int, int] | None = None,
) -> Sweep:
    """Compute `function` for every design of a grid or a list.

    Designs are run in chunks by one compiled program, so memory stays flat, and the results do not depend, to
    the last bit, on how the chunks are spread over devices, shards and processes.

    With a `store`, finished chunks are kept in that folder, and a sweep that was stopped goes on where it was.
    Several processes may run the same sweep on one store at once: each takes the missing chunks in an order of
    its own, and passes over those that another one has finished.

    In a program of several processes (`jax.distributed.initialize` has been called in each, with the same
    sweep), all devices of all of them take part. They need a `store` in a folder that all of them see.

    Args:
        function: takes the named scalars and returns a pytree of arrays; pure, traced by JAX.
        axes: 1-D arrays by name, for the full grid in this order; or `zipped(...)`, for a list of designs.
        chunk_size: designs in a chunk; default by the size of the sweep.
        store: folder for finished chunks, made if missing.
        devices: None for all of JAX's devices (or the one that `jax.default_device` sets), a number of this host's
            devices, or a list of devices. A CPU is one device, in which XLA computes mostly in one thread, unless
            `jax.config.update("jax_num_cpu_devices", N)` comes first.
        progress: whether to show a bar on stderr, or what to write before it.
        units: units of axes and results by name, for labels.
        shard: (i, n) to run only every n-th chunk, from the i-th on, `0 <= i < n`; needs a `store`.

    Returns:
        the sweep. With a `store`, its results are read from there when they are asked for.

    Raises:
        ValueError: naming what is wrong with the arguments, or how the store's sweep differs. A design that
            fails raises nothing: it is logged, its results are NaN, and `Sweep.bad` has it.
    """
    found = run_sweep(function, axes, chunk_size, store, devices, progress, units, shard)
    if bad := found.bad:
        lines = [f"{len(bad)} of {prod(found.shape)} designs gave no finite result:"]
        lines += [f"  {design}" for design in bad[:_TOLD]]
        log.warning("\n".join(lines + ["  ..."] * (len(bad) > _TOLD)))
    return found


def run_sweep(
    function: Callable[..., Any],
    axes: Mapping[str, ArrayLike],
    chunk_size: int | None,
    store: str | os.PathLike[str] | None,
    devices: Devices,
    progress: bool | str,
    units: Mapping[str, str] | None,
    shard: tuple[int, int] | None,
) -> Sweep:
    """Do what `sweep` does, and leave the telling of bad designs to the caller."""
    designs = check_axes(axes)
    check_function(function, designs)
    mesh = mesh_of(devices)
    first, parts = _check_shard(shard, store)
    if store is None and jax.process_count() > 1:
        raise ValueError("several processes put their results into a `store`; give the folder.")
    outputs = outputs_of(function, designs)
    labels = _check_units(units, designs, outputs)
    platform = mesh.devices.flat[0].platform
    sizes = chunking(designs.total, chunk_size, bytes_per_design(outputs.arrays), platform)
    mine = range(first, sizes.chunks, parts)
    mesh = at_most(mesh, len(mine))
    if store is None:
        memory = Memory(outputs.arrays, sizes, "give a `store`")
        program = compile_chunk(function, designs, sizes, mesh)
        with noting("without a store nothing is kept"), Progress(sizes, mine, show=progress) as shown:
            for chunk in run(function, program, outputs, mine):
                memory.put(chunk)
                shown.add(chunk.number)
        failures, load = memory.failures, lambda: memory.arrays(designs)
    else:
        kept = create(store, identity(function, designs, outputs, sizes, platform), designs, labels)
        failures = complete(function, outputs, kept, mesh, mine, progress)
        load = lambda: assemble([kept])[0]
    return Sweep(designs, labels, lambda: jax.tree.unflatten(outputs.structure, load()), failures)


def _check_shard(shard: tuple[int, int] | None, store: object) -> tuple[int, int]:
    if shard is None:
        return 0, 1
    pair = shard if isinstance(shard, Sequence) and len(shard) == 2 else (0, 0)
    if not all(isinstance(number, int | np.integer) for number in pair) or not 0 <= pair[0] < pair[1]:
        raise ValueError(f"`shard` is {shorten(shard)}; it must be (i, n) with 0 <= i < n.")
    if store is None:
        raise ValueError("a shard's results go into a `store`; give the folder.")
    return pair


def _check_units(units: Mapping[str, str] | None, designs: Designs, outputs: Outputs) -> dict[str, str]:
    labels = dict(units or {})
    known = (*designs.axes, *outputs.names)
    for name, unit in labels.items():
        if name not in known or not isinstance(unit, str):
            names = ", ".join(known)
            raise ValueError(f"units[{name!r}] is {shorten(unit)}; it must be the text of a unit, of one of {names}.")
    return labels

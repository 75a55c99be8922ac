"""The devices that a sweep runs on, as a mesh for `shard_map`."""

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np
from jax.sharding import Mesh

from reojax._internal.checks import shorten

Devices = int | Sequence[jax.Device] | None


def mesh_of(devices: Devices) -> Mesh:
    """Mesh of the chosen devices: all, the first so many of this host, or the ones given.

    None means all devices of JAX's default platform, or the default device where one is set (`jax.default_device`). In
    a program of several processes (`jax.distributed`) it means all devices of all of them, and a number so many of
    each process.

    Raises:
        ValueError: if there are not so many devices, or something else is given.
    """
    if devices is None:
        alone = jax.process_count() == 1 and jax.config.values["jax_default_device"] is not None
        chosen = [jax.numpy.zeros(()).device] if alone else jax.devices()
    elif isinstance(devices, int | np.integer) and not isinstance(devices, bool):
        chosen = _first(int(devices))
    else:
        chosen = list(devices) if isinstance(devices, Sequence) else [devices]
    if not chosen or not all(isinstance(device, jax.Device) for device in chosen):
        raise ValueError(
            f"`devices` is {shorten(devices)}; it must be None, a number of devices, or a list of JAX devices."
        )
    if len(set(chosen)) < len(chosen):
        raise ValueError("`devices` names a device twice.")
    return Mesh(np.array(chosen), ("device",))


def at_most(mesh: Mesh, number: int) -> Mesh:
    """Leave out devices of one process beyond `number`, which would have nothing to do."""
    return mesh if jax.process_count() > 1 else Mesh(mesh.devices[: max(1, number)], mesh.axis_names)


def _first(number: int) -> list[Any]:
    local = jax.local_devices()
    if not 0 < number <= len(local):
        hint = "" if local[0].platform != "cpu" else " (`jax.config.update('jax_num_cpu_devices', N)` makes more)"
        raise ValueError(f"`devices` is {number}; this process has {len(local)} {local[0].platform} devices{hint}.")
    if jax.process_count() == 1:
        return local[:number]
    return [d for process in range(jax.process_count()) for d in jax.local_devices(process)[:number]]

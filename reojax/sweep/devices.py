"""The devices that a sweep runs on, as a mesh for `shard_map`."""

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np
from jax.sharding import Mesh

Devices = int | Sequence[jax.Device] | None


def mesh_of(devices: Devices) -> Mesh:
    """Mesh of the chosen devices: the default one, the first so many of this host, or the ones given.

    In a program of several processes (`jax.distributed`) None means all devices of all of them, and a number
    so many of each process.

    Raises:
        ValueError: if there are not so many devices, or something else is given.
    """
    if devices is None:
        chosen = jax.devices() if jax.process_count() > 1 else [jax.numpy.zeros(()).device]
    elif isinstance(devices, int | np.integer) and not isinstance(devices, bool):
        chosen = _first(int(devices))
    else:
        chosen = list(devices) if isinstance(devices, Sequence) else [devices]
    if not chosen or not all(isinstance(device, jax.Device) for device in chosen):
        raise ValueError(f"`devices` is {devices!r}; it must be None, a number of devices, or a list of JAX devices.")
    if len(set(chosen)) < len(chosen):
        raise ValueError("`devices` names a device twice.")
    return Mesh(np.array(chosen), ("device",))


def _first(number: int) -> list[Any]:
    local = jax.local_devices()
    if not 0 < number <= len(local):
        hint = "" if local[0].platform != "cpu" else " (XLA_FLAGS=--xla_force_host_platform_device_count=N makes more)"
        raise ValueError(f"`devices` is {number}; this process has {len(local)} {local[0].platform} devices{hint}.")
    if jax.process_count() == 1:
        return local[:number]
    return [d for process in range(jax.process_count()) for d in jax.local_devices(process)[:number]]

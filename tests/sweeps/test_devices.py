"""The same bits on one device, two devices, two shards, and two processes of one `jax.distributed` program."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import jax
import numpy as np
import pytest
from helpers import sweep_child

import reojax
from reojax.sweeps import merge


def start(store, *, flags="", **options) -> subprocess.Popen:
    environment = {**os.environ, "XLA_FLAGS": f"{os.environ.get('XLA_FLAGS', '')} {flags}"}
    command = [sys.executable, sweep_child.__file__, str(store), json.dumps(options)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_the_same_to_the_last_bit(tmp_path):
    """Net rotations, 63 designs in chunks of 8."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        coordinator = f"127.0.0.1:{free.getsockname()[1]}"
    children = [
        start(tmp_path / "devices", flags="--xla_force_host_platform_device_count=2"),
        start(tmp_path / "processes", coordinator=coordinator, process=0),
        start(tmp_path / "processes", coordinator=coordinator, process=1),
    ]
    whole = sweep_child.run(None)
    for i in range(2):
        sweep_child.run(tmp_path / f"shard {i}", shard=(i, 2))
    for process in children:
        printed, complaint = process.communicate(timeout=120)
        assert process.returncode == 0, complaint
        assert json.loads(printed.splitlines()[-1]) == "Sweep(twist 9 x bend 7, 0 bad)"
    for folders in (["devices"], ["processes"], ["shard 0", "shard 1"]):
        merged = merge(*(tmp_path / folder for folder in folders))
        np.testing.assert_array_equal(merged.results["vector"], whole.results["vector"])
        np.testing.assert_array_equal(merged.results["angle"], whole.results["angle"])
    assert len(list(Path(tmp_path / "processes").glob("chunk-*.npz"))) == 8


@pytest.mark.parametrize("devices", [0, -1, 1000, 1.5, True, [], ["cpu"], "cpu"])
def test_devices_that_are_not_there(devices):
    with pytest.raises(ValueError, match="`devices` is"):
        reojax.sweep(lambda x: x, {"x": [1.0]}, devices=devices, progress=False)


def test_chosen_devices():
    device = jax.local_devices()[0]
    for devices in (1, [device]):
        found = reojax.sweep(lambda x: x, {"x": [1.0]}, devices=devices, progress=False)
        np.testing.assert_array_equal(found.results, [1.0])
    with pytest.raises(ValueError, match="twice"):
        reojax.sweep(lambda x: x, {"x": [1.0]}, devices=[device, device])


def test_a_device_for_each_core():
    """All of them are used unless one is the default, and no more than there are chunks."""
    code = """
import os, jax
from reojax.session import one_device_per_core
from reojax.sweeps.devices import at_most, mesh_of
one_device_per_core()
everything = mesh_of(None)
assert list(everything.devices) == jax.devices() and everything.size == len(os.sched_getaffinity(0))
with jax.default_device(jax.devices()[-1]):
    assert list(mesh_of(None).devices) == jax.devices()[-1:]
assert at_most(everything, 1).size == at_most(everything, 0).size == 1
assert at_most(everything, 1000).size == everything.size
one_device_per_core()  # too late for a change, and no error
"""
    environment = {name: value for name, value in os.environ.items() if name != "XLA_FLAGS"}
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True, env=environment)

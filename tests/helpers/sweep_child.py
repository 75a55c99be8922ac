"""A sweep in a process of its own, for the tests: `python sweep_child.py STORE '{"devices": 2}'`.

With `"coordinator"` and `"process"` among the options it is one of two processes of `jax.distributed`.
"""

import json
import sys

import jax
import jax.numpy as jnp
import numpy as np

import reojax

AXES = {"twist": np.linspace(0.1, 4.7, 9), "bend": np.linspace(0.2, 2.0, 7)}
ROBOT = reojax.robots.prototype()


def turn(twist, bend):
    """A true sweep, small: the turn after manoeuvre A."""
    rotation = reojax.net_rotation(ROBOT, reojax.manoeuvre_a(twist, bend), steps=1)
    return {"vector": reojax.so3.log(rotation), "angle": reojax.so3.angle(rotation)}


def cheap(twist, bend):
    """Something for many chunks."""
    return jnp.sin(twist) * bend


def run(store, function="turn", chunk_size=8, coordinator=None, process=0, **options):
    """Run the sweep into a store."""
    jax.config.update("jax_enable_x64", True)
    if coordinator is not None:
        jax.distributed.initialize(coordinator, num_processes=2, process_id=process)
    chosen = {"turn": turn, "cheap": cheap}[function]
    return reojax.sweep(chosen, AXES, store=store, chunk_size=chunk_size, progress=False, **options)


if __name__ == "__main__":
    print(json.dumps(repr(run(sys.argv[1], **json.loads(sys.argv[2])))))

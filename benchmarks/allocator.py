"""What a plain script loses to the allocator: the same calls with freed memory held and given back, by turns.

    python benchmarks/allocator.py

Every turn is a process of its own that runs as a user's script would; `REOJAX_HOLD_MEMORY=0` leaves the allocator
alone. Processor time, the system's part included, in microseconds a loop of the prototype, default steps.
"""

import json
import os
import subprocess
import sys
import time

import numpy as np

CASES = [("value", n) for n in (1, 100, 1024, 3000, 100_000)] + [
    ("gradient", n) for n in (1, 100, 300, 1024, 3000, 10_000)
]
TURNS = 3


def measure() -> list[float]:
    """Median processor time of each case [us a loop]."""
    import jax
    import jax.numpy as jnp

    import reojax

    jax.config.update("jax_enable_x64", True)
    robot = reojax.robots.prototype()
    weights = jnp.arange(9.0).reshape(3, 3)

    def value(x):
        twist, bend, inertia, ratio = x
        design = robot.replace(gear_ratio=robot.gear_ratio * ratio, inertia=robot.inertia.copy() * inertia)
        return (reojax.net_rotation(design, reojax.manoeuvre_a(twist, bend)) * weights).sum()

    found = []
    functions = {"value": jax.jit(jax.vmap(value)), "gradient": jax.jit(jax.vmap(jax.value_and_grad(value)))}
    for kind, count in CASES:
        x = jnp.asarray(np.random.default_rng(0).uniform(0.5, 1.5, (count, 4)))
        taken = []
        for _ in range(2 + max(5, min(200, 20_000 // count))):
            before = time.process_time()
            jax.block_until_ready(functions[kind](x))
            taken.append(time.process_time() - before)
        found.append(float(np.median(taken[2:])) / count * 1e6)
    return found


def main() -> None:
    """Print the table."""
    taken: dict[str, list[list[float]]] = {"1": [], "0": []}
    for _ in range(TURNS):
        for held, runs in taken.items():
            run = subprocess.run(
                [sys.executable, __file__, "--one"],
                env={**os.environ, "REOJAX_HOLD_MEMORY": held},
                capture_output=True,
                text=True,
                check=True,
            )
            runs.append(json.loads(run.stdout))
    held, given_back = (np.array(taken[key]) for key in ("1", "0"))
    print(f"{'':>8} {'loops':>7} {'as it is':>9} {'spread':>15} {'given back':>11} {'spread':>15}")
    for i, (kind, count) in enumerate(CASES):
        row = [
            f"{np.median(x[:, i]):.2f} {f'{x[:, i].min():.2f} .. {x[:, i].max():.2f}':>15}" for x in (held, given_back)
        ]
        print(f"{kind:>8} {count:>7} {row[0]:>25} {row[1]:>27}")


if __name__ == "__main__":
    if "--one" in sys.argv:
        print(json.dumps(measure()))
    else:
        main()

"""How do compile and run time grow with the number of joints?

    python benchmarks/long_robots.py           # some minutes; --quick: 3 and 12 joints

Random branched robots with axes along the frame, loops of four edges, default steps; the net rotation of one design
and of a batch, and its gradient by the path. Compile is tracing and compiling, in seconds of processor time;
run is processor time of a call for each design, the least of five, in microseconds. Writes long_robots.json.
"""

import time
from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from _command import machine, options, run

import reojax
from reojax.files import check_writable, write_json
from reojax.robots.random import random_robot

JOINTS = (3, 7, 12, 29, 32)
BATCH = 64
_TEXT = "{joints:3d} joints {of:9s} {designs:3d} designs {compile_s:6.1f} s {run_us:9.1f} us"


def main(out: Path, *, quick: bool, joints: list[int]) -> None:
    """Measure, print and write."""
    result = check_writable(out / "long_robots.json")
    rows = []
    for count in (3, 12) if quick else joints:
        robot = random_robot(7, count, branched=True)
        robot = robot.replace(axis=np.eye(3)[np.arange(count) % 3])
        points = np.random.default_rng(7).uniform(-1.5, 1.5, (BATCH, 5, count))
        points[:, -1] = points[:, 0]

        def net(corners: jax.Array, robot: reojax.Robot = robot) -> jax.Array:
            return reojax.net_rotation(robot, reojax.Path(corners))

        def slope(corners: jax.Array, net: Callable = net) -> jax.Array:
            return jax.grad(lambda c: (net(c) * jnp.arange(9.0).reshape(3, 3)).sum())(corners)

        for name, function in (("value", net), ("gradient", slope)):
            for designs, call, given in ((1, function, points[0]), (BATCH, jax.vmap(function), points)):
                compiled, seconds = _compile(call, given)
                row = {"joints": count, "of": name, "designs": designs, "compile_s": seconds}
                rows.append(row | {"run_us": 1e6 * _least(compiled, given) / designs})
                print(_TEXT.format(**rows[-1]), flush=True)
    write_json(result, {"machine": machine(), "rows": rows})


def _compile(function: Callable, given: np.ndarray) -> tuple[Callable, float]:
    start = time.process_time()
    compiled = jax.jit(function).lower(given).compile()
    return compiled, time.process_time() - start


def _least(function: Callable, given: np.ndarray) -> float:
    jax.block_until_ready(function(given))
    seconds = []
    for _ in range(5):
        start = time.process_time()
        jax.block_until_ready(function(given))
        seconds.append(time.process_time() - start)
    return min(seconds)


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--joints", type=int, nargs="+", default=JOINTS, metavar="N", help="numbers of joints")
    run(main, parser)

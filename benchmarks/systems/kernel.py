"""A kernel in C, written by hand for SIMD: `benchmarks/kernel.c`."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import jax
import numpy as np

from reojax import Robot, so3
from reojax.robots import prototype
from reojax.robots.prototype import END_INERTIA

from . import _magnus
from ._c import build, pointer
from ._measure import CORES, measure
from ._rows import Row, row
from ._task import Loops, Task

SOURCE = Path(__file__).resolve().parents[1] / "kernel.c"
FLAGS = ("-O3", "-march=native", "-fopenmp-simd")
LANES = 8  # most of kernel.c
FORMS = {"net_rotation": "any axes", "net_rotation_prototype": "this robot only"}


def rows(task: Task) -> Iterator[Row]:
    """Rows of both forms, on one thread and on all cores."""
    library, seconds = build(SOURCE.read_text(), FLAGS)
    for function, form in FORMS.items():
        single, loops = _caller(getattr(library, function), task), len(task.loops.twist)
        threads = sorted({1, CORES})
        with ThreadPoolExecutor(CORES) as pool:
            calls = [partial(_in_parts, pool, single, task.loops, count) for count in threads]
            for count, samples in zip(threads, measure(calls, task.seconds), strict=True):
                yield row(
                    f"C by hand, SIMD, {form}",
                    "value",
                    samples,
                    loops=loops,
                    threads=count,
                    steps=task.magnus_steps,
                    evaluations=_magnus.evaluations(task.magnus_steps),
                    error=task.error(_rotations(single(task.loops.first(task.checked)))),
                    compile=seconds,
                )


def _caller(function: Callable, task: Task) -> Callable[[Loops], np.ndarray]:
    robot = _constants(prototype())

    def call(loops: Loops) -> np.ndarray:
        quaternion = np.empty((4, len(loops.twist)))
        columns = (*map(pointer, loops), pointer(quaternion))
        function(pointer(robot), task.magnus_steps, len(loops.twist), *columns)  # ctypes lets other threads run
        return quaternion

    return call


def _in_parts(
    pool: ThreadPoolExecutor, call: Callable[[Loops], np.ndarray], loops: Loops, count: int
) -> list[np.ndarray]:
    size = len(loops.twist) // count // LANES * LANES
    starts = [i * size for i in range(count)] + [len(loops.twist)]
    parts = [Loops(*(field[a:b] for field in loops)) for a, b in zip(starts, starts[1:], strict=False)]
    return list(pool.map(call, parts))


def _rotations(quaternion: np.ndarray) -> np.ndarray:
    return np.asarray(jax.vmap(so3.from_quaternion)(quaternion.T))


def _constants(robot: Robot) -> np.ndarray:
    """`Robot` of kernel.c."""
    place = np.einsum("ia,ib,i->iab", robot.com, robot.com, robot.mass)
    spread = np.trace(robot.inertia, axis1=1, axis2=2)[:, None, None] / 2 * np.eye(3) - robot.inertia + place
    inertia = np.trace(spread, axis1=1, axis2=2)[:, None, None] * np.eye(3) - spread
    side = [1 if on == "parent" else -1 for on in robot.rotor_on]
    parts = [robot.mass, robot.mass[:, None] * robot.com, *map(_six, spread[[0, 3]]), *map(_six, inertia[1:3])]
    parts += [robot.axis, robot.anchor, side * robot.rotor_inertia, [END_INERTIA]]
    return np.concatenate([np.ravel(part) for part in parts])


def _six(symmetric: np.ndarray) -> np.ndarray:
    return symmetric[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]

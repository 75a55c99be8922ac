"""Clocks: wall time and the processor time of all threads, several calls by turns, so that ratios are of one moment."""

import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from reojax.session import usable_cores

SAMPLE = 0.03
"""Least length of one sample [s]; short calls are repeated within it."""
CORES = usable_cores()
"""Cores that this process may use."""


class Samples(NamedTuple):
    """Times of one call, sample by sample [s]."""

    wall: np.ndarray
    cpu: np.ndarray
    """Processor time of all threads of this process."""


def measure(calls: Sequence[Callable[[], Any]], seconds: float) -> list[Samples]:
    """Time `calls` by turns, for about `seconds` each; at least three samples after one call to warm up.

    A call returns when its work is done; what it returns as JAX arrays is waited for.
    """
    repeats = []
    for call in calls:
        timed(call)
        once, _ = timed(call)
        repeats.append(max(1, round(SAMPLE / max(once, 1e-7))))
    taken = np.zeros((0, len(calls), 2))
    while len(taken) < 3 or (taken[:, :, 0].sum() < seconds * len(calls)):
        sample = [timed(call, count) for call, count in zip(calls, repeats, strict=True)]
        taken = np.concatenate([taken, [sample]])
    each = taken / np.array(repeats)[None, :, None]
    return [Samples(*each[:, i].T) for i in range(len(calls))]


def timed(call: Callable[[], Any], count: int = 1) -> tuple[float, float]:
    """Wall and processor time of `count` calls [s]."""
    wall, cpu = time.perf_counter(), time.process_time()
    for _ in range(count):
        jax.block_until_ready(call())
    return time.perf_counter() - wall, time.process_time() - cpu


def compiled(function: Callable, *arguments: Any) -> tuple[Callable, float]:
    """Compile for the shapes of `arguments`; return it and the seconds from trace to program, nothing being cached."""
    jax.clear_caches()
    start = time.perf_counter()
    call = jax.jit(function).lower(*arguments).compile()
    return call, time.perf_counter() - start


def fewest(error_with: Callable[[int], float], tolerance: float, *, start: int = 1, most: int = 4096) -> int:
    """Return the fewest steps with an error within `tolerance`: found by doubling, then by halving the interval.

    Raises:
        ValueError: if even `most` steps are too few.
    """
    low, high = 0, start
    while (error := error_with(high)) > tolerance:
        if high >= most:
            raise ValueError(f"{high} steps an edge leave an error of {error:.1e} rad.")
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if error_with(middle) <= tolerance else (middle, high)
    return high

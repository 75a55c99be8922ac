"""Results of a sweep in memory, and whether they fit."""

from pathlib import Path
from typing import Any

import numpy as np

from reojax.sweeps.chunks import Chunk, Chunking
from reojax.sweeps.grid import Designs
from reojax.sweeps.outputs import Output, bytes_per_design


class Memory:
    """Arrays that are filled chunk by chunk."""

    def __init__(self, outputs: tuple[Output, ...], sizes: Chunking, advice: str) -> None:
        """Make room for the results.

        Raises:
            ValueError: if there is not enough memory; its text ends in `advice`.
        """
        check_memory(sizes.total, bytes_per_design(outputs), advice)
        self._arrays = [np.empty((sizes.total, *output.shape), output.dtype) for output in outputs]
        self._sizes, self._kept = sizes, set[int]()
        self.failures: dict[int, str] = {}
        """Reasons by number of the design, of designs without a finite result."""

    def put(self, chunk: Chunk) -> None:
        """Keep a chunk."""
        start, stop = self._sizes.bounds(chunk.number)
        for array, values in zip(self._arrays, chunk.results, strict=True):
            array[start:stop] = values
        self._kept.add(chunk.number)
        self.failures |= chunk.bad

    def arrays(self, designs: Designs) -> list[Any]:
        """Return the results with the grid's shape in front.

        Raises:
            ValueError: if a chunk was never kept, as nothing is known of its designs.
        """
        if len(self._kept) < self._sizes.chunks:
            raise ValueError(f"{self._sizes.chunks - len(self._kept)} chunks of the sweep are not there.")
        return [array.reshape(designs.shape + array.shape[1:]) for array in self._arrays]


def check_memory(designs: int, bytes_each: int, advice: str) -> None:
    """Refuse results that do not fit into memory.

    Raises:
        ValueError: naming the sizes; its text ends in `advice`.
    """
    needed, free = designs * bytes_each, available()
    if free is not None and needed > free:
        raise ValueError(
            f"the results of {designs:.3g} designs take {needed / 2**30:.3g} GiB of memory, and "
            f"{free / 2**30:.3g} GiB are free; {advice}."
        )


def available() -> int | None:
    """Memory that can be had without swapping [bytes], where the system tells."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:"))
    except (OSError, StopIteration, ValueError):
        return None

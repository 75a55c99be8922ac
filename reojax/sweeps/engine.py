"""Running chunks: several calls under way, and a chunk that fails is run again design by design."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from itertools import islice
from typing import Any

import jax
import numpy as np
from jax.sharding import Mesh

from reojax.sweeps.chunks import Chunk, Program, compile_chunk
from reojax.sweeps.outputs import Outputs, bad_rows, blank

IN_FLIGHT = 1
"""Calls under way while the results of an earlier one are put away."""


def run(function: Callable[..., Any], program: Program, outputs: Outputs, todo: Iterable[int]) -> Iterator[Chunk]:
    """Run the chunks `todo`, which is read one round of devices at a time; yield those this process computes."""
    fallback = _Fallback(function, program, outputs)
    numbers, under_way = iter(todo), deque[tuple[Any, list[int | None]]]()
    try:
        while True:
            chunks: list[int | None] = list(islice(numbers, program.mesh.size))
            if chunks:
                chunks += [None] * (program.mesh.size - len(chunks))
                under_way.append((_start(program, chunks), chunks))
            if under_way and (not chunks or len(under_way) > IN_FLIGHT):
                yield from _finish(program, fallback, outputs, *under_way.popleft())
            elif not chunks:
                return
    finally:  # stopped: the program must not outlive the interpreter
        for started, _ in under_way:
            with suppress(Exception):
                jax.block_until_ready(started)


def _start(program: Program, chunks: list[int | None]) -> Any:
    try:
        with jax.debug_nans(False):  # a sweep tells of them itself
            return program.start(chunks)
    except Exception:  # of the program, which is compiled already; other calls fail when their results are read
        return None


def _finish(
    program: Program, fallback: "_Fallback", outputs: Outputs, started: Any, chunks: list[int | None]
) -> Iterator[Chunk]:
    for number, device in program.here(chunks).items():
        start, _ = program.slicing.bounds(number)
        try:
            found = None if started is None else program.results(started, number, device)
        except Exception:
            found = None
        results, failed = fallback.chunk(number) if found is None else (found, {})
        bad = bad_rows(outputs, results) | failed
        yield Chunk(number, results, {start + row: reason for row, reason in bad.items()})


class _Fallback:
    """A chunk whose program raised: by itself, and if it still raises one design after the other."""

    def __init__(self, function: Callable[..., Any], program: Program, outputs: Outputs) -> None:
        self.function, self.program, self.outputs = function, program, outputs
        self.alone: Program | None = None
        self.one = jax.jit(lambda design: jax.tree.leaves(function(**design)))

    def chunk(self, number: int) -> tuple[list[np.ndarray], dict[int, str]]:
        """Results of the chunk, and why designs failed by their row in it."""
        if self.alone is None:
            mesh = Mesh(self.program.mesh.local_mesh.devices.ravel()[:1], self.program.mesh.axis_names)
            self.alone = compile_chunk(self.function, self.program.designs, self.program.slicing, mesh)
        try:
            with jax.debug_nans(False):
                started = self.alone.start([number])
                return self.alone.results(started, number, self.alone.mesh.devices.flat[0]), {}
        except Exception as error:
            if "RESOURCE_EXHAUSTED" in str(error):
                raise ValueError("a chunk does not fit into memory; choose a smaller `chunk_size`.") from error
        start, stop = self.program.slicing.bounds(number)
        results, failed = blank(self.outputs, stop - start), {}
        columns = self.program.designs.stretch(start, stop)
        for row in range(stop - start):
            try:
                with jax.debug_nans(False):
                    values = self.one({name: column[row] for name, column in columns.items()})
                for result, value in zip(results, values, strict=True):
                    result[row] = value
            except Exception as error:
                failed[row] = _reason(error)
        return results, failed


def _reason(error: Exception) -> str:
    """The line of an error of XLA that says what happened in the user's callback."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__

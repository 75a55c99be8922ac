"""How the designs are cut, and the one program that runs them.

Designs are cut into chunks, a chunk into blocks. One program runs a chunk: `lax.map` over its blocks, `vmap`
within a block. A block is small enough to stay in the cache of a CPU core, a chunk large enough for the call
not to count. The sizes depend on the sweep alone, never on the number of devices, shards or processes, so each
design is computed by the same program in the same place of the same block wherever it runs: results agree to
the last bit.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from reojax._internal import checks
from reojax.sweeps.grid import Designs

BLOCK = {"cpu": 1024}
"""Most designs in a block, by platform."""
ACCELERATOR_BLOCK = 2**16
"""Most designs in a block on other platforms."""
CHUNK = 2**16
"""Most designs in a chunk, unless it is chosen."""
CHUNK_BYTES = 2**26
"""Most memory for the results of a chunk, unless its size is chosen."""
CHUNKS = 16
"""Chunks that a sweep is cut into at least, as long as they are not smaller than a block."""


class Chunking(NamedTuple):
    """The designs of a sweep in chunks of `chunk`, run as `blocks` blocks of `block` designs."""

    total: int
    chunk: int
    block: int
    blocks: int

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return -(-self.total // self.chunk)

    def bounds(self, number: int) -> tuple[int, int]:
        """First design of a chunk, and the one after its last."""
        return number * self.chunk, min((number + 1) * self.chunk, self.total)


def chunking(count: int, chunk_size: int | None, bytes_per_design: int, platform: str) -> Chunking:
    """Choose the sizes for `count` designs.

    Raises:
        ValueError: if `chunk_size` is not a positive integer.
    """
    largest = BLOCK.get(platform, ACCELERATOR_BLOCK)
    if chunk_size is None:
        least, most = min(count, largest), min(count, CHUNK)
        chunk = min(max(-(-count // CHUNKS), least), most, max(1, CHUNK_BYTES // max(1, bytes_per_design)))
        block = -(-chunk // -(-chunk // largest))
        chunk = -(-chunk // block) * block
    else:
        checks.whole("chunk_size", chunk_size)
        chunk = min(int(chunk_size), count)
        block = -(-chunk // -(-chunk // largest))
    return Chunking(count, chunk, block, -(-chunk // block))


class Chunk(NamedTuple):
    """Results of a chunk."""

    number: int
    results: list[np.ndarray]
    """The function's arrays in the order of the pytree's leaves, the chunk's designs in front."""
    bad: dict[int, str]
    """Reasons by number of the design, of designs without a finite result."""


class Program(NamedTuple):
    """The compiled program of a sweep on a mesh of devices: one chunk for each of them."""

    designs: Designs
    slicing: Chunking
    mesh: Mesh
    run: Callable[[dict[str, jax.Array]], Any]

    def start(self, chunks: Sequence[int | None]) -> Any:
        """Start the computation of one chunk per device (None: nothing to do there, a chunk is done twice)."""
        todo = [next(c for c in chunks if c is not None) if c is None else c for c in chunks]
        blocks = self.slicing.blocks
        sharding = NamedSharding(self.mesh, PartitionSpec("device"))
        columns: dict[int, dict[str, np.ndarray]] = {}

        def part(name: str, where: Any) -> np.ndarray:
            chunk = todo[(where[0].start or 0) // blocks]
            if chunk not in columns:
                columns[chunk] = self._pad(chunk)
            return columns[chunk][name]

        shape = (len(todo) * blocks, self.slicing.block)
        return self.run(
            {
                name: jax.make_array_from_callback(shape, sharding, lambda where, name=name: part(name, where))
                for name in self.designs.axes
            }
        )

    def here(self, chunks: Sequence[int | None]) -> dict[int, Any]:
        """Which of `chunks` this process computes, and on which device."""
        pairs = zip(chunks, self.mesh.devices.flat, strict=True)
        return {c: d for c, d in pairs if c is not None and d.process_index == jax.process_index()}

    def results(self, started: Any, chunk: int, device: Any) -> list[np.ndarray]:
        """Wait for a chunk of this process: the function's arrays, the chunk's designs in front."""
        start, stop = self.slicing.bounds(chunk)
        found = []
        for leaf in jax.tree.leaves(started):
            shard = next(shard for shard in leaf.addressable_shards if shard.device == device)
            values = np.asarray(shard.data)
            found.append(values.reshape(-1, *values.shape[2:])[: stop - start])
        return found

    def _pad(self, chunk: int) -> dict[str, np.ndarray]:
        """Designs of a chunk in blocks; the last one is repeated to fill them."""
        size = self.slicing.blocks * self.slicing.block
        columns = self.designs.stretch(*self.slicing.bounds(chunk))
        return {
            name: np.pad(column, (0, size - len(column)), mode="edge").reshape(self.slicing.blocks, self.slicing.block)
            for name, column in columns.items()
        }


def compile_chunk(function: Callable[..., Any], designs: Designs, slicing: Chunking, mesh: Mesh) -> Program:
    """Compile the program that runs one chunk on each device of `mesh`."""

    def on_device(design: dict[str, jax.Array]) -> Any:
        return jax.lax.map(jax.vmap(lambda design: function(**design)), design)

    place = PartitionSpec("device")
    everywhere = jax.shard_map(on_device, mesh=mesh, in_specs=place, out_specs=place, check_vma=False)
    shape = (mesh.size * slicing.blocks, slicing.block)
    sharding = NamedSharding(mesh, place)
    arguments = {
        name: jax.ShapeDtypeStruct(shape, values.dtype, sharding=sharding) for name, values in designs.axes.items()
    }
    return Program(designs, slicing, mesh, jax.jit(everywhere).lower(arguments).compile())

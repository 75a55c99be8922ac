"""Computing what a store does not have yet, alone or with other processes."""

import os
import random
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import numpy as np
from jax.sharding import Mesh

from reojax._internal.checks import shorten
from reojax._internal.interruption import noting
from reojax.sweeps.chunks import compile_chunk
from reojax.sweeps.engine import run
from reojax.sweeps.outputs import Outputs
from reojax.sweeps.progress import Progress
from reojax.sweeps.store import Store


def complete(
    function: Callable[..., Any], outputs: Outputs, store: Store, mesh: Mesh, mine: range, progress: bool | str
) -> dict[int, str]:
    """Compute the chunks `mine` that are missing or damaged; return the bad designs of all of `mine`.

    Processes that know nothing of each other may do this on one store at once. Each goes through the missing
    chunks in a random order of its own and passes over what is there by then, so that they seldom do the same
    one twice; where they do, both write the same file. The processes of one `jax.distributed` program have to
    do the same in the same order instead, and wait for each other at the end.
    """
    found = {number: chunk.bad for number in mine if (chunk := store.get(number)) is not None}
    missing = [number for number in mine if number not in found]
    damaged = {number for number in missing if store.has(number)}
    several = jax.process_count() > 1
    if several:
        missing = _agree_on(missing, mine)
    else:
        random.Random(os.urandom(8)).shuffle(missing)
    show = jax.process_index() == 0 and progress
    with Progress(store.sizes, mine, show=show, done=found, alike=jax.process_count()) as shown:

        def todo() -> Iterator[int]:
            for number in missing:
                if not several and number not in damaged and store.has(number):
                    shown.add(number)
                else:
                    yield number

        where = shorten(str(store.folder))
        with noting(f"finished chunks are in {where}, and the same sweep goes on from there"):
            if missing:
                for chunk in run(function, compile_chunk(function, store.designs, store.sizes, mesh), outputs, todo()):
                    store.put(chunk)
                    found[chunk.number] = chunk.bad
                    shown.add(chunk.number)
    if several:
        from jax.experimental import multihost_utils

        multihost_utils.sync_global_devices("reojax.sweep: all chunks are stored")
    for number in mine:
        if number not in found and (chunk := store.get(number)) is not None:
            found[number] = chunk.bad
    store.check_whole(mine)
    return {design: reason for bad in found.values() for design, reason in bad.items()}


def _agree_on(missing: Sequence[int], mine: range) -> list[int]:
    """Chunks that are missing as the first process sees it, the same list in every process."""
    from jax.experimental import multihost_utils

    mask = multihost_utils.broadcast_one_to_all(np.isin(mine, missing))
    return [number for number, absent in zip(mine, mask, strict=True) if absent]

"""Putting the chunks of one or more stores together."""

import os
from collections.abc import Sequence
from typing import Any

from reojax._internal.checks import shorten
from reojax.sweeps.identity import differences
from reojax.sweeps.memory import Memory
from reojax.sweeps.result import Sweep
from reojax.sweeps.store import Store, open_store

_ADVICE = "read the chunk files one by one instead, each is a NumPy archive"


def merge(*folders: str | os.PathLike[str]) -> Sweep:
    """Put together the chunks of a sweep that was run with `store`, in one folder or in several.

    Args:
        folders: stores of one and the same sweep, each with all or some of its chunks.

    Returns:
        the sweep; `results` is a dict of arrays by name.

    Raises:
        ValueError: if a folder is no store, they hold different sweeps, or chunks are missing or damaged in all
            of them, naming these.
    """
    if not folders:
        raise ValueError("`merge` needs the folder of a store.")
    for folder in folders:
        if not isinstance(folder, str | os.PathLike):
            raise ValueError(f"a folder is {shorten(folder)}; it must be the path of a store.")
    stores = [open_store(folder) for folder in folders]
    for store in stores[1:]:
        if store.hash != stores[0].hash:
            other = "; ".join(differences(stores[0].identity, store.identity))
            raise ValueError(f"{str(stores[0].folder)!r} and {str(store.folder)!r} hold different sweeps: {other}.")
    arrays, failures = assemble(stores)
    results = {output.name: array for output, array in zip(stores[0].outputs, arrays, strict=True)}
    return Sweep(stores[0].designs, stores[0].units, lambda: results, failures)


def assemble(stores: Sequence[Store]) -> tuple[list[Any], dict[int, str]]:
    """Results with the grid's shape in front, and the bad designs.

    Raises:
        ValueError: if chunks are missing or damaged, or do not fit into memory.
    """
    first = stores[0]
    memory = Memory(first.outputs, first.sizes, _ADVICE)
    missing, damaged = [], []
    for number in range(first.sizes.chunks):
        chunk = next((chunk for store in stores if (chunk := store.get(number)) is not None), None)
        if chunk is not None:
            memory.put(chunk)
        elif any(store.file(number).exists() for store in stores):
            damaged.append(number)
        else:
            missing.append(number)
    if missing or damaged:
        texts = [
            f"{word} {_ranges(numbers)}" for word, numbers in (("missing", missing), ("damaged", damaged)) if numbers
        ]
        where = ", ".join(repr(str(store.folder)) for store in stores)
        raise ValueError(
            f"of {first.sizes.chunks} chunks in {where} there are {' and '.join(texts)}; run the sweep again."
        )
    return memory.arrays(first.designs), memory.failures


def _ranges(numbers: Sequence[int]) -> str:
    """Numbers in order as `0, 3-7, 9`."""
    spans: list[list[int]] = []
    for number in numbers:
        if spans and number == spans[-1][1] + 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in spans)

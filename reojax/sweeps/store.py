"""A sweep on disk: a folder that any NumPy and JSON reader understands.

    sweep.json            what was computed: axes, function, robots, results, versions, units, and one hash of it all
    axes.npz              values, `axes/NAME`
    chunk-00000017.npz    results of chunk 17, `results/NAME` with its designs in front; `start` and `stop`, their
                          numbers; the hash; `bad/design` and `bad/reason`, the numbers of the bad ones and why

Files appear whole: written beside, synced, and renamed. So any number of processes may work on one store, and one
that is killed loses the chunks it is at. A chunk that was damaged later, in whatever way, is as one that is not there:
its checksums (of the zip format), names, shapes, types and sizes are looked at, sizes before anything is unpacked.
"""

import json
import os
import time
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from reojax._internal.archives import check_arrays, read_archive
from reojax._internal.checks import shorten
from reojax._internal.files import replacing
from reojax.sweeps.chunks import Chunk
from reojax.sweeps.grid import Designs
from reojax.sweeps.identity import axis_identity, differences, digest
from reojax.sweeps.manifest import Manifest, read_manifest
from reojax.sweeps.outputs import bytes_per_design

MANIFEST, AXES = "sweep.json", "axes.npz"
_LEFT_OVER = 3600.0
"""Age from which a temporary file is one that a killed process left behind [s]."""
_REASON = 200
"""Most characters that are kept of why a design is bad."""
_ROOM = 2**16
"""Bytes of an archive beside its arrays' numbers, at most, for a few arrays more than there are."""


class Store:
    """A folder of chunks."""

    def __init__(self, folder: Path, manifest: Manifest, designs: Designs) -> None:
        """Open what `create` or `open_store` has checked."""
        self.folder, self.designs = folder, designs
        self.identity, self.units = manifest.identity, manifest.units
        self.outputs, self.sizes = manifest.outputs, manifest.sizes
        self.hash = digest(self.identity)

    def file(self, number: int) -> Path:
        """Path of a chunk."""
        return self.folder / f"chunk-{number:08d}.npz"

    def has(self, number: int) -> bool:
        """Tell whether the file of a chunk is there."""
        return self.file(number).exists()

    def put(self, chunk: Chunk) -> None:
        """Write a chunk, whole or not at all."""
        start, stop = self.sizes.bounds(chunk.number)
        members = {"hash": np.array(self.hash), "start": np.array(start), "stop": np.array(stop)}
        members["bad/design"] = np.array(list(chunk.bad), np.int64)
        members["bad/reason"] = np.array([reason[:_REASON] for reason in chunk.bad.values()], str)
        members |= {f"results/{o.name}": values for o, values in zip(self.outputs, chunk.results, strict=True)}
        with replacing(self.file(chunk.number)) as file:
            np.savez(file, allow_pickle=False, **members)

    def get(self, number: int) -> Chunk | None:
        """Read a chunk; None if it is not there, damaged, or of another sweep."""
        start, stop = self.sizes.bounds(number)
        rows = stop - start
        most = rows * (bytes_per_design(self.outputs) + 8 + 4 * _REASON) + _ROOM * (len(self.outputs) + 5)
        results = {f"results/{output.name}": ((rows, *output.shape), output.dtype) for output in self.outputs}
        try:
            arrays = read_archive(self.file(number), most)
            check_arrays(arrays, results)
            if str(arrays["hash"]) != self.hash or (int(arrays["start"]), int(arrays["stop"])) != (start, stop):
                return None
            bad = _bad(arrays["bad/design"], arrays["bad/reason"], start, stop)
        except (KeyError, TypeError, ValueError):
            return None
        return Chunk(number, [arrays[name] for name in results], bad)

    def check_whole(self, numbers: Iterable[int]) -> None:
        """Look once more, at the end, whether everything is where it was put.

        Raises:
            ValueError: if the folder, or a chunk, has gone, or the folder is another sweep's by now.
        """
        lost = [number for number in numbers if not self.has(number)]
        if lost:
            what = f"chunk {lost[0]}" if len(lost) == 1 else f"{len(lost)} chunks, the first one {lost[0]},"
            raise ValueError(
                f"while the sweep ran, the store {shorten(str(self.folder))} has lost {what}; run it again."
            )
        if open_store(self.folder).hash != self.hash:
            raise ValueError(f"while the sweep ran, another one took the store {shorten(str(self.folder))}.")


def _bad(designs: np.ndarray, reasons: np.ndarray, start: int, stop: int) -> dict[int, str]:
    """The bad designs of a chunk, if they can be its own.

    Raises:
        ValueError: if not.
    """
    numbers = designs.tolist()
    fit = designs.dtype == np.int64 and designs.ndim == 1 and all(start <= number < stop for number in numbers)
    if not fit or len(set(numbers)) < len(numbers) or reasons.dtype.kind != "U":
        raise ValueError("its bad designs are none of the chunk's")
    return dict(zip(numbers, map(str, reasons), strict=True))


def create(
    folder: str | os.PathLike[str], same: Mapping[str, Any], designs: Designs, units: Mapping[str, str]
) -> Store:
    """Open the store of a sweep, or make it.

    Raises:
        ValueError: if it holds another sweep, naming what differs, or the folder cannot be used.
    """
    place = Path(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
        if not (place / MANIFEST).exists():
            with replacing(place / AXES) as file:
                np.savez(file, allow_pickle=False, **{f"axes/{name}": values for name, values in designs.axes.items()})
            _write_once(place / MANIFEST, json.dumps({"identity": same, "units": dict(units)}, indent=2) + "\n")
        _sweep_out(place)
    except OSError as error:
        raise ValueError(f"cannot use {shorten(str(folder))} as a store: {error.strerror or error}.") from error
    store = open_store(place)
    if store.hash != digest(same):
        other = "; ".join(differences(store.identity, same))
        raise ValueError(f"the store {shorten(str(folder))} holds another sweep: {other}. Choose another folder.")
    return store


def open_store(folder: str | os.PathLike[str]) -> Store:
    """Open a store as it is.

    Raises:
        ValueError: if the folder is none, or its manifest or axes cannot be read.
    """
    place = Path(folder)
    try:
        manifest = read_manifest(place / MANIFEST)
        room = sum(shape[0] * dtype.itemsize for shape, dtype in manifest.axes.values())
        arrays = read_archive(place / AXES, room + _ROOM * (len(manifest.axes) + 1))
        check_arrays(arrays, {f"axes/{name}": expected for name, expected in manifest.axes.items()})
        axes = {name: arrays[f"axes/{name}"] for name in manifest.axes}
        if {name: axis_identity(values) for name, values in axes.items()} != manifest.identity["axes"]:
            raise ValueError(f"{AXES} and {MANIFEST} do not belong together")
    except ValueError as error:
        raise ValueError(f"{shorten(str(folder))} is not the store of a sweep: {str(error).rstrip('.')}.") from error
    return Store(place, manifest, Designs(axes, manifest.zipped))


def _write_once(path: Path, text: str) -> None:
    """Write a file that nobody has written yet, whole; if somebody was faster, leave theirs."""
    temporary = path.with_name(f".reojax-{os.getpid()}-{time.monotonic_ns()}")
    try:
        with temporary.open("x") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        try:
            os.link(temporary, path)
        except FileExistsError:
            pass
        except OSError:  # a file system without links
            os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _sweep_out(folder: Path) -> None:
    """Remove temporary files that killed processes have left."""
    for file in folder.glob(".reojax-*"):
        with suppress(FileNotFoundError):  # another process has just renamed it
            if time.time() - file.stat().st_mtime > _LEFT_OVER:
                file.unlink()

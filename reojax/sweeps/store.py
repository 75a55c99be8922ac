"""A sweep on disk: a folder that any NumPy and JSON reader understands.

    sweep.json            what was computed: axes, function, robots, results, versions, units, and one hash of it all
    axes.npz              values, `axes/NAME`
    chunk-00000017.npz    results of chunk 17, `results/NAME` with its designs in front; `start` and `stop`, their
                          numbers; the hash; `bad/design` and `bad/reason`, the numbers of the bad ones and why

Files appear whole: written beside, synced, and renamed. So any number of processes may work on one store, and one
that is killed loses the chunks it is at. A file that was damaged later is noticed (checksums of the zip format).
"""

import json
import os
import time
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from reojax._internal.files import replacing
from reojax.sweeps.chunks import Chunk, Chunking
from reojax.sweeps.grid import Designs
from reojax.sweeps.identity import SCHEMA, axis_identity, differences, digest
from reojax.sweeps.outputs import Output

MANIFEST, AXES = "sweep.json", "axes.npz"
_LEFT_OVER = 3600.0
"""Age from which a temporary file is one that a killed process left behind [s]."""


class Store:
    """A folder of chunks."""

    def __init__(self, folder: Path, manifest: Mapping[str, Any], designs: Designs) -> None:
        """Open what `create` or `open_store` has checked."""
        self.folder, self.designs = folder, designs
        self.identity: dict[str, Any] = manifest["identity"]
        self.units: dict[str, str] = manifest["units"]
        self.hash = digest(self.identity)
        self.outputs = tuple(
            Output(output["name"], tuple(output["shape"]), np.dtype(output["dtype"]))
            for output in self.identity["results"]
        )
        chunk, block = self.identity["chunk"], self.identity["block"]
        self.sizes = Chunking(designs.total, chunk, block, -(-chunk // block))

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
        members["bad/reason"] = np.array(list(chunk.bad.values()), str)
        members |= {f"results/{o.name}": values for o, values in zip(self.outputs, chunk.results, strict=True)}
        with replacing(self.file(chunk.number)) as file:
            np.savez(file, allow_pickle=False, **members)

    def get(self, number: int) -> Chunk | None:
        """Read a chunk; None if it is not there, damaged, or of another sweep."""
        if not self.has(number):
            return None
        start, stop = self.sizes.bounds(number)
        try:
            with self.file(number).open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                if str(file["hash"]) != self.hash or (int(file["start"]), int(file["stop"])) != (start, stop):
                    return None
                results = [file[f"results/{output.name}"] for output in self.outputs]
                reasons = [str(reason) for reason in file["bad/reason"]]
                bad = dict(zip(file["bad/design"].tolist(), reasons, strict=True))
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None
        for output, values in zip(self.outputs, results, strict=True):
            if values.shape != (stop - start, *output.shape) or values.dtype != output.dtype:
                return None
        return Chunk(number, results, bad)


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
        raise ValueError(f"cannot use {str(folder)!r} as a store: {error.strerror or error}.") from error
    store = open_store(place)
    if store.hash != digest(same):
        other = "; ".join(differences(store.identity, same))
        raise ValueError(f"the store {str(folder)!r} holds another sweep: {other}. Choose another folder.")
    return store


def open_store(folder: str | os.PathLike[str]) -> Store:
    """Open a store as it is.

    Raises:
        ValueError: if the folder is none, or its manifest or axes cannot be read.
    """
    place = Path(folder)
    try:
        manifest = json.loads((place / MANIFEST).read_text())
        if manifest["identity"]["schema"] != SCHEMA:
            raise ValueError(f"its layout is {manifest['identity']['schema']!r}; this reojax reads {SCHEMA!r}")
        with np.load(place / AXES, allow_pickle=False) as file:
            axes = {name: file[f"axes/{name}"] for name in manifest["identity"]["order"]}
        if {name: axis_identity(values) for name, values in axes.items()} != manifest["identity"]["axes"]:
            raise ValueError(f"{AXES} and {MANIFEST} do not belong together")
        return Store(place, manifest, Designs(axes, manifest["identity"]["zipped"]))
    except Exception as error:
        raise ValueError(f"{str(folder)!r} is not the store of a sweep: {_text(error)}.") from error


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


def _text(error: Exception) -> str:
    return f"there is no {error}" if isinstance(error, KeyError) else str(error).rstrip(".")

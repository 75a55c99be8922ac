"""What command line, experiments and benchmarks set before they compute; the library sets nothing."""

import ctypes
import os
import re
import sys
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jaxlib
from jax.experimental.compilation_cache.compilation_cache import reset_cache

from reojax._internal import checks, kept

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # malloc.h
CACHE_BYTES = 2**30
"""Bound on the compilation cache, kept by removing the oldest programs at the start."""
_LOOP_BY_LOOP: dict[str, bool | int | str] = (
    {"xla_cpu_use_fusion_emitters": False} if jaxlib.version.__version_info__ < (0, 11) else {}
)
LEAN_COMPILE = _LOOP_BY_LOOP
"""Options of a `jax.jit` whose program runs some milliseconds in all: a quarter less to compile, about as fast."""
LEAST_COMPILE = _LOOP_BY_LOOP | {"xla_backend_optimization_level": 0}
"""Options of a `jax.jit` whose program runs once or twice: a quarter of the compile time, several times as slow."""
SEARCH_COMPILE = {"xla_backend_optimization_level": 3}
"""Options of a `jax.jit` that a search runs many hundred times: optimised in a process that compiles quickly, too."""

_folders: set[Path] = set()
"""Folders that this process has kept programs in."""


class CompilationCache(NamedTuple):
    """Where compiled programs are kept for the next run, and how much there is of them."""

    folder: Path | None
    """None where no programs are kept, because the environment says `REOJAX_CACHE=0`."""
    programs: int
    """Number of programs there now."""
    size: int
    """What they take now [bytes]."""
    limit: int | None
    """What they may take [bytes], kept by removing the oldest when a process begins; None: nothing is removed."""


def start() -> None:
    """Switch float64 on, hold freed memory, and keep compiled programs for the next run, where that can be."""
    jax.config.update("jax_enable_x64", True)
    hold_memory()
    with suppress(ValueError):  # no home, no permission, a file in the way
        kept.keep_in(_own(cache()))


def cache(folder: str | os.PathLike[str] | None = None, *, limit: int = CACHE_BYTES) -> CompilationCache:
    """Keep compiled programs in a folder, so that the next run of a script reads them instead of compiling.

    One call, before or after the first compilation; what compiles from then on is kept, whatever its size. An entry
    that cannot be read, as a process that was killed may leave it, is made anew without a word. Deleting the folder is
    safe. Keep others from writing to it: programs are run as they are found. The environment goes first:
    `REOJAX_CACHE=0` switches this off, and a folder that JAX has been told of already (`JAX_COMPILATION_CACHE_DIR`)
    stays as it is, unless `folder` is given.

    Args:
        folder: default `$XDG_CACHE_HOME/reojax/jax`, or `~/.cache/reojax/jax`.
        limit: bound on the size of all programs [bytes]; the oldest beyond it are removed by this call.

    Returns:
        The folder, and the number and the size of the programs that it has.

    Raises:
        ValueError: if the folder cannot be made or written, or `limit` is no positive integer.
    """
    limit = checks.whole("limit", limit, most=2**63)
    told = jax.config.values["jax_compilation_cache_dir"]
    if os.environ.get("REOJAX_CACHE") == "0":
        return CompilationCache(None, 0, 0, None)
    if told and folder is None:
        return CompilationCache(Path(told), *_content(Path(told)), None)
    place = _usable(folder)
    _trim(place, limit)
    jax.config.update("jax_compilation_cache_dir", str(place))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    reset_cache()  # JAX has looked for a folder at its first compilation, and would not look again
    _forget_damaged(place)
    return CompilationCache(place, *_content(place), limit)


def _own(found: CompilationCache) -> Path | None:
    """A folder of programs that is reojax's own, and none that JAX has been told of: it is bounded."""
    return None if found.limit is None else found.folder


def _usable(folder: str | os.PathLike[str] | None) -> Path:
    try:
        place = cache_folder() if folder is None else Path(folder).expanduser().absolute()
        place.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError, TypeError) as error:
        reason = getattr(error, "strerror", None) or error
        name = "the default folder" if folder is None else checks.shorten(os.fspath(folder))
        raise ValueError(f"`folder`, {name}, cannot be made: {reason}.") from error
    if not os.access(place, os.W_OK | os.X_OK):
        raise ValueError(f"`folder`, {checks.shorten(str(place))}, cannot be written to.")
    return place


def _content(folder: Path) -> tuple[int, int]:
    """Number and size of the programs in a folder."""
    sizes = [size for name, size, _ in _files(folder) if name.endswith(("-cache", kept.SUFFIX))]
    return len(sizes), sum(sizes)


def _files(folder: Path) -> list[tuple[str, int, float]]:
    """Name, size and time of every file; another process may be removing some."""
    found = []
    for file in folder.iterdir() if folder.is_dir() else ():
        with suppress(OSError):
            state = file.stat()
            if file.is_file():
                found.append((file.name, state.st_size, state.st_mtime))
    return found


def _forget_damaged(folder: Path) -> None:
    """Let entries of the cache that cannot be read be made anew, without a word, instead of a warning at every run."""
    if not _folders:
        show = warnings.showwarning

        def show_others(message: Warning | str, *rest: Any, **more: Any) -> None:
            found = re.match(r"Error reading persistent compilation cache entry for '(\w+)'", str(message))
            if found is None:
                return show(message, *rest, **more)
            for file in (file for folder in _folders for file in folder.glob(f"{found[1]}-*")):
                file.unlink(missing_ok=True)
            return None

        warnings.showwarning = show_others
    _folders.add(folder)
    warnings.filterwarnings("always", "Error reading persistent compilation cache entry", UserWarning)


def hold_memory() -> None:
    """Keep freed memory for the next call instead of giving it back to the system (glibc).

    XLA asks for its buffers anew at every call; where their pages are fresh each time, some programs take three times
    as long. What the environment says (`MALLOC_TRIM_THRESHOLD_`, `MALLOC_MMAP_THRESHOLD_`) goes first, and
    `REOJAX_HOLD_MEMORY=0` leaves the allocator alone. The first net rotation of a process on the CPU calls this.
    """
    left_alone = os.environ.get("REOJAX_HOLD_MEMORY") == "0" or any(name.startswith("MALLOC_") for name in os.environ)
    if sys.platform == "linux" and not left_alone:
        mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # musl has none
        if mallopt:
            mallopt(_M_TRIM_THRESHOLD, 2**28)
            mallopt(_M_MMAP_THRESHOLD, 2**25)  # the most it takes


def usable_cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def one_device_per_core() -> None:
    """Make every core that this process may use a device of JAX, for sweeps: XLA runs a program mostly in one thread.

    Nothing happens where devices have been set already (`JAX_NUM_CPU_DEVICES`, `XLA_FLAGS`) or are in use.
    """
    chosen = "xla_force_host_platform_device_count" in os.environ.get("XLA_FLAGS", "")
    if not chosen and jax.config.values["jax_num_cpu_devices"] < 1:
        with suppress(RuntimeError):  # JAX has started
            jax.config.update("jax_num_cpu_devices", usable_cores())


def compile_quickly() -> None:
    """Let XLA optimise less: a quarter of the compile time, the same operations, slower programs.

    For work that compiles far more than it computes, such as tests. Takes effect before the first compilation only,
    and not where `XLA_FLAGS` is set already. A flag that XLA does not know ends the process, hence the version.
    """
    options = LEAST_COMPILE | {"xla_cpu_parallel_codegen_split_count": 1}  # one module takes less work than its parts
    flags = (f"--{name}={str(value).lower()}" for name, value in options.items())
    os.environ.setdefault("XLA_FLAGS", " ".join(flags))


def cache_folder() -> Path:
    """Folder of the compilation cache."""
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (base if base.is_absolute() else Path.home() / ".cache") / "reojax" / "jax"


def _trim(folder: Path, limit: int) -> None:
    """Remove the oldest files until `limit` bytes are left. (JAX's own bound needs a further package.)"""
    files = _files(folder)
    excess = sum(size for _, size, _ in files) - limit
    for name, size, _ in sorted(files, key=lambda file: file[2]):
        if excess <= 0:
            break
        with suppress(OSError):
            (folder / name).unlink()
        excess -= size

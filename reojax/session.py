"""What command line, experiments and benchmarks set before they compute; the library sets nothing."""

import ctypes
import os
import re
import sys
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any

import jax
import jaxlib

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # malloc.h
CACHE_BYTES = 2**30
"""Bound on the compilation cache, kept by removing the oldest programs at the start."""


def start() -> None:
    """Switch float64 on, hold freed memory, and keep compiled programs for the next run.

    The programs go to `$XDG_CACHE_HOME/reojax/jax` (default `~/.cache/reojax/jax`), unless `REOJAX_CACHE` is 0, a
    cache has been set already (`JAX_COMPILATION_CACHE_DIR`), or the folder cannot be written.
    """
    jax.config.update("jax_enable_x64", True)
    hold_memory()
    if os.environ.get("REOJAX_CACHE") == "0" or jax.config.values["jax_compilation_cache_dir"]:
        return
    try:
        folder = cache_folder()
        folder.mkdir(parents=True, exist_ok=True)
        _trim(folder, CACHE_BYTES)
    except (OSError, RuntimeError):  # no home, no permission, a file in the way
        return
    if os.access(folder, os.W_OK | os.X_OK):
        jax.config.update("jax_compilation_cache_dir", str(folder))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
        _forget_damaged(folder)


def _forget_damaged(folder: Path) -> None:
    """Let entries of the cache that cannot be read be made anew, without a word, instead of a warning at every run."""
    show = warnings.showwarning

    def told(message: Warning | str, *rest: Any, **more: Any) -> None:
        found = re.match(r"Error reading persistent compilation cache entry for '(\w+)'", str(message))
        if found is None:
            return show(message, *rest, **more)
        for file in folder.glob(f"{found[1]}-*"):
            file.unlink(missing_ok=True)
        return None

    warnings.showwarning = told
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
    flags = "--xla_backend_optimization_level=0"
    if jaxlib.version.__version_info__ < (0, 11):
        flags += " --xla_cpu_use_fusion_emitters=false"
    os.environ.setdefault("XLA_FLAGS", flags)


def cache_folder() -> Path:
    """Folder of the compilation cache."""
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (base if base.is_absolute() else Path.home() / ".cache") / "reojax" / "jax"


def _trim(folder: Path, limit: int) -> None:
    """Remove the oldest files until `limit` bytes are left. (JAX's own bound needs a further package.)"""
    files = [(file.stat(), file) for file in folder.iterdir() if file.is_file()]
    excess = sum(stat.st_size for stat, _ in files) - limit
    for stat, file in sorted(files, key=lambda item: item[0].st_mtime):
        if excess <= 0:
            break
        file.unlink(missing_ok=True)
        excess -= stat.st_size

"""C source to a library that Python calls."""

import ctypes
import shutil
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ._rows import Missing


def build(source: str, flags: Sequence[str]) -> tuple[ctypes.CDLL, float]:
    """Compile with gcc; return the loaded library and the seconds it took.

    Raises:
        Missing: if there is no gcc, or it refuses.
    """
    if not shutil.which("gcc"):
        raise Missing("gcc is not installed")
    with tempfile.TemporaryDirectory() as folder:
        file, library = Path(folder) / "source.c", Path(folder) / "library.so"
        file.write_text(source)
        start = time.perf_counter()
        command = ["gcc", "-std=gnu11", *flags, "-shared", "-fPIC", str(file), "-o", str(library), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True)
        seconds = time.perf_counter() - start
        if done.returncode:
            raise Missing(f"gcc failed: {done.stderr.strip().splitlines()[-1]}")
        return ctypes.CDLL(str(library)), seconds


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    """Return the address of a contiguous float64 array, for a call during which the array lives."""
    assert array.dtype == np.float64
    assert array.flags.c_contiguous
    return ctypes.c_void_p(array.ctypes.data)

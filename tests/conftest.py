"""A hostile test environment: strict shapes and dtypes, NaN is an error, float64 on; and a quick compiler.

`REOJAX_TEST_X64=0` leaves float64 off, JAX's default, for the tests marked `float32`. `REOJAX_TEST_CACHE` is a folder
for compiled programs; default one of pytest's.
"""

import gc
import os
from collections.abc import Iterator
from pathlib import Path

import jax
import pytest
from helpers import shapes

shapes.install()

from reojax.session import compile_quickly  # noqa: E402

MOST_BYTES, GROWTH = 2e9, 1e9
"""Memory of a process from which on compiled programs are let go, and how much more it takes before the next time."""
_most = MOST_BYTES
LONGEST = (
    "test_compile_keys.py",
    "steering/test_righting.py",
    "planning/test_free_paths.py",
    "planning/test_plan.py",
    "captures/test_calibration.py",
    "collision/test_path_clearance.py",
    "cli/test_plan_readers.py",
    "mechanics/test_no_lapack.py",
    "mechanics/test_derivatives.py",
    "design/test_authority.py",
)
"""Files that take longest, begun first: no process is left alone with one of them at the end."""
X64 = os.environ.get("REOJAX_TEST_X64", "1") != "0"

compile_quickly()
jax.config.update("jax_enable_x64", X64)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_debug_nans", True)


def pytest_collection_finish() -> None:
    """Look for garbage seldom: a tenth of the time goes there otherwise.

    (To freeze what stays would save a little more, and breaks the oldest Hypothesis that is allowed.)
    """
    gc.set_threshold(100_000, 20, 20)


def pytest_configure(config: pytest.Config) -> None:
    """Keep compiled programs for the next run, and for the other processes of this one."""
    told = os.environ.get("REOJAX_TEST_CACHE")
    if not told and not hasattr(config, "cache"):  # pytest -p no:cacheprovider
        return
    folder = Path(told or config.cache.mkdir("jax"))  # pyright: ignore[reportOptionalMemberAccess]
    folder.mkdir(parents=True, exist_ok=True)
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first; without float64 only the tests that are meant for that run."""
    place = {Path(__file__).parent / name: rank for rank, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path, len(place)))
    if not X64:
        skip = pytest.mark.skip(reason="needs float64")
        for item in items:
            if item.get_closest_marker("float32") is None:
                item.add_marker(skip)


@pytest.fixture(autouse=True, scope="module")
def _forget_programs() -> Iterator[None]:
    """Compiled programs take gigabytes by the end: they are let go before that, and not after every file.

    Freed memory is held for what comes, so what counts is how much has been taken since they were let go last.
    """
    global _most
    yield
    if _resident() > _most:
        jax.clear_caches()
        gc.collect()
        _most = _resident() + GROWTH


def _resident() -> float:
    """Memory of this process [bytes]; infinite where nothing tells it."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, AttributeError, ValueError):
        return float("inf")

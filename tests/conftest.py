"""A hostile test environment: strict shapes and dtypes, NaN is an error, float64 on; and a quick compiler."""

from collections.abc import Iterator

import jax
import pytest

from reojax.session import compile_quickly

compile_quickly()
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_debug_nans", True)


@pytest.fixture(autouse=True, scope="module")
def _forget_programs() -> Iterator[None]:
    """Compiled programs take gigabytes by the end; few of them serve two files."""
    yield
    jax.clear_caches()

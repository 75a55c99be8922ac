"""What asks for more than single precision computes in double precision on the host, or says how to switch it on."""

import warnings
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

import jax
import numpy as np

Arguments = ParamSpec("Arguments")
Answer = TypeVar("Answer")


def in_double(function: Callable[Arguments, Answer]) -> Callable[Arguments, Answer]:
    """Let a function of the host, outside of transformations, compute in float64 whatever JAX's default."""

    @wraps(function)
    def computed(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Answer:
        with jax.enable_x64(True):
            return function(*args, **kwargs)

    return computed


def warn_if_single(what: str, dtype: np.dtype, stacklevel: int = 3) -> None:
    """Warn, at the line that calls the public function, that float32 gives less than `what` promises."""
    if dtype == np.float32:
        warnings.warn(
            f"{what} in single precision, JAX's default: switch double precision on by jax.config.update("
            '"jax_enable_x64", True) before anything is computed.',
            UserWarning,
            stacklevel=stacklevel,
        )

"""What asks for more than single precision computes in double precision on the host, or says how to switch it on."""

import sys
import warnings
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

import jax
import numpy as np

_PACKAGE = str(Path(__file__).parents[1])
_BETWEEN = ("jax.", "jax._src", "jaxtyping", "beartype")
"""Modules that may stand between a user's line and what it calls."""
Arguments = ParamSpec("Arguments")
Answer = TypeVar("Answer")
Tree = TypeVar("Tree")


def in_double(function: Callable[Arguments, Answer]) -> Callable[Arguments, Answer]:
    """Let a function of the host, outside of transformations, compute in float64 whatever JAX's default."""

    @wraps(function)
    def compute(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Answer:
        args, kwargs = own_copies((args, kwargs))
        with jax.enable_x64(True):
            return function(*args, **kwargs)

    return compute


def own_copies(tree: Tree) -> Tree:
    """The same with NumPy arrays of its own.

    JAX remembers, by the array object, which float a NumPy array within a live program was taken for. The same object
    under another default would be an error; so what switches the default works on copies.
    """
    try:
        return jax.tree.map(lambda leaf: leaf.copy() if isinstance(leaf, np.ndarray) else leaf, tree)
    except (TypeError, ValueError):  # something that is no tree, which the function refuses by name
        return tree


def as_double(tree: Tree) -> Tree:
    """The same with NumPy arrays of its own in float64, whatever they were made of."""
    return jax.tree.map(lambda leaf: np.array(leaf, float), tree)


def warn_if_single(what: str, dtype: np.dtype) -> None:
    """Warn that float32 gives less than `what` promises."""
    if dtype == np.float32:
        warn_user(
            f"{what} in single precision, JAX's default: switch double precision on by jax.config.update("
            '"jax_enable_x64", True) before anything is computed.'
        )


def warn_user(message: str) -> None:
    """Warn at the line of the user's that led here."""
    level, frame = 1, sys._getframe()
    while frame is not None and (
        frame.f_code.co_filename.startswith((_PACKAGE, "<")) or frame.f_globals["__name__"].startswith(_BETWEEN)
    ):
        level, frame = level + 1, frame.f_back
    warnings.warn(message, UserWarning, stacklevel=level)

"""The designs of a sweep: a full grid of axes, or a list; any stretch of them from its numbers alone."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from math import prod
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Shaped
from numpy.typing import ArrayLike

from reojax._internal.arrays import is_concrete
from reojax._internal.checks import shorten


class Designs(NamedTuple):
    """Checked axes of a sweep. Designs are numbered through the grid, the last axis fastest."""

    axes: dict[str, np.ndarray]
    """Values by name; 1-D."""
    zipped: bool
    """Whether the axes are columns of one list of designs, and not the sides of a grid."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape that results have in front: one side per axis, or the length of the list."""
        sides = tuple(len(values) for values in self.axes.values())
        return sides[:1] if self.zipped else sides

    @property
    def total(self) -> int:
        """Number of designs."""
        return prod(self.shape)

    @property
    def dimensions(self) -> tuple[str, ...]:
        """Names of the sides of `shape`."""
        return ("design",) if self.zipped else tuple(self.axes)

    def stretch(self, start: int, stop: int) -> dict[str, Shaped[np.ndarray, " m"]]:
        """Return the designs `start` to `stop`, by name, without building the others."""
        if self.zipped:
            return {name: values[start:stop] for name, values in self.axes.items()}
        number = np.arange(start, stop)
        columns = {}
        for name, values in reversed(self.axes.items()):
            number, place = np.divmod(number, len(values))
            columns[name] = values[place]
        return {name: columns[name] for name in self.axes}

    def design(self, number: int) -> dict[str, float]:
        """Return one design as plain numbers."""
        return {name: column[0].item() for name, column in self.stretch(number, number + 1).items()}


class Zipped(dict[str, ArrayLike]):
    """Axes of equal length that belong together, value by value; made by `zipped`."""


def zipped(axes: Mapping[str, ArrayLike] | None = None, /, **more: ArrayLike) -> Zipped:
    """List of designs for `sweep`: design `i` has entry `i` of every array.

    Args:
        axes: arrays (m, ...) of one length m, by name.
        more: further ones, `zipped(twist=..., bend=...)`.

    Raises:
        ValueError: if the arrays are not of one length, or there is none.
    """
    if axes is not None and not isinstance(axes, Mapping):
        raise ValueError(f"`axes` is {shorten(axes)}; it must map names to the values of each axis.")
    return Zipped({**(axes or {}), **more})


def check_axes(axes: Mapping[str, ArrayLike]) -> Designs:
    """Check the axes of a sweep.

    Raises:
        ValueError: naming the axis and what is wrong with it.
    """
    if not isinstance(axes, Mapping) or not axes:
        raise ValueError(f"`axes` is {shorten(axes)}; it must map at least one name to the values of that axis.")
    checked = {name: _check_axis(name, values) for name, values in axes.items()}
    lengths = {name: len(values) for name, values in checked.items()}
    if isinstance(axes, Zipped) and len(set(lengths.values())) > 1:
        raise ValueError(f"zipped axes must be equally long; they have {_as_list(lengths)} values.")
    return Designs(checked, isinstance(axes, Zipped))


def check_function(function: Callable[..., Any], designs: Designs) -> None:
    """Check that `function` takes the axes by name.

    Raises:
        ValueError: if it does not.
    """
    if not callable(function):
        raise ValueError(f"`function` is {shorten(function)}; it must be a function of the axes' names.")
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # built in, without a signature: the call will tell
        return
    try:
        signature.bind(**dict.fromkeys(designs.axes))
    except TypeError as error:
        names = ", ".join(designs.axes)
        raise ValueError(f"`function` takes {signature}, and the axes are {names}: {error}.") from error


def _check_axis(name: str, values: ArrayLike) -> np.ndarray:
    if not isinstance(name, str) or not name:
        raise ValueError(f"an axis is named {name!r}; names must be text.")
    if not is_concrete(values):
        raise ValueError(f"axis {name!r} is being traced by JAX; a sweep runs outside `jit`, `vmap` and `grad`.")
    try:
        array = np.asarray(values)
    except (TypeError, ValueError) as error:
        raise ValueError(f"axis {name!r} is {shorten(values)}; it must be a list of real numbers.") from error
    if array.ndim != 1 or not array.size:
        raise ValueError(f"axis {name!r} has shape {array.shape}; it must be a list of one value or more.")
    if not (np.issubdtype(array.dtype, np.integer) or jax.numpy.issubdtype(array.dtype, np.floating)):
        raise ValueError(f"axis {name!r} has entries of type {array.dtype}; only real numbers will do.")
    given = array
    with np.errstate(over="ignore"):
        array = array.astype(jax.dtypes.canonicalize_dtype(array.dtype))
    wrong = ~np.isfinite(array) if jax.numpy.issubdtype(array.dtype, np.floating) else array != given
    if wrong.any():
        first = np.flatnonzero(wrong)[0]
        raise ValueError(f"{name}[{first}] is {given[first]}; values of an axis must be finite and fit {array.dtype}.")
    return array


def _as_list(numbers: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {number}" for name, number in numbers.items())

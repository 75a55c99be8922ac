"""Arrays of a robot: NumPy's, which keep float64 whatever JAX is set to, with `.at[...]` as JAX's have it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np


class Entries(np.ndarray):
    """A NumPy array with `at`; JAX takes it as it takes any array of NumPy's."""

    @property
    def at(self) -> "_At":
        """`array.at[index].set(value)` and its kin: a changed copy, as of a JAX array."""
        return _At(self)


class _At:
    def __init__(self, array: Entries) -> None:
        self._array = array

    def __getitem__(self, index: Any) -> "_Place":
        return _Place(self._array, index)


class _Place:
    """One place of an array; with JAX's arrays in index or value the copy is JAX's."""

    def __init__(self, array: Entries, index: Any) -> None:
        self._array, self._index = array, index

    def set(self, values: Any) -> Any:
        """The values there, replaced."""
        return self._change("set", values, lambda _, new: new)

    def add(self, values: Any) -> Any:
        """The values there, increased."""
        return self._change("add", values, np.add)

    def subtract(self, values: Any) -> Any:
        """The values there, decreased."""
        return self._change("subtract", values, np.subtract)

    def multiply(self, values: Any) -> Any:
        """The values there, times `values`."""
        return self._change("multiply", values, np.multiply)

    mul = multiply

    def divide(self, values: Any) -> Any:
        """The values there, over `values`."""
        return self._change("divide", values, np.divide)

    def power(self, values: Any) -> Any:
        """The values there, to the power of `values`."""
        return self._change("power", values, np.power)

    def min(self, values: Any) -> Any:
        """The lesser of the values there and `values`."""
        return self._change("min", values, np.minimum)

    def max(self, values: Any) -> Any:
        """The larger of the values there and `values`."""
        return self._change("max", values, np.maximum)

    def apply(self, function: Callable[[Any], Any]) -> Any:
        """The values there, taken through a function."""
        return jnp.asarray(self._array).at[self._index].apply(function)

    def get(self) -> Any:
        """The values there."""
        return jnp.asarray(self._array).at[self._index].get() if self._on_device() else self._array[self._index]

    def _on_device(self, *values: Any) -> bool:
        return any(isinstance(leaf, jax.Array) for leaf in jax.tree.leaves((self._index, *values)))

    def _change(self, name: str, values: Any, change: Callable[[Any, Any], Any]) -> Any:
        if self._on_device(values):
            return getattr(jnp.asarray(self._array).at[self._index], name)(values)
        copy = np.array(self._array, copy=True).view(Entries)
        copy[self._index] = change(copy[self._index], np.asarray(values))
        copy.setflags(write=False)
        return copy

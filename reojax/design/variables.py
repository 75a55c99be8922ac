"""What a design problem may change: named numbers with bounds and units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array, as_numbers
from reojax._internal.checks import shorten

SI = {
    "": 1.0,
    "rad": 1.0,
    "deg": np.pi / 180,
    "kg": 1.0,
    "g": 1e-3,
    "m": 1.0,
    "mm": 1e-3,
    "kg m^2": 1.0,
    "kg mm^2": 1e-6,
    "g mm^2": 1e-9,
}
"""Units that variables may have, and what they are in SI."""


class Variable(NamedTuple):
    """A named number, or vector, that a design may choose."""

    name: str
    lower: ArrayLike
    """Least value, in `unit`."""
    upper: ArrayLike
    """Largest value, in `unit`."""
    unit: str = ""
    """One of `SI`."""
    catalogue: Sequence[float] = ()
    """The values that can be bought, in `unit`; empty where any value can be had. Numbers only, not vectors."""


class Space:
    """The box of several variables, and the way between vectors, in SI, and named values."""

    def __init__(self, variables: Sequence[Variable]) -> None:
        """Check the variables.

        Args:
            variables: one or more, in the order that they have in the vector.

        Raises:
            ValueError: for names that repeat, an unknown unit, bounds the wrong way round, or a catalogue outside.
        """
        self.variables = tuple(variables)
        for k, variable in enumerate(self.variables):
            if not isinstance(variable, Variable) or not isinstance(variable.name, str) or not variable.name:
                raise ValueError(f"variables[{k}] is {shorten(variable)}; it must be a Variable with a name.")
        self.names = tuple(variable.name for variable in self.variables)
        if not self.variables or len(set(self.names)) != len(self.names):
            raise ValueError(f"`variables` are named {self.names}; there must be at least one, and names must differ.")
        lower, upper = zip(*(_bounds(variable) for variable in self.variables), strict=True)
        self._shapes = [low.shape for low in lower]
        ends = np.cumsum([low.size for low in lower])
        self._places = [slice(end - low.size, end) for low, end in zip(lower, ends, strict=True)]
        self.lower: Float[np.ndarray, " n"] = np.concatenate([low.ravel() for low in lower])
        self.upper: Float[np.ndarray, " n"] = np.concatenate([high.ravel() for high in upper])

    def place(self, name: str) -> slice:
        """Where a variable stands in the vector.

        Raises:
            ValueError: for an unknown name.
        """
        if name not in self.names:
            raise ValueError(f"there is no variable {name!r}; the variables are {', '.join(self.names)}.")
        return self._places[self.names.index(name)]

    def named(self, x: Array) -> dict[str, Array]:
        """Values in SI by name, of a vector `x` (n,) or several (m, n); may be traced."""
        return {
            name: x[..., place].reshape(x.shape[:-1] + shape)
            for name, place, shape in zip(self.names, self._places, self._shapes, strict=True)
        }

    def vector(self, values: Mapping[str, ArrayLike]) -> Float[np.ndarray, " n"]:
        """Vector (n,) in SI of a design whose `values` are given by name, in the variables' own units.

        Raises:
            ValueError: for unknown or missing names, or a wrong shape.
        """
        for name in values:
            self.place(name)
        x = np.empty_like(self.lower)
        for variable, shape in zip(self.variables, self._shapes, strict=True):
            if variable.name not in values:
                raise ValueError(f"the variable {variable.name!r} is missing.")
            array = np.asarray(as_numbers(variable.name, values[variable.name]))
            if array.shape != shape:
                raise ValueError(f"`{variable.name}` has shape {array.shape}; it must be {shape}.")
            x[self.place(variable.name)] = array.ravel() * SI[variable.unit]
        return x

    def hold(
        self, x: Float[np.ndarray, "m n"], held: Mapping[str, np.ndarray]
    ) -> tuple[Float[np.ndarray, "m n"], Float[np.ndarray, "m n"], Float[np.ndarray, "m n"]]:
        """Designs and their lower and upper bounds, with variables kept at values (1 or m, ...) in SI.

        Args:
            x: designs in SI.
            held: values by name, NaN where the variable is free.

        Raises:
            ValueError: for an unknown name, or a value outside of its bounds.
        """
        lower, upper = np.tile(self.lower, (len(x), 1)), np.tile(self.upper, (len(x), 1))
        x = x.copy()
        for name, value in held.items():
            place = self.place(name)
            part = np.broadcast_to(value.reshape(len(value), -1), x[:, place].shape)
            fixed = ~np.isnan(part)
            if (fixed & ~((lower[:, place] <= part) & (part <= upper[:, place]))).any():
                values = shorten(np.squeeze(value).tolist())
                raise ValueError(f"{name!r} is held at {values}, which is outside of its bounds (SI).")
            for array in (x, lower, upper):
                array[:, place] = np.where(fixed, part, array[:, place])
        return x, lower, upper

    def catalogues(self) -> dict[str, Float[np.ndarray, " k"]]:
        """The catalogues in SI, by name, of the variables that have one."""
        return {
            v.name: np.sort(np.asarray(v.catalogue, float)) * SI[v.unit] for v in self.variables if len(v.catalogue)
        }


def _bounds(variable: Variable) -> tuple[np.ndarray, np.ndarray]:
    name = variable.name
    if not isinstance(variable.unit, str) or variable.unit not in SI:
        raise ValueError(f"variable {name!r} has unit {variable.unit!r}; the units are {', '.join(map(repr, SI))}.")
    low, high = (np.asarray(as_numbers(f"{name}.{end}", getattr(variable, end))) for end in ("lower", "upper"))
    if low.shape != high.shape:
        raise ValueError(f"variable {name!r} has bounds of shapes {low.shape} and {high.shape}; they must agree.")
    if not (np.isfinite(low).all() and np.isfinite(high).all() and (low <= high).all()):
        raise ValueError(f"variable {name!r} has bounds {low} and {high}; they must be finite, the lower one first.")
    if len(variable.catalogue):
        entries: Any = np.asarray(as_numbers(f"{name}.catalogue", variable.catalogue))
        if low.shape or not ((low <= entries) & (entries <= high)).all():
            raise ValueError(f"variable {name!r} has the catalogue {entries}; it must lie within its bounds, numbers.")
    return low * SI[variable.unit], high * SI[variable.unit]


def neighbours(entries: np.ndarray, value: float) -> list[float]:
    """Catalogue entries on either side of a value, or the one that it is, or the end that it is beyond."""
    near = np.isclose(entries, value, rtol=1e-9, atol=0)
    if near.any():
        return [float(entries[near][0])]
    above = int(np.searchsorted(entries, value))
    return [float(entry) for entry in entries[max(above - 1, 0) : above + 1]]

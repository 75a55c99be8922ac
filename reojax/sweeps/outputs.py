"""What a sweep's function returns: names, shapes and types of its arrays, and which results are bad."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from reojax.sweeps.grid import Designs


class Output(NamedTuple):
    """One array of what the function returns for a design."""

    name: str
    """Where it sits in the pytree, `turn.angle`; `result` if the function returns one array."""
    shape: tuple[int, ...]
    dtype: np.dtype


class Outputs(NamedTuple):
    """All arrays that the function returns, in the order of the pytree's leaves."""

    arrays: tuple[Output, ...]
    structure: Any
    """Tree structure of JAX, to put the arrays together again."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the arrays."""
        return tuple(array.name for array in self.arrays)


def scalars(designs: Designs) -> dict[str, jax.ShapeDtypeStruct]:
    """Shapes and types of one design."""
    return {name: jax.ShapeDtypeStruct((), values.dtype) for name, values in designs.axes.items()}


def outputs_of(function: Callable[..., Any], designs: Designs) -> Outputs:
    """Find out what `function` returns, without computing it.

    Raises:
        ValueError: if it is not a pytree of arrays, or has none.
    """
    try:
        result = jax.eval_shape(lambda design: function(**design), scalars(designs))
    except TypeError as error:
        if "is not a valid JAX type" not in str(error):
            raise
        raise ValueError(f"`function` must return arrays, or a pytree of arrays: {error}") from error
    leaves, structure = jax.tree_util.tree_flatten_with_path(result)
    names = [jax.tree_util.keystr(path, simple=True, separator=".") or "result" for path, _ in leaves]
    if not leaves:
        raise ValueError("`function` returns no array; there is nothing to keep of a design.")
    for name, (_, leaf) in zip(names, leaves, strict=True):
        if leaf.dtype.kind not in "biufc":
            raise ValueError(f"result `{name}` has entries of type {leaf.dtype}; only NumPy's number types will do.")
    if len(set(names)) < len(names):
        raise ValueError(f"`function` returns several arrays of the same name, among {', '.join(names)}.")
    arrays = (Output(name, leaf.shape, np.dtype(leaf.dtype)) for name, (_, leaf) in zip(names, leaves, strict=True))
    return Outputs(tuple(arrays), structure)


def bytes_per_design(outputs: Sequence[Output]) -> int:
    """Memory that the results of a design take."""
    return sum(int(np.prod(output.shape, dtype=np.int64)) * output.dtype.itemsize for output in outputs)


def bad_rows(outputs: Outputs, results: list[np.ndarray]) -> dict[int, str]:
    """Rows of `results` (the designs' axis in front) with a number that is not finite, and which one it is."""
    found: dict[int, str] = {}
    for output, values in zip(outputs.arrays, results, strict=True):
        if not jax.numpy.issubdtype(output.dtype, np.inexact):
            continue
        finite = np.isfinite(values).reshape(len(values), -1).all(1)
        reason = f"`{output.name}` is not finite"
        for row in np.flatnonzero(~finite).tolist():
            found.setdefault(row, reason)
    return found


def blank(outputs: Outputs, rows: int) -> list[np.ndarray]:
    """Results of designs that failed: NaN, and zero where there is no NaN."""
    return [
        np.full((rows, *output.shape), np.nan if jax.numpy.issubdtype(output.dtype, np.inexact) else 0, output.dtype)
        for output in outputs.arrays
    ]

"""Cost and constraints as two compiled programs, values and derivatives, that take starts in blocks.

The starts that are still running change in number from step to step; blocks of one size, the last one filled up, let
one program serve them all. JAX runs the blocks one after the other while the next are being handed over.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from reojax._internal.arrays import Array

Function = Callable[..., Any]
_BLOCK, _VALUES_BLOCK = 8, 16
"""Most starts differentiated, and most points evaluated, in one call."""


class Values(NamedTuple):
    """Cost and constraints of points."""

    cost: Float[np.ndarray, " r"]
    rows: Float[np.ndarray, "r m"]
    """Equalities first, then inequalities."""


class Derivatives(NamedTuple):
    """Their first derivatives by the variables."""

    gradient: Float[np.ndarray, "r n"]
    jacobian: Float[np.ndarray, "r m n"]


class Functions(NamedTuple):
    """What is to be compiled; hashable. Several functions of a kind are differentiated apart, each in its best mode."""

    cost: Function
    equality: tuple[Function, ...]
    inequality: tuple[Function, ...]
    with_data: bool

    def call(self, function: Function, x: Array, data: Any) -> Array:
        """One function at one point."""
        return jnp.asarray(function(x, data) if self.with_data else function(x))


class Programs:
    """The two programs of some functions, for starts of one type, with the data of all starts."""

    def __init__(self, functions: Functions, x: Float[np.ndarray, "m n"], data: Any) -> None:
        """Compile them, unless they have been.

        Raises:
            ValueError: if a function does not return real numbers of the right rank.
        """
        self._data = jax.tree.map(np.asarray, data)
        self._dtype = x.dtype
        block = _power_of_two(min(len(x), _BLOCK))
        leaves, structure = jax.tree.flatten(self._data)
        types = tuple((leaf.shape[1:], jax.dtypes.canonicalize_dtype(leaf.dtype)) for leaf in leaves)
        self._blocks = (_VALUES_BLOCK, block)
        compiled = _compile(functions, x.dtype, x.shape[1], structure, types, self._blocks)
        self._values, self._derivatives, self.equalities = compiled

    def values(self, x: Float[np.ndarray, "r n"], owner: Int[np.ndarray, " r"]) -> Values:
        """Cost and constraints at points that belong to the starts `owner`."""
        cost, rows = self._run(self._values, self._blocks[0], x, owner)
        return Values(cost, rows)

    def derivatives(self, x: Float[np.ndarray, "r n"], owner: Int[np.ndarray, " r"]) -> tuple[Values, Derivatives]:
        """The same with first derivatives."""
        cost, rows, gradient, jacobian = self._run(self._derivatives, self._blocks[1], x, owner)
        return Values(cost, rows), Derivatives(gradient, jacobian)

    def _run(self, program: Function, block: int, x: np.ndarray, owner: np.ndarray) -> list[np.ndarray]:
        count = len(x)
        place = np.minimum(np.arange(-(-count // block) * block), count - 1).reshape(-1, block)
        data_of = lambda p: jax.tree.map(lambda leaf: leaf[owner[p]], self._data)
        with jax.debug_nans(False):  # a point that is not finite is not taken, and no error
            parts = [program(x[p].astype(self._dtype), data_of(p)) for p in place]
        return [
            np.concatenate([np.asarray(array, float) for array in arrays])[:count]
            for arrays in zip(*parts, strict=True)
        ]


@lru_cache(maxsize=64)
def _compile(
    functions: Functions,
    dtype: np.dtype,
    n: int,
    structure: Any,
    types: tuple[Hashable, ...],
    blocks: tuple[int, int],
) -> tuple[Function, Function, int]:
    """Both programs and the number of equalities. Only the last few are kept, as they hold on to a user's functions."""

    def values(x: Array, data: Any) -> tuple[Array, Array]:
        cost, equality, inequality = (
            [functions.call(f, x, data) for f in kind]
            for kind in ((functions.cost,), functions.equality, functions.inequality)
        )
        _check(cost, equality, inequality)
        return cost[0], _join(equality + inequality, x, 1)

    def derivatives(x: Array, data: Any) -> tuple[Array, Array, Array, Array]:
        call = lambda f: _differentiate(lambda x: functions.call(f, x, data), x)
        (cost, gradient), *pairs = [call(f) for f in (functions.cost, *functions.equality, *functions.inequality)]
        rows, jacobian = ([pair[i] for pair in pairs] for i in (0, 1))
        return cost, _join(rows, x, 1), gradient, _join(jacobian, x, 2)

    def lower(function: Function, block: int) -> Any:
        leaves = [jax.ShapeDtypeStruct((block, *shape), leaf) for shape, leaf in types]
        x = jax.ShapeDtypeStruct((block, n), dtype)
        return jax.jit(jax.vmap(function)).lower(x, jax.tree.unflatten(structure, leaves))

    point = jax.ShapeDtypeStruct((n,), dtype)
    data = jax.tree.unflatten(structure, [jax.ShapeDtypeStruct(shape, leaf) for shape, leaf in types])
    equalities = sum(
        int(np.prod(jax.eval_shape(lambda x, data, f=f: functions.call(f, x, data), point, data).shape))
        for f in functions.equality
    )
    lowered = [lower(values, blocks[0]), lower(derivatives, blocks[1])]
    # tracing holds Python's lock, compiling does not
    with ThreadPoolExecutor(2) as pool:
        small, large = pool.map(lambda program: program.compile(), lowered)
    return small, large, equalities


def _check(cost: list[Array], equality: list[Array], inequality: list[Array]) -> None:
    for entry, arrays, rank, rule in (
        ("cost", cost, 0, "a scalar"),
        ("equality", equality, 1, "a vector (p,)"),
        ("inequality", inequality, 1, "a vector (q,)"),
    ):
        for array in arrays:
            if array.ndim != rank:
                raise ValueError(f"`{entry}` returns an array of shape {array.shape}; it must return {rule}.")
            if not jnp.issubdtype(array.dtype, jnp.floating):
                raise ValueError(f"`{entry}` returns {array.dtype}; it must return real floating-point numbers.")


def _differentiate(function: Function, x: Array) -> tuple[Array, Array]:
    """Value and derivative (last axis) by the mode that needs fewer passes."""
    shape = jax.eval_shape(function, x).shape
    rows = int(np.prod(shape))
    if not rows:
        return jnp.zeros(shape, x.dtype), jnp.zeros((*shape, x.shape[0]), x.dtype)
    mode = jax.jacfwd if x.shape[0] < rows else jax.jacrev
    slope, value = mode(lambda x: (function(x),) * 2, has_aux=True)(x)
    return value, slope


def _join(parts: list[Array], x: Array, rank: int) -> Array:
    empty = jnp.zeros((0, x.shape[0])[:rank], x.dtype)
    return jnp.concatenate([empty, *(part.astype(x.dtype) for part in parts)])


def _power_of_two(count: int) -> int:
    return 1 << (count - 1).bit_length()

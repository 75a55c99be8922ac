"""Cost and constraints as two compiled programs, values and derivatives, that take starts in blocks.

The starts that are still running change in number from step to step; blocks of one size, the last one filled up, let
one program serve them all. JAX runs the blocks one after the other while the next are being handed over.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from threading import Lock
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from reojax._internal.arrays import Array
from reojax._internal.checks import shorten
from reojax.session import LEAN_COMPILE

Function = Callable[..., Any]
BLOCK, _VALUES_BLOCK = 8, 12
"""Most starts differentiated in one call, and points evaluated: as many as a line search looks at."""


class Given(NamedTuple):
    """What functions are given beside the variables."""

    data: Any
    """A start's own, or that of a block of starts in front."""
    shared: Any
    """The same for all."""


Part = Callable[[Array, Given], Any]


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

    cost: Function | None
    equality: tuple[Function, ...]
    inequality: tuple[Function, ...]
    with_data: bool
    together: Function | None = None
    """Of x, data and what all starts share to (cost, equality, inequality) at once, instead of the three."""

    def parts(self) -> list[Part]:
        """Functions to lists of costs, of equalities and of inequalities, each with what it has."""
        if self.together is not None:
            together = self.together
            return [lambda x, given: tuple([jnp.asarray(array)] for array in together(x, *given))]
        call = lambda f, x, given: f(x, given.data) if self.with_data else f(x)
        one = lambda entry, f, x, given: [_array(entry, call(f, x, given))]
        return [
            lambda x, given: (one("cost", self.cost, x, given), [], []),
            *(lambda x, given, f=f: ([], one("equality", f, x, given), []) for f in self.equality),
            *(lambda x, given, f=f: ([], [], one("inequality", f, x, given)) for f in self.inequality),
        ]


class Programs:
    """The two programs of some functions, for starts of one type, with the data of all starts."""

    def __init__(self, functions: Functions, x: Float[np.ndarray, "m n"], data: Any, shared: Any = None) -> None:
        """Compile them, unless they have been: numbers in `data` and `shared` are arguments of the programs.

        Raises:
            ValueError: if a function does not return real numbers of the right rank.
        """
        self._data = jax.tree.map(np.asarray, data)
        # through the host: the programs run on the default device, wherever numbers come from
        self._shared = jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)), shared)
        self._dtype = x.dtype
        self._blocks = _VALUES_BLOCK, _power_of_two(min(len(x), BLOCK))
        types = Given(_types(self._data, 1), _types(self._shared, 0))
        compiled = _compile(functions, x.dtype, x.shape[1], types, self._blocks)
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
            parts = [program(x[p].astype(self._dtype), Given(data_of(p), self._shared)) for p in place]
        return [
            np.concatenate([np.asarray(array, float) for array in arrays])[:count]
            for arrays in zip(*parts, strict=True)
        ]


class _Types(NamedTuple):
    """Structure, shapes and dtypes of a tree; hashable."""

    structure: Any
    leaves: tuple[tuple[tuple[int, ...], Any], ...]

    def placeholders(self, *front: int) -> Any:
        """The tree, every array with further axes in front, without numbers."""
        return jax.tree.unflatten(
            self.structure, [jax.ShapeDtypeStruct((*front, *shape), dtype) for shape, dtype in self.leaves]
        )


def _types(tree: Any, skip: int) -> _Types:
    """Of a tree of arrays, without their first `skip` axes."""
    leaves, structure = jax.tree.flatten(tree)
    types = ((leaf.shape[skip:], jax.dtypes.canonicalize_dtype(leaf.dtype)) for leaf in leaves)
    return _Types(structure, tuple(types))


def _compile(
    functions: Functions, dtype: np.dtype, n: int, types: Given, blocks: tuple[int, int]
) -> tuple[Function, Function, int]:
    """Both programs and the number of equalities."""
    point = functions, dtype, n, types
    programs = _program(*point, blocks[0], _values), _program(*point, blocks[1], _derivatives)
    # tracing holds Python's lock, compiling does not
    with ThreadPoolExecutor(2) as pool:
        small, large = pool.map(lambda program: program.compiled, programs)
    return small, large, programs[0].equalities


class _Program:
    """One of the two, for blocks of one size; compiled when it is first asked for, once for all threads."""

    def __init__(self, lowered: Any, equalities: int) -> None:
        """Keep what has been traced."""
        self.equalities = equalities
        self._lock = Lock()
        self._lowered: Any = lowered
        self._compiled: Any = None

    @property
    def compiled(self) -> Function:
        """The program; what it was made of is let go. Each has a lock of its own, so that two compile at once."""
        with self._lock:
            if self._compiled is None:
                self._compiled = self._lowered.compile(compiler_options=LEAN_COMPILE)
                self._lowered = None
            return self._compiled


@lru_cache(maxsize=128)
def _program(
    functions: Functions,
    dtype: np.dtype,
    n: int,
    types: Given,
    block: int,
    kind: Callable[[tuple[Part, ...], Array, Given], Any],
) -> _Program:
    """Trace a program. Only the last few are kept, as they hold on to a user's functions."""
    parts = _parts_of(functions)
    made = partial(kind, parts)
    many = jax.vmap(made, (0, Given(0, None))) if block > 1 else partial(_alone, made)
    shared = types.shared.placeholders()
    lowered = jax.jit(many).lower(
        jax.ShapeDtypeStruct((block, n), dtype), Given(types.data.placeholders(block), shared)
    )
    point = jax.ShapeDtypeStruct((n,), dtype), Given(types.data.placeholders(), shared)
    equalities = sum(array.size for part in parts for array in jax.eval_shape(part, *point)[1])
    return _Program(lowered, equalities)


@lru_cache(maxsize=64)
def _parts_of(functions: Functions) -> tuple[Part, ...]:
    """The parts such that sizes, values and derivatives, of any block, trace each function once for all."""
    return tuple(jax.jit(part, inline=True) for part in functions.parts())


def _values(parts: tuple[Part, ...], x: Array, given: Given) -> tuple[Array, Array]:
    """Cost and constraints of a point."""
    found = [part(x, given) for part in parts]
    for kinds in found:
        _check(*kinds)
    rows = [array for kind in (1, 2) for kinds in found for array in kinds[kind]]
    return _total([array for kinds in found for array in kinds[0]]), _join(rows, x, 1)


def _derivatives(parts: tuple[Part, ...], x: Array, given: Given) -> tuple[Array, Array, Array, Array]:
    """Cost, constraints, gradient and Jacobian of a point."""
    cost, gradient, rows, jacobian = [], [], ([], []), ([], [])
    for part in parts:
        kinds = jax.eval_shape(part, x, given)
        sizes = [sum(array.size for array in kind) for kind in kinds]
        every = lambda x, part=part: _join([jnp.ravel(a) for kind in part(x, given) for a in kind], x, 1)
        value, slope = _differentiate(every, x)
        ends = np.cumsum(sizes)
        if sizes[0]:
            cost.append(value[0])
            gradient.append(slope[0])
        for kind in (0, 1):
            rows[kind].append(value[ends[kind] : ends[kind + 1]])
            jacobian[kind].append(slope[ends[kind] : ends[kind + 1]])
    rows, jacobian = _join(rows[0] + rows[1], x, 1), _join(jacobian[0] + jacobian[1], x, 2)
    return _total(cost), rows, _total(gradient), jacobian


def _alone(function: Function, x: Array, given: Given) -> Any:
    """One start in a block of its own, which takes less compilation than `vmap`."""
    answer = function(x[0], Given(jax.tree.map(lambda leaf: leaf[0], given.data), given.shared))
    return jax.tree.map(lambda leaf: leaf[None], answer)


def _array(entry: str, value: Any) -> Array:
    try:
        return jnp.asarray(value)
    except Exception as error:
        raise ValueError(f"`{entry}` returns {shorten(value)}; it must return real floating-point numbers.") from error


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


def _total(parts: list[Array]) -> Array:
    return jnp.stack([jnp.asarray(part) for part in parts]).sum(0)


def _power_of_two(count: int) -> int:
    return 1 << (count - 1).bit_length()

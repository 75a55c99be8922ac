"""Values at the nodes that are computed once, side by side, and kept, however many read them.

XLA on CPU makes one loop for every array it writes, and computes what several loops share again in each: the three
components of omega would take three whole inward passes. A reduction of several arrays at once is the exception, one
loop with several results. So arrays that belong together are kept by a reduction that changes nothing: a sum over an
axis of two, the value and a zero. The compiler unrolls that axis, and never computes or stores the zeros. (It would
see through an axis of one.) A net rotation takes half as long this way, its gradient two thirds.

From some ten results or sixty arguments on, the compiler no longer vectorises such a loop, and it takes ten times as
long: keep up to six together.
"""

from typing import Any

import jax
import jax.numpy as jnp
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir


def materialize(vector: tuple[Any, ...]) -> tuple[Any, ...]:
    """Keep those components that are arrays, all of one shape and dtype; the others are single numbers."""
    places = [i for i, c in enumerate(vector) if isinstance(c, jax.Array) and c.ndim]
    return tuple(_replace(vector, places))


def _replace(values: Any, places: list[int]) -> list[Any]:
    kept = list(values)
    if places:
        for i, value in zip(places, _kept.bind(*(values[i] for i in places)), strict=True):
            kept[i] = value
    return kept


def _not_zero(values: Any) -> list[int]:
    return [i for i, value in enumerate(values) if not isinstance(value, ad.Zero)]


def _same(*values: jax.Array) -> list[jax.Array]:
    return list(values)


def _side_by_side(*values: jax.Array) -> list[jax.Array]:
    last = values[0].ndim
    with_zero = [jnp.pad(x[..., None], [(0, 0)] * last + [(0, 1)]) for x in values]
    zeros = [jnp.zeros((), x.dtype) for x in values]
    return list(jax.lax.reduce(with_zero, zeros, lambda a, b: [x + y for x, y in zip(a, b, strict=True)], (last,)))


def _batch(values, axes):
    size = next(x.shape[axis] for x, axis in zip(values, axes, strict=True) if axis is not None)
    moved = [
        jnp.broadcast_to(x, (size, *x.shape)) if axis is None else jnp.moveaxis(x, axis, 0)
        for x, axis in zip(values, axes, strict=True)
    ]
    return _kept.bind(*moved), [0] * len(moved)


def _jvp(values, tangents):
    return _kept.bind(*values), _replace(tangents, _not_zero(tangents))


def _transpose(cotangents, *_):
    return _replace(cotangents, _not_zero(cotangents))


_kept = Primitive("kept")
"""The identity of several arrays, which on the CPU is that sum; its derivatives are kept likewise."""
_kept.multiple_results = True
_kept.def_impl(_same)
_kept.def_abstract_eval(_same)
batching.primitive_batchers[_kept] = _batch
ad.primitive_jvps[_kept] = _jvp
ad.primitive_transposes[_kept] = _transpose
mlir.register_lowering(_kept, mlir.lower_fun(_same, multiple_results=True))
mlir.register_lowering(_kept, mlir.lower_fun(_side_by_side, multiple_results=True), platform="cpu")

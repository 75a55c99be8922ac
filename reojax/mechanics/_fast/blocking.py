"""Functions of one design that run many designs block by block, so that a block's values stay in the cache.

Under `vmap` XLA computes each intermediate value for all designs before the next one; from some thousand values
on they travel through main memory, and a gradient takes twice as long. A primitive of its own can see the batch:
its rule for `vmap` keeps the call and notes what is batched, and on the CPU the call becomes a loop over blocks,
in which XLA still uses all cores. Other devices take the batch as a whole.

The last arguments may be ones in which the function is linear. It then comes with its transpose, another such
function, so reverse mode stays in blocks; only derivatives of the second order are taken in one batch.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir

from reojax.session import hold_memory

_BYTES = 2**19
"""Of one intermediate value of a block, where few are alive at once. (Smaller blocks are no faster: XLA splits each
large operation between two threads, which costs some 30 us.)

The number of designs in a block is made odd: arrays whose size is a power of two begin at the same place of the cache,
and some ten that are read side by side drive one another out; a gradient took 1.3 times as long.
"""
_FEW = 16
"""Designs of a block that are not made odd: one more would cost too much."""


class Call(NamedTuple):
    """What is fixed of a call; hashable, and a key of the compilation cache."""

    function: Callable[..., Sequence[jax.Array]]
    """From `static` and arrays of one design to arrays."""
    static: Any
    shapes: tuple[tuple[int, ...], ...]
    """Of the results, for one design."""
    nodes: int
    """Elements of a typical intermediate value of one design; times as many, where many values are alive at once."""
    short: tuple[Any, int] | None = None
    """Another `static` that makes a program which is shorter to compile, and the most designs for which it serves."""
    transpose: Callable[..., Sequence[jax.Array]] | None = None
    """The same arguments with cotangents of the results in the place of the last `linear` ones, to theirs."""
    linear: int = 0


def in_blocks(call: Call, *args: jax.Array) -> list[jax.Array]:
    """Return `call.function(call.static, *args)`; all arrays of one dtype."""
    return _blocks.bind(*args, call=call, batched=(False,) * len(args), size=None)


def _whole(*args, call: Call, batched: tuple[bool, ...], size: int | None) -> list[jax.Array]:
    """Compute it all at once: what the primitive means."""

    def one(*args):
        return list(call.function(call.static, *args))

    return one(*args) if size is None else jax.vmap(one, [0 if b else None for b in batched], axis_size=size)(*args)


def _on_cpu(*args, **of_call) -> list[jax.Array]:
    hold_memory()  # for this process, once more does not hurt
    return _block_by_block(*args, **of_call)


def _block_by_block(*args, call: Call, batched: tuple[bool, ...], size: int | None) -> list[jax.Array]:
    if call.short and (size or 1) <= call.short[1]:
        return _one_by_one(*args, call=call._replace(static=call.short[0]), batched=batched, size=size)
    block = max(1, _BYTES // (call.nodes * args[0].dtype.itemsize))
    if size is None or size < 2 * block:
        return _whole(*args, call=call, batched=batched, size=size)
    rounds = -(-size // block)
    block = -(-size // rounds)
    block |= block > _FEW
    rounds = -(-size // block)
    missing = rounds * block - size  # made up by repeating the last design
    many = [x for x, b in zip(args, batched, strict=True) if b]
    many = [jnp.concatenate([x, jnp.repeat(x[-1:], missing, axis=0)]) if missing else x for x in many]

    def of_block(block_of_many):
        values = iter(block_of_many)
        part = [next(values) if b else x for x, b in zip(args, batched, strict=True)]
        return _whole(*part, call=call, batched=batched, size=block)

    found = jax.lax.map(of_block, [x.reshape(rounds, block, *x.shape[1:]) for x in many])
    return [x.reshape(-1, *x.shape[2:])[:size] for x in found]


def _one_by_one(*args, call: Call, batched: tuple[bool, ...], size: int | None) -> list[jax.Array]:
    if size is None:
        return _whole(*args, call=call, batched=batched, size=None)

    def of_design(design):
        values = iter(design)
        part = [next(values) if b else x for x, b in zip(args, batched, strict=True)]
        return _whole(*part, call=call, batched=(False,) * len(part), size=None)

    return jax.lax.map(of_design, [x for x, b in zip(args, batched, strict=True) if b])


def _shapes(*avals, call: Call, batched: tuple[bool, ...], size: int | None) -> list[Any]:
    """Through a function with the same results in shape and dtype, and cheap to trace."""

    def like(*args):
        zero = sum(0 * x.sum() for x in args)
        return [jnp.broadcast_to(zero, shape if size is None else (size, *shape)) for shape in call.shapes]

    return list(jax.make_jaxpr(like)(*avals).out_avals)


def _batch(args, axes, *, call: Call, batched: tuple[bool, ...], size: int | None):
    """Put a further axis of designs first; merge it with the one that is there."""
    more = next(x.shape[axis] for x, axis in zip(args, axes, strict=True) if axis is not None)
    if size is None:
        moved = [x if axis is None else jnp.moveaxis(x, axis, 0) for x, axis in zip(args, axes, strict=True)]
        now = tuple(axis is not None for axis in axes)
        found = _blocks.bind(*moved, call=call, batched=now, size=more)
    else:
        merged = [
            x if axis is None and not b else _merge(x, axis, b, more, size)
            for x, axis, b in zip(args, axes, batched, strict=True)
        ]
        now = tuple(b or axis is not None for axis, b in zip(axes, batched, strict=True))
        found = _blocks.bind(*merged, call=call, batched=now, size=more * size)
        found = [x.reshape(more, size, *x.shape[1:]) for x in found]
    return found, [0] * len(found)


def _merge(x: jax.Array, axis: int | None, batched: bool, more: int, size: int) -> jax.Array:
    x = x[None] if axis is None else jnp.moveaxis(x, axis, 0)
    x = x if batched else x[:, None]
    return jnp.broadcast_to(x, (more, size, *x.shape[2:])).reshape(-1, *x.shape[2:])


def _jvp(primals, tangents, **of_call):
    moving = [i for i, tangent in enumerate(tangents) if not isinstance(tangent, ad.Zero)]

    def whole(*values):
        args = list(primals)
        for i, value in zip(moving, values, strict=True):
            args[i] = value
        return _whole(*args, **of_call)

    return jax.jvp(whole, [primals[i] for i in moving], [tangents[i] for i in moving])


def _transpose(cotangents, *args, call: Call, batched: tuple[bool, ...], size: int | None):
    fixed, linear = args[: -call.linear], args[-call.linear :]
    assert call.transpose is not None
    given = [ad.instantiate_zeros(c) for c in cotangents]
    back = Call(
        function=call.transpose,
        static=call.static,
        shapes=tuple(x.aval.shape[b:] for x, b in zip(linear, batched[-call.linear :], strict=True)),
        nodes=call.nodes,
        short=call.short,
        transpose=call.function,
        linear=len(given),
    )
    now = batched[: -call.linear] + (size is not None,) * len(given)
    found = _blocks.bind(*fixed, *given, call=back, batched=now, size=size)
    if size is not None:
        found = [x if b else x.sum(0) for x, b in zip(found, batched[-call.linear :], strict=True)]
    return [None] * len(fixed) + found


_blocks = Primitive("blocks")
_blocks.multiple_results = True
_blocks.def_impl(_on_cpu)
_blocks.def_abstract_eval(_shapes)
batching.primitive_batchers[_blocks] = _batch
ad.primitive_jvps[_blocks] = _jvp
ad.primitive_transposes[_blocks] = _transpose
mlir.register_lowering(_blocks, mlir.lower_fun(_whole, multiple_results=True))
mlir.register_lowering(_blocks, mlir.lower_fun(_on_cpu, multiple_results=True), platform="cpu")

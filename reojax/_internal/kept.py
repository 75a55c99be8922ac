"""Functions whose compiled programs are found by the next process without tracing; the command line turns that on.

JAX's own store is asked with the lowered program: tracing and lowering, most of the time of a short command, come
first. Here a program is found by all that it is made of: the source of reojax, versions and settings of what compiles
it, the processor, the function, its options, its static arguments, and shapes and types of the others. What cannot be
found, read or kept is compiled as by `jax.jit`, without a word.
"""

import functools
import hashlib
import os
import pickle
import platform
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import RLock
from typing import Any

import jax
import jaxlib
import numpy as np
from jax.experimental import serialize_executable
from jax.experimental.compilation_cache.compilation_cache import reset_cache

from reojax._internal.arrays import is_concrete
from reojax._internal.files import replacing

SUFFIX = ".program"
_DIGEST = 32
"""Bytes of a digest, which stands before the program in its file."""
_PREPARED = b"lapack"
"""What JAX prepares while it lowers, so that a program with it cannot do without."""
_one_at_a_time = RLock()
_folder: Path | None = None


def keep_in(folder: Path | None) -> None:
    """Keep programs in a folder that is there from now on, and run what is found there; None: do neither."""
    global _folder
    _folder = folder


class Program:
    """`jax.jit` of a module's function, or a `partial` of one, by positional arguments; kept where `keep_in` says.

    Static arguments and those of a `partial` are pytrees of numbers, arrays, strings and bytes, to be told apart
    between processes.
    """

    def __init__(self, function: Callable[..., Any], *, static_argnums: Sequence[int] = (), **options: Any):
        self._function, self._given = function, ()
        if isinstance(function, functools.partial):
            self._function, self._given = function.func, (function.args, function.keywords)
        if "<" in self._function.__qualname__:
            raise ValueError(f"{self._function.__qualname__} is no function of a module: its name does not tell it.")
        functools.update_wrapper(self, self._function)
        # a function of its own, so that JAX has no program of it in memory that it has read from its store
        self._jit = jax.jit(functools.partial(function), static_argnums=static_argnums, **options)
        self._options, self._static = options, static_argnums
        self._programs: dict[Any, Callable[..., Any]] = {}

    def __call__(self, *arguments: Any) -> Any:
        """What the function gives."""
        traced = [a for number, a in enumerate(arguments) if number not in self._static]
        leaves, tree = jax.tree.flatten(traced)
        if _folder is None or not is_concrete(traced) or not _simple():
            return self._jit(*arguments)
        static = tuple(a for number, a in enumerate(arguments) if number in self._static)
        key = tree, tuple(map(jax.typeof, leaves)), static
        with _one_at_a_time:
            if key not in self._programs:
                self._programs[key], result = self._first(_folder / self._name(*key), arguments, traced)
                return result
        return self._programs[key](*traced)

    def _name(self, tree: Any, types: tuple[Any, ...], static: tuple[Any, ...]) -> str:
        """File of a program, by all that it is made of."""
        function = f"{self._function.__module__}.{self._function.__qualname__}"
        forms = [(kind.shape, str(kind.dtype), kind.weak_type) for kind in types]
        made_of = (_surroundings(), function, self._options, _content((self._given, static)), str(tree), forms)
        return f"{self._function.__name__}-{hashlib.sha256(repr(made_of).encode()).hexdigest()}{SUFFIX}"

    def _first(self, file: Path, arguments: tuple[Any, ...], traced: list[Any]) -> tuple[Callable[..., Any], Any]:
        """A program, and what it gives the first time: the one that is kept, if it does give something."""
        with suppress(Exception):  # not there, damaged, or of a form that JAX does not know any more
            program = _read(file)
            return program, program(*traced)
        with _without_cache():  # what JAX has read from its own store cannot be written again
            program = self._jit.lower(*arguments).compile()
        with suppress(Exception):  # no room, or a program that cannot be written
            _write(file, program)
        return program, program(*traced)


def _simple() -> bool:
    """Whether programs are for one processor, on which all arrays lie, and may be kept."""
    wanted = jax.config.values["jax_enable_compilation_cache"] and not jax.config.values["jax_disable_jit"]
    return wanted and jax.default_backend() == "cpu" and jax.device_count() == 1


@contextmanager
def _without_cache() -> Iterator[None]:
    """Compile without JAX's store of programs."""
    folder = jax.config.values["jax_compilation_cache_dir"]
    jax.config.update("jax_compilation_cache_dir", None)
    reset_cache()
    try:
        yield
    finally:
        jax.config.update("jax_compilation_cache_dir", folder)
        reset_cache()


def _read(file: Path) -> Callable[..., Any]:
    data = file.read_bytes()
    if hashlib.sha256(data[_DIGEST:]).digest() != data[:_DIGEST]:
        raise ValueError("damaged")
    return serialize_executable.deserialize_and_load(*pickle.loads(zlib.decompress(data[_DIGEST:])))


def _write(file: Path, program: jax.stages.Compiled) -> None:
    kept = serialize_executable.serialize(program)
    if _PREPARED not in kept[0]:
        data = zlib.compress(pickle.dumps(kept), 1)
        with replacing(file) as stream:
            stream.write(hashlib.sha256(data).digest() + data)


def _content(tree: Any) -> tuple[Any, ...]:
    """All that a pytree is, as text and bytes."""
    leaves, structure = jax.tree.flatten(tree)
    arrays = [np.asarray(leaf) for leaf in leaves]
    if any(array.dtype == object for array in arrays):
        raise TypeError("Static arguments of what is kept are numbers, arrays, strings and bytes.")
    return str(structure), [(array.shape, array.dtype.str, array.tobytes()) for array in arrays]


def _surroundings() -> tuple[Any, ...]:
    """Everything outside a function that its program may depend on."""
    settings = {name: value for name, value in jax.config.values.items() if name != "jax_compilation_cache_dir"}
    return *_versions(), os.environ.get("XLA_FLAGS"), repr(sorted(settings.items()))


@functools.cache
def _versions() -> tuple[Any, ...]:
    """Version of all that makes programs, and of reojax to the letter; the processor, with what it can do."""
    source, package = hashlib.sha256(), Path(__file__).parents[1]
    for file in sorted(package.rglob("*.py")):
        source.update(f"{file.relative_to(package)}\n{file.stat().st_size}\n".encode() + file.read_bytes())
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    processor = [platform.machine(), platform.processor(), cores]
    with suppress(OSError), open("/proc/cpuinfo") as file:
        processor += [line for line in iter(file.readline, "\n") if line.startswith(("model", "flags", "Features"))]
    versions = [platform.python_version(), np.__version__, jax.__version__, jaxlib.version.__version__]
    return versions, source.digest(), processor

"""Shapes in signatures are executed: a call that succeeds although its arrays are not as annotated is a failure.

`install()` makes every function of reojax that is imported from then on check the jaxtyping shapes of its arguments, of
its result, and of the fields of a named tuple that it returns; names of axes must agree within one call. Dtypes are
left to the functions, which take integers for numbers. A call that raises is left alone: that is the door at work.
"""

import contextlib
import functools
import importlib.abc
import importlib.machinery
import inspect
import sys
import types
import typing
from typing import Any

import jax
import numpy as np
from jaxtyping import AbstractArray, AnnotationError, Shaped, jaxtyped


class WrongShape(AssertionError):
    """A shape in a signature is not what it says."""


def is_array_type(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, AbstractArray)


def array_types(annotation: Any) -> list[Any]:
    """The shapes that an annotation allows, none if anything else is allowed too."""
    union = typing.get_origin(annotation) in (typing.Union, types.UnionType)
    options = [option for option in typing.get_args(annotation) if option is not type(None)] if union else [annotation]
    return options if all(map(is_array_type, options)) else []


def fits(value: Any, annotation: Any) -> bool:
    """Whether an array has one of the shapes; anything else fits."""
    options = array_types(annotation)
    if not options or not isinstance(value, np.ndarray | jax.Array):
        return True
    empty = np.broadcast_to(0.0, value.shape)
    return any(isinstance(empty, Shaped[np.ndarray, option.dim_str]) for option in options)


def misfits(values: dict[str, Any], hints: dict[str, Any]) -> list[str]:
    """Names whose arrays do not have the shape annotated; axes of one name agree among all of them."""
    bad, later = [], []
    with jaxtyped("context"):
        for name, value in values.items():
            try:
                if not fits(value, hints.get(name)):
                    bad.append(f"{name} {np.shape(value)}, annotated {hints[name]}")
            except AnnotationError:  # an axis such as n+1, before n is known
                later.append(name)
        for name in later:
            with contextlib.suppress(AnnotationError):  # nothing tells how long that axis is
                if not fits(values[name], hints[name]):
                    bad.append(f"{name} {np.shape(values[name])}, annotated {hints[name]}")
    return bad


def with_shapes(function: types.FunctionType) -> Any:
    """`function`, which looks at its shapes once it has succeeded."""
    signature = inspect.signature(function)

    @functools.wraps(function)
    def wrapper(*args: Any, **kwargs: Any) -> Any:
        result = function(*args, **kwargs)
        hints = _hints(function)
        values = dict(signature.bind(*args, **kwargs).arguments) | {"return": result}
        bad = misfits(values, hints)
        if isinstance(result, tuple) and hasattr(result, "_fields"):
            bad += misfits(result._asdict(), _hints(type(result)))
        if bad:
            raise WrongShape(f"{function.__module__}.{function.__qualname__}: {'; '.join(bad)}")
        return result

    return wrapper


@functools.cache
def _hints(item: Any) -> dict[str, Any]:
    try:
        return typing.get_type_hints(item)
    except (NameError, TypeError):  # a name imported for type checkers only
        return {}


class _Loader(importlib.machinery.SourceFileLoader):
    def exec_module(self, module: types.ModuleType) -> None:
        super().exec_module(module)
        for name, value in list(vars(module).items()):
            if isinstance(value, types.FunctionType) and value.__module__ == module.__name__:
                if any("[" in str(annotation) for annotation in value.__annotations__.values()):
                    setattr(module, name, with_shapes(value))


class _Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, fullname: str, path: Any, target: Any = None) -> Any:
        if not fullname.startswith("reojax."):
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path)
        if spec is not None and isinstance(spec.loader, importlib.machinery.SourceFileLoader):
            spec.loader = _Loader(spec.loader.name, spec.loader.path)
        return spec


def install() -> None:
    """Check the shapes of all functions of reojax that are imported from now on."""
    sys.meta_path.insert(0, _Finder())

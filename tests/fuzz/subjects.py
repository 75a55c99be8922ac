"""Calls of public functions with one or two arguments replaced by hostile values."""

import inspect
import operator
import random
from collections.abc import Callable, Iterator
from typing import Any

import reojax
from fuzz.values import VALUES

Subjects = dict[str, tuple[Any, dict[str, Any]]]


def calls(of: Subjects, draw: random.Random) -> Iterator[tuple[str, Callable[[], Any] | None]]:
    """Without end: every argument by every value in random order, then two at once.

    A call of what this version of reojax does not have is None, so that two versions see the same inputs.
    """
    there = {name: _taken(function, right) for name, (function, right) in of.items()}
    once = [(name, entry, k) for name, (_, right) in of.items() for entry in right for k in range(len(VALUES))]
    draw.shuffle(once)
    for name, entry, k in once:
        yield _call(name, of[name], there[name], {entry: VALUES[k]})
    while True:
        name = draw.choice(list(of))
        entries = draw.sample(list(of[name][1]), min(2, len(of[name][1])))
        yield _call(name, of[name], there[name], {entry: draw.choice(VALUES) for entry in entries})


def _function(function: Any) -> Callable[..., Any] | None:
    if not isinstance(function, str):
        return function
    try:
        return operator.attrgetter(function)(reojax)
    except AttributeError:
        return None


def _taken(what: Any, right: dict[str, Any]) -> set[str]:
    """Those of the arguments that this version takes: none of a function that it does not have."""
    function = _function(what)
    if function is None:
        return set()
    if not isinstance(what, str):  # written here: it has what it calls if it does with arguments that are right
        try:
            function(**right)
        except (AttributeError, TypeError, ImportError):
            return set()
        except ValueError:  # a path that nobody can write
            pass
    known = inspect.signature(function).parameters
    if any(parameter.kind == parameter.VAR_KEYWORD for parameter in known.values()):
        return set(right)
    return set(right) & set(known)


def _call(name: str, of: tuple[Any, dict], taken: set[str], wrong: dict) -> tuple[str, Callable[[], Any] | None]:
    shown = ", ".join(f"{entry}={repr(value)[:60]}" for entry, value in wrong.items())
    if not wrong.keys() <= taken:
        return f"{name}({shown})", None
    function = _function(of[0])
    right = {entry: value for entry, value in of[1].items() if entry in taken}
    assert function is not None
    return f"{name}({shown})", lambda: function(**(right | wrong))

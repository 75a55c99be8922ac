"""The door of the pictures: what a function says it takes is what it is given."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from reojax._internal import checks
from reojax._internal.arrays import as_numbers
from reojax.captures.comparison import Comparison
from reojax.collision.nearest import Nearest
from reojax.drawing.view import View
from reojax.motion.closed_loop import Tracking
from reojax.motion.motor import Motor
from reojax.motion.simulation import Motion
from reojax.path import Path
from reojax.robot import Robot

Arguments = ParamSpec("Arguments")
Answer = TypeVar("Answer")
_KINDS: dict[str, tuple[type, str]] = {
    "Robot": (Robot, "`make_robot` makes"),
    "Path": (Path, "`polygon(waypoints)` makes"),
    "Motion": (Motion, "`simulate` makes"),
    "Comparison": (Comparison, "`compare` makes"),
    "Tracking": (Tracking, "`track` makes"),
    "Nearest": (Nearest, "`nearest_parts` makes"),
    "Motor": (Motor, "`RE_MAX_17`"),
    "View": (View, "`plot.View()`"),
    "Axes": (Axes, "`figure.add_subplot()` makes"),
    "Axes3D": (Axes3D, '3-D axes, `figure.add_subplot(projection="3d")`'),
    "Figure": (Figure, "Matplotlib makes"),
    "str": (str, "'a title'"),
    "bool": (bool, "True"),
}


def check_arguments(function: Callable[Arguments, Answer]) -> Callable[Arguments, Answer]:
    """Check the arguments by the types that the signature names: robots, words, numbers, arrays of numbers."""
    signature = inspect.signature(function)
    rules = {name: _words(parameter.annotation) for name, parameter in signature.parameters.items()}

    @wraps(function)
    def draw(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Answer:
        bound = signature.bind(*args, **kwargs)
        for entry, value in bound.arguments.items():
            bound.arguments[entry] = _check(entry, value, rules[entry])
        return function(*bound.args, **bound.kwargs)

    return draw


def _words(annotation: Any) -> list[str]:
    """The alternatives of a type, without the modules that they are from."""
    text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    if "ArrayLike" in text or "_array_like" in text or text.startswith(("Float[", "tuple[float")):
        return ["numbers", *(["None"] if "None" in text else [])]
    return re.sub(r"\b(?:\w+\.)+(\w+)", r"\1", text).split(" | ")


def _check(entry: str, value: Any, words: list[str]) -> Any:
    if value is None and "None" in words:
        return value
    first = words[0]
    if len([word for word in words if word != "None"]) > 1:
        return value  # the function tells them apart
    if first in _KINDS:
        return checks.instance(entry, value, *_KINDS[first])
    if first == "float" and entry == "alpha":
        return checks.number(entry, value, least=0, most=1)
    if first == "float":
        return checks.number(entry, value)
    if first == "int":
        return checks.whole(entry, value)
    if first == "numbers":
        return np.asarray(as_numbers(entry, value), float)
    if first == "Sequence[str]":
        return [checks.instance(f"{entry}[{i}]", word, str, "'a word'") for i, word in _enumerate(entry, value)]
    if first.startswith("dict["):
        return checks.mapping(entry, value, "names to numbers")
    if first.startswith("Sequence["):
        return [item for _, item in _enumerate(entry, value)]
    return value


def _enumerate(entry: str, value: Any) -> list[tuple[int, Any]]:
    listed = list(value) if isinstance(value, str) else checks.listing(entry, value, "one thing for each")
    return list(enumerate(listed))

"""Public functions name their arguments, so that type checkers and `help` know them, and a mistyped one is an error."""

import ast
import importlib
import inspect
import pkgutil
from pathlib import Path

import pytest

import reojax

OPEN = {
    ("merge", "folders"): "any number of folders",
    ("zipped", "more"): "names are the user's own",
    ("Robot.replace", "fields"): "checked by name",
}
"""Where any number of arguments is what the function is for."""


def public() -> dict[str, object]:
    """Everything that a user can reach without an underscore: names, packages' names, methods of classes."""
    found, rooms = {}, [reojax]
    for module in pkgutil.walk_packages(reojax.__path__, "reojax."):
        if not any(part.startswith("_") for part in module.name.split(".")[1:]):
            rooms.append(importlib.import_module(module.name))
    for room in rooms:
        listed = getattr(room, "__all__", None) or [name for name in vars(room) if not name.startswith("_")]
        for name in listed:
            thing = getattr(room, name)
            if getattr(thing, "__module__", "").startswith("reojax"):
                found[name] = thing
                if inspect.isclass(thing):
                    found |= {f"{name}.{key}": method for key, method in vars(thing).items() if not key.startswith("_")}
    return {name: thing for name, thing in found.items() if inspect.isfunction(inspect.unwrap(thing))}


def test_no_public_function_takes_options_it_does_not_name():
    everything = public()
    assert len(everything) > 300
    found = set()
    for name, function in everything.items():
        if inspect.getmodule(function).__name__.startswith(("reojax.cli", "reojax._internal")):
            continue
        for parameter in inspect.signature(function).parameters.values():
            any_number = parameter.kind == parameter.VAR_POSITIONAL and name in reojax.__all__
            if parameter.kind == parameter.VAR_KEYWORD or any_number:
                found.add((name, parameter.name))
    assert found == OPEN.keys() | INNER


INNER = {("check_motion", "motion"), ("check_tolerances", "tolerances")}
"""Of functions that only reojax itself calls."""


def test_every_public_name_has_a_docstring():
    missing = {name for name in reojax.__all__ if not inspect.getdoc(getattr(reojax, name))}
    assert missing == set()


@pytest.mark.parametrize("file", sorted((Path(reojax.__file__).parent).rglob("*.py")), ids=lambda file: file.stem)
def test_docstrings_of_public_functions_name_all_their_arguments(file):
    """Where there is an `Args:` part, it is complete."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            text = ast.get_docstring(node) or ""
            if "Args:" in text:
                arguments = [a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
                missing = [name for name in arguments if name not in ("self", "cls") and f"{name}:" not in text]
                assert not missing, f"{node.name}: {missing}"


@pytest.mark.parametrize(
    ("call", "meant"),
    [
        (lambda robot: robot.replace(masses=robot.mass), "Did you mean 'mass'?"),
        (lambda robot: reojax.robots.by_name("prototyp"), "Did you mean 'prototype'?"),
        (
            lambda robot: reojax.plan(robot, _EYE, twist_limit=1, bend_limit=1, max_manoeuvres=1, objective="cont"),
            "count",
        ),
        (lambda robot: reojax.free_path(robot, _EYE, joints=["twist_1"]), "Did you mean 'twist1'?"),
    ],
)
def test_what_was_probably_meant_is_named(call, meant):
    with pytest.raises(ValueError, match="ean") as caught:
        call(reojax.robots.prototype())
    assert meant in str(caught.value)


_EYE = [[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]

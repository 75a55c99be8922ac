"""One word, one meaning: of arguments in every public function, and of options at the command line."""

import inspect
import re
from collections.abc import Callable
from typing import Any

import pytest

import reojax
from reojax import cli, design, optimisation
from reojax.optimisation import adam, optimise

MEANING: dict[str, tuple[str, str, Any]] = {
    # name: annotation, what the docs of it must speak of, default (... for any)
    "steps": (r"int( \| None)?", "step", ...),
    "substeps": (r"int( \| None)?", "step", ...),
    "samples": (r"int( \| None)?", r"sample|instants|points|keyframes|each edge|per edge|of each", ...),
    "draws": (r"int", "draw", ...),
    "max_steps": (r"int", "most", ...),
    "starts": (r"int( \| ArrayLike)?|ArrayLike", r"start|\(m, n\)", ...),
    "seed": (r"int", r"seed|random|draw", 0),
    "progress": (r"bool \| str", "whether to show a bar on stderr, or what to write before it", ...),
    "law": (r"Law \| str", "time law", ...),
    "tolerance": (r"float", r"reached|below the true least|violation|of `optimise`|as for", ...),
}
"""What an argument of that name is, wherever it stands."""


def public_functions() -> dict[str, Callable[..., Any]]:
    """Public functions and methods by name, those of `reojax` and of its public packages."""
    found: dict[str, Callable[..., Any]] = {}
    for space in (reojax, design, reojax.plot, reojax.robots, optimisation, optimise, adam):
        for name in getattr(space, "__all__", dir(space)):
            thing = getattr(space, name)
            members = vars(thing).items() if inspect.isclass(thing) else [("", thing)]
            for member, function in members:
                if name.startswith("_") or member.startswith("_") or not inspect.isfunction(function):
                    continue
                function = inspect.unwrap(function)
                own = space in (reojax, design, reojax.plot, reojax.robots) or function.__module__ == space.__name__
                if own and function.__module__.startswith("reojax"):
                    found[f"{function.__module__}.{name}.{member}".rstrip(".")] = function
    return found


FUNCTIONS = public_functions()


def test_the_functions_are_found():
    assert len(FUNCTIONS) > 100
    assert {"reojax.motion.simulation.simulate", "reojax.design.problem.Problem.solve"} <= FUNCTIONS.keys()


@pytest.mark.parametrize("word", MEANING)
def test_arguments_of_one_name_mean_the_same(word):
    annotation, said, default = MEANING[word]
    users = {name: f for name, f in FUNCTIONS.items() if word in inspect.signature(f).parameters}
    assert users
    for name, function in users.items():
        parameter = inspect.signature(function).parameters[word]
        kind = parameter.annotation
        text = kind.__name__ if isinstance(kind, type) else re.sub(r"[\w.]+\.(Law)\b", r"\1", str(kind))
        if "numpy._typing" not in text:  # ArrayLike, written out
            assert re.fullmatch(annotation, text), f"{name}: {word} is {text}"
        assert default is ... or parameter.default == default, f"{name}: {word} is {parameter.default} by default"
        described = re.search(rf"^ +{word}: (.+?)(?=^ +\w+: |^ *$|\Z)", function.__doc__ or "", re.M | re.S)
        if described:
            assert re.search(said, described[1]), f"{name}: {word} is {described[1]!r}"


def options() -> dict[str, dict[str, Any]]:
    """The actions of each option at the command line, by subcommand."""
    parser = cli._parser()
    commands = next(a.choices for a in parser._actions if a.dest == "command")
    found: dict[str, dict[str, Any]] = {}
    for command, sub in dict(commands or {}).items():
        for action in sub._actions:
            for name in action.option_strings:
                found.setdefault(name, {})[command] = action
    return found


OPTIONS = options()


@pytest.mark.parametrize("option", sorted(name for name, users in OPTIONS.items() if len(users) > 1))
def test_options_of_one_name_read_the_same(option):
    """One reader, and one unit of what is read, whichever subcommand has it."""
    several = OPTIONS[option].values()
    if option == "--duration":  # `view` has one law for a whole path, and takes one number
        several = [action for command, action in OPTIONS[option].items() if command != "view"]
    assert len({str(action.type) for action in several}) == 1
    assert len({action.metavar for action in several if action.type}) <= 1


def test_pictures_are_pictures_and_durations_seconds():
    for action in OPTIONS["--picture"].values():
        assert re.search(r"\.png", action.help), action.help
    for action in OPTIONS["--duration"].values():
        assert action.metavar.startswith("S")
        assert not re.search("edge", action.help) or "of it all" in action.help

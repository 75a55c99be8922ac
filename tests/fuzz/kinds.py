"""All kinds of hostile input, by name, and how many of each make a long run."""

import random
from collections.abc import Callable, Iterator
from typing import Any

Source = Iterator[tuple[str, Callable[[], Any]]]
LONG = {
    "functions that compile nothing": 9000,
    "functions that compile little": 4000,
    "functions that compile": 400,
    "command lines that compute little": 3000,
    "command lines that compute": 60,
    "captures": 4000,
    "robots, JSON": 3000,
    "robots, URDF": 3000,
    "robots, MJCF": 1500,
    "plans": 1500,
    "sweeps, manifests": 2000,
    "sweeps, chunks": 2000,
}


def source(kind: str, seed: int) -> Source | None:
    """Inputs of a kind without end, the same for the same seed; None where this version has nothing of that kind."""
    draw = random.Random(f"{kind} {seed}")
    if kind.startswith("functions"):
        from fuzz import subjects

        if kind.endswith("compile"):
            return subjects.calls(subjects.DEAR, draw)
        compiling = {name: subjects.CHEAP[name] for name in subjects.COMPILING}
        nothing = {name: subject for name, subject in subjects.CHEAP.items() if name not in compiling}
        return subjects.calls(nothing if kind.endswith("nothing") else compiling, draw)
    if kind.startswith("command lines"):
        from fuzz import lines

        quick = ("sweep", "merge", "export", "show", "view")
        return lines.lines(draw, quick if kind.endswith("little") else ("simulate", "time", "compare", "plan"))
    from fuzz import damage

    there = damage.subjects(kind)
    return damage.files(*there[kind], draw) if kind in there else None

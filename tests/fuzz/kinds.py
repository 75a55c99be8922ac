"""All kinds of hostile input, by name, and how many of each make a long run."""

import random
from collections.abc import Callable, Iterator
from typing import Any

from fuzz.subjects import calls

Source = Iterator[tuple[str, Callable[[], Any] | None]]
"""What is tried, in words, and what does it; None where this version of reojax cannot."""
LONG = {
    "functions that compile nothing": 9000,
    "functions that compile little": 4000,
    "functions that compile": 6000,
    "functions that search": 6000,
    "functions that draw": 2000,
    "command lines that compute little": 3000,
    "command lines that compute": 2500,
    "captures": 4000,
    "robots, JSON": 3000,
    "robots, URDF": 3000,
    "robots, MJCF": 1500,
    "plans": 2500,
    "sweeps, manifests": 2000,
    "sweeps, chunks": 2000,
}


def source(kind: str, seed: int) -> Source | None:
    """Inputs of a kind without end, the same for the same seed; None where this version has nothing of that kind."""
    draw = random.Random(f"{kind} {seed}")
    if kind == "functions that draw":
        from fuzz.pictures import PICTURES

        return calls(PICTURES, draw)
    if kind == "functions that compile":
        from fuzz.dear import DEAR

        return calls(DEAR, draw)
    if kind == "functions that search":
        from fuzz.searches import SEARCHES

        return calls(SEARCHES, draw)
    if kind.startswith("functions"):
        from fuzz.cheap import CHEAP, COMPILING

        little = kind.endswith("little")
        return calls({name: subject for name, subject in CHEAP.items() if (name in COMPILING) == little}, draw)
    if kind.startswith("command lines"):
        from fuzz import lines

        quick = ("sweep", "merge", "export", "show", "view")
        return lines.lines(draw, quick if kind.endswith("little") else ("simulate", "time", "compare", "plan"))
    from fuzz import damage

    there = damage.subjects(kind)
    return damage.files(*there[kind], draw) if kind in there else None

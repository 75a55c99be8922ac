"""What makes two sweeps the same one, so that a store of another is refused by name."""

import functools
import hashlib
import inspect
import json
from collections.abc import Callable, Mapping
from typing import Any

import jax
import numpy as np

from reojax._internal.version import version
from reojax.robot import Robot
from reojax.sweeps.chunks import Chunking
from reojax.sweeps.grid import Designs
from reojax.sweeps.outputs import Outputs, scalars

SCHEMA = "reojax-sweep-store-1"
"""Name of the layout of stores."""


def identity(
    function: Callable[..., Any], designs: Designs, outputs: Outputs, sizes: Chunking, platform: str
) -> dict[str, Any]:
    """Return all that results depend on, as plain data.

    The function is known by the program that JAX makes of it for one design (StableHLO), with every constant in
    it: another robot, manoeuvre or number in its closure is another function. What a host callback does is not
    seen. Robots that the function refers to are listed too, so that it can be said which one has changed.
    """
    program = jax.jit(lambda design: function(**design)).trace(scalars(designs)).lower(lowering_platforms=("cpu",))
    return {
        "schema": SCHEMA,
        "reojax": version(),
        "jax": jax.__version__,
        "platform": platform,
        "axes": {name: axis_identity(values) for name, values in designs.axes.items()},
        "order": list(designs.axes),
        "zipped": designs.zipped,
        "function": _sha256(program.as_text().encode()),
        "robots": {name: {"name": robot.name, "sha256": _of_robot(robot)} for name, robot in _robots(function)},
        "results": [
            {"name": output.name, "shape": list(output.shape), "dtype": str(output.dtype)} for output in outputs.arrays
        ],
        "chunk": sizes.chunk,
        "block": sizes.block,
    }


def axis_identity(values: np.ndarray) -> dict[str, Any]:
    """Return what tells the values of an axis from others, as plain data."""
    return {"values": len(values), "dtype": str(values.dtype), "sha256": _sha256(values.tobytes())}


def digest(same: Mapping[str, Any]) -> str:
    """Return one hash of an identity; every chunk carries it. Robots are in the function, whatever their names."""
    return _sha256(json.dumps({**same, "robots": None}, sort_keys=True).encode())


def differences(stored: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Name what differs between the identity in a store and this one."""
    found = [
        f"{text} {stored.get(key)!r}, now {now[key]!r}"
        for key, text in (
            ("schema", "layout"),
            ("reojax", "reojax version"),
            ("jax", "jax version"),
            ("platform", "platform"),
            ("order", "axes"),
            ("zipped", "zipped"),
            ("chunk", "chunk size"),
            ("block", "block size"),
        )
        if stored.get(key) != now[key]
    ]
    if stored.get("order") == now["order"]:
        found += [
            f"axis {name!r} ({stored['axes'][name]['values']} values) other values ({axis['values']}) now"
            for name, axis in now["axes"].items()
            if stored["axes"][name] != axis
        ]
    robots = {
        name: (stored.get("robots", {}).get(name), now["robots"].get(name))
        for name in {**stored.get("robots", {}), **now["robots"]}
    }
    found += [
        f"robot {before['name']!r} as {name!r}, now {after['name']!r} with other numbers"
        for name, (before, after) in robots.items()
        if before and after and before != after
    ]
    if stored.get("results") != now["results"]:
        found.append("other results of the function")
    elif stored.get("function") != now["function"]:
        found.append("another function (what it computes, or robot, manoeuvre and numbers in it)")
    return found


def _robots(function: Any) -> list[tuple[str, Robot]]:
    """Robots that a function refers to by name, in its closure or module or bound by `functools.partial`."""
    names: dict[str, Any] = {}
    while isinstance(function, functools.partial):
        names |= {f"argument {i}": value for i, value in enumerate(function.args)} | function.keywords
        function = function.func
    function = inspect.unwrap(function)
    if inspect.isfunction(function):
        scope = inspect.getclosurevars(function)
        names = {**scope.globals, **scope.nonlocals, **names}
    return sorted((name, value) for name, value in names.items() if isinstance(value, Robot))


def _of_robot(robot: Robot) -> str:
    leaves, structure = jax.tree.flatten(robot)
    whole = hashlib.sha256(str(structure).encode())
    for leaf in map(np.asarray, leaves):
        whole.update(f"{leaf.dtype}{leaf.shape}".encode() + leaf.tobytes())
    return whole.hexdigest()


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()

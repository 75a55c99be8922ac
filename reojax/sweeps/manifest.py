"""The manifest of a store, `sweep.json`: read, and nothing in it believed before it is checked."""

import json
import re
from math import prod
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from reojax._internal.checks import shorten, whole
from reojax._internal.files import read_text
from reojax.sweeps.chunks import Chunking
from reojax.sweeps.identity import SCHEMA
from reojax.sweeps.outputs import Output

LARGEST = 2**26
"""Most bytes of a manifest."""
_HASH = re.compile(r"[0-9a-f]{64}")


class Manifest(NamedTuple):
    """What a store says about itself, checked."""

    identity: dict[str, Any]
    """What its results depend on, as `identity.identity` makes it."""
    units: dict[str, str]
    axes: dict[str, tuple[tuple[int], np.dtype]]
    """Shape and type of each axis, in their order."""
    zipped: bool
    outputs: tuple[Output, ...]
    sizes: Chunking


def read_manifest(path: Path) -> Manifest:
    """Read and check a manifest.

    Raises:
        ValueError: naming the entry, its value and the rule.
    """
    data = _mapping("the file", _load(path), ("identity", "units"))
    identity = data["identity"]
    if not isinstance(identity, dict) or "schema" not in identity:
        raise ValueError(f"its `identity` is {shorten(identity)}, without a `schema`")
    if identity["schema"] != SCHEMA:
        raise ValueError(f"its layout is {shorten(identity['schema'])}; this reojax reads {SCHEMA!r}")
    keys = ("reojax", "jax", "platform", "axes", "order", "zipped", "function", "robots", "results", "chunk", "block")
    _mapping("`identity`", identity, keys)
    for key in ("reojax", "jax", "platform", "function"):
        _text(key, identity[key])
    axes = _axes(identity)
    if not isinstance(identity["zipped"], bool):
        raise ValueError(f"`zipped` is {shorten(identity['zipped'])}; it must be true or false")
    lengths = [shape[0] for shape, _ in axes.values()]
    if identity["zipped"] and len(set(lengths)) > 1:
        raise ValueError(f"its zipped axes have {', '.join(map(str, lengths))} values")
    total = lengths[0] if identity["zipped"] else prod(lengths)
    outputs = _outputs(identity["results"])
    units = data["units"]
    if not isinstance(units, dict) or not all(isinstance(unit, str) for unit in units.values()):
        raise ValueError(f"`units` is {shorten(units)}; it must give texts by name")
    if unknown := sorted(units.keys() - axes.keys() - {output.name for output in outputs}):
        raise ValueError(f"`units` has {shorten(unknown[0])}, which is neither an axis nor a result")
    for name, robot in _mapping("`robots`", identity["robots"]).items():
        for key in ("name", "sha256"):
            _text(f"robots[{name!r}].{key}", _mapping(f"robots[{name!r}]", robot, ("name", "sha256"))[key])
    chunk = whole("chunk", identity["chunk"], 1, total)
    block = whole("block", identity["block"], 1, chunk)
    return Manifest(
        identity, units, axes, identity["zipped"], outputs, Chunking(total, chunk, block, -(-chunk // block))
    )


def _load(path: Path) -> Any:
    try:
        return json.loads(read_text(path, LARGEST))
    except RecursionError:
        raise ValueError(f"{path.name} is nested too deeply") from None
    except json.JSONDecodeError as error:
        raise ValueError(f"{path.name} is no JSON: {error}") from None


def _axes(identity: dict[str, Any]) -> dict[str, tuple[tuple[int], np.dtype]]:
    axes, order = _mapping("`axes`", identity["axes"]), identity["order"]
    if not isinstance(order, list) or not order or sorted(map(str, order)) != sorted(axes):
        raise ValueError(f"`order` is {shorten(order)}; it must list the axes {shorten(list(axes))}")
    found = {}
    for name in order:
        axis = _mapping(f"axes[{name!r}]", axes[_text("order", name)], ("values", "dtype", "sha256"))
        if not isinstance(axis["sha256"], str) or not _HASH.fullmatch(axis["sha256"]):
            raise ValueError(f"axes[{name!r}].sha256 is {shorten(axis['sha256'])}; it must be 64 hexadecimal digits")
        length = whole(f"axes[{name!r}].values", axis["values"])
        found[name] = ((length,), _dtype(f"axes[{name!r}].dtype", axis["dtype"], "iuf"))
    return found


def _outputs(results: Any) -> tuple[Output, ...]:
    if not isinstance(results, list) or not results:
        raise ValueError(f"`results` is {shorten(results)}; it must list at least one array")
    outputs = []
    for number, result in enumerate(results):
        entry = _mapping(f"results[{number}]", result, ("name", "shape", "dtype"))
        shape = entry["shape"]
        if not isinstance(shape, list) or len(shape) > 32:
            raise ValueError(f"results[{number}].shape is {shorten(shape)}; it must be a short list")
        sides = tuple(whole(f"results[{number}].shape", side, 0) for side in shape)
        name = _text(f"results[{number}].name", entry["name"])
        outputs.append(Output(name, sides, _dtype(f"results[{number}].dtype", entry["dtype"], "biufc")))
    if len({output.name for output in outputs}) < len(outputs):
        raise ValueError("two of its results have the same name")
    return tuple(outputs)


def _mapping(entry: str, value: Any, keys: tuple[str, ...] = ()) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{entry} is {shorten(value)}; it must be a mapping")
    if missing := [key for key in keys if key not in value]:
        raise ValueError(f"{entry} has no {missing[0]!r}")
    return value


def _text(entry: str, value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"`{entry}` is {shorten(value)}; it must be text")
    return value


def _dtype(entry: str, value: Any, kinds: str) -> np.dtype:
    try:
        dtype = np.dtype(_text(entry, value))
    except TypeError:
        dtype = np.dtype("V")
    if dtype.kind not in kinds or str(dtype) != value:
        raise ValueError(f"{entry} is {shorten(value)}; it must be the name of a number type")
    return dtype

"""JSON from outside: one object, no surprises, or a `ValueError` of one line."""

import json
import os
from typing import Any

from reojax._internal.checks import shorten
from reojax._internal.files import reading

LARGEST = 64 * 2**20
"""Largest file that is read [bytes]."""


def read_bytes(path: str | os.PathLike[str], largest: int = LARGEST) -> bytes:
    """Return what a regular file holds.

    Raises:
        ValueError: naming the path, if it is none, or larger than `largest`.
    """
    with reading(path, largest) as file:
        data = file.read(largest + 1)
    if len(data) > largest:  # it has grown meanwhile
        raise ValueError(f"cannot read {shorten(os.fspath(path))}: it is larger than {largest} bytes.")
    return data


def read_object(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the object that a JSON file holds.

    Raises:
        ValueError: naming the path and what is wrong; NaN, infinities and names that come twice are refused.
    """
    data = read_bytes(path)
    try:
        value = json.loads(data.decode(), parse_constant=_refuse_constant, object_pairs_hook=_unique)
    except RecursionError:
        raise ValueError(f"cannot read {shorten(os.fspath(path))}: it is nested too deeply.") from None
    except ValueError as error:  # JSON and UTF-8 errors are ValueErrors
        raise ValueError(f"cannot read {shorten(os.fspath(path))}: {str(error)[:200]}.") from None
    if not isinstance(value, dict):
        raise ValueError(f"cannot read {shorten(os.fspath(path))}: it holds no JSON object.")
    return value


def entries(where: str, value: Any, required: tuple[str, ...], optional: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return an object that has all of `required` and nothing but these and `optional`.

    Raises:
        ValueError: naming the entry.
    """
    if not isinstance(value, dict):
        raise ValueError(f"{where} is {shorten(value)}; it must be an object.")
    for key in required:
        if key not in value:
            raise ValueError(f"{where} has no {key!r}.")
    for key in value:
        if key not in required and key not in optional:
            raise ValueError(f"{where} has an entry {shorten(key)} that is not known.")
    return value


def items(where: str, value: Any) -> list[Any]:
    """Return a list.

    Raises:
        ValueError: naming the entry.
    """
    if not isinstance(value, list):
        raise ValueError(f"{where} is {shorten(value)}; it must be a list.")
    return value


def plain_number(where: str, value: Any) -> float:
    """Return one finite number; truth values and digits in strings are none.

    Raises:
        ValueError: naming the entry.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < float("inf"):
        raise ValueError(f"{where} is {shorten(value)}; it must be a finite number.")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{where} is {shorten(value)}; it is too large.") from None


def _refuse_constant(text: str) -> float:
    raise ValueError(f"{text} is no number of JSON")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the name {shorten(next(k for k in keys if keys.count(k) > 1))} comes twice in an object")
    return found

"""What the subcommands share: the error for bad input, the parser, the reading of angles, the version."""

import argparse
import math
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

LARGEST_ANGLE = 36000.0
"""Largest amplitude at the command line [deg]: a hundred turns."""
SHORTEST = 1e-4
"""Shortest duration at the command line [s]; a power of a shorter one may not be a number."""


class BadInput(Exception):
    """Something the user gave cannot be used; its text is the one line that says so."""


class Parser(argparse.ArgumentParser):
    """`ArgumentParser` that raises `BadInput` with one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        """Raise `BadInput`, led by the command's name."""
        raise BadInput(f"{self.prog}: {message}")

    def _print_message(self, message: str, file: Any = None) -> None:
        """Print help; argparse's own lets errors of the stream pass."""
        (file or sys.stderr).write(message)


def degrees(text: str) -> float:
    """Read an angle in degrees (an argparse type)."""
    try:
        angle = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not math.isfinite(angle):
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number")
    if abs(angle) > LARGEST_ANGLE:
        raise argparse.ArgumentTypeError(f"{text!r} is beyond {LARGEST_ANGLE:g} degrees")
    return angle


def join_negative_values(arguments: Sequence[str]) -> list[str]:
    """Join options to negative numbers after them, of which argparse knows only some: `--bend=-1e2`."""
    result: list[str] = []
    for argument in arguments:
        if result and result[-1].startswith("--") and "=" not in result[-1] and _negative(argument):
            result[-1] += f"={argument}"
        else:
            result.append(argument)
    return result


def version() -> str:
    """Version of the installed package."""
    from importlib import metadata

    try:
        return metadata.version("reojax")
    except metadata.PackageNotFoundError:
        return "(not installed)"


def _negative(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return text.startswith("-")

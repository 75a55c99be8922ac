"""What the subcommands share: the error for bad input, the parser, the reading of angles, the version."""

import argparse
import difflib
import math
import re
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

OPTIONS: dict[str, None] = {}
"""Options of all subcommands."""


class BadInput(Exception):
    """Something the user gave cannot be used; its text is the one line that says so."""


class Parser(argparse.ArgumentParser):
    """`ArgumentParser` that raises `BadInput` with one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        """Raise `BadInput`, led by the command's name, with what may have been meant."""
        wrong = re.search(r"invalid choice: '([^']*)' \(choose from (.*)\)|unrecognized arguments: (--[\w-]+)", message)
        known = [*OPTIONS] if wrong and wrong[3] else re.findall(r"[\w-]+", wrong[2]) if wrong else []
        near = difflib.get_close_matches(wrong[1] or wrong[3], known, 1, 0.6) if wrong else []
        message = message if len(message) <= 500 else f"{message[:350]} ... {message[-100:]}"
        raise BadInput(f"{self.prog}: {message}" + (f"; did you mean {near[0]}?" if near else ""))

    def add_argument(self, *names: Any, **options: Any) -> argparse.Action:
        """Declare an argument, and remember the option's name for whoever mistypes it."""
        OPTIONS.update(dict.fromkeys(name for name in names if name.startswith("--")))
        return super().add_argument(*names, **options)

    def _print_message(self, message: str, file: Any = None) -> None:
        """Print help; argparse's own lets errors of the stream pass."""
        (file or sys.stderr).write(message)


def join_negative_values(arguments: Sequence[str]) -> list[str]:
    """Make argparse see all negative numbers: `--bend=-1e2`; further ones of an option begin with a space."""
    result: list[str] = []
    for argument in arguments:
        if result and not result[-1].startswith("--") and _negative(argument):
            result.append(f" {argument}")
        elif result and result[-1].startswith("--") and "=" not in result[-1] and _negative(argument):
            result[-1] += f"={argument}"
        else:
            result.append(argument)
    return result


def in_degrees(text: str) -> str:
    """A message with its angles in degrees: `1.5 rad`, `-1 to 1 rad` and `-1..1 rad`."""
    number = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|[-+]?inf"
    angles = re.compile(rf"(?<![\w.])({number})(?:( to |\.\.)({number}))? rad\b(?!/)")

    def turned(found: re.Match[str]) -> str:
        first, between, last = found.groups()
        ends = [f"{math.degrees(float(end)):.5g}" for end in (first, last) if end]
        return f"{(between or '').join(ends)} degrees"

    asked = re.sub(r"[;:] (is it in|are these) degrees\?", "", text)
    return re.sub(r"\bin rad\b", "in degrees", angles.sub(turned, asked))


def _negative(text: str) -> bool:
    try:
        return text.startswith("-") and bool([float(part) for part in text.split(",")])
    except ValueError:
        return False

"""What the subcommands share: the error for bad input, the parser, the reading of angles, the version."""

import argparse
import difflib
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
        hint = f"; did you mean {near[0]}?" if near else ""
        if wrong and near and near[0] == wrong[3]:
            hint = "; it is an option of other commands"
        raise BadInput(f"{self.prog}: {message}{hint}")

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


def _negative(text: str) -> bool:
    try:
        return text.startswith("-") and bool([float(part) for part in text.split(",")])
    except ValueError:
        return False

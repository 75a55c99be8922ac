"""The command line, `reojax` or `python -m reojax`: one module per subcommand, listed in `COMMANDS`.

A subcommand's module has a docstring, whose first line is its help, `add_arguments(parser)` and `run(args)`.
It imports what computes inside `run`, so that help and mistyped arguments are answered at once. Results go
to stdout, after any file has been written. Exit status: 0 done, 1 done but something has no result or cannot be
printed, 2 bad input (one line on stderr), 130 interrupted.
"""

import argparse
import io
import os
import sys
from collections.abc import Sequence
from typing import TextIO

from reojax._internal.version import version
from reojax.cli import compare, export, merge, plan, show, simulate, sweep, time, view
from reojax.cli._arguments import BadInput, Parser, join_negative_values
from reojax.cli._numbers import in_degrees

COMMANDS = {
    "simulate": simulate,
    "time": time,
    "compare": compare,
    "export": export,
    "plan": plan,
    "sweep": sweep,
    "merge": merge,
    "view": view,
    "show": show,
}
"""Subcommands by name."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line with `argv` (default: the process's arguments) and return its exit status."""
    if sys.stdout is None:
        _tell("reojax: stdout is closed, so that no result can be printed.")
        return 2
    for stream in (sys.stdout, sys.stderr):  # a name that the terminal cannot show is no reason to stop
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        args = parse(sys.argv[1:] if argv is None else argv)
        args.run(args)
        sys.stdout.flush()
    except BadInput as error:
        _tell(in_degrees(str(error)))
        return 2
    except SystemExit as stop:  # argparse, after --help and --version; a subcommand whose result is not all there
        return _flush() or int(stop.code or 0)
    except KeyboardInterrupt as interrupt:
        _tell("; ".join(["reojax: interrupted", *getattr(interrupt, "__notes__", ())]))
        return 130
    except MemoryError as error:
        _tell(f"reojax: it does not fit into memory. {error}".rstrip())
        return 2
    except OSError as error:
        return _without_output(error)
    return 0


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Read arguments; what would be run is `args.run(args)`."""
    return _parser().parse_args(join_negative_values(argv))


def _flush() -> int:
    try:
        sys.stdout.flush()
    except OSError as error:
        return _without_output(error)
    return 0


def _without_output(error: OSError) -> int:
    """Status where stdout takes no more: 0 if its reader has enough (`| head`)."""
    _discard(sys.stdout)
    if isinstance(error, BrokenPipeError):
        return 0
    _tell(f"reojax: cannot print the result: {error.strerror or error}.")
    return 1


def _discard(stream: TextIO) -> None:
    """Let what a stream still holds go: Python flushes once more when it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _tell(text: str) -> None:
    """Write a line to stderr, if there is one."""
    if sys.stderr is not None:
        try:
            print(text, file=sys.stderr, flush=True)
        except OSError:
            _discard(sys.stderr)


def _parser() -> Parser:
    parser = Parser(
        prog="reojax",
        description="How a robot in free fall turns itself with its own joints.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, module in COMMANDS.items():
        text = (module.__doc__ or "").partition("\n")[0]
        command = subparsers.add_parser(name, help=text, description=text, allow_abbrev=False)
        module.add_arguments(command)
        command.set_defaults(run=module.run)
    return parser


class _Version(argparse.Action):
    """Looks the version up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        print(f"reojax {version()}")
        parser.exit()

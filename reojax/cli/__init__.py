"""The command line, `reojax` or `python -m reojax`: one module per subcommand, listed in `COMMANDS`.

A subcommand's module has a docstring, whose first line is its help, `add_arguments(parser)` and `run(args)`.
It imports what computes inside `run`, so that help and mistyped arguments are answered at once. Results go
to stdout, after any file has been written. Exit status: 0 done, 1 done but something has no result, 2 bad
input (one line on stderr), 130 interrupted.
"""

import argparse
import os
import sys
from collections.abc import Sequence

from reojax.cli import compare, export, merge, plan, simulate, sweep, time
from reojax.cli._arguments import BadInput, Parser, join_negative_values, version

COMMANDS = {
    "simulate": simulate,
    "time": time,
    "compare": compare,
    "export": export,
    "plan": plan,
    "sweep": sweep,
    "merge": merge,
}
"""Subcommands by name."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line with `argv` (default: the process's arguments) and return its exit status."""
    try:
        args = parse(sys.argv[1:] if argv is None else argv)
        args.run(args)
        sys.stdout.flush()
    except BadInput as error:
        print(error, file=sys.stderr)
        return 2
    except SystemExit as stop:  # argparse, after --help and --version
        return int(stop.code or 0)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the reader of stdout has enough; Python flushes once more when it ends
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Read arguments; what would be run is `args.run(args)`."""
    return _parser().parse_args(join_negative_values(argv))


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

"""What every experiment's command line does: options, the folder for results, clear errors, exit codes."""

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path

from reojax.session import compile_quickly, start


def options(doc: str | None) -> argparse.ArgumentParser:
    """Parser with the options that all experiments have; `doc` is the experiment's docstring."""
    summary, _, rest = (doc or "").partition("\n")
    parser = argparse.ArgumentParser(
        description=summary, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="smaller, for trying out")
    parser.add_argument(
        "--out", type=Path, default=Path("out"), help="folder for results, made if missing (default: out)"
    )
    return parser


def run(main: Callable[..., dict], parser: argparse.ArgumentParser) -> None:
    """Call `main(out, quick=..., **other options)`; exit 1 if its answer says `converged: False`, 2 on bad input."""
    arguments = vars(parser.parse_args())
    if arguments["quick"]:
        compile_quickly()
    start()
    try:
        out = arguments.pop("out")
        _make_folder(out)
        answer = main(out, **arguments)
    except ValueError as error:
        parser.exit(2, f"{parser.prog}: {error}\n")
    except KeyboardInterrupt:
        parser.exit(130, f"{parser.prog}: stopped\n")
    sys.exit(0 if answer.get("converged", True) else 1)


def length(text: str) -> float:
    """Metres, of a length such as `5mm`; a bare number is in mm."""
    for unit, size in (("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("", 1e-3)):
        if text.endswith(unit):
            return size * float(text.removesuffix(unit))
    raise AssertionError(text)


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"cannot make the folder {str(out)!r}: {error.strerror}.") from error
    if not os.access(out, os.W_OK | os.X_OK):
        raise ValueError(f"cannot write into the folder {str(out)!r}.")

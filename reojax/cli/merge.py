"""Put the chunks of a sweep together that was run with --store, in one folder or in several."""

import argparse
import json
import sys

from reojax.cli._arguments import BadInput
from reojax.cli._results import add_files, check_files, complaint, table, write


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `reojax merge`."""
    parser.add_argument("folders", nargs="+", metavar="FOLDER", help="store of the sweep, or of a part of it")
    add_files(parser)


def run(args: argparse.Namespace) -> None:
    """Read, write, and print; exit status 1 if designs gave no finite result."""
    from reojax.sweeps import merge

    try:
        check_files(args)
        found = merge(*args.folders)
        report = write(found, args, "")
    except ValueError as error:
        raise BadInput(f"reojax merge: {error}") from error
    print(json.dumps(report, indent=2, allow_nan=False) if args.json else table(report))
    if found.bad:
        print(complaint(found), file=sys.stderr)
        raise SystemExit(1)

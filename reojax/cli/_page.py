"""The option `--html` of subcommands: what was computed as a page to look at in a browser."""

import argparse
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from reojax.robot import Robot


def add_page(parser: argparse.ArgumentParser, what: str) -> None:
    """Declare the option."""
    parser.add_argument("--html", metavar="PAGE", help=f"write {what} as one .html file to look at in a browser")


def check_page(args: argparse.Namespace) -> None:
    """Refuse a page that cannot be written, before a long computation.

    Raises:
        ValueError: saying why.
    """
    from reojax._internal.files import check_ending

    if args.html is not None:
        check_ending(args.html, "page", ("html", "htm"))


def write_page(args: argparse.Namespace, robot: "Robot", motion: Any, *, title: str, target: Any = None) -> None:
    """Write the page, if one is asked for."""
    if args.html is not None:
        from reojax.viewer import view  # takes as long to import as some answers to compute

        asked = getattr(args, "clearance", None) is not None
        view(robot, motion, args.html, title=title, target=target, clearance=asked or None)

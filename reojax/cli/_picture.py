"""The option `--picture` of subcommands: what was computed as a figure."""

import argparse


def add_picture(parser: argparse.ArgumentParser, what: str) -> None:
    """Declare the option; `--out`, its name before, is still taken."""
    text = f"draw {what} to a .png, .pdf or .svg"
    parser.add_argument("--picture", dest="out", metavar="FIGURE", help=text)
    parser.add_argument("--out", dest="out", metavar="FIGURE", help=argparse.SUPPRESS)


def check_picture(args: argparse.Namespace) -> None:
    """Refuse a picture that cannot be written, before a long computation.

    Raises:
        ValueError: saying why.
    """
    if args.out is not None:
        from reojax import plot

        plot.check_picture(args.out)

"""What the subcommands that run a manoeuvre share: its options, its path, and how it is called."""

import argparse
from typing import TYPE_CHECKING

from reojax.cli._arguments import degrees

if TYPE_CHECKING:
    from reojax.path import Path
    from reojax.robot import Robot


def add_manoeuvre(parser: argparse.ArgumentParser) -> None:
    """Declare the options that say which manoeuvre of which robot."""
    add = parser.add_argument
    parts = "a: the distal joints twist opposite ways; b: the same way [%(default)s]"
    add("--manoeuvre", choices=("a", "b"), default="a", help=parts)
    add("--twist", type=degrees, default=270.0, metavar="DEG", help="twist of the distal joints [%(default)g]")
    add("--bend", type=degrees, default=120.0, metavar="DEG", help="bend of the centre joint [%(default)g]")
    add("--robot", default="prototype", metavar="NAME", help="robot; a wrong name lists them [%(default)s]")


def path_of(robot: "Robot", args: argparse.Namespace) -> "Path":
    """Path of the manoeuvre.

    Raises:
        ValueError: for a robot that the manoeuvres are not laid out for.
    """
    import numpy as np

    from reojax.manoeuvres import manoeuvre_a, manoeuvre_b
    from reojax.robot import layout_of

    manoeuvre = {"a": manoeuvre_a, "b": manoeuvre_b}[args.manoeuvre]
    return manoeuvre(np.deg2rad(args.twist), np.deg2rad(args.bend), layout_of(robot))


def edge_names(robot: "Robot") -> tuple[str, ...]:
    """What the robot does on each edge of a manoeuvre."""
    from reojax.robot import layout_of

    names = ("bend", "twist", "unbend", "untwist")
    return names if layout_of(robot).fold is None else ("fold", *names, "unfold")


def heading(args: argparse.Namespace) -> str:
    """The manoeuvre in a line."""
    angles = f"twist {args.twist:g} deg, bend {args.bend:g} deg"
    return f"Manoeuvre {args.manoeuvre.upper()} on {args.robot}: {angles}"

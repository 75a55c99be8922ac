"""What the subcommands that run a manoeuvre share: its options, its path, and how it is called."""

import argparse
from typing import TYPE_CHECKING, Any

from reojax.cli._numbers import degrees
from reojax.cli._plan_file import add_plan_file, saved_plan
from reojax.cli._robot import add_robot, layout_of, robot_of

if TYPE_CHECKING:
    from reojax.path import Path
    from reojax.robot import Robot


def add_amplitudes(parser: argparse.ArgumentParser, *, default: str | None = "a", otherwise: str = "") -> None:
    """Declare the options of a manoeuvre: which, `default` or none, and its amplitudes.

    Args:
        parser: gets the options.
        default: the manoeuvre that is meant where none is given; None for no manoeuvre.
        otherwise: said of the amplitudes, such as when they are not taken from elsewhere.
    """
    add = parser.add_argument
    parts = "a: the distal joints twist opposite ways; b: the same way" + (" [%(default)s]" if default else "")
    add("--manoeuvre", choices=("a", "b"), default=default, help=parts)
    for name, angle, what in (
        ("--twist", 270.0, "twist of the distal joints"),
        ("--bend", 120.0, "bend of the centre joint"),
    ):
        add(name, type=degrees, default=angle, metavar="DEG", help=f"{what}{otherwise} [%(default)g]")


def add_manoeuvre(parser: argparse.ArgumentParser, *, plan: bool = True) -> None:
    """Declare the options that say which manoeuvre of which robot; with `plan`, or which plan."""
    add_amplitudes(parser)
    add_robot(parser)
    if plan:
        add_plan_file(parser)


def robot_and_path(args: argparse.Namespace) -> tuple["Robot", "Path"]:
    """The robot and its path: of `--plan` all runs, otherwise the manoeuvre.

    Raises:
        ValueError: for a file that is no plan or no robot, or a robot that the manoeuvres are not laid out for.
    """
    saved = saved_plan(args)
    if saved is None:
        robot = robot_of(args.robot)
        return robot, path_of(robot, args)
    args.robot, args.runs = saved.robot.name, saved.repeats
    if not saved.travel:
        raise ValueError(f"nothing moves in the plan {args.plan!r}.")
    return saved.robot, saved.path


def path_of(robot: "Robot", args: argparse.Namespace) -> "Path":
    """Path of the manoeuvre.

    Raises:
        ValueError: for a robot that the manoeuvres are not laid out for.
    """
    import numpy as np

    from reojax.manoeuvres import BY_NAME

    return BY_NAME[args.manoeuvre](np.deg2rad(args.twist), np.deg2rad(args.bend), layout_of(robot))


def config_of(args: argparse.Namespace) -> dict[str, Any]:
    """What a report says of the manoeuvre or the plan that was run."""
    return {
        "robot": args.robot,
        "plan": args.plan,
        "manoeuvre": args.manoeuvre,
        "twist_deg": args.twist,
        "bend_deg": args.bend,
    }


def edge_names(robot: "Robot", path: "Path", args: argparse.Namespace) -> tuple[str, ...]:
    """What the robot does on each edge of a manoeuvre, or the number of each edge of a plan."""

    if args.plan is not None:
        return tuple(f"edge {k}" for k in range(1, path.edges + 1))
    names = ("bend", "twist", "unbend", "untwist")
    return names if layout_of(robot).fold is None else ("fold", *names, "unfold")


def heading(args: argparse.Namespace) -> str:
    """The manoeuvre, or the plan, in a line."""
    if getattr(args, "runs", None) is not None:
        runs = f", {args.runs} runs" if args.runs > 1 else ""
        return f"Plan {args.plan} on {args.robot}{runs}"
    angles = f"twist {args.twist:g} deg, bend {args.bend:g} deg"
    return f"Manoeuvre {args.manoeuvre.upper()} on {args.robot}: {angles}"

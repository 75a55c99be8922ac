"""A plan file in place of a manoeuvre: what `reojax plan --save` wrote, for the commands that run a path."""

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from reojax.planning.plan_file import SavedPlan


def add_plan_file(parser: argparse.ArgumentParser) -> None:
    """Declare `--plan`."""
    text = "run the path of a plan that `reojax plan --save` wrote, on its robot, instead of a manoeuvre"
    parser.add_argument("--plan", metavar="PLAN.json", help=text)


def saved_plan(args: argparse.Namespace) -> "SavedPlan | None":
    """The plan of `--plan`, if it is given.

    Raises:
        ValueError: if the file is no plan.
    """
    if args.plan is None:
        return None
    from reojax.planning.plan_file import load_plan

    return load_plan(args.plan)

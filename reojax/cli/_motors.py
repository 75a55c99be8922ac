"""What the subcommands that drive the joints share: the motors' supply and numbers that must be positive."""

import argparse
from typing import TYPE_CHECKING

from reojax.cli._numbers import VOLTAGE, number, number_from

if TYPE_CHECKING:
    from reojax.motion.motor import Motor
    from reojax.robot import Robot

WEAKEST = 1e-3
"""Weakest supply at the command line [V]; no motor moves by less."""


def add_motors(parser: argparse.ArgumentParser, *, law: str | None) -> None:
    """Declare `--supply` and `--law`; `law` is its default."""
    laws = "quintic, trapezoid or minimum-jerk"
    default = "" if law is None else " [%(default)s]"
    parser.add_argument("--law", default=law, metavar="NAME", help=f"time law of every edge: {laws}{default}")
    add = parser.add_argument
    add("--supply", type=volts, default=12.0, metavar="V", help="supply of the motors [%(default)g]")
    add("--resistance", type=_winding, metavar="OHM", help="of the motors' windings [the RE-max 17's, 8.3]")
    add("--torque-constant", type=_winding, metavar="NM/A", help="of the motors [the RE-max 17's, 0.0107]")


def volts(text: str) -> float:
    """Read a supply voltage (an argparse type)."""
    return number_from(text, "a supply voltage", WEAKEST, 1e4, VOLTAGE)


def momentum(text: str) -> list[float]:
    """Read an angular momentum, three numbers between commas (an argparse type)."""
    try:
        numbers = [number(part) for part in text.split(",")]
    except argparse.ArgumentTypeError:
        numbers = []
    if len(numbers) != 3:
        raise argparse.ArgumentTypeError(f"{text!r} is not three finite numbers X,Y,Z")
    return numbers


def motor_of(robot: "Robot", args: argparse.Namespace) -> "Motor":
    """The prototype's motor, or one of another winding, with the rotors and gears that the robot has."""
    from reojax.motion.motor import RE_MAX_17

    given = {"resistance": args.resistance, "torque_constant": args.torque_constant}
    winding = {key: value for key, value in given.items() if value is not None}
    return RE_MAX_17._replace(
        supply=args.supply, rotor_inertia=robot.rotor_inertia, gear_ratio=robot.gear_ratio, **winding
    )


def _winding(text: str) -> float:
    return number_from(text, "a number of a winding", 1e-6, 1e6)

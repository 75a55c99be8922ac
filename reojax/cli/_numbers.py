"""Numbers at the command line, each with its unit or in the one that its option names: one reader for all options."""

import argparse
import math

LARGEST_ANGLE = 36000.0
"""Largest amplitude at the command line [deg]: a hundred turns."""
SHORTEST = 1e-4
"""Shortest duration at the command line [s]; a power of a shorter one may not be a number."""
LONGEST = 1e4
"""Longest duration at the command line [s]."""

ANGLE = {"deg": 1.0, "rad": 180 / math.pi}
TIME = {"ms": 1e-3, "s": 1.0}
LENGTH = {"mm": 1e-3, "cm": 1e-2, "um": 1e-6, "m": 1.0}
VOLTAGE = {"mV": 1e-3, "V": 1.0}
RATE = {"kHz": 1e3, "Hz": 1.0}


def number(text: str, units: dict[str, float] | None = None) -> float:
    """Read a finite number with one of the units, or none.

    Raises:
        ArgumentTypeError: saying what is wrong with it.
    """
    bare, size = text.strip(), 1.0
    for unit, factor in (units or {}).items():
        if bare.endswith(unit) and bare != unit:
            bare, size = bare.removesuffix(unit).rstrip(), factor
            break
    try:
        value = float(bare) * size
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number")
    return value


def number_from(text: str, what: str, least: float, most: float, units: dict[str, float] | None = None) -> float:
    """Read a number within a range; `what` says what it is."""
    value = number(text, units)
    if not least <= value <= most:
        raise argparse.ArgumentTypeError(f"{text!r} is not {what}: it must be from {least:g} to {most:g}")
    return value


def degrees(text: str) -> float:
    """Read an angle, in degrees if it says nothing else (an argparse type): 270, 270deg, 1.5rad."""
    angle = number(text, ANGLE)
    if abs(angle) > LARGEST_ANGLE:
        raise argparse.ArgumentTypeError(f"{text!r} is beyond {LARGEST_ANGLE:g} degrees")
    return angle


def seconds(text: str) -> float:
    """Read a duration, in seconds if it says nothing else (an argparse type): 0.5, 500ms."""
    return number_from(text, "a duration in seconds", SHORTEST, LONGEST, TIME)


def length(text: str) -> float:
    """Read a length with its unit, from 0 up, in metres (an argparse type): 5mm, 0.5 cm, 0.005m."""
    wrong = argparse.ArgumentTypeError(f"{text!r} is not a length from 0 up with its unit, such as 5mm or 0.005m")
    if not text.strip().endswith(tuple(LENGTH)):
        raise wrong
    try:
        value = number(text, LENGTH)
    except argparse.ArgumentTypeError:
        raise wrong from None
    if value < 0:
        raise wrong
    return value


def from_zero(text: str, units: dict[str, float] | None = None) -> float:
    """Read a number that is not negative."""
    value = number(text, units)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text!r} must be finite and not negative")
    return value


def whole(text: str) -> int:
    """Read a positive whole number (an argparse type)."""
    if not (text.isdecimal() and text.isascii() and len(text) < 19 and int(text) > 0):
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is not a positive whole number")
    return int(text)

"""Command lines of real options and hostile words."""

import io
import random
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from typing import Any

from reojax.cli import main

WORDS = [
    "", "a", "b", "-1", "1e9", "nan", "inf", "x", "0", "0.5", "1,2", "1,2,3,4", "-0.001,0,0", "/dev/full", "/nowhere/a",
    "prototype", "planar2", "six_body", "quintic", "trapezoid", "a.png", "a.csv", "a.npz", "twist=0:1:2", "twist=1,2",
    "gear=0,1", "roll", "--", "-h", "x" * 5000, "é°\udc80", "3deg", "[", "rotvec 0 90 0", "rotvec", "rotvec nan 0 0",
    "quat 0 0 0 0", "matrix /dev/full", "matrix /dev/stdin", "zxz 1e300 0 0", "count", "least", "elbow=90",
    "1e400", "∞",
]  # fmt: skip
OPTIONS = """--robot --manoeuvre --twist --bend --law --duration --supply --momentum --json --out --picture --rate
--delay --torques --angles --offset --calibrate --shard --store --chunk-size --devices --outputs --plan --html
--target --twist-limit --bend-limit --max-manoeuvres --objective --vocabulary --from --to --joints --repeats --corners
--clearance --save --csv --animate --beside --title --up""".split()
COMMANDS = {
    "simulate": [], "time": [], "compare": ["capture.csv"], "export": ["--out", "t.csv"], "sweep": ["twist=0:10:2"],
    "merge": ["store"], "plan": ["--target", "rotvec 0 0 10", "--max-manoeuvres", "1"], "view": ["plan.json"],
    "show": [],
}  # fmt: skip
"""Subcommands and what makes them nearly right."""


def lines(draw: random.Random, commands: tuple[str, ...]) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Command lines without end."""
    while True:
        command = draw.choice(commands)
        line = [command, *(COMMANDS[command] if draw.random() < 0.5 else [])]
        for _ in range(draw.randrange(1, 5)):
            line.append(draw.choice(OPTIONS) if draw.random() < 0.5 else draw.choice(WORDS))
        yield str(line)[:200], lambda line=line: run_line(line)


def run_line(line: list[str]) -> None:
    """Run a command line; a refusal is a `ValueError`, and anything else but success, is an error."""
    printed, complaint = io.StringIO(), io.StringIO()
    with redirect_stdout(printed), redirect_stderr(complaint):
        status = main(line)
    said = complaint.getvalue()
    if status == 2 and said.count("\n") == 1 and not printed.getvalue():
        raise ValueError(said)
    if status not in (0, 1) or "nan" in printed.getvalue().lower().split():
        raise RuntimeError(f"status {status}: {said[:200]} {printed.getvalue()[:200]}")

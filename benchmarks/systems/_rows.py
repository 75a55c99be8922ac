"""What is reported of a system."""

import importlib
from contextlib import redirect_stdout
from io import StringIO
from typing import Any, NamedTuple

import numpy as np

from ._measure import Samples

GRADIENT = "with gradient"
"""Of `what`, where the value comes with a gradient."""


class Missing(Exception):
    """A system that cannot be measured here; its text is the reason."""


class Row(NamedTuple):
    """One measured call of one system. Times are per loop."""

    system: str
    what: str
    """Value, or which gradient with it."""
    steps: str
    """Steps per edge, or the tolerance of an adaptive solver."""
    evaluations: float | None
    """Evaluations of omega per loop."""
    loops: int
    """Loops in one call."""
    threads: int
    error: float | None
    """95th percentile over loops of the angle from the reference [rad]."""
    gradient_error: float | None
    """The same of the gradient, relative to the median gradient."""
    wall: float
    """[s]"""
    cpu: float
    """[s]"""
    spread: float
    """Distance of the quartiles of `wall` over its median."""
    compile: float | None
    """Seconds from the first trace to a compiled program, or to build and compile C."""
    over_value: float | None
    """Median ratio to the value alone, sample by sample (processor time)."""
    note: str = ""


def row(
    system: str,
    what: str,
    samples: Samples,
    *,
    loops: int,
    threads: int,
    steps: int | str,
    evaluations: float | None = None,
    error: float | None = None,
    gradient_error: float | None = None,
    compile: float | None = None,
    value: Samples | None = None,
    note: str = "",
) -> Row:
    """Make a row of the samples of one call; `value`: samples of the value alone, taken by turns with them."""
    wall = float(np.median(samples.wall)) / loops
    return Row(
        system=system,
        what=what,
        steps=str(steps),
        evaluations=evaluations,
        loops=loops,
        threads=threads,
        error=error,
        gradient_error=gradient_error,
        wall=wall,
        cpu=float(np.median(samples.cpu)) / loops,
        spread=float(np.subtract(*np.quantile(samples.wall, (0.75, 0.25)))) / loops / wall,
        compile=compile,
        over_value=None if value is None else float(np.median(samples.cpu / value.cpu)),
        note=note,
    )


def optional(module: str, package: str) -> Any:
    """Import a module of an optional package.

    Raises:
        Missing: if it is not installed, or does not work here.
    """
    try:
        with redirect_stdout(StringIO()):  # MJX prints what else is not installed
            return importlib.import_module(module)
    except Exception as error:  # a peer built for another version may fail in any way
        absent = isinstance(error, ModuleNotFoundError) and error.name == module.split(".")[0]
        reason = f"not installed: pip install {package}" if absent else f"{type(error).__name__}: {error}"
        raise Missing(reason) from error

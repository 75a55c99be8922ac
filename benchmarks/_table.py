"""The table of rows, as Markdown that reads well in a terminal too."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from systems._rows import GRADIENT, Row
from systems._task import REFERENCE_STEPS, TOLERANCE, Task

from reojax.files import replacing

START, END = "<!-- table -->", "<!-- /table -->"
HEADINGS = (
    *("system", "what", "steps", "omegas", "error", "grad. err.", "us/loop", "us core", "loops/s", "loops/s core"),
    *("ns/omega", "x value", "compile s", "x reojax", "threads"),
)


def table(rows: Sequence[Row]) -> str:
    """Return all rows as one Markdown table, its columns aligned."""
    cells = [HEADINGS, *(_cells(row, rows) for row in rows)]
    width = [max(len(line[i]) for line in cells) for i in range(len(HEADINGS))]
    lines = [
        " | ".join(
            cell.ljust(w) if i < 2 else cell.rjust(w) for i, (cell, w) in enumerate(zip(line, width, strict=True))
        )
        for line in cells
    ]
    rule = " | ".join("-" * w if i < 2 else "-" * (w - 1) + ":" for i, w in enumerate(width))
    return "\n".join(f"| {line} |" for line in [lines[0], rule, *lines[1:]])


def _cells(row: Row, rows: Sequence[Row]) -> tuple[str, ...]:
    base = next((r for r in rows if _kind(r) == _kind(row)), None)  # the first row is reojax, where it is measured
    base = base if base and base.system.startswith("reojax") else None
    return (
        row.system,
        row.what,
        row.steps,
        "" if row.evaluations is None else f"{row.evaluations:.0f}",
        _power(row.error),
        _power(row.gradient_error),
        _number(row.wall * 1e6),
        _number(row.cpu * 1e6),
        _number(1 / row.wall),
        _number(1 / row.cpu),
        _number(row.evaluations and row.cpu / row.evaluations * 1e9),
        _number(row.over_value),
        _number(row.compile),
        _number(base and row.cpu / base.cpu),
        str(row.threads),
    )


def _kind(row: Row) -> str:
    return GRADIENT if row.what.startswith(GRADIENT) else "value"


def _number(x: float | None) -> str:
    """Three digits, thousands apart."""
    if x is None:
        return ""
    if x >= 1000:
        return f"{float(f'{x:.3g}'):_.0f}".replace("_", " ")
    return f"{x:#.3g}".rstrip(".")


def _power(x: float | None) -> str:
    return "" if x is None else f"{x:.1e}"


def notes(
    rows: Sequence[Row], missing: dict[str, str], machine: dict[str, Any], task: Task, check: float | None
) -> list[str]:
    """Lines that go with the table."""
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items() if version)
    verified = "not checked against DOP853: no SciPy" if check is None else f"within {check:.0e} rad of DOP853"
    load = "" if machine["load"] is None else f", load {machine['load'][0]:.1f} at the start"
    lines = [
        f"- {machine['processor']}, {machine['cores']} cores{load}; {machine['date']}{', quick run' * task.quick}.",
        f"- {versions}.",
        f"- Error: 95th percentile over {task.checked} loops, or as many as the row has; aim {TOLERANCE:.0e} rad. "
        f"Reference: reojax with {REFERENCE_STEPS} steps, {verified}.",
    ]
    for note in dict.fromkeys((row.system, row.note) for row in rows if row.note):
        lines.append(f"- {note[0]}: {note[1]}.")
    return lines + [f"- Left out: {name} ({reason})." for name, reason in missing.items()]


def update(readme: Path, text: str) -> None:
    """Put `text` between the marks in the README.

    Raises:
        ValueError: if it has not both marks.
    """
    before, start, rest = readme.read_text().partition(START)
    _, end, after = rest.partition(END)
    if not start or not end:
        raise ValueError(f"{str(readme)!r} has no lines {START!r} and {END!r}.")
    with replacing(readme) as file:
        file.write(f"{before}{start}\n\n{text}\n\n{end}{after}".encode())

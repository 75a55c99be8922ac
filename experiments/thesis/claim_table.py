"""A claim of the thesis with its verdict, and tables of claims."""

from collections.abc import Sequence
from typing import NamedTuple


class Claim(NamedTuple):
    """A claim, and what became of it."""

    section: str
    """Where the thesis makes it."""
    text: str
    """What it says."""
    figure: str
    """Picture or measurement that tests it."""
    result: str
    """What reojax gets."""
    agrees: bool | None
    """The verdict; None if it was not tested."""
    why: str
    """Where it does not agree or was not tested, why; else what to know."""

    @property
    def verdict(self) -> str:
        """In a word."""
        return {True: "yes", False: "no", None: "not tested"}[self.agrees]


LEFT_OUT = "left out by --quick"
COLUMNS = ("thesis", "claim", "tested by", "reojax", "agrees", "remark")


def markdown(claims: Sequence[Claim]) -> str:
    """Return the table in Markdown."""
    rows = [COLUMNS, ("---",) * len(COLUMNS)]
    rows += [(c.section, c.text, _figure(c.figure), c.result, c.verdict, c.why) for c in claims]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows) + "\n"


def text(claims: Sequence[Claim]) -> str:
    """Return the table for a terminal: two lines a claim, and the remark where it does not agree."""
    lines = []
    for c in claims:
        lines.append(f"{c.verdict:11}{c.section:20}{c.text}")
        lines.append(f"{'':11}{_figure(c.figure)}: {c.result or '-'}")
        if c.agrees is not True:
            lines.append(f"{'':11}why: {c.why}")
    count = [sum(c.agrees is verdict for c in claims) for verdict in (True, False, None)]
    return "\n".join([*lines, "", "{} agree, {} do not, {} not tested".format(*count)])


def _figure(name: str) -> str:
    return f"figure {name}" if name[:1].isdigit() and name.replace(".", "").isdigit() else name

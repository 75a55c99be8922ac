"""What `reojax sweep` and `reojax merge` do with results: files, a table of ranges, the bad designs."""

import argparse
from math import prod
from typing import TYPE_CHECKING, Any

from reojax._internal.display_units import display_unit

if TYPE_CHECKING:
    from reojax.sweeps import Sweep

_TOLD = 20
"""Bad designs that are printed; the files have all of them."""


def add_files(parser: argparse.ArgumentParser) -> None:
    """Declare the options for files."""
    parser.add_argument("--out", metavar="FILE", help="write axes and results to a NumPy archive, .npz")
    parser.add_argument("--picture", metavar="FIGURE", help="draw the results to a .png, .pdf or .svg")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def check_files(args: argparse.Namespace) -> None:
    """Refuse files that cannot be written.

    Raises:
        ValueError: naming the file and what is wrong.
    """
    from reojax._internal.files import check_writable

    if args.out is not None:
        if not args.out.endswith(".npz"):
            raise ValueError(f"cannot write {args.out!r}: the name of a NumPy archive ends in .npz.")
        check_writable(args.out)
    if args.picture is not None:
        from reojax import plot

        plot.check_picture(args.picture)


def write(found: "Sweep", args: argparse.Namespace, title: str) -> dict[str, Any]:
    """Write the files that were asked for; return what was written and the ranges of the results, in shown units."""
    if args.out is not None:
        found.save(args.out)
    if args.picture is not None:
        from reojax import plot

        plot.save(plot.sweep_figure(found, title=title), args.picture)
    return {
        "shape": dict(zip(found.dimensions, found.shape, strict=True)),
        "designs": prod(found.shape),
        "bad": len(found.bad),
        "results": {name: _extremes(found, name) for name in found.arrays()},
        "out": args.out,
        "picture": args.picture,
    }


def table(report: dict[str, Any]) -> str:
    """Lay a report of `write` out for people."""
    sides = " x ".join(f"{name} {side}" for name, side in report["shape"].items())
    lines = [f"{report['designs']} designs: {sides}", "", f"{'result':20}{'least':>12}  {'at':44}{'most':>12}  at"]
    for name, (unit, *ends) in ((n, r.values()) for n, r in report["results"].items()):
        label = f"{name} [{unit}]" if unit else name
        cells = (("-", "") if end is None else (f"{end['value']:.4f}", end["at"]) for end in ends)
        (least, where), (most, there) = cells
        lines.append(f"{label:20}{least:>12}  {where:44}{most:>12}  {there}".rstrip())
    lines += [f"{what} in {report[what]}" for what in ("out", "picture") if report[what] is not None]
    return "\n".join(lines)


def complaint(found: "Sweep") -> str:
    """Name the bad designs, in shown units."""
    bad = found.bad
    lines = [f"{len(bad)} of {prod(found.shape)} designs gave no finite result:"]
    lines += [f"  {_where(found, one.design)}: {one.reason}" for one in bad[:_TOLD]]
    return "\n".join(lines + [f"  and {len(bad) - _TOLD} more"] * (len(bad) > _TOLD))


def _extremes(found: "Sweep", name: str) -> dict[str, Any]:
    """Unit, and the least and the largest finite value of a result, with the design that has it."""
    import numpy as np

    values = found.arrays()[name]
    unit, scale = display_unit(found.units.get(name, ""))
    ends = {}
    for end, pick in (("least", np.nanargmin), ("most", np.nanargmax)):
        finite = np.where(np.isfinite(values), values, np.nan).ravel()
        if np.isnan(finite).all():
            ends[end] = None
            continue
        number = int(pick(finite))
        ends[end] = {"value": float(finite[number] * scale), "at": _where(found, found.design(number))}
    return {"unit": unit, **ends}


def _where(found: "Sweep", design: dict[str, float]) -> str:
    return ", ".join(
        f"{name} {value * display_unit(found.units.get(name, ''))[1]:.6g}" for name, value in design.items()
    )

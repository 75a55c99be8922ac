"""Results of a sweep: lines over one axis, contours over two."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reojax._internal.display_units import display_unit
from reojax.drawing.colours import GREY, INK, PALE
from reojax.plot._arguments import check_arguments

if TYPE_CHECKING:
    from reojax.sweeps import Sweep

_MOST = 6
"""Most results in one picture."""
_ROWS, _COLUMNS = 3, 4
"""Most results, and values of a third axis, in small multiples."""


@check_arguments
def sweep_figure(sweep: "Sweep", *, title: str | None = None, results: Sequence[str] | None = None) -> Figure:
    """Draw scalar results of a sweep, side by side.

    A list of designs is drawn over the number of the design, a grid of one axis as lines, and one of more axes as
    contours over the two longest ones. Along the next longest axis there are small multiples, a column for each of up
    to four of its values and one scale for a row; all other axes are held at their middle value, which the title says.
    Axes of one value do not count. Angles are in degrees and inertias in kg mm^2. Designs without a finite
    result are left white.

    Args:
        sweep: what to draw.
        title: first line of the title.
        results: names of the scalar results to draw; default the first six, of small multiples the first three.

    Raises:
        ValueError: if a result is unknown or no scalar, or all axes have one value.
    """
    free = [k for k, side in enumerate(sweep.shape) if side > 1]
    if not free:
        raise ValueError("all axes of the sweep have one value; a picture needs one of two values or more.")
    longest = sorted(free, key=lambda k: -sweep.shape[k])
    drawn = sorted(longest[:2])
    names = _choose(sweep, results, _MOST if len(free) < 3 else _ROWS)
    place = tuple(slice(None) if k in drawn else side // 2 for k, side in enumerate(sweep.shape))
    if len(free) > 2:
        return _multiples(sweep, names, drawn, longest[2], place, title)
    columns = min(len(names), 2)
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(4.6 * columns + 0.4, 3.5 * rows + 0.5), layout="constrained", facecolor="white")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, name in zip(panels, names, strict=False):
        draw_result(axes, sweep, name, [sweep.dimensions[k] for k in drawn], place)
    for axes in panels[len(names) :]:
        axes.set_axis_off()
    _head(figure, sweep, title, place, drawn)
    return figure


def _multiples(
    sweep: "Sweep",
    names: Sequence[str],
    drawn: Sequence[int],
    third: int,
    place: tuple[slice | int, ...],
    title: str | None,
) -> Figure:
    """Contours over two axes, a column for each of some values of a third one, a row for each result."""
    side = sweep.shape[third]
    picks = np.unique(np.round(np.linspace(0, side - 1, min(side, _COLUMNS))).astype(int))
    figure = Figure(figsize=(3.1 * len(picks) + 0.9, 2.9 * len(names) + 0.7), layout="constrained", facecolor="white")
    panels = figure.subplots(len(names), len(picks), squeeze=False, sharex=True, sharey=True)
    dimensions = [sweep.dimensions[k] for k in drawn]
    for row, name in zip(panels, names, strict=True):
        slices = [tuple(int(pick) if k == third else at for k, at in enumerate(place)) for pick in picks]
        ends = _ends(sweep, name, slices)
        for axes, cut in zip(row, slices, strict=True):
            draw_result(axes, sweep, name, dimensions, cut, ends=ends)
            value = _at(sweep, sweep.dimensions[third], cut[third])
            axes.set_title(f"{_label(sweep, name)}\nat {value}", loc="left", fontsize=9.5, color=INK)
            axes.label_outer()
    _head(figure, sweep, title, place, [*drawn, third])
    return figure


def _ends(sweep: "Sweep", name: str, slices: Sequence[tuple[slice | int, ...]]) -> tuple[float, float] | None:
    """Least and greatest finite value of a result in some slices, in the unit that is shown."""
    values = np.concatenate([np.asarray(sweep.arrays()[name], float)[cut].ravel() for cut in slices])
    values = values[np.isfinite(values)] * display_unit(sweep.units.get(name, ""))[1]
    return (float(values.min()), float(values.max())) if values.size else None


def _head(
    figure: Figure, sweep: "Sweep", title: str | None, place: tuple[slice | int, ...], drawn: Sequence[int]
) -> None:
    """Title, and at which values the axes are held that are not drawn."""
    held = [_at(sweep, sweep.dimensions[k], place[k]) for k in range(len(place)) if k not in drawn]
    lines = [line for line in (title, f"at {', '.join(held)}" if held else None) if line]
    if lines:
        figure.suptitle("\n".join(lines), color=INK, fontsize=12, ha="left", x=0.02)


def draw_result(
    axes: Axes,
    sweep: "Sweep",
    name: str,
    drawn: Sequence[str],
    place: tuple[slice | int, ...],
    *,
    ends: tuple[float, float] | None = None,
) -> Axes:
    """Draw one scalar result over one or two of the sweep's dimensions.

    Args:
        axes: flat axes.
        sweep: what to draw.
        name: name of the result.
        drawn: dimensions to draw over.
        place: index of the results that leaves these dimensions.
        ends: least and greatest value of the colours, in the unit that is shown; default those drawn.
    """
    values = np.asarray(sweep.arrays()[name], float)[place] * display_unit(sweep.units.get(name, ""))[1]
    values = np.ma.masked_invalid(values)
    axes.set_xlabel(_label(sweep, drawn[0]), color=INK)
    axes.set_title(_label(sweep, name), loc="left", fontsize=11, color=INK)
    axes.tick_params(colors=INK, color=GREY)
    if len(drawn) == 1:
        marker = "o" if values.size <= 40 else ""
        axes.plot(_display_axis(sweep, drawn[0]), values, color="#0072b2", linewidth=1.8, marker=marker, markersize=4)
        axes.grid(color=PALE, linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        return axes
    x, y = (_display_axis(sweep, dimension) for dimension in drawn)
    axes.set_ylabel(_label(sweep, drawn[1]), color=INK)
    if values.count() == 0 or np.ptp(values.compressed()) == 0:
        text = f"{values.compressed()[0]:g} everywhere" if values.count() else "no finite result"
        axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", color=INK)
        axes.set(xlim=(x.min(), x.max()), ylim=(y.min(), y.max()))
        return axes
    levels = 12 if ends is None else MaxNLocator(12).tick_values(*ends)
    filled = axes.contourf(x, y, values.T, levels, cmap="cividis")
    axes.contour(x, y, values.T, filled.levels, colors=INK, linewidths=0.4, linestyles="solid")
    axes.figure.colorbar(filled, ax=axes, pad=0.02)
    return axes


def _choose(sweep: "Sweep", results: Sequence[str] | None, most: int) -> list[str]:
    sides = len(sweep.shape)
    scalar = [name for name, values in sweep.arrays().items() if values.ndim == sides and values.dtype.kind in "biuf"]
    for name in results or ():
        if name not in scalar:
            raise ValueError(f"{name!r} is no scalar result of this sweep; these are {', '.join(scalar) or 'none'}.")
    names = list(results or scalar[:most])
    if not names:
        raise ValueError("the sweep has no scalar result; there is nothing to draw.")
    return names


def _display_axis(sweep: "Sweep", dimension: str) -> np.ndarray:
    if dimension not in sweep.axes:  # a list of designs
        return np.arange(sweep.shape[0])
    return np.asarray(sweep.axes[dimension], float) * display_unit(sweep.units.get(dimension, ""))[1]


def _label(sweep: "Sweep", name: str) -> str:
    unit, _ = display_unit(sweep.units.get(name, ""))
    words = name.replace("_", " ")
    return f"{words} [{unit.replace('^2', '²')}]" if unit else words


def _at(sweep: "Sweep", dimension: str, index: slice | int) -> str:
    unit, _ = display_unit(sweep.units.get(dimension, ""))
    value = _display_axis(sweep, dimension)[index]
    return f"{dimension.replace('_', ' ')} {value:.6g} {unit.replace('^2', '²')}".rstrip()

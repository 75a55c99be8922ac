"""Results of a sweep: lines over one axis, contours over two."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reojax._internal.display_units import display_unit
from reojax.drawing.colours import GREY, INK, PALE

if TYPE_CHECKING:
    from reojax.sweeps import Sweep

_MOST = 6
"""Most results in one picture."""


def sweep_figure(sweep: "Sweep", *, title: str | None = None, results: Sequence[str] | None = None) -> Figure:
    """Draw scalar results of a sweep, side by side.

    A list of designs is drawn over the number of the design, a grid of one axis as lines, and one of more axes as
    contours over the two longest ones. The other axes are held at their middle value then, which the title says.
    Axes of one value do not count. Angles are in degrees and inertias in kg mm^2. Designs without a finite
    result are left white.

    Args:
        sweep: what to draw.
        title: first line of the title.
        results: names of the scalar results to draw; default the first six.

    Raises:
        ValueError: if a result is unknown or no scalar, or all axes have one value.
    """
    names = _choose(sweep, results)
    free = [k for k, side in enumerate(sweep.shape) if side > 1]
    if not free:
        raise ValueError("all axes of the sweep have one value; a picture needs one of two values or more.")
    drawn = sorted(sorted(free, key=lambda k: -sweep.shape[k])[:2])
    place = tuple(slice(None) if k in drawn else side // 2 for k, side in enumerate(sweep.shape))
    columns = min(len(names), 2)
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(4.6 * columns + 0.4, 3.5 * rows + 0.5), layout="constrained", facecolor="white")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, name in zip(panels, names, strict=False):
        draw_result(axes, sweep, name, [sweep.dimensions[k] for k in drawn], place)
    for axes in panels[len(names) :]:
        axes.set_axis_off()
    held = [_at(sweep, sweep.dimensions[k], place[k]) for k in range(len(place)) if k not in drawn]
    lines = [line for line in (title, f"at {', '.join(held)}" if held else None) if line]
    if lines:
        figure.suptitle("\n".join(lines), color=INK, fontsize=12, ha="left", x=0.02)
    return figure


def draw_result(axes: Axes, sweep: "Sweep", name: str, drawn: Sequence[str], place: tuple[slice | int, ...]) -> Axes:
    """Draw one scalar result over one or two of the sweep's dimensions.

    Args:
        axes: flat axes.
        sweep: what to draw.
        name: name of the result.
        drawn: dimensions to draw over.
        place: index of the results that leaves these dimensions.
    """
    values = np.asarray(sweep.arrays()[name], float)[place] * display_unit(sweep.units.get(name, ""))[1]
    values = np.ma.masked_invalid(values)
    axes.set_xlabel(_label(sweep, drawn[0]), color=INK)
    axes.set_title(_label(sweep, name), loc="left", fontsize=11, color=INK)
    axes.tick_params(colors=INK, color=GREY)
    if len(drawn) == 1:
        marker = "o" if values.size <= 40 else ""
        axes.plot(_shown_axis(sweep, drawn[0]), values, color="#0072b2", linewidth=1.8, marker=marker, markersize=4)
        axes.grid(color=PALE, linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        return axes
    x, y = (_shown_axis(sweep, dimension) for dimension in drawn)
    axes.set_ylabel(_label(sweep, drawn[1]), color=INK)
    if values.count() == 0 or np.ptp(values.compressed()) == 0:
        text = f"{values.compressed()[0]:g} everywhere" if values.count() else "no finite result"
        axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", color=INK)
        axes.set(xlim=(x.min(), x.max()), ylim=(y.min(), y.max()))
        return axes
    filled = axes.contourf(x, y, values.T, 12, cmap="cividis")
    axes.contour(x, y, values.T, filled.levels, colors=INK, linewidths=0.4, linestyles="solid")
    axes.figure.colorbar(filled, ax=axes, pad=0.02)
    return axes


def _choose(sweep: "Sweep", results: Sequence[str] | None) -> list[str]:
    sides = len(sweep.shape)
    scalar = [name for name, values in sweep.arrays().items() if values.ndim == sides and values.dtype.kind in "biuf"]
    for name in results or ():
        if name not in scalar:
            raise ValueError(f"{name!r} is no scalar result of this sweep; these are {', '.join(scalar) or 'none'}.")
    names = list(results or scalar[:_MOST])
    if not names:
        raise ValueError("the sweep has no scalar result; there is nothing to draw.")
    return names


def _shown_axis(sweep: "Sweep", dimension: str) -> np.ndarray:
    if dimension not in sweep.axes:  # a list of designs
        return np.arange(sweep.shape[0])
    return np.asarray(sweep.axes[dimension], float) * display_unit(sweep.units.get(dimension, ""))[1]


def _label(sweep: "Sweep", name: str) -> str:
    unit, _ = display_unit(sweep.units.get(name, ""))
    words = name.replace("_", " ")
    return f"{words} [{unit.replace('^2', '²')}]" if unit else words


def _at(sweep: "Sweep", dimension: str, index: slice | int) -> str:
    unit, _ = display_unit(sweep.units.get(dimension, ""))
    value = _shown_axis(sweep, dimension)[index]
    return f"{dimension.replace('_', ' ')} {value:.6g} {unit.replace('^2', '²')}".rstrip()

"""The look of axes, one for all pictures."""

from typing import Literal

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, MultipleLocator

from reojax.drawing.colours import GREY, INK, PALE

_SPACINGS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 45, 90, 180, 360, 720, 1440, 3600, 7200, 18000)


def dress(axes: Axes, *, grid: Literal["x", "y", "both"] = "y") -> None:
    """Pale grid behind, a line at zero, two spines, and minus signs that are none of a hyphen."""
    axes.set_axisbelow(True)
    axes.grid(axis=grid, color=PALE, linewidth=0.6)
    axes.axhline(0, color=GREY, linewidth=0.8, zorder=0.9)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(GREY)
    axes.tick_params(colors=INK, length=3, color=GREY)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}".replace("-", "\N{MINUS SIGN}")))


def dress_path(axes: Axes, edges: int) -> None:
    """Dress axes of angles [deg] along the edges of a path: round ticks, a line at each corner, the legend above."""
    dress(axes)
    low, high = axes.get_ylim()
    spacing = next((s for s in _SPACINGS if (high - low) / s <= 7), _SPACINGS[-1])
    axes.yaxis.set_major_locator(MultipleLocator(spacing))
    axes.set_xlim(0, edges)
    if edges <= 40:
        for corner in range(1, edges):
            axes.axvline(corner, color="#aaaaaa", linewidth=0.8, zorder=0.9)
    legend_above(axes)


def legend_above(axes: Axes, *, columns: int = 6) -> None:
    """Put the legend above the axes, from the left, without a frame."""
    axes.legend(
        loc="lower left",
        bbox_to_anchor=(0, 1),
        borderaxespad=0.3,
        borderpad=0,
        ncols=columns,
        columnspacing=1.6,
        frameon=False,
        handlelength=2.2,
        fontsize=9.5,
        labelcolor=INK,
    )

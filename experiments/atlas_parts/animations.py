"""Each robot's farthest turn that was found as a page for a browser; what all pages have in common lies beside them."""

import re
from pathlib import Path

import numpy as np

import reojax
from atlas_parts.store import Row
from atlas_parts.subjects import subject
from reojax import so3

SHARED = ("three.js", "page.js")
"""A page's scripts, in its order: the library that draws and the page's own, nine tenths of a page by itself."""
_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
_POLICY = ("script-src 'unsafe-inline';", "script-src 'unsafe-inline' 'self' file:;")
"""What a page allows itself to load: as `view` writes it, and with what lies beside it."""


def write(name: str, row: Row, folder: Path) -> Path | None:
    """Write the page of one run of a robot's farthest turn, and the shared scripts; None where nothing was found."""
    reached = {turn: found for turn, found in row["turns"].items() if found["reached"]}
    if not reached:
        return None
    turn = max(reached, key=lambda turn: float(turn.split()[1]) / reached[turn]["runs"])
    found, one = reached[turn], subject(name)
    axis, angle = turn.split()
    target = so3.exp(np.deg2rad(float(angle)) / found["runs"] * one.axes[axis])
    rows = {
        "joint travel of all runs": f"{found['travel_deg']:.0f} deg",
        "least time of all runs": f"{found['time_s']:.3g} s",
        "clearance, proven": f"{1e3 * (found['certificate']['clearance_m'] or 0):.1f} mm",
    }
    runs = f", one of {found['runs']} runs" if found["runs"] > 1 else ""
    folder.mkdir(exist_ok=True)
    page = folder / f"{name.replace(' ', '_')}.html"
    reojax.view(one.robot, reojax.polygon(np.array(found["waypoints"])), page, target=np.asarray(target), rows=rows,
                title=f"{name}: {angle}° of {axis}{runs}")  # fmt: skip
    share(page)
    return page


def share(page: Path) -> None:
    """Take the scripts out of a page, put them beside it, and allow the page to load what lies there."""
    names = iter(SHARED)

    def beside(script: re.Match[str]) -> str:
        name = next(names)
        (page.parent / name).write_text(script[1], "utf-8")
        return f'<script src="{name}"></script>'

    text = _SCRIPT.sub(beside, page.read_text("utf-8"))
    page.write_text(text.replace(*_POLICY, 1), "utf-8")

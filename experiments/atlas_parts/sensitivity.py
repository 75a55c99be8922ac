"""Question 3: which number of a robot matters most for its turn, by `design.sensitivities`."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from common.markdown import table
from matplotlib.figure import Figure

import reojax
from atlas_parts.store import Row, Store
from atlas_parts.subjects import Subject
from atlas_parts.turns import answers
from reojax import design, plot

FIELDS = ("mass", "com", "inertia", "anchor", "axis", "rotor_inertia", "gear_ratio")
_PREFERRED = ("roll 90", "yaw 90", "pitch 90", "roll 180", "yaw 180")


def jobs(subjects: list[Subject], store: Store, quick: bool) -> list[tuple[str, Callable[[], Row]]]:
    """A row for each robot that question 1 turns."""
    turned = {} if quick else answers(store.under("turns"))
    return [
        (s.name, lambda s=s: _row(s, turned[s.name])) for s in subjects if s.name in turned and _turn(turned[s.name])
    ]


def _turn(row: Row) -> str | None:
    """The turn that is looked at: a quarter turn of roll where there is one."""
    return next((name for name in _PREFERRED if row["turns"].get(name, {}).get("reached")), None)


def _row(subject: Subject, turned: Row) -> Row:
    name = str(_turn(turned))
    turn = turned["turns"][name]
    path = reojax.polygon(np.array(turn["waypoints"]))
    found = design.sensitivities(subject.robot, path)
    angle = float(reojax.so3.angle(reojax.net_rotation(subject.robot, path)))
    share = 100 * found.effect / angle  # of the turn, per share of the number
    numbers = [{"name": _named(subject.robot, n), "share": float(s)} for n, s in zip(found.name, share, strict=True)]
    by_field = {
        field: max((s for n, s in zip(found.name, share, strict=True) if n.startswith(f"{field}[")), default=0.0)
        for field in FIELDS
    }
    return {"turn": name, "one_run_deg": float(np.rad2deg(angle)), "numbers": numbers[:8],
            "by_field": {field: float(value) for field, value in by_field.items()}}  # fmt: skip


def _named(robot: reojax.Robot, name: str) -> str:
    """`inertia[3].xx` with the link's or joint's name in place of its number."""
    field, number, entry = re.fullmatch(r"(\w+)\[(\d+)\](.*)", name).groups()  # type: ignore[union-attr]
    names = robot.link_names if field in ("mass", "com", "inertia") else robot.joint_names
    return f"{field} {names[int(number)]}{entry.replace('.', ' ')}"


def show(rows: dict[str, Row], out: Path) -> None:
    """Print the table and draw the picture."""
    print(table(["robot", "turn", "the numbers that matter most: percent of the turn per percent"], [
        [name, row["turn"], "; ".join(f"{n['name']} {n['share']:.2f}" for n in row["numbers"][:3])]
        for name, row in rows.items()
    ]))  # fmt: skip
    if rows:
        plot.save(_picture(rows), out / "atlas_sensitivities.png")


def _picture(rows: dict[str, Row]) -> Figure:
    """Robot by robot, what the most influential number of each kind does."""
    figure = Figure(figsize=(8.2, 1.4 + 0.42 * len(rows)), layout="constrained", facecolor="white")
    axes = figure.subplots()
    share = np.array([[row["by_field"][field] for field in FIELDS] for row in rows.values()])
    shown = np.log10(np.maximum(share, 1e-3))
    image = axes.imshow(shown, cmap="cividis", vmin=-2, vmax=max(0.5, float(shown.max())), aspect="auto")
    for i, k in np.ndindex(*share.shape):
        dark = shown[i, k] < -0.5
        text = f"{share[i, k]:.2g}" if share[i, k] >= 5e-4 else "0"
        axes.text(k, i, text, ha="center", va="center", color="white" if dark else "black", fontsize=10)
    axes.set_xticks(range(len(FIELDS)), [field.replace("_", "\n") for field in FIELDS])
    axes.set_yticks(range(len(rows)), [f"{name}, {row['turn']}°" for name, row in rows.items()])
    axes.tick_params(length=0)
    for side in axes.spines.values():
        side.set_visible(False)
    axes.set_title(
        "Percent of the turn per percent of the number that matters most of its kind", loc="left", fontsize=11
    )
    bar = figure.colorbar(image, ax=axes, ticks=[-2, -1, 0])
    bar.ax.set_yticklabels(["0.01", "0.1", "1"])
    return figure

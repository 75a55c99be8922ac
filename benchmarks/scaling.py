"""How does the cost of a net rotation grow with designs, joints, corners and accuracy?

    python benchmarks/scaling.py                    # 8 minutes on 2 quiet cores; --quick is shorter

Writes scaling.json and scaling.png, one panel for each. Expected: a loop costs the same among a thousand as among
millions, if they come in batches that fit the cache; cost grows no faster than linearly with joints, compilation
included, and with corners; the error falls at least with the tenth power of the steps.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from _apart import apart
from _command import machine, options, run, say
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, StrMethodFormatter
from systems._magnus import GAUSS, plain_error
from systems._measure import compiled, measure, timed
from systems._task import Loops, Reference, net_rotation, objective, random_loops
from tqdm import tqdm

import reojax
from reojax import robots
from reojax.files import check_writable, replacing, write_json
from reojax.mechanics._fast.nodes import NODES
from reojax.mechanics.holonomy import DEFAULT_STEPS
from reojax.robots.random import random_robot

BATCH = 1000
JOINTS = (2, 4, 8, 16)
CORNERS = (4, 16, 64, 250, 1000, 4000)
STEPS = tuple(range(1, 11))
MAGNUS_STEPS = (1, 2, 4, 8, 16, 32, 64, 128)
LONG = 100_000
"""From so many designs on, one run says enough."""
MEMORY = 12 * 2.0**30
"""Bytes for each number of joints."""
VALUE, GRADIENT, ALL = "value", "with gradient", "with gradient, every array"
COLOURS = {VALUE: "#0072b2", GRADIENT: "#d55e00", ALL: "#7f3c8d"}


class Point(NamedTuple):
    """One measurement; times are per loop, in the median [s]."""

    series: str
    size: int
    wall: float
    cpu: float
    compile: float | None = None


def main(out: Path, *, quick: bool) -> None:
    """Measure, write the numbers, draw the picture."""
    result, picture = check_writable(out / "scaling.json"), check_writable(out / "scaling.png")
    before, seconds = machine(), 0.3 if quick else 1.5
    missing: dict[str, str] = {}
    about = {"quick": quick, "missing": missing, "machine": before}
    numbers: dict[str, list] = {}
    panels: dict[str, list[Point]] = {}
    for name, points in {
        "designs": _designs(quick, seconds),
        "joints": _joints(quick, seconds, missing),
        "corners": _corners(seconds),
    }.items():
        panels[name] = _progress(name, points)
        numbers[name] = [point._asdict() for point in panels[name]]
        write_json(result, {**about, **numbers})  # what is measured is kept
    numbers["accuracy"] = accuracy = _accuracy(64 if quick else 512)
    about["machine"] = {**before, "load after": machine()["load"]}
    write_json(result, {**about, **numbers})
    with replacing(picture) as file:
        _figure(panels, accuracy, missing).savefig(file, dpi=140, format="png")
    say(f"wrote {result} and {picture}")


def _progress(name: str, points: Iterator[Point]) -> list[Point]:
    return list(tqdm(points, desc=name, unit="point"))


def _with_gradient(rotation: Callable, variables: Sequence[int] = (0,)) -> Callable:
    return jax.value_and_grad(lambda *x: objective(rotation(*x)), argnums=tuple(variables))


def _designs(quick: bool, seconds: float) -> Iterator[Point]:
    """Loops of the prototype with four variables each, in one batch and in batches of 1000."""
    sizes = [10**k for k in range(3, 6 if quick else 8)]

    def rotation(loop: Loops) -> Any:
        return net_rotation(loop, DEFAULT_STEPS)

    for size in sizes[: 2 if quick else 3]:
        loops = random_loops(size)
        call, took = compiled(jax.vmap(rotation), loops)
        yield _point(f"{VALUE}, one batch", size, size, lambda call=call, loops=loops: call(loops), seconds, took)
    for series, function, most in (
        (VALUE, lambda loop: (rotation(loop),), 10**7),
        (GRADIENT, lambda loop: jax.tree.leaves(_with_gradient(rotation)(loop)), 10**6),
    ):
        call, took = compiled(jax.vmap(function), random_loops(BATCH))
        for size in (size for size in sizes if size <= most):
            loops = random_loops(size)
            results = [np.empty((size, *part.shape[1:])) for part in call(loops.first(BATCH))]

            def everything(call=call, loops=loops, results=results, size=size) -> None:
                for start in range(0, size, BATCH):
                    part = slice(start, start + BATCH)
                    for whole, new in zip(results, call(Loops(*(field[part] for field in loops))), strict=True):
                        whole[part] = new

            yield _point(f"{series}, batches of {BATCH}", size, size, everything, seconds, took)


def _joints(quick: bool, seconds: float, missing: dict[str, str]) -> Iterator[Point]:
    """Random serial robots on random loops of four edges, each in a process of its own; gaps go to `missing`."""
    for joints in JOINTS:
        for series in (VALUE, GRADIENT) if quick else (VALUE, GRADIENT, ALL):
            try:
                yield from apart(_of_joints, joints, series, seconds, patience=30 if quick else 120, memory=MEMORY)
            except (TimeoutError, MemoryError) as error:
                missing[f"{series}, {joints} joints"] = str(error)


def _of_joints(joints: int, series: str, seconds: float) -> Iterator[Point]:
    robot = random_robot(7, joints)
    points = np.random.default_rng(7).uniform(-1.5, 1.5, (256, 5, joints))
    points[:, -1] = points[:, 0]

    def rotation(points: Any, robot: reojax.Robot = robot) -> Any:
        return reojax.net_rotation(robot, reojax.Path(points))

    every_array = lambda points: _with_gradient(rotation, (0, 1))(points, robot)
    function = {VALUE: rotation, GRADIENT: _with_gradient(rotation), ALL: every_array}[series]
    call, took = compiled(jax.vmap(function), points)
    yield _point(series, joints, len(points), lambda: call(points), seconds, took)


def _corners(seconds: float) -> Iterator[Point]:
    """The prototype on sampled closed curves, one step an edge, about as many edges in a batch at any length."""
    robot = robots.prototype()
    for corners in CORNERS:
        along = np.linspace(0, 2 * np.pi, corners + 1)[:, None] + np.array([0, 1, 3])
        size = np.random.default_rng(7).uniform(0.5, 1.5, (max(1, 16000 // corners), 1, 1))
        points = size * np.sin(along)

        def rotation(points) -> Any:
            return reojax.net_rotation(robot, reojax.Path(points), steps=1)

        for name, function in {VALUE: rotation, GRADIENT: _with_gradient(rotation)}.items():
            call, took = compiled(jax.vmap(function), points)
            yield _point(name, corners, len(points), lambda call=call, points=points: call(points), seconds, took)


def _point(series: str, size: int, loops: int, call: Callable[[], Any], seconds: float, compile: float) -> Point:
    if loops >= LONG:
        wall, cpu = timed(call)
    else:
        [samples] = measure([call], seconds)
        wall, cpu = float(np.median(samples.wall)), float(np.median(samples.cpu))
    return Point(series, size, wall / loops, cpu / loops, compile)


def _accuracy(loops: int) -> dict[str, list]:
    """95th percentile of the error [rad] over evaluations of omega an edge, of reojax and of the classic method."""
    reference = Reference(random_loops(loops), loops)

    def error(steps: int) -> float:
        call, _ = compiled(jax.vmap(lambda loop: net_rotation(loop, steps)), reference.loops)
        return reference.error(np.asarray(call(reference.loops)))

    classic = plain_error(reference)
    return {
        "reojax": [(len(NODES) * steps, error(steps)) for steps in tqdm(STEPS, desc="accuracy", unit="step")],
        "Magnus 4": [(len(GAUSS) * steps, classic(steps)) for steps in MAGNUS_STEPS],
    }


def _figure(panels: dict[str, list[Point]], accuracy: dict[str, list], missing: dict[str, str]) -> Figure:
    figure = Figure(figsize=(11, 8.6), layout="constrained", facecolor="white")
    designs, joints, corners, errors = figure.subplots(2, 2).ravel()
    for axes in (designs, joints, corners, errors):
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.grid(which="major", color="#dddddd")
        axes.spines[["top", "right"]].set_visible(False)
    _draw_designs(designs, panels["designs"])
    _draw_joints(joints, panels["joints"], missing)
    _draw_corners(corners, panels["corners"])
    _draw_accuracy(errors, accuracy)
    for axes in (designs, joints, corners, errors):
        axes.legend(frameon=False, fontsize=9)
    return figure


def _by_series(points: Sequence[Point]) -> dict[str, list[Point]]:
    return {name: [p for p in points if p.series == name] for name in dict.fromkeys(p.series for p in points)}


def _draw_designs(axes: Axes, points: Sequence[Point]) -> None:
    for name, line in _by_series(points).items():
        style = "s:" if "one batch" in name else "o-"
        colour = COLOURS[name.rpartition(", ")[0]]
        axes.plot([p.size for p in line], [p.wall * 1e6 for p in line], style, color=colour, label=name)
    axes.set(title="Designs: cost of a loop", xlabel="designs", ylabel="wall time of a loop [us]")
    axes.set_ylim(1, 20 * max(p.wall * 1e6 for p in points))  # with room for the legend


def _draw_joints(axes: Axes, points: Sequence[Point], missing: dict[str, str]) -> None:
    for name, line in _by_series(points).items():
        sizes = [p.size for p in line]
        if 4 not in sizes:
            continue
        base = sizes.index(4)
        run, compile = ([getattr(p, field) or np.nan for p in line] for field in ("cpu", "compile"))
        for times, style, label in (
            (run, "o-", f"{name} ({run[base] * 1e6:.3g} us at 4)"),
            (compile, "s:", f"{name}, compilation ({compile[base]:.2g} s at 4)"),
        ):
            axes.plot(sizes, np.array(times) / times[base], style, color=COLOURS[name], label=label)
    axes.plot(JOINTS, np.array(JOINTS) / 4, color="#999999", linewidth=4, alpha=0.4, label="linear", zorder=0)
    axes.set(title="Joints: cost relative to 4 joints", xlabel="joints", ylabel="cost over that of 4 joints")
    for axis, ticks in ((axes.xaxis, JOINTS), (axes.yaxis, (0.5, 1, 2, 4, 8, 16))):
        axis.set_major_locator(FixedLocator(ticks))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_locator(NullLocator())
    axes.set_ylim(0.2 if missing else 0.4, 64)  # with room for legend and note
    if missing:
        note = "not measured, see scaling.json:\n" + "\n".join(missing)
        axes.text(0.98, 0.02, note, transform=axes.transAxes, fontsize=8, ha="right")


def _draw_corners(axes: Axes, points: Sequence[Point]) -> None:
    for name, line in _by_series(points).items():
        compile = [p.compile for p in line if p.compile is not None]
        label = f"{name} (compilation {min(compile):.2g} to {max(compile):.2g} s)"
        axes.plot([p.size for p in line], [p.wall * 1e6 for p in line], "o-", color=COLOURS[name], label=label)
    first = next(p for p in points if p.series == VALUE)
    guide = np.array(CORNERS) * first.wall / first.size * 1e6
    axes.plot(CORNERS, guide, color="#999999", linewidth=4, alpha=0.4, label="linear", zorder=0)
    axes.set(title="Corners: cost of a loop, one step an edge", xlabel="corners", ylabel="wall time of a loop [us]")


def _draw_accuracy(axes: Axes, accuracy: dict[str, list]) -> None:
    for (name, line), colour, style in zip(accuracy.items(), ("#0072b2", "#999999"), ("o-", "s:"), strict=True):
        axes.plot(*zip(*line, strict=True), style, color=colour, label=name)
    for point in accuracy["reojax"]:
        if point[0] == len(NODES) * DEFAULT_STEPS:
            axes.annotate("default", point, (8, 8), textcoords="offset points")
    axes.set(
        title="Accuracy: prototype, manoeuvres up to 270/120 degrees",
        xlabel="evaluations of omega an edge",
        ylabel="error, 95th percentile [rad]",
    )


if __name__ == "__main__":
    run(main, options(__doc__))

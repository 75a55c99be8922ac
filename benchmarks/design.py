"""How many starts of a design problem does `design.Problem.solve` finish in a second, beside SLSQP and IPOPT?

    python benchmarks/design.py             # some minutes on 2 cores; --quick: fewer starts, one turn
    python benchmarks/design.py --only spline --turns 1

Prints a table and writes design.json. Closed polygons of least joint travel with the whole net rotation given, on
several robots, from the same random starts. The others run start by start with the same functions, values and
reverse-mode derivatives compiled, each point evaluated once. Times are without compilation, by turns, the least of
three (`--turns`); ratios are of one run. At most 300 steps of every system. Converged: feasible to 1e-8, and of
reojax also stationary to 1e-6. SLSQP is SciPy's; IPOPT (`pip install cyipopt`) uses its limited-memory Hessian, and
is left out where it is not installed. Set OPENBLAS_NUM_THREADS=1: the small BLAS calls of SLSQP otherwise get in each
other's way on a busy machine.

Expected: several times as many starts a second as either, as many converged, and no worse a best cost.
"""

import time
from pathlib import Path
from typing import Any

import numpy as np
from _command import machine, options, run, say
from systems.optimisers import PEERS, Ended, Functions

import reojax
from reojax import design
from reojax.design import Loops, Problem, Variable
from reojax.files import check_writable, write_json
from reojax.robots import prototype
from reojax.robots.random import random_robot

TARGET = Variable("target", [-7.0] * 3, [7.0] * 3, "rad")
OURS = "reojax"


def least_travel(robot: reojax.Robot, loop: Loops, *, steps: int = 4) -> Problem:
    """Loops of least joint travel to a net rotation that is held."""
    return Problem(
        lambda values: (robot, loop.path(values["loop"])),
        [loop, TARGET],
        objective=design.travel(loop),
        equality=[design.turned_to("target")],
        steps=steps,
    )


def within_a_degree(robot: reojax.Robot, corners: int) -> Problem:
    """The same with 120 degrees of roll, and at most a degree besides."""
    loop = design.polygons(robot, corners)
    return Problem(
        lambda values: (robot, loop.path(values["loop"])),
        [loop],
        objective=design.travel(loop),
        equality=[design.turned_about([0, 0, 1], np.deg2rad(120))],
        inequality=[design.off_axis_within([0, 0, 1], np.deg2rad(1))],
        steps=4,
    )


def tasks() -> dict[str, tuple[Problem, dict[str, Any]]]:
    """Problems and what is held in them."""
    five, seven = (random_robot(joints, joints, limits=(-1.5, 1.5)) for joints in (5, 7))
    polygons, half_turn = design.polygons, {"target": [0.0, 0.0, np.pi]}
    spline = design.spline_loops(prototype(), 8, samples=48)
    return {
        "prototype, half turn of roll, 5 corners": (least_travel(prototype(), polygons(prototype(), 5)), half_turn),
        "prototype, 120 deg of roll, 3 corners, off axis at most 1 deg": (within_a_degree(prototype(), 3), {}),
        "random robot of 5 joints, 3 corners": (least_travel(five, polygons(five, 3)), {"target": [0.3, -0.2, 0.5]}),
        "random robot of 7 joints, 4 corners": (least_travel(seven, polygons(seven, 4)), {"target": [0.0, 0.4, 0.7]}),
        "prototype, half turn of roll, spline of 8 points a joint": (
            least_travel(prototype(), spline, steps=1),
            half_turn,
        ),
    }


def main(out: Path, *, quick: bool, only: list[str] | None, turns: int) -> None:
    """Measure, print and write."""
    result = check_writable(out / "design.json")
    before, rows = machine(), []
    for name, (problem, held) in tasks().items():
        if only is None or any(text in name for text in only):
            say(f"{name} ...")
            rows += _compare(name, problem, held, starts=8 if quick else 64, turns=1 if quick else turns)
    print("| problem | by | starts a second | converged | at the best | best cost | gradients | reojax is faster by |")
    print("|---|---|--:|--:|--:|--:|--:|--:|")
    for row in rows:
        print(
            f"| {row['problem']} | {row['system']} | {row['starts'] / row['seconds']:.3g} | {row['converged']} of "
            f"{row['starts']} | {row['at_best']} | {row['best']:.6f} | {row['gradients']} | {row['ratio']:.2f} |"
        )
    write_json(result, {"quick": quick, "machine": {**before, "load after": machine()["load"]}, "rows": rows})
    say(f"wrote {result}")


def _compare(name: str, problem: Problem, held: dict[str, Any], *, starts: int, turns: int) -> list[dict[str, Any]]:
    x = problem.starts(starts, seed=1)
    functions = Functions(problem, held)
    inside = x[:, functions.free] / functions.scale
    problem.solve(x, hold=held, max_steps=1)  # compile
    found: dict[str, Ended] = {}
    for _ in range(turns):
        for system in (OURS, *PEERS):
            ended = _ours(problem, x, held) if system == OURS else PEERS[system](functions, inside)
            if system not in found or ended.seconds < found[system].seconds:
                found[system] = ended
    return [
        {
            "problem": name,
            "system": system,
            "starts": starts,
            "seconds": ended.seconds,
            "converged": int(ended.converged.sum()),
            "best": float(ended.cost[ended.converged].min(initial=np.inf)),
            "at_best": _at_best(ended),
            "gradients": ended.gradients,
            "ratio": ended.seconds / found[OURS].seconds,
        }
        for system, ended in found.items()
    ]


def _ours(problem: Problem, x: np.ndarray, held: dict[str, Any]) -> Ended:
    begin = time.perf_counter()
    found = problem.solve(x, hold=held, max_steps=300)
    seconds = time.perf_counter() - begin
    return Ended(found.cost, found.residual, found.converged, int(found.steps.sum()), seconds)


def _at_best(ended: Ended) -> int:
    best = ended.cost[ended.converged].min(initial=np.inf)
    return int((ended.converged & (ended.cost <= best * (1 + 1e-6))).sum())


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--only", nargs="+", metavar="TEXT", help="problems whose names contain one of these")
    parser.add_argument("--turns", type=int, default=3, metavar="N", help="how often (default: 3)")
    run(main, parser)

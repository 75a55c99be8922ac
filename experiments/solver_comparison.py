"""How does the solver of `reojax.design` compare with SciPy's, on the same problem with the same gradients?

    python experiments/solver_comparison.py         # a minute or two on 2 cores, compilation included

The polygon of least joint travel, five free corners, that turns the prototype by exactly 180 degrees of roll within
270/120 (`design_opt.py`), from the same 64 random starts: `Problem.solve`, all side by side; SciPy's SLSQP, start by
start, with the same compiled functions and gradients; and SciPy's differential evolution on the corners, with the
violation as a penalty, in batches. Times are without compilation. `benchmarks/design.py` does this on several robots.

Expected: the same best travel from both gradient methods, ours several times as fast; the search without gradients
ends above it, or off target, after a hundred times the evaluations.
"""

import time
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from common.script import options, run
from common.tables import at_best, least_travel, table
from common.types import Array
from tqdm import tqdm

import reojax
from reojax import design, so3
from reojax.design import Loops, Problem
from reojax.files import check_writable, write_json
from reojax.robots import prototype

TARGET = np.array([0.0, 0.0, np.pi])
PENALTY = 30.0
"""Travel [rad] that a miss of one radian costs in the search without gradients."""


def main(out: Path, *, quick: bool = False) -> dict:
    """Print the comparison, write `solver_comparison.json`."""
    record = check_writable(out / "solver_comparison.json")
    robot = prototype()
    loop = design.polygons(robot, 3 if quick else 5)
    steps = 1 if quick else 4
    problem = least_travel(robot, loop, steps=steps)
    starts = problem.starts(8 if quick else 64, seed=1)
    some = 1 if quick else len(starts)
    answer = {
        "Problem.solve": ours(problem, starts),
        "SLSQP": theirs(problem, starts[:some]),
        "differential evolution": evolution(robot, loop, steps=steps, generations=20 if quick else 400),
    }
    print(f"\n180 deg of roll by a {loop.name}, least travel\n")
    rows = ("starts", "converged", "starts_at_best", "travel_deg", "miss_rad", "evaluations", "gradients", "seconds")
    table(["", *answer], [[row, *(column[row] for column in answer.values())] for row in rows], width=24)
    write_json(record, answer)
    print(f"\nwrote {record}")
    return answer


def ours(problem: Problem, starts: np.ndarray) -> dict[str, Any]:
    """All starts at once; the second run is timed."""
    hold = {"target": TARGET}
    problem.solve(starts, hold=hold, progress="Problem.solve, compiling", max_steps=1)
    begin = time.perf_counter()
    found = problem.solve(starts, hold=hold, progress="Problem.solve", max_steps=100)
    seconds = time.perf_counter() - begin
    return {
        "starts": len(starts),
        "converged": int(found.converged.sum()),
        "starts_at_best": at_best(found),
        "travel_deg": float(np.rad2deg(found.cost[found.best])),
        "miss_rad": float(found.residual[found.best]),
        "evaluations": "not counted",
        "gradients": int(found.steps.sum()),
        "seconds": seconds,
    }


def theirs(problem: Problem, starts: np.ndarray) -> dict[str, Any]:
    """SLSQP from each start, values and gradients by the same functions, compiled."""
    from scipy.optimize import minimize

    space = problem.space
    place = space.place("loop")

    def whole(x: Array) -> Array:
        return jnp.concatenate([x, jnp.asarray(TARGET)])

    equality = jax.jit(lambda x: problem.equality(whole(x)))
    slope = jax.jit(jax.jacrev(lambda x: problem.equality(whole(x))))
    first = starts[0, place]
    linear = lambda x: (problem.cost(whole(x)), problem.inequality(whole(x)))
    (_, least), (price, rows) = map(jax.device_get, jax.jit(lambda x: (linear(x), jax.jacfwd(linear)(x)))(first))
    offset = least - rows @ first
    jax.block_until_ready((equality(first), slope(first)))
    constraints = [
        {"type": "eq", "fun": lambda x: np.asarray(equality(x)), "jac": lambda x: np.asarray(slope(x))},
        {"type": "ineq", "fun": lambda x: -(rows @ x + offset), "jac": lambda x: -rows},
    ]
    bounds = list(zip(space.lower[place], space.upper[place], strict=True))
    costs, misses, evaluations, gradients = [], [], 0, 0
    begin = time.perf_counter()
    for start in tqdm(starts[:, place], desc="SLSQP", unit="start"):
        found = minimize(
            lambda x: price @ x,
            start,
            jac=lambda x: price,
            bounds=bounds,
            constraints=constraints,
            method="SLSQP",
            options={"ftol": 1e-10, "maxiter": 300},
        )
        costs.append(found.fun)
        misses.append(max(np.abs(equality(found.x)).max(), (rows @ found.x + offset).max()))
        evaluations, gradients = evaluations + found.nfev, gradients + found.njev
    seconds = time.perf_counter() - begin
    good = np.array(misses) <= 1e-8
    best = int(np.argmin(np.where(good, costs, np.inf))) if good.any() else int(np.argmin(misses))
    near = good & (np.array(costs) <= costs[best] * (1 + 1e-6))
    return {
        "starts": len(starts),
        "converged": int(good.sum()),
        "starts_at_best": int(near.sum()),
        "travel_deg": float(np.rad2deg(costs[best])),
        "miss_rad": float(misses[best]),
        "evaluations": int(evaluations),
        "gradients": int(gradients),
        "seconds": seconds,
    }


def evolution(robot: reojax.Robot, loop: Loops, *, steps: int, generations: int) -> dict[str, Any]:
    """Differential evolution on the free corners, travel plus penalty, a generation at a time."""
    from scipy.optimize import differential_evolution

    corners = loop.path(jnp.zeros(np.size(loop.variable.lower))).waypoints.shape[0] - 2

    @jax.jit
    @jax.vmap
    def travel_and_miss(x: jax.Array) -> tuple[Array, Array]:
        free = x.reshape(corners, robot.joints)
        path = reojax.polygon(jnp.pad(free, ((1, 1), (0, 0))))
        rotation = reojax.net_rotation(robot, path, steps=steps)
        return reojax.joint_travel(path), so3.angle(so3.exp(TARGET).T @ rotation)

    def cost(columns: np.ndarray) -> np.ndarray:
        travel, miss = travel_and_miss(jnp.asarray(columns.T))
        return np.asarray(travel + PENALTY * miss)

    bounds = np.tile(np.stack([robot.lower, robot.upper], axis=1), (corners, 1))
    cost(np.zeros((len(bounds), 15 * len(bounds))))
    begin = time.perf_counter()
    with tqdm(total=generations, desc="differential evolution", unit="generation") as bar:
        found = differential_evolution(
            cost,
            bounds,
            popsize=15,
            maxiter=generations,
            rng=np.random.default_rng(0),
            vectorized=True,
            updating="deferred",
            polish=False,
            tol=0,
            callback=lambda *_, **__: bar.update() and False,
        )
    seconds = time.perf_counter() - begin
    travel, miss = (np.asarray(part)[0] for part in travel_and_miss(jnp.asarray(found.x)[None]))
    return {
        "starts": 15 * len(bounds),
        "converged": int(miss <= 1e-8),
        "starts_at_best": 0,
        "travel_deg": float(np.rad2deg(travel)),
        "miss_rad": float(miss),
        "evaluations": int(found.nfev),
        "gradients": 0,
        "seconds": seconds,
    }


if __name__ == "__main__":
    run(main, options(__doc__))

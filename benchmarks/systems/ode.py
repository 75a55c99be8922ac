"""General solvers of ordinary differential equations on the same equation, `R' = R hat(omega)` edge by edge."""

from collections.abc import Callable, Iterator
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

import reojax
from reojax import so3

from . import _jax_rows
from ._measure import compiled, measure
from ._rows import Missing, Row, optional, row
from ._task import TOLERANCE, Loops, Reference, Task, angles, edges, path_of, robot_of

RTOLS = tuple(10.0**-k for k in range(4, 12))


def diffrax(task: Task) -> Iterator[Row]:
    """Rows of diffrax's Dopri8 with adaptive steps, edges and loops under vmap, omega by `reojax.connection`."""
    dfx = optional("diffrax", "diffrax")
    solver = dfx.Dopri8()

    def edge(robot, start, change, rtol: float):
        def slope(s, rotation, _):
            return rotation @ so3.hat(reojax.connection(robot, start + s * change) @ change)

        steps = dfx.PIDController(rtol=rtol, atol=rtol)
        solved = dfx.diffeqsolve(
            dfx.ODETerm(slope), solver, 0.0, 1.0, None, jnp.eye(3), stepsize_controller=steps, max_steps=256
        )
        return solved.ys[0], solved.stats["num_steps"]

    def rotation_and_steps(loop: Loops, rtol: float) -> tuple[jax.Array, jax.Array]:
        corners = path_of(loop).waypoints
        each = jax.vmap(partial(edge, robot_of(loop), rtol=rtol))(corners[:-1], jnp.diff(corners, axis=0))
        a, b, c, d = each[0]
        return a @ b @ c @ d, each[1].sum()

    loops = task.loops.first(min(task.checked, 64))
    call, _ = compiled(jax.vmap(rotation_and_steps, in_axes=(0, None)), loops, RTOLS[0])
    rtol = _loosest(lambda rtol: task.error(np.asarray(call(loops, rtol)[0])))
    steps = float(np.mean(call(loops, rtol)[1]))
    yield from _jax_rows.rows(
        task,
        "diffrax, Dopri8",
        *_jax_rows.under_vmap(lambda loop: rotation_and_steps(loop, rtol)[0]),
        loops=32 if task.quick else 256,
        steps=f"rtol {rtol:.0e}",
        evaluations=steps * solver.tableau.num_stages,
    )


def scipy(task: Task) -> Iterator[Row]:
    """Rows of SciPy's DOP853, loop by loop, omega by one compiled call of `reojax.connection` each time."""
    one = _dop853()
    loops = list(task.loops.first(2 if task.quick else 8).each())

    def run(rtol: float) -> np.ndarray:
        return np.stack([one(loop, rtol)[0] for loop in loops])

    rtol = _loosest(lambda rtol: task.error(run(rtol)))
    yield row(
        "SciPy, DOP853",
        "value",
        measure([lambda: run(rtol)], task.seconds)[0],
        loops=len(loops),
        threads=1,
        steps=f"rtol {rtol:.0e}",
        evaluations=float(np.mean([one(loop, rtol)[1] for loop in loops])),
        error=task.error(run(rtol)),
    )


def _dop853() -> Callable[[Loops, float], tuple[np.ndarray, int]]:
    """Return what integrates one loop: its rotation, and how often omega was evaluated."""
    integrate = optional("scipy.integrate", "scipy")
    connection = jax.jit(reojax.connection)

    def one(loop: Loops, rtol: float) -> tuple[np.ndarray, int]:
        robot, rotation, count = jax.device_put(robot_of(loop)), np.eye(3), 0
        for start, change in edges(loop):

            def slope(s, y, start=start, change=change):
                wx, wy, wz = np.asarray(connection(robot, start + s * change)) @ change
                return (y.reshape(3, 3) @ np.array([[0, -wz, wy], [wz, 0, -wx], [-wy, wx, 0]])).ravel()

            solved = integrate.solve_ivp(slope, (0, 1), rotation.ravel(), method="DOP853", rtol=rtol, atol=rtol)
            rotation, count = solved.y[:, -1].reshape(3, 3), count + solved.nfev
        return rotation, count

    return one


def _loosest(error_with: Callable[[float], float]) -> float:
    for rtol in RTOLS:
        if error_with(rtol) <= TOLERANCE:
            return rtol
    raise Missing(f"no tolerance down to {RTOLS[-1]:.0e} brings the error to {TOLERANCE:.0e} rad")


def independent_check(reference: Reference, count: int) -> float | None:
    """Largest angle of the first `count` reference rotations from DOP853 at its finest [rad]; None without SciPy."""
    try:
        one = _dop853()
    except Missing:
        return None
    exact = np.stack([one(loop, 3e-14)[0] for loop in reference.loops.first(count).each()])
    return float(angles(exact, reference.rotation[:count]).max())

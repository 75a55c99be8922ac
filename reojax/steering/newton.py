"""Newton's steps to a motion of little effort that ends on its target within limits."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array
from reojax._internal.linalg import cholesky, cholesky_solve, solve_symmetric3
from reojax.mechanics.momentum import momentum_matrices
from reojax.steering.end import basis, end_and_slope, end_of
from reojax.steering.free_points import free_points
from reojax.steering.limits import FEASIBLE, RightingTask, bounds, conditions, conditions_and_slopes, states

STEPS, EXACT_STEPS = 6, 16
"""Steps of the integration to a piece, for the search and for the answer."""
_LAST = 8
"""Newton steps that are kept for the target alone."""
_SETTLED = 0.1
"""Change of the points [rad] below which effort goes down no more."""
STRENGTH = 30.0
"""Price of the square of a limit that is passed."""


class Judged(NamedTuple):
    """A motion, and what is to be known of it; fields as of `Righting`."""

    points: Array
    error: Array
    beyond: Array
    effort: Array
    rotation: Array
    omega: Array
    margin: Array
    steps: Array


class _Iterate(NamedTuple):
    x: Array
    multipliers: Array
    reach: Array
    miss: Array
    moved: Array
    beyond: Array
    settled: Array
    steps: Array


@partial(jax.jit, static_argnums=1)
def solve(
    task: RightingTask, pieces: int, max_steps: int | Array, points, goals, momenta, durations, tolerance
) -> Judged:
    """Many releases side by side: `points` (m, p + 1, j) to start from, and of each its goal, momentum, duration."""
    one = partial(_solve_one, task, pieces, max_steps)
    points, goals, momenta, durations = map(jnp.asarray, (points, goals, momenta, durations))
    return jax.vmap(one, (0, 0, 0, 0, None))(points, goals, momenta, durations, tolerance)


def effort_form(pieces: int) -> np.ndarray:
    """(p + 1, p + 1) form of the mean square acceleration by a spline's points, of order one."""
    own = basis(pieces, STEPS)
    rows = own.nodes[:, 2]
    form = (rows * own.weights[:, None]).T @ rows
    return form / (np.trace(form[1:-1, 1:-1]) / (pieces - 1))


def rows_at_steps(pieces: int, steps: int, duration: Array, dtype: np.dtype) -> Float[Array, "k 3 p+1"]:
    """Angles, rates and accelerations at the ends of all steps, by the spline's points."""
    rows = jnp.asarray(basis(pieces, steps).nodes[::2], dtype)
    return rows * (1 / duration) ** jnp.arange(3, dtype=dtype)[None, :, None]


def _solve_one(
    task: RightingTask, pieces: int, max_steps: int | Array, points, goal, momentum, duration, tolerance
) -> Judged:
    robot, dtype = task.robot, points.dtype
    variables, x = free_points(robot, points)
    rows = rows_at_steps(pieces, STEPS, duration, dtype)
    lift = variables.slopes(rows)
    low, high = (side[None] for side in bounds(task, spare=True))
    form, carried = effort_form(pieces), task.weights[:, None] * variables.carry
    hessian = jnp.kron(jnp.asarray(form[1:-1, 1:-1], dtype), variables.carry.T @ carried)
    hessian = hessian + 1e-6 * jnp.eye(x.size, dtype=dtype)

    def step(s: _Iterate, aim: Array) -> _Iterate:
        points = variables.of(s.x)
        history, slope = end_and_slope(robot, points, duration, momentum, STEPS)
        value, by = conditions_and_slopes(task, states(rows, points, history, momentum), lift)
        miss = so3.log(history[-1] @ aim.T)
        length = jnp.sqrt((miss * miss).sum())
        beyond = jnp.abs(value - jnp.clip(value, low, high)).max()
        # limits: augmented Lagrangian, of those that are active
        shifted = value + s.multipliers / STRENGTH
        push = STRENGTH * (shifted - jnp.clip(shifted, low, high))
        active = (push != 0).astype(dtype)
        matrix = hessian + STRENGTH * jnp.einsum("kcn,kc,kcm->nm", by, active, by)
        # effort first; in the end the target alone
        ease = jnp.where(s.settled, 0.0, 0.5)
        effort_slope = (jnp.asarray(form[1:-1], dtype) @ points @ carried).ravel()
        gradient = ease * effort_slope + jnp.einsum("kcn,kc->n", by, push)
        # target: three linear equations, by their multipliers
        jacobian = jnp.einsum("apj,jf->apf", slope[:, 1:-1], variables.carry).reshape(3, -1)
        lower = cholesky(matrix, drop=True)
        solved = cholesky_solve(lower, jnp.concatenate([gradient[None], jacobian]).T).T
        normal = jacobian @ solved[1:].T
        normal = normal + 1e-9 * (1e-3 + jnp.trace(normal)) * jnp.eye(3, dtype=dtype)
        wanted = -miss * jnp.minimum(1, 0.7 / jnp.maximum(length, 1e-12))
        force = solve_symmetric3(normal, (wanted + jacobian @ solved[0])[:, None])[:, 0]
        move = force @ solved[1:] - solved[0]
        # no further than the step before was right
        reach = jnp.clip(jnp.where(length < s.miss, 1.5, 0.6) * s.reach, 0.05, 0.8)
        move = move * jnp.minimum(1, reach / jnp.maximum(jnp.abs(move).max(), 1e-12))
        near = length < 0.1
        multipliers = jnp.where(near, push, s.multipliers)
        moved = jnp.abs(move).max()
        settled = s.settled | (s.steps >= max_steps - _LAST) | (near & (moved < _SETTLED) & (beyond < 10 * FEASIBLE))
        return _Iterate(s.x + move, multipliers, reach, length, moved, beyond, settled, s.steps + 1)

    def going(s: _Iterate) -> Array:
        done = s.settled & (s.miss < 0.1 * tolerance) & (s.beyond < 0.5 * FEASIBLE)
        return (s.steps < max_steps) & ~done

    huge = jnp.asarray(1e3, dtype)
    no = jnp.zeros((), bool)
    none = jnp.zeros((len(rows), low.shape[1]), dtype)
    s = _Iterate(x, none, jnp.asarray(0.4, dtype), huge, huge, huge, no, jnp.zeros((), int))

    def search(k: Array, carry: tuple[_Iterate, Array]) -> tuple[_Iterate, Array]:
        """Once from the start, and again for what the steps of the search miss of the true end."""
        s, aim = carry
        s = jax.lax.while_loop(going, lambda s: step(s, aim), s)
        points = variables.of(s.x)
        true = end_of(robot, points, duration, momentum, EXACT_STEPS)[-1]
        here = end_and_slope(robot, points, duration, momentum, STEPS)[0][-1]
        more = jnp.maximum(s.steps - _LAST // 2, 0)
        return s._replace(miss=huge, settled=~no, steps=more), here @ true.T @ goal

    s, _ = jax.lax.fori_loop(0, 2, search, (s, goal))
    return judged(task, pieces, variables.of(s.x), goal, momentum, duration, s.steps)


def judged(task: RightingTask, pieces: int, points, goal, momentum, duration, steps) -> Judged:
    """A motion with all that is to be known of it, by the finer integration."""
    robot, dtype = task.robot, points.dtype
    history = end_of(robot, points, duration, momentum, EXACT_STEPS)
    rotation = history[-1]
    rows = rows_at_steps(pieces, EXACT_STEPS, duration, dtype)
    value = jax.vmap(partial(conditions, task))(states(rows, points, history, momentum))
    low, high = (side[None] for side in bounds(task))
    beyond = jnp.abs(value - jnp.clip(value, low, high)).max()
    margin = jnp.zeros((), dtype)
    if task.motors is not None:
        margin = 1 - jnp.abs(value[:, robot.joints : 2 * robot.joints]).max()
    omega = solve_symmetric3(momentum_matrices(robot, points[-1]).A, (rotation.T @ momentum)[:, None])[:, 0]
    own = basis(pieces, STEPS)
    acceleration = jnp.asarray(own.nodes[:, 2], dtype) @ points / duration**2
    effort = (jnp.asarray(own.weights, dtype)[:, None] * acceleration**2 * task.weights[None]).sum()
    return Judged(points, so3.angle(rotation.T @ goal), beyond, effort, rotation, omega, margin, steps)

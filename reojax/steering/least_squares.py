"""One motion for many momenta: Levenberg-Marquardt steps to the least mean square miss, within limits."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array
from reojax._internal.linalg import cholesky, cholesky_solve
from reojax.steering.end import end_and_slope
from reojax.steering.free_points import free_points
from reojax.steering.limits import FEASIBLE, RightingTask, bounds, conditions_and_slopes, states
from reojax.steering.newton import STEPS, Judged, assessment, effort_form, rows_at_steps

_PRICE = 1e4
"""Of the square of a limit that is passed, against the mean square of the miss."""
_EFFORT = 1e-6
"""Of the effort, which decides where the miss does not."""
_BACK = (1.0, 0.99, 0.97, 0.94, 0.88, 0.75, 0.5, 0.0)
"""Shares of the way from the start at which motions are assessed: less than all where the end is beyond a limit."""


class _State(NamedTuple):
    x: Array
    cost: Array
    matrix: Array
    gradient: Array
    damping: Array


@partial(jax.jit, static_argnums=1)
def solve_for_all(
    task: RightingTask,
    pieces: int,
    max_steps: int | Array,
    points: Float[Array, "m p+1 j"],
    goal: Float[Array, "3 3"],
    momenta: Float[Array, "k 3"],
    shares: Float[Array, " k"],
    duration: Array,
) -> tuple[Judged, Float[Array, "m k"]]:
    """From each start the answer, assessed at the mean momentum, and the angles that each of the momenta leaves."""
    one = partial(_solve_one, task, pieces, max_steps)
    return jax.vmap(one, (0, None, None, None, None))(points, goal, momenta, shares, duration)


def _solve_one(task: RightingTask, pieces: int, max_steps: int | Array, points, goal, momenta, shares, duration):
    robot, dtype = task.robot, points.dtype
    variables, x = free_points(robot, points)
    rows = rows_at_steps(pieces, STEPS, duration, dtype)
    lift = variables.slopes(rows)
    low, high = (side[None] for side in bounds(task, spare=True))
    form, carried = effort_form(pieces), task.weights[:, None] * variables.carry
    hessian = _EFFORT * jnp.kron(jnp.asarray(form[1:-1, 1:-1], dtype), variables.carry.T @ carried)

    def around(x: Array) -> tuple[Array, Array, Array]:
        """Half the cost, its Gauss-Newton matrix and its gradient."""
        points = variables.of(x)
        history, slope = jax.vmap(lambda h: end_and_slope(robot, points, duration, h, STEPS))(momenta)
        miss = jax.vmap(lambda end: so3.log(end @ goal.T))(history[:, -1])
        by = jnp.einsum("kapj,jf->kapf", slope[:, :, 1:-1], variables.carry).reshape(len(momenta), 3, -1)
        matrix = hessian + jnp.einsum("k,kan,kam->nm", shares, by, by)
        gradient = jnp.einsum("k,kan,ka->n", shares, by, miss)
        gradient = gradient + _EFFORT * (jnp.asarray(form[1:-1], dtype) @ points @ carried).ravel()
        cost = (shares[:, None] * miss**2).sum() + _EFFORT * jnp.einsum(
            "pq,pj,qj,j->", jnp.asarray(form, dtype), points, points, task.weights
        )
        looked = momenta if task.motors is not None else momenta[:1]  # joints and clearance do not depend on them
        for k in range(len(looked)):
            value, lifted = conditions_and_slopes(task, states(rows, points, history[k], looked[k]), lift)
            out = value - jnp.clip(value, low, high)
            active = (out != 0).astype(dtype)
            price = _PRICE / len(rows)
            matrix = matrix + price * jnp.einsum("qcn,qc,qcm->nm", lifted, active, lifted)
            gradient = gradient + price * jnp.einsum("qcn,qc->n", lifted, out)
            cost = cost + price * (out**2).sum()
        return cost, matrix, gradient

    def step(_: Array, s: _State) -> _State:
        lower = cholesky(s.matrix + s.damping * jnp.eye(x.size, dtype=dtype), drop=True)
        move = -cholesky_solve(lower, s.gradient)
        move = move * jnp.minimum(1, 0.5 / jnp.maximum(jnp.abs(move).max(), 1e-12))
        cost, matrix, gradient = around(s.x + move)
        better = cost < s.cost
        damping = jnp.clip(jnp.where(better, s.damping / 3, 4 * s.damping), 1e-9, 1e3)
        found = _State(s.x + move, cost, matrix, gradient, damping)
        kept = s._replace(damping=damping)
        return jax.tree.map(lambda a, b: jnp.where(better, a, b), found, kept)

    s = jax.lax.fori_loop(0, max_steps, step, _State(x, *around(x), jnp.asarray(1e-2, dtype)))

    def judge(share: Array) -> tuple[Judged, Array]:
        """At the mean momentum, by the worst of all; and the angles that they leave."""
        points = variables.of(x + share * (s.x - x))
        every = jnp.concatenate([(shares @ momenta)[None], momenta])
        each = jax.vmap(lambda h: assessment(task, pieces, points, goal, h, duration, jnp.asarray(max_steps)))(every)
        mean = jax.tree.map(lambda leaf: leaf[0], each)
        return mean._replace(beyond=each.beyond[1:].max()), each.error[1:]

    found = jax.lax.map(judge, jnp.asarray(_BACK, dtype))
    answers, angles = found
    within = answers.beyond <= FEASIBLE
    best = jnp.argmin(jnp.where(within, angles**2 @ shares, 1e3 + answers.beyond))
    return jax.tree.map(lambda leaf: leaf[best], found)


def cubature(momentum: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Six momenta with a mean and a covariance, and their shares (I. Arasaratnam, S. Haykin, IEEE TAC 54, 2009)."""
    values, vectors = np.linalg.eigh(covariance)
    arms = np.sqrt(3 * np.maximum(values, 0))[:, None] * vectors.T
    return np.concatenate([momentum + arms, momentum - arms]), np.full(6, 1 / 6)

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
from reojax.steering.free_points import FreePoints, free_points
from reojax.steering.limits import FEASIBLE, RightingTask, bounds, conditions, conditions_and_slopes, nearest, states

STEPS, EXACT_STEPS = 6, 16
"""Steps of the integration to a piece, for the search and for the answer."""
_LAST, _AGAIN = 18, 4
"""Newton steps that are kept for the target alone, and those after each look at the true end, at least."""
_LOOKS = 4
"""How often the true end is looked at, and what the search's own steps miss of it taken back."""
_FAR = 1e3
"""Angle to the target before the first step."""
_PATIENCE, _LOST = 14, 0.4
"""A search that is so far from its target [rad] after so many steps is given up."""
_NEAR = 0.25
"""Angle to the target within which effort counts [rad]: from afar its pull would undo the turns of a start."""
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

    def reached(self, tolerance: float) -> Array:
        """Whether motions end within the tolerance [rad] of their targets and keep all limits."""
        return (self.error <= tolerance) & (self.beyond <= FEASIBLE)


class _Iterate(NamedTuple):
    x: Array
    multipliers: Array
    reach: Array
    miss: Array
    moved: Array
    beyond: Array
    settled: Array
    steps: Array


class _Terms(NamedTuple):
    """What the steps of one search share."""

    variables: FreePoints
    rows: Array
    lift: Array
    low: Array
    high: Array
    form: Array
    """Of the effort, by the inner points and all points."""
    carried: Array
    """Weights of the joints, by the free ones."""
    hessian: Array
    axis: Array
    """About which the end may be turned in any way, inertial frame; zero if about none."""
    momentum: Array
    duration: Array
    tolerance: Array
    max_steps: Array


@partial(jax.jit, static_argnums=1)
def solve(
    task: RightingTask, pieces: int, max_steps: int | Array, points, goals, momenta, durations, tolerance
) -> Judged:
    """Many releases side by side, each from its own start.

    A step of Newton's method for `least effort, so that the end is on the target and the limits hold`: the target by
    three linear equations with multipliers (sequential quadratic programming), limits by an augmented Lagrangian
    (J. Nocedal and S. Wright, Numerical Optimization, chapters 17 and 18), and a bound on how far it goes.

    Args:
        task: what they share.
        pieces: of the spline, static.
        max_steps: at most.
        points: (m, p + 1, j) to start from [rad].
        goals: (m, 3, 3) orientations to end in, from the identity.
        momenta: (m, 3) inertial frame [kg m^2/s].
        durations: (m,) [s].
        tolerance: angle that counts as reached [rad].
    """
    one = partial(_solve_one, task, pieces, max_steps)
    points, goals, momenta, durations = map(jnp.asarray, (points, goals, momenta, durations))
    return jax.vmap(one, (0, 0, 0, 0, None))(points, goals, momenta, durations, tolerance)


@partial(jax.jit, static_argnums=1)
def judge(task: RightingTask, pieces: int, points, goals, momenta, durations, steps) -> Judged:
    """`assessment` of many motions side by side."""
    return jax.vmap(partial(assessment, task, pieces))(points, goals, momenta, durations, steps)


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
    terms, x = _terms_of(task, pieces, max_steps, points, goal, momentum, duration, tolerance)
    huge = jnp.asarray(_FAR, dtype)
    none = jnp.zeros((len(terms.rows), terms.low.shape[1]), dtype)
    s = _Iterate(x, none, jnp.asarray(0.4, dtype), huge, huge, huge, jnp.zeros((), bool), jnp.zeros((), int))
    fine = jnp.asarray(basis(pieces, EXACT_STEPS).nodes[::2, 0], dtype)

    def search(k: Array, carry: tuple[_Iterate, Array, Array]) -> tuple[_Iterate, Array, Array]:
        """From the start, and again for what the search's nodes miss of the true end and of the joints' limits."""
        s, aim, kept = carry
        own = _tightened(terms, kept)
        s = jax.lax.while_loop(partial(_goes_on, own), partial(_step, task, own, aim), s)
        points = terms.variables.of(s.x)
        angles = fine @ points
        over = jnp.stack([(robot.lower[None] - angles).max(0), (angles - robot.upper[None]).max(0)])
        true = end_of(robot, points, duration, momentum, EXACT_STEPS)[-1]
        here = end_and_slope(robot, points, duration, momentum, STEPS)[0][-1]
        more = jnp.minimum(s.steps, terms.max_steps - _AGAIN)
        s = s._replace(miss=huge, settled=jnp.ones((), bool), steps=more)
        return s, here @ true.T @ nearest(task, goal, true), kept + jnp.maximum(over, 0)

    s, *_ = jax.lax.fori_loop(0, _LOOKS, search, (s, goal, jnp.zeros((2, robot.joints), dtype)))
    return assessment(task, pieces, terms.variables.of(s.x), goal, momentum, duration, s.steps)


def _tightened(terms: _Terms, kept: Float[Array, "2 j"]) -> _Terms:
    """With joint limits that are nearer by so much, below and above."""
    low, high = jnp.asarray(terms.low), jnp.asarray(terms.high)
    joints = kept.shape[1]
    return terms._replace(low=low.at[0, :joints].add(kept[0]), high=high.at[0, :joints].add(-kept[1]))


def _terms_of(task: RightingTask, pieces: int, max_steps, points, goal, momentum, duration, tolerance):
    """What a search goes by, and the variables that it starts from."""
    dtype = points.dtype
    variables, x = free_points(task.robot, points)
    rows = rows_at_steps(pieces, STEPS, duration, dtype)
    form, carried = jnp.asarray(effort_form(pieces), dtype), task.weights[:, None] * variables.carry
    hessian = jnp.kron(form[1:-1, 1:-1], variables.carry.T @ carried) + 1e-6 * jnp.eye(x.size, dtype=dtype)
    low, high = (side[None] for side in bounds(task, spare=True))
    terms = _Terms(
        variables, rows, variables.slopes(rows), low, high, form[1:-1], carried, hessian, goal @ task.about, momentum,
        duration, tolerance, jnp.asarray(max_steps),
    )  # fmt: skip
    return terms, x


def _goes_on(terms: _Terms, s: _Iterate) -> Array:
    """Until it is done, out of steps, or still far from the target where others have come near."""
    done = s.settled & (s.miss < 0.1 * terms.tolerance) & (s.beyond < 0.5 * FEASIBLE)
    lost = (s.steps >= _PATIENCE) & (s.miss > _LOST) & (s.miss < _FAR)
    return (s.steps < terms.max_steps) & ~done & ~lost


def _step(task: RightingTask, terms: _Terms, aim: Array, s: _Iterate) -> _Iterate:
    """A step of Newton's method for the least effort, onto the target and back within the limits."""
    dtype = s.x.dtype
    points = terms.variables.of(s.x)
    history, slope = end_and_slope(task.robot, points, terms.duration, terms.momentum, STEPS)
    value, by = conditions_and_slopes(task, states(terms.rows, points, history, terms.momentum), terms.lift)
    miss = so3.log(history[-1] @ nearest(task, aim, history[-1]).T)
    length = jnp.sqrt((miss * miss).sum())
    beyond = jnp.abs(value - jnp.clip(value, terms.low, terms.high)).max()
    # limits: augmented Lagrangian, of those that are active
    shifted = value + s.multipliers / STRENGTH
    push = STRENGTH * (shifted - jnp.clip(shifted, terms.low, terms.high))
    active = (push != 0).astype(dtype)
    matrix = terms.hessian + STRENGTH * jnp.einsum("kcn,kc,kcm->nm", by, active, by)
    # less effort where the target is near; from afar, and in the end, the target alone
    ease = jnp.where(s.settled | (length > _NEAR), 0.0, 0.5)
    gradient = ease * (terms.form @ points @ terms.carried).ravel() + jnp.einsum("kcn,kc->n", by, push)
    # target: three linear equations, by their multipliers; two where the turn about an axis is free
    jacobian = jnp.einsum("apj,jf->apf", slope[:, 1:-1], terms.variables.carry).reshape(3, -1)
    free = terms.axis[:, None] * terms.axis[None]
    jacobian = jacobian - free @ jacobian
    lower = cholesky(matrix, drop=True)
    solved = cholesky_solve(lower, jnp.concatenate([gradient[None], jacobian]).T).T
    normal = jacobian @ solved[1:].T
    size = 1e-3 + jnp.trace(normal)
    normal = normal + 1e-9 * size * jnp.eye(3, dtype=dtype) + size * free
    wanted = -miss * jnp.minimum(1, 0.7 / jnp.maximum(length, 1e-12))
    force = solve_symmetric3(normal, (wanted + jacobian @ solved[0])[:, None])[:, 0]
    move = force @ solved[1:] - solved[0]
    # no further than the step before was right
    reach = jnp.clip(jnp.where(length < s.miss, 1.5, 0.6) * s.reach, 0.05, 0.8)
    move = move * jnp.minimum(1, reach / jnp.maximum(jnp.abs(move).max(), 1e-12))
    near = length < 0.1
    multipliers = jnp.where(near, push, s.multipliers)
    moved = jnp.abs(move).max()
    last = s.steps >= terms.max_steps - _LAST
    settled = s.settled | last | (near & (moved < _SETTLED) & (beyond < 10 * FEASIBLE))
    return _Iterate(s.x + move, multipliers, reach, length, moved, beyond, settled, s.steps + 1)


def assessment(task: RightingTask, pieces: int, points, goal, momentum, duration, steps) -> Judged:
    """A motion (p + 1, j) with all that is to be known of it, by the finer integration; units as of `Righting`."""
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
    error = so3.angle(rotation.T @ nearest(task, goal, rotation))
    return Judged(points, error, beyond, effort, rotation, omega, margin, steps)

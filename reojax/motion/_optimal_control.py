"""The optimiser behind the fastest motions: least duration, motors within their curves, joints within their limits."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from tqdm import tqdm

from reojax import so3
from reojax._internal.arrays import Array
from reojax.mechanics.dynamics import joint_load
from reojax.mechanics.integrators import GAUSS, end_rotation
from reojax.motion._feasibility import Look, beyond, beyond_limits, limits, restore_feasibility
from reojax.motion.least_time import minimum_stretch
from reojax.motion.motor import Motor, demand, no_load_speed, per_joint, stall_torque
from reojax.motion.simulation import net_rotation_of
from reojax.motion.trajectory import Trajectory, polynomial, stretch
from reojax.optimisation.optimise import optimise
from reojax.robot import Robot

_SAMPLES = 6
"""Steps per piece while optimising, of three nodes each."""
_NODES = np.concatenate([[0], ((np.arange(_SAMPLES)[:, None] + np.array(GAUSS)) / _SAMPLES).ravel(), [1]])
_LOOKED = np.array([0, *range(2, 3 * _SAMPLES, 3), 3 * _SAMPLES + 1])
"""Nodes at which motors and joints are looked at: both ends of a piece, and the middle of each step."""
_FINE = 48
"""Steps per piece for the net rotation of the answer."""
_EXACT = 1e-8
"""Largest error of an answer's net rotation that counts as converged [rad]."""
_ROUNDING = 1e-12
"""What a joint may be beyond its limit by rounding [rad]."""


class Fastest(NamedTuple):
    """A motion of least duration, and how well it is what it should be."""

    trajectory: Trajectory
    """The motion, no motor beyond its torque-speed curve."""
    duration: Float[Array, ""]
    """How long it takes [s]."""
    error: Float[Array, ""]
    """Angle between its net rotation and the one wanted [rad]."""
    beyond: Float[Array, ""]
    """Farthest that a joint goes beyond its limits at any time [rad], 0 for none."""
    converged: Bool[Array, ""]
    """Whether the optimiser says that nothing near is faster, and `error` is below 1e-8 and `beyond` zero."""


class Task(NamedTuple):
    """What is to be fast: a motion made of unknowns."""

    robot: Robot
    motors: Motor
    goal: Array
    """(3, 3) the net rotation wanted."""
    kept: bool
    """Whether all unknowns have it."""
    build: Callable[[Array], Trajectory]
    """Makes the motion from the unknowns."""
    cost: Callable[[Array], Array]
    """Its duration."""
    order: Callable[[Array], Array]
    """Further numbers that must not be positive, linear in the unknowns."""


class UnknownBox(NamedTuple):
    """Least and largest values of the unknowns, and their scales, each (n,)."""

    lower: np.ndarray
    upper: np.ndarray
    scale: np.ndarray


def least_duration(task: Task, starts: np.ndarray, box: UnknownBox, max_steps: int, progress: str | None) -> Fastest:
    """Solve a task from several starts, (m, n); the best answer is polished, and run as fast as its motors allow."""
    robot = jax.tree.map(lambda leaf: jnp.asarray(leaf, float), task.robot)
    motors = per_joint(task.motors, np.dtype(float))
    soft = 0.02 * float(np.max(np.asarray(stall_torque(motors) * no_load_speed(motors))))
    limited = limits(robot)
    build = jax.jit(task.build)
    halves = np.full((2, build(starts[0]).pieces, robot.joints), 0.5)

    def node(theta: Array, theta_dot: Array, theta_ddot: Array) -> tuple[Array, Array]:
        """Share of the supply that each motor takes too much, and the base's angular velocity."""
        load = joint_load(robot, theta, theta_dot, theta_ddot)
        a, b, c = demand(robot, motors, theta_dot, load, soft=soft)
        return jnp.abs(a + b.sum(0) + c) / motors.supply - 1, load.omega

    def sample(x: Array) -> tuple[Array, Array]:
        """What must not be positive, at the samples: motors, joints, order; and the net rotation."""
        trajectory = task.build(x)
        length = jnp.diff(trajectory.breaks)
        state = jax.vmap(jax.vmap(polynomial, (None, 0)))(trajectory.coefficients, length[:, None] * _NODES[None])
        taken, omega = jax.vmap(jax.vmap(node))(*state)
        past = [(sign * (state.theta[:, _LOOKED, k] - place)).ravel() for sign, k, place in limited]
        rows = jnp.concatenate([taken[:, _LOOKED].ravel(), *past, task.order(x) / box.scale[0]])
        return rows, end_rotation(jnp.repeat(length / _SAMPLES, _SAMPLES), omega[:, 1:-1].reshape(-1, 3, 3))

    def exact(x: Array, share: Array) -> Array:
        """The same where the joints are farthest, without motors."""
        return jnp.concatenate([beyond_limits(robot, task.build(x), share), task.order(x) / box.scale[0]])

    fine = jax.jit(lambda trajectory: so3.log(task.goal.T @ net_rotation_of(robot, trajectory, _FINE)))
    if task.kept:  # many rows and no curved ones: what the batched solver is better at
        found = optimise(
            task.cost, starts, lower=box.lower, upper=box.upper, scale=box.scale, inequality=lambda x: sample(x)[0],
            tolerance=1e-7, slope_tolerance=1e-4, max_steps=max_steps, progress=progress,
        )  # fmt: skip
        best, converged = np.asarray(found.value[found.best]), bool(found.converged[found.best])
        look, equal = _with_slope(exact), 0
    else:

        def everything(x: Array, share: Array) -> Array:
            rows, turned = sample(x)
            return jnp.concatenate([task.cost(x)[None], so3.log(task.goal.T @ turned), exact(x, share), rows])

        program, equal = _with_slope(everything), 3
        last = 4 + exact(starts[0], halves).size
        best, converged = _least(lambda x: program(x, halves), last, starts, box, max_steps, progress)
        look = lambda x, share: tuple(part[1:last] for part in program(x, share))
    if not task.kept or beyond(robot, build(best)) > _ROUNDING:
        best = restore_feasibility(look, build, fine, best, box, equal)
    trajectory = build(best)
    trajectory = stretch(trajectory, minimum_stretch(task.robot, trajectory, task.motors))
    error, past = jnp.linalg.norm(fine(trajectory)), beyond(robot, trajectory)
    past = past if past > _ROUNDING else 0.0  # a corner of a path may lie on a limit
    return Fastest(
        trajectory=trajectory,
        duration=trajectory.duration,
        error=error,
        beyond=jnp.asarray(past),
        converged=jnp.asarray(converged and past == 0 and float(error) < _EXACT),
    )


def _with_slope(function: Callable[[Array, Array], Array]) -> Look:
    """`function` of the unknowns and of shares of the pieces, with its derivative by the unknowns; one program."""

    def both(x: Array, share: Array) -> tuple[Array, Array]:
        slope, value = jax.jacfwd(lambda x: (function(x, share),) * 2, has_aux=True)(x)
        return value, slope

    return jax.jit(both)


def _least(
    program: Callable[[np.ndarray], tuple[Array, Array]],
    last: int,
    starts: np.ndarray,
    box: UnknownBox,
    max_steps: int,
    progress: str | None,
) -> tuple[np.ndarray, bool]:
    """Least first number of `program`, the next three zero and those from `last` on not positive (SciPy's SLSQP).

    One small program with all derivatives is compiled, where the batched solver of `design` would compile for minutes.
    """
    from scipy.optimize import minimize

    lower, upper, scale = box
    known: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def at(unit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        key = unit.tobytes()
        if key not in known:
            known.clear()
            value, slope = program(unit * scale)
            known[key] = np.asarray(value), np.asarray(slope) * scale
        return known[key]

    def part(kind: str, rows: slice, sign: int) -> dict[str, Any]:
        return {"type": kind, "fun": lambda x: sign * at(x)[0][rows], "jac": lambda x: sign * at(x)[1][rows]}

    constraints = [part("eq", slice(1, 4), 1), part("ineq", slice(last, None), -1)]
    found = []
    total = max_steps * len(starts)
    with tqdm(total=total, desc=progress, unit="step", file=sys.stderr, disable=progress is None) as bar:
        for start in starts:
            answer = minimize(
                lambda x: at(x)[0][0], start / scale, jac=lambda x: at(x)[1][0], method="SLSQP",
                bounds=list(zip(lower / scale, upper / scale, strict=True)), constraints=constraints,
                options={"maxiter": max_steps, "ftol": 1e-6}, callback=lambda _: bar.update(1),
            )  # fmt: skip
            value = at(answer.x)[0]
            off = max(np.abs(value[1:4]).max(), value[last:].max())
            found.append((not (answer.success and off < 1e-5), value[0] if off < 1e-4 else np.inf, answer.x * scale))
    failed, _, best = min(found, key=lambda item: item[:2])
    return best, not failed

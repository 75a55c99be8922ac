"""Aerial righting: joint motions that turn a robot that already has angular momentum, in the time of its fall.

With angular momentum `H` the turn depends on the time as well as on the path, `R' = R hat(A^-1 (B theta' + R^T H))`
(thesis 1.9; a cat dropped upside down, or one that already spins). The joints go along a spline of least jerk, at rest
at both ends; its points are found by Newton steps of little effort that end on the target, with multipliers for what
the joints' limits, the motors and the clearance allow. Several starts run side by side.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from functools import cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike

from reojax import so3
from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax._internal.linalg import cholesky, cholesky_solve, solve_symmetric3
from reojax.collision.clearance import clearance as clearances
from reojax.mechanics.dynamics import joint_inertia, joint_load
from reojax.mechanics.momentum import momentum_matrices
from reojax.motion.motor import Motor, check_motors, demand, per_joint
from reojax.motion.trajectory import Trajectory
from reojax.optimisation.status import Status
from reojax.robot import Robot
from reojax.steering.end import basis, end_and_slope, end_of

PIECES, FEW_PIECES, MANY_JOINTS = 7, 4, 6
"""Pieces of the spline, and of that of a robot of so many joints or more, which has more ways to turn."""
_STEPS, _EXACT_STEPS = 6, 16
"""Steps of the integration to a piece, for the search and for the answer."""
_TABLE = 1024
"""Random motions from which a search takes its starts."""
_LAST = 8
"""Newton steps that are kept for the target alone."""
_SETTLED = 0.1
"""Change of the points [rad] below which effort goes down no more."""
_FEASIBLE = 1e-4
"""How far a limit may be passed: rad, share of the supply, or m."""
_SOFT = 0.02
"""Power over which driving turns into being driven back [W]."""
_FASTEST = 100.0
"""Body rate that a momentum may imply [rad/s]; more is a wrong unit."""
_TURNS = 20.0
"""Turns during the motion that a momentum may imply."""


class Righting(NamedTuple):
    """A motion for each release; of `righting` one, without the leading axis."""

    points: Float[np.ndarray, "*m p+1 j"]
    """Joint angles at equal times, between which the motion is the spline of least jerk [rad]."""
    duration: Float[np.ndarray, "*m"]
    """How long it takes [s]."""
    momentum: Float[np.ndarray, "*m 3"]
    """Angular momentum that it is made for [kg m^2/s]."""
    rotation: Float[np.ndarray, "*m 3 3"]
    """Orientation at the end, from the identity."""
    omega: Float[np.ndarray, "*m 3"]
    """Angular velocity of the base at the end, base frame: what the momentum leaves in that posture [rad/s]."""
    error: Float[np.ndarray, "*m"]
    """Angle left to the target [rad]."""
    beyond: Float[np.ndarray, "*m"]
    """How far a limit is passed at most: of joints [rad], motors [share of the supply] or clearance [m]; 0 if none."""
    margin: Float[np.ndarray, "*m"]
    """Least distance to the torque-speed lines, `1 - |voltage| / supply`; NaN without motors."""
    effort: Float[np.ndarray, "*m"]
    """Mean square of the weighted joint accelerations."""
    travel: Float[np.ndarray, "*m"]
    """Sum over the joints of the angle each one moves through [rad]."""
    converged: Bool[np.ndarray, "*m"]
    """Whether error and limits are within their tolerances; the effort is then the least found from the starts."""
    status: Int[np.ndarray, "*m"]
    """How it ended: `reojax.optimisation.status.describe` says it in words."""
    steps: Int[np.ndarray, "*m"]
    """Newton steps of the answer."""
    least_duration: Float[np.ndarray, "*m"]
    """Shortest duration that was found to do, where `duration` would not or none was given; else NaN [s]."""

    @property
    def trajectory(self) -> Trajectory:
        """The motion of one release, for `simulate`, `track` and `Steering`."""
        if self.points.ndim != 2:
            raise ValueError("`trajectory` is of one release; take one by `Righting(*(field[i] for field in many))`.")
        own = basis(self.points.shape[0] - 1, _STEPS)
        pieces = own.coefficients.shape[0]
        powers = (1 / float(self.duration)) ** np.arange(6)
        coefficients = np.einsum("qkp,pj->qkj", own.coefficients, self.points) * powers[None, :, None]
        return Trajectory(float(self.duration) * np.arange(pieces + 1) / pieces, coefficients)


def righting(
    robot: Robot,
    target: ArrayLike,
    *,
    momentum: ArrayLike,
    duration: float | None,
    start: ArrayLike | None = None,
    end: ArrayLike | None = None,
    motors: Motor | Sequence[Motor] | None = None,
    clearance: float | None = None,
    weights: ArrayLike | None = None,
    pieces: int | None = None,
    starts: int = 24,
    tolerance: float = 1e-6,
    max_steps: int = 40,
    seed: int = 0,
) -> Righting:
    """Find a joint motion after which a robot with angular momentum has the target orientation and posture.

    Args:
        robot: the robot; its joint limits hold.
        target: (3, 3) orientation at the end, base frame to inertial frame; the base starts at the identity.
        momentum: (3,) angular momentum about the centre of mass, inertial frame [kg m^2/s].
        duration: of the motion [s]; None with motors: the shortest that is found.
        start: (j,) posture at the start [rad]; default zero.
        end: (j,) posture at the end; default `start`. The joints are at rest at both.
        motors: whose torque-speed lines must hold, as for `simulate`; default none.
        clearance: least distance of the robot's collision pairs at the nodes of the motion [m]; default not asked.
        weights: (j,) price of each joint's mean square acceleration; default the square of its inertia at the start.
        pieces: pieces of the spline, at least 3; default 7, and 4 from six joints on.
        starts: motions to start from, at most.
        tolerance: angle to the target that counts as reached [rad].
        max_steps: Newton steps from each start, at most.
        seed: of the random motions among which starts are looked for.

    Returns:
        The motion of least effort of those that converged first; where none did, the best, with `converged` False, and
        with motors the least duration that does (`least_duration`), if one was found.

    Raises:
        ValueError: naming the entry, its value and the rule; also for a momentum that implies a body rate or turns
            beyond reason, which is likely in another unit.
    """
    goal = checks.rotations("target", target)
    many = _righting(robot, goal[None], np.asarray(momentum)[None] if np.ndim(momentum) == 1 else momentum, duration,
                     start, end, motors, clearance, weights, pieces, starts, tolerance, max_steps, seed)  # fmt: skip
    return Righting(*(field[0] for field in many))


def righting_many(
    robot: Robot,
    targets: ArrayLike,
    *,
    momenta: ArrayLike,
    duration: float,
    start: ArrayLike | None = None,
    end: ArrayLike | None = None,
    motors: Motor | Sequence[Motor] | None = None,
    clearance: float | None = None,
    weights: ArrayLike | None = None,
    pieces: int | None = None,
    starts: int = 24,
    tolerance: float = 1e-6,
    max_steps: int = 40,
    seed: int = 0,
) -> Righting:
    """`righting` for many releases side by side: `targets` (m, 3, 3) or one for all, `momenta` (m, 3).

    Every field of the result has a leading axis m. Other arguments and errors as for `righting`.
    """
    given = np.asarray(momenta, float)
    goals = np.asarray(targets)
    if goals.ndim == 2:
        goals = np.broadcast_to(goals, (len(np.atleast_2d(given)), 3, 3))
    goals = checks.rotations("targets", goals, (-1, 3, 3))
    return _righting(robot, goals, given, duration, start, end, motors, clearance, weights, pieces, starts, tolerance,
                     max_steps, seed)  # fmt: skip


class _Task(NamedTuple):
    """What all lanes of a search share."""

    robot: Robot
    motors: Motor | None
    clearance: Array | None
    start: Array
    end: Array
    weights: Array


def _righting(robot, goals, momenta, duration, start, end, motors, clearance, weights, pieces, starts, tolerance,
              max_steps, seed) -> Righting:  # fmt: skip
    """Check everything, search, and where the motors cannot do it, look for the least duration."""
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    checks.on_host("robot", robot, "righting")
    if pieces is None:
        pieces = PIECES if robot.joints < MANY_JOINTS else FEW_PIECES
    pieces, starts = checks.whole("pieces", pieces, 3), checks.whole("starts", starts)
    tolerance, max_steps = checks.positive("tolerance", tolerance), checks.whole("max_steps", max_steps)
    seed = checks.whole("seed", seed, 0)
    first = _posture(robot, "start", np.zeros(robot.joints) if start is None else start)
    last = first if end is None else _posture(robot, "end", end)
    if duration is None and motors is None:
        raise ValueError("`duration` is None, the shortest that is found; without `motors` there is none.")
    seconds = 0.5 if duration is None else checks.positive("duration", duration, "s")
    h = np.asarray(checks.numbers("momentum", momenta, (-1, 3)))
    if len(h) != len(goals):
        raise ValueError(f"`momenta` has {len(h)} rows for {len(goals)} targets.")
    _reasonable(robot, first, h, seconds)
    if weights is None:
        price = np.diagonal(np.asarray(joint_inertia(robot, first))) ** 2
    else:
        price = np.asarray(checks.numbers("weights", weights, (robot.joints,)))
        if not (price > 0).all():
            raise ValueError(f"`weights` is {price.tolist()}; each must be positive.")
    if clearance is not None and not robot.collision_pairs:
        raise ValueError(f"`clearance` is {clearance}, but {robot.name!r} has no collision pairs.")
    known = None if motors is None else check_motors(motors, robot)
    least = None if clearance is None else np.asarray(checks.number("clearance", clearance, unit="m"))
    task = _Task(robot, None if known is None else per_joint(known, np.dtype(float)), least, first, last,
                 price / price.mean())  # fmt: skip
    task = jax.tree.map(lambda x: jnp.asarray(x, float), task)
    search = partial(_search, task, pieces=pieces, starts=starts, tolerance=tolerance, max_steps=max_steps, seed=seed)
    if duration is not None:
        found = search(goals, h, np.full(len(h), seconds))
        if motors is None or found.converged.all():
            return found
    else:
        found = search(goals, h, np.full(len(h), seconds))
    return _least_durations(search, found, goals, h, keep=duration is not None)


def _posture(robot: Robot, entry: str, value: Any) -> np.ndarray:
    posture = np.asarray(checks.numbers(entry, value, (robot.joints,)))
    low, high = np.asarray(robot.lower), np.asarray(robot.upper)
    out = (posture < low - 1e-9) | (posture > high + 1e-9)
    if out.any():
        k = int(np.argmax(out))
        raise ValueError(
            f"{entry}[{k}] is {posture[k]:g} rad; joint {robot.joint_names[k]!r} goes from {low[k]:g} to {high[k]:g}."
        )
    for number, (joint, driver) in enumerate(robot.couplings):
        own = float(robot.coupling_ratio[number]) * posture[driver] + float(robot.coupling_offset[number])
        if abs(own - posture[joint]) > 1e-6:
            raise ValueError(
                f"{entry}[{joint}] is {posture[joint]:g} rad; joint {robot.joint_names[joint]!r} follows "
                f"{robot.joint_names[driver]!r}, which puts it at {own:g}."
            )
    return posture


def _reasonable(robot: Robot, start: np.ndarray, momenta: np.ndarray, duration: float) -> None:
    """Ask about a momentum that is likely in another unit."""
    inertia = np.asarray(momentum_matrices(robot, start).A)
    rates = np.linalg.norm(np.linalg.solve(inertia, momenta.T), axis=0)
    worst = int(np.argmax(rates))
    if rates[worst] > _FASTEST or rates[worst] * duration > 2 * np.pi * _TURNS:
        raise ValueError(
            f"`momentum` is {momenta[worst].tolist()} kg m^2/s, which implies a body rate of {rates[worst]:.4g} rad/s "
            f"in the start posture, {rates[worst] * duration / (2 * np.pi):.3g} turns in {duration:g} s; is it in "
            "another unit, or an angular velocity?"
        )


def _search(task: _Task, goals, momenta, durations, *, pieces, starts, tolerance, max_steps, seed) -> Righting:
    """From ever further starts, until each release has its motion; lanes of one size, one program."""
    table, ends = _table(_Key(task.robot), pieces, seed, task.start.tobytes(), task.end.tobytes())
    m = len(goals)
    lanes = 2 if m == 1 else min(32, m)
    inertia = np.asarray(momentum_matrices(task.robot, task.start).A)
    best: dict[int, tuple] = {}
    order = []
    for goal, h, seconds in zip(goals, momenta, durations, strict=True):
        drift = np.asarray(so3.exp(jnp.asarray(np.linalg.solve(inertia, h) * seconds)))
        cosine = np.einsum("ab,kbc,ac->k", drift, ends, goal)
        order.append(np.argsort(-cosine)[:starts])
    tried = np.zeros(m, int)
    per_round = 2 if m == 1 else 1
    while True:
        waiting = [i for i in range(m) if tried[i] < len(order[i]) and not (i in best and best[i][0])]
        if not waiting:
            break
        queue = [(i, order[i][tried[i] + r]) for i in waiting for r in range(per_round) if tried[i] + r < len(order[i])]
        tried[waiting] += per_round
        for first in range(0, len(queue), lanes):
            part = queue[first : first + lanes]
            rows = np.array([part[min(k, len(part) - 1)] for k in range(lanes)])
            i, k = rows.T
            out = _solve(task, pieces, max_steps, table[k], goals[i], momenta[i], durations[i], tolerance)
            out = jax.tree.map(np.asarray, out)
            for lane, (i, _) in enumerate(part):
                one = tuple(leaf[lane] for leaf in out)
                good = one[1] <= tolerance and one[2] <= _FEASIBLE
                rank = (not good, float(one[3]) if good else float(one[1] + one[2]))
                if i not in best or rank < best[i][1]:
                    best[i] = (good, rank, one)
    rows = [best[i][2] for i in range(m)]
    points, error, beyond, effort, rotation, omega, margin, steps = (np.stack(x) for x in zip(*rows, strict=True))
    good = np.array([best[i][0] for i in range(m)])
    status = np.where(good, Status.CONVERGED, np.where(error > tolerance, Status.NOT_FOUND, Status.INFEASIBLE))
    fine = basis(pieces, _EXACT_STEPS).nodes[:, 0] @ points
    travel = np.abs(np.diff(fine, axis=1)).sum((1, 2))
    nothing = np.full(m, np.nan)
    margin = nothing if task.motors is None else margin
    return Righting(points, durations, momenta, rotation, omega, error, beyond, margin, effort, travel, good, status,
                    steps, nothing)  # fmt: skip


def _least_durations(search, found: Righting, goals, momenta, *, keep: bool) -> Righting:
    """Double the durations that are too short, then halve the gap; `keep` the answers for the durations asked for."""
    fields = [np.array(field) for field in found]
    for i in range(len(goals)):
        if keep and found.converged[i]:
            continue
        one = partial(search, goals[i : i + 1], momenta[i : i + 1])
        low, high, best = 0.0, float(found.duration[i]), None
        if found.converged[i]:
            best = Righting(*(field[i : i + 1] for field in found))
        for _ in range(4):
            if best is not None:
                break
            low, high = high, 1.6 * high
            trial = one(np.array([high]))
            best = trial if trial.converged[0] else None
        if best is None:
            continue
        for _ in range(5):
            middle = 0.5 * (low + high) if low else 0.7 * high
            trial = one(np.array([middle]))
            if trial.converged[0]:
                high, best = middle, trial
            else:
                low = middle
        if keep:
            fields[-1][i] = high
        else:
            for field, value in zip(fields, best, strict=True):
                field[i] = value[0]
            fields[-1][i] = high
    return Righting(*fields)


class _Key:
    """A robot that is equal to another of the same numbers."""

    def __init__(self, robot: Robot):
        self.robot = robot
        leaves, structure = jax.tree.flatten(robot)
        self.key: Hashable = (structure, *(np.asarray(leaf).tobytes() for leaf in leaves))

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self.key == other.key


@cache
def _table(key: _Key, pieces: int, seed: int, start: bytes, end: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Random motions (k, p + 1, j) within the limits, and where they end without momentum (k, 3, 3)."""
    robot = key.robot
    first, last = np.frombuffer(start), np.frombuffer(end)
    rng = np.random.default_rng(seed)
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    share = np.linspace(0, 1, pieces + 1)[:, None]
    smooth = share**3 * (10 - 15 * share + 6 * share**2)
    straight = first + smooth * (last - first)
    inside = rng.uniform(low, high, (_TABLE, pieces + 1, robot.joints))
    size = rng.uniform(0.1, 0.8, (_TABLE, 1, 1))
    points = straight + size * (inside - straight)
    for number, (joint, driver) in enumerate(robot.couplings):
        points[..., joint] = float(robot.coupling_ratio[number]) * points[..., driver] + float(
            robot.coupling_offset[number]
        )
    points[:, 0], points[:, -1] = first, last
    return points, np.asarray(_ends(robot, jnp.asarray(points)))


@jax.jit
def _ends(robot: Robot, points: Array) -> Array:
    robot = jax.tree.map(lambda x: jnp.asarray(x, points.dtype), robot)
    still, one = jnp.zeros(3, points.dtype), jnp.ones((), points.dtype)
    return jax.lax.map(lambda p: end_of(robot, p, one, still, 3)[-1], points, batch_size=32)


class _State(NamedTuple):
    x: Array
    multipliers: Array
    reach: Array
    miss: Array
    moved: Array
    beyond: Array
    settled: Array
    steps: Array


@partial(jax.jit, static_argnums=(1, 2))
def _solve(task: _Task, pieces: int, max_steps: int, points, goals, momenta, durations, tolerance):
    one = partial(_solve_one, task, pieces, max_steps)
    points, goals, momenta, durations = map(jnp.asarray, (points, goals, momenta, durations))
    return jax.vmap(one, (0, 0, 0, 0, None))(points, goals, momenta, durations, tolerance)


def _solve_one(task: _Task, pieces: int, max_steps: int, points, goal, momentum, duration, tolerance):
    """One lane: the points, and what is to be known of them."""
    robot, dtype = task.robot, points.dtype
    own = basis(pieces, _STEPS)
    values = jnp.asarray(own.nodes[::2], dtype)  # (k, 3, p + 1)
    values = values * (1 / duration) ** jnp.arange(3, dtype=dtype)[None, :, None]
    carry, free = _carry(robot)
    inner = pieces - 1
    size = inner * len(free)
    ends = jnp.zeros_like(points).at[0].set(points[0]).at[-1].set(points[-1])
    offset = jnp.zeros(robot.joints, dtype)
    for number, (joint, _) in enumerate(robot.couplings):
        offset = offset.at[joint].set(robot.coupling_offset[number])

    def to_points(x: Array) -> Array:
        return ends.at[1:-1].set(x.reshape(inner, len(free)) @ carry.T + offset[None])

    # effort: mean square acceleration, weighted, of order one
    rows = own.nodes[:, 2]
    form = (rows * own.weights[:, None]).T @ rows
    scale = np.trace(form[1:-1, 1:-1]) / inner
    form = form / scale
    price = carry.T @ (task.weights[:, None] * carry)
    hessian = jnp.kron(jnp.asarray(form[1:-1, 1:-1], dtype), price)

    def effort_slope(points: Array) -> Array:
        return (jnp.asarray(form[1:-1], dtype) @ points @ (task.weights[:, None] * carry)).ravel()

    def limited(state: Array) -> Array:
        """What must stay within bounds at one node, of `(theta, theta_dot, theta_ddot, h)`."""
        theta, rate, acceleration, h = jnp.split(state, np.cumsum([robot.joints] * 3))
        parts: list[Any] = [theta]
        if task.motors is not None:
            load = joint_load(robot, theta, rate, acceleration, momentum=h)
            squared, linear, constant = demand(robot, task.motors, rate, load, soft=_SOFT)
            parts.append((squared + linear.sum(0) + constant) / task.motors.supply)
        if task.clearance is not None:
            parts.append(clearances(robot, theta))
        return jnp.concatenate(parts)

    bounds: list[tuple[Any, Any]] = [(robot.lower, robot.upper)]
    if task.motors is not None:
        bounds.append((-jnp.ones(robot.joints, dtype), jnp.ones(robot.joints, dtype)))
    if task.clearance is not None:
        count = len(robot.collision_pairs)
        bounds.append((jnp.full(count, task.clearance), jnp.full(count, jnp.inf)))
    low, high = (jnp.concatenate(side)[None] for side in zip(*bounds, strict=True))
    plain = task.motors is None and task.clearance is None
    strength = 30.0
    lift = jnp.einsum("kop,jf->kojpf", values[:, :, 1:-1], carry).reshape(len(values), 3 * robot.joints, size)

    def at_nodes(points: Array, rotation: Array) -> tuple[Array, Array]:
        """Values (k, c) and slopes (k, c, n) of what is limited."""
        state = jnp.einsum("kop,pj->koj", values, points).reshape(len(values), -1)
        if plain:
            return state[:, : robot.joints], lift[:, : robot.joints]
        h = rotation.swapaxes(1, 2) @ momentum
        state = jnp.concatenate([state, h], axis=1)
        slope = jax.vmap(jax.jacfwd(limited))(state)[:, :, : 3 * robot.joints]
        return jax.vmap(limited)(state), slope @ lift

    def step(s: _State, aim: Array) -> _State:
        points = to_points(s.x)
        history, slope = end_and_slope(robot, points, duration, momentum, _STEPS)
        value, by = at_nodes(points, history)
        miss = so3.log(history[-1] @ aim.T)
        length = jnp.sqrt((miss * miss).sum())
        beyond = jnp.abs(value - jnp.clip(value, low, high)).max()
        shifted = value + s.multipliers / strength
        push = strength * (shifted - jnp.clip(shifted, low, high))
        active = (push != 0).astype(dtype)
        matrix = hessian + strength * jnp.einsum("kcn,kc,kcm->nm", by, active, by)
        matrix = matrix + 1e-6 * jnp.eye(size, dtype=dtype)
        ease = jnp.where(s.settled, 0.0, 0.5)  # less effort first; in the end the target alone
        gradient = ease * effort_slope(points) + jnp.einsum("kcn,kc->n", by, push)
        jacobian = (slope[:, 1:-1] @ carry).reshape(3, size)
        lower = cholesky(matrix, drop=True)
        solved = cholesky_solve(lower, jnp.concatenate([gradient[None], jacobian]).T).T
        normal = jacobian @ solved[1:].T
        normal = normal + 1e-9 * (1e-3 + jnp.trace(normal)) * jnp.eye(3, dtype=dtype)
        wanted = -miss * jnp.minimum(1, 0.7 / jnp.maximum(length, 1e-12))
        force = solve_symmetric3(normal, (wanted + jacobian @ solved[0])[:, None])[:, 0]
        move = force @ solved[1:] - solved[0]
        longest = jnp.abs(move).max()
        better = length < s.miss
        reach = jnp.clip(jnp.where(better, 1.5, 0.6) * s.reach, 0.05, 0.8)
        move = move * jnp.minimum(1, reach / jnp.maximum(longest, 1e-12))
        near = length < 0.1
        multipliers = jnp.where(near, push, s.multipliers)
        moved = jnp.abs(move).max()
        settled = s.settled | (s.steps >= max_steps - _LAST) | (near & (moved < _SETTLED) & (beyond < 10 * _FEASIBLE))
        return _State(s.x + move, multipliers, reach, length, moved, beyond, settled, s.steps + 1)

    def going(s: _State) -> Array:
        done = s.settled & (s.miss < 0.1 * tolerance) & (s.beyond < 0.5 * _FEASIBLE)
        return (s.steps < max_steps) & ~done

    x = points[1:-1][:, np.array(free)].ravel()
    huge = jnp.asarray(1e3, dtype)
    no = jnp.zeros((), bool)
    none = jnp.zeros((len(values), low.shape[1]), dtype)
    s = _State(x, none, jnp.asarray(0.4, dtype), huge, huge, huge, no, jnp.zeros((), int))

    def search(k: Array, carry: tuple[_State, Array]) -> tuple[_State, Array]:
        """Once from the start, and again for what the steps of the search miss of the true end."""
        s, aim = carry
        s = jax.lax.while_loop(going, lambda s: step(s, aim), s)
        true = end_of(robot, to_points(s.x), duration, momentum, _EXACT_STEPS)[-1]
        here = end_of(robot, to_points(s.x), duration, momentum, _STEPS)[-1]
        more = jnp.maximum(s.steps - _LAST // 2, 0)
        return s._replace(miss=huge, settled=~no, steps=more), here @ true.T @ goal

    s, _ = jax.lax.fori_loop(0, 2, search, (s, goal))
    points = to_points(s.x)
    history = end_of(robot, points, duration, momentum, _EXACT_STEPS)
    rotation = history[-1]
    fine = jnp.asarray(basis(pieces, _EXACT_STEPS).nodes[::2], dtype)
    fine = fine * (1 / duration) ** jnp.arange(3, dtype=dtype)[None, :, None]
    state = jnp.einsum("kop,pj->koj", fine, points).reshape(len(fine), -1)
    state = jnp.concatenate([state, history.swapaxes(1, 2) @ momentum], axis=1)
    value = jax.vmap(limited)(state)
    beyond = jnp.abs(value - jnp.clip(value, low, high)).max()
    volts = value[:, robot.joints : 2 * robot.joints] if task.motors is not None else None
    margin = jnp.zeros((), dtype) if volts is None else 1 - jnp.abs(volts).max()
    omega = solve_symmetric3(momentum_matrices(robot, points[-1])[0], (rotation.T @ momentum)[:, None])[:, 0]
    acceleration = jnp.asarray(own.nodes[:, 2], dtype) @ points / duration**2
    effort = (jnp.asarray(own.weights, dtype)[:, None] * acceleration**2 * task.weights[None]).sum()
    error = so3.angle(rotation.T @ goal)
    return points, error, beyond, effort, rotation, omega, margin, s.steps


def _carry(robot: Robot) -> tuple[Array, list[int]]:
    """(j, f) how all joints follow the free ones, and which these are."""
    coupled = {joint: (driver, number) for number, (joint, driver) in enumerate(robot.couplings)}
    free = [k for k in range(robot.joints) if k not in coupled]
    carry = jnp.zeros((robot.joints, len(free)), robot.mass.dtype)
    for column, k in enumerate(free):
        carry = carry.at[k, column].set(1)
    for joint, (driver, number) in coupled.items():
        carry = carry.at[joint, free.index(driver)].set(robot.coupling_ratio[number])
    return carry, free

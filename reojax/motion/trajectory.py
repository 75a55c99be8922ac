"""Trajectories: joint angles by time, polynomials between breaks.

A path with a time law for each edge makes one (`along`), and so does a smooth curve through waypoints at
given times (`through`), which is another path: it rounds the corners.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import partial
from math import comb
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array, as_numbers, common_float, is_concrete
from reojax.motion.splines import least_jerk
from reojax.motion.time_laws import Law, check_law
from reojax.path import Path


class State(NamedTuple):
    """Where the joints are and how they move, at one time or at many."""

    theta: Float[Array, "... j"]
    """Joint angles [rad]."""
    theta_dot: Float[Array, "... j"]
    """Joint rates [rad/s]."""
    theta_ddot: Float[Array, "... j"]
    """Joint accelerations [rad/s^2]."""


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, eq=False)
class Trajectory:
    """Joint angles by time; an immutable pytree, built by `along` or `through`."""

    breaks: Float[Array, " p+1"]
    """Times where the pieces meet [s], not decreasing, the first one 0."""
    coefficients: Float[Array, "p d+1 j"]
    """Of the powers of the time since the piece began [rad, rad/s, ...], lowest first."""

    @property
    def joints(self) -> int:
        """Number of joint angles."""
        return self.coefficients.shape[2]

    @property
    def pieces(self) -> int:
        """Number of polynomial pieces."""
        return self.coefficients.shape[0]

    @property
    def duration(self) -> Array:
        """The whole time that it takes [s]."""
        return self.breaks[-1]

    def at(self, time: ArrayLike) -> State:
        """Return the joints' state at one time [s], which is held within the trajectory's own."""
        breaks = jnp.asarray(self.breaks)
        return _state_at(breaks, jnp.asarray(self.coefficients), jnp.asarray(time, breaks.dtype))


@partial(jax.jit, inline=True)
def _state_at(breaks: Float[Array, " p+1"], coefficients: Float[Array, "p d+1 j"], time: Array) -> State:
    """The state of the piece that a time is in."""
    t = jnp.clip(time, breaks[0], breaks[-1])
    piece = jnp.clip((breaks <= t).sum() - 1, 0, coefficients.shape[0] - 1)
    return polynomial(coefficients[piece], t - breaks[piece])


def polynomial(coefficients: Float[Array, "d+1 j"], time: Float[Array, ""]) -> State:
    """Values and two derivatives of polynomials at `time`, by Horner's rule."""
    value = rate = half = jnp.zeros_like(coefficients[0])
    for row in coefficients[::-1]:
        half = half * time + rate
        rate = rate * time + value
        value = value * time + row
    return State(value, rate, 2 * half)


def along(path: Path, law: Law | str, durations: ArrayLike) -> Trajectory:
    """Trajectory along a path: each edge by the same law, in its own time, at rest at every corner.

    Args:
        path: the path in shape space, one edge or more.
        law: the time law, or its name: "quintic", "trapezoid" or "minimum-jerk".
        durations: (edges,) durations [s], or one for every edge; positive, but for edges that stay put.

    Raises:
        ValueError: if the law is none, or a duration is not positive and finite, or there are too many or few.
    """
    law = check_law(law)
    _check_path(path)
    times = _durations(durations, path)
    dtype = common_float(path.waypoints, times, law)
    return _along(*(jnp.asarray(x, dtype) for x in (path.waypoints, times, *law)))


@partial(jax.jit, inline=True)
def _along(
    points: Float[Array, "v j"], times: Float[Array, " e"], breaks: Float[Array, " q+1"], powers: Float[Array, "q d+1"]
) -> Trajectory:
    """Trajectory along points by the law of these breaks and powers."""
    dtype = points.dtype
    # theta = start + turn f(t / T): powers of the law's piece, each by T^-k, times the turn of the edge
    order = jnp.arange(powers.shape[1])
    safe = jnp.where(times > 0, times, 1)
    scale = jax.vmap(lambda duration: duration ** -order.astype(dtype))(safe)
    pieces = jnp.einsum("pk,ek,ej->epkj", powers, scale, jnp.diff(points, axis=0))
    pieces = pieces.at[:, :, 0].add(points[:-1, None])
    # where the edges begin, and the law's breaks within each
    start = jnp.concatenate([jnp.zeros(1, dtype), jnp.cumsum(times)])
    inner = start[:-1, None] + times[:, None] * breaks[None, :-1]
    return Trajectory(jnp.concatenate([inner.ravel(), start[-1:]]), pieces.reshape(inner.size, *pieces.shape[2:]))


def through(path: Path, durations: ArrayLike) -> Trajectory:
    """Trajectory of least jerk through the corners of a path without stopping; it rounds them.

    The integral of the squared third derivatives is least among all motions that pass the waypoints at
    their times and are at rest at both ends. This is another path in shape space, with another net rotation.

    Args:
        path: the waypoints, two or more.
        durations: (edges,) durations between them [s], or one for all; positive.

    Raises:
        ValueError: if a duration is not positive and finite, or there are too many or few.
    """
    _check_path(path)
    times = _durations(durations, path, still=False)
    dtype = common_float(path.waypoints, times)
    points, times = jnp.asarray(path.waypoints, dtype), jnp.asarray(times, dtype)
    breaks = jnp.concatenate([jnp.zeros(1, dtype), jnp.cumsum(times)])
    return Trajectory(breaks, least_jerk(times, points))


def overlap_pieces(
    corners: Array, law: Law, start: Array, length: Array, moves: tuple[tuple[int, int], ...]
) -> Trajectory:
    """Trajectory along a path whose joints move edge by edge, each joint in a time of its own.

    A move is one joint's part in one edge. Moves that overlap in time round the corners. Nothing is checked: moves of
    one joint must follow one another in time.

    Args:
        corners: (v, j) waypoints [rad].
        law: the time law of every move.
        start: (moves,) when each move begins [s].
        length: (moves,) how long it takes [s].
        moves: edge and joint of each move, static.
    """
    edge, joint = np.array(moves).T
    dtype = common_float(corners, start, length)
    corners, start, length = (jnp.asarray(x, dtype) for x in (corners, start, length))
    law = Law(*(jnp.asarray(x, dtype) for x in law))
    turn = (corners[1:] - corners[:-1])[edge, joint]
    # pieces end wherever a piece of any move does
    ends = (start[:, None] + length[:, None] * law.breaks[None]).ravel()
    breaks = jnp.sort(jnp.concatenate([jnp.zeros(1, dtype), ends]))
    middle = 0.5 * (breaks[1:] + breaks[:-1])

    def part(begin: Array, middle: Array, start: Array, length: Array) -> Array:
        """Coefficients of one move's law over one interval, by powers of the time since `begin`."""
        u = (middle - start) / length
        piece = jnp.clip((law.breaks <= u).sum() - 1, 0, law.coefficients.shape[0] - 1)
        powers = shift(law.coefficients[piece], (begin - start) / length - law.breaks[piece])
        constant = jnp.zeros_like(powers).at[0].set(jnp.where(u < 0, 0, 1))
        return jnp.where((u < 0) | (u > 1), constant, powers) * (1 / length) ** jnp.arange(powers.shape[0])

    # the sum of all moves' parts, each onto its joint
    over_moves = jax.vmap(part, (None, None, 0, 0))
    parts = jax.vmap(over_moves, (0, 0, None, None))(breaks[:-1], middle, start, length)
    carrier = jnp.asarray(np.eye(corners.shape[1])[joint], dtype) * turn[:, None]
    coefficients = jnp.einsum("pmk,mj->pkj", parts, carrier)
    return Trajectory(breaks, coefficients.at[:, 0].add(corners[:1]))


def shift(powers: Float[Array, " d+1"], by: Float[Array, ""]) -> Float[Array, " d+1"]:
    """Coefficients of `f(x + by)` from those of `f(x)`, lowest power first."""
    count = powers.shape[0]
    rows = []
    for k in range(count):
        terms = [comb(n, k) * powers[n] * by ** (n - k) for n in range(k, count)]
        rows.append(sum(terms[1:], terms[0]))
    return jnp.stack(rows)


def stretch(trajectory: Trajectory, factor: Float[Array, ""]) -> Trajectory:
    """The same motion, `factor` times as long."""
    powers = trajectory.coefficients.shape[1]
    scale = (1 / jnp.asarray(factor)) ** jnp.arange(powers)
    return Trajectory(trajectory.breaks * factor, trajectory.coefficients * scale[None, :, None])


def join(parts: Sequence[Trajectory]) -> Trajectory:
    """One trajectory after the other; each must begin where the one before it ends."""
    begin = jnp.cumsum(jnp.stack([jnp.zeros_like(parts[0].duration), *(part.duration for part in parts)]))
    breaks = [part.breaks[:-1] + start for part, start in zip(parts, begin[:-1], strict=True)]
    return Trajectory(jnp.concatenate([*breaks, begin[-1:]]), jnp.concatenate([part.coefficients for part in parts]))


def _check_path(path: Path) -> None:
    if not isinstance(path, Path):
        raise ValueError(f"`path` is a {type(path).__name__}; it must be a Path, such as `polygon(waypoints)` makes.")
    if not path.edges:
        raise ValueError("`path` has one waypoint; a motion needs an edge.")


def _durations(durations: ArrayLike, path: Path, *, still: bool = True) -> Array:
    times = as_numbers("durations", durations)
    if times.shape not in ((), (path.edges,)):
        raise ValueError(f"`durations` has shape {times.shape}; it must be one number or ({path.edges},).")
    xp = np if isinstance(times, np.ndarray | np.floating) else jnp
    times = xp.broadcast_to(times, (path.edges,))
    if is_concrete((times, path)):
        moves = (np.diff(np.asarray(path.waypoints), axis=0) != 0).any(1) if still else True
        bad = ~(np.isfinite(times) & ((times > 0) | (~moves & (times >= 0)) if still else times > 0))
        if bad.any():
            edge = int(np.argmax(bad))
            raise ValueError(f"durations[{edge}] is {times[edge]} s; a duration must be positive and finite.")
        most = 1e12 if times.dtype == np.float64 else 1e7
        beyond = (times > most) | ((times > 0) & (times < 1 / most))
        if beyond.any():
            edge = int(np.argmax(beyond))
            raise ValueError(
                f"durations[{edge}] is {times[edge]} s; in {times.dtype} it must be from {1 / most:g} to {most:g} s."
            )
    return times

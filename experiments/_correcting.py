"""Words of manoeuvres A and B for many runs at once, each with a robot of its own: rotations, slopes, corrections."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

import reojax
from reojax._arrays import Array

LIMITS = np.deg2rad([270.0, 120.0])
"""Of twist and bend."""
_CHUNK = 128
_STEPS, _LONGEST = 16, 0.5
"""Gauss-Newton steps of a correction, and the longest change of an amplitude in one, as a share of its limit."""


class Words(NamedTuple):
    """Words of m runs, s slots each; unused slots have amplitudes 0."""

    last: np.ndarray
    """(m, s) the last distal joint's angle per angle of the first: -1 in A, 1 in B."""
    x: np.ndarray
    """(m, s, 2) twist and bend [rad]."""


def corners_of(last: Array, x: Array) -> jax.Array:
    """Corners (5, 3) of one manoeuvre."""
    twist, bend = x[0], x[1]
    rest = jnp.zeros_like(twist)
    rows = [(rest, rest, rest), (rest, bend, rest), (twist, bend, last * twist), (twist, rest, last * twist),
            (rest, rest, rest)]  # fmt: skip
    return jnp.stack([jnp.stack(row) for row in rows])


@jax.jit
def legs(last, x):
    """Corners (m, s, 5, 3) of all manoeuvres."""
    return jax.vmap(jax.vmap(corners_of))(last, x)


def _turn(robot, last, x):
    rotation = reojax.net_rotation(robot, reojax.Path(corners_of(last, x)))
    return rotation, rotation


@jax.jit
def _turns(robots, last, x):
    return jax.vmap(lambda robot, last, x: _turn(robot, last, x)[0])(robots, last, x)


@jax.jit
def _slopes(robots, last, x):
    slopes, turned = jax.vmap(jax.jacfwd(_turn, argnums=2, has_aux=True))(robots, last, x)
    spin = jnp.einsum("mai,majd->mijd", turned, slopes)
    return turned, jnp.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)


def _in_chunks(function, robots, words: Words, used: np.ndarray):
    """A function of robots (c,), last (c,) and amplitudes (c, 2) for the used slots, robots[m] for all slots of m."""
    run, slot = np.nonzero(used)
    parts = []
    for first in range(0, max(len(run), 1), _CHUNK):
        i, j = (np.resize(part[first : first + _CHUNK], _CHUNK) if len(run) else np.zeros(_CHUNK, int)
                for part in (run, slot))  # fmt: skip
        robot = jax.tree.map(lambda leaf, i=i: leaf[i], robots)
        parts.append(jax.tree.map(np.asarray, function(robot, words.last[i, j], words.x[i, j])))
    return run, slot, jax.tree.map(lambda *part: np.concatenate(part)[: len(run)], *parts)


def rotations(robots, words: Words) -> np.ndarray:
    """Net rotation (m, s, 3, 3) of every manoeuvre."""
    turned = np.tile(np.eye(3), (*words.last.shape, 1, 1))
    run, slot, found = _in_chunks(_turns, robots, words, np.asarray((words.x != 0).any(axis=-1)))
    turned[run, slot] = found
    return turned


def along(start: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Orientations (m, s + 1, 3, 3) before and after each of the turns (m, s, 3, 3)."""
    places = [start]
    for slot in range(turns.shape[1]):
        places.append(places[-1] @ turns[:, slot])
    return np.stack(places, axis=1)


def angle_left(now: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Rotation vectors (m, 3) from where it is to the target, base frame."""
    return Rotation.from_matrix(now.swapaxes(-1, -2) @ target).as_rotvec()


class Corrected(NamedTuple):
    """Words with new amplitudes."""

    words: Words
    error: np.ndarray
    """(m,) angle left on the robots that the correction was made for [rad]."""


def correct(robots, words: Words, start: np.ndarray, target: np.ndarray, free: np.ndarray) -> Corrected:
    """Least changes of the free manoeuvres' amplitudes, by Gauss-Newton steps, that end on the targets.

    Args:
        robots: (m,) robots on which the words are to end on the targets.
        words: where the amplitudes start.
        start: (m, 3, 3) orientations before the free manoeuvres.
        target: (m, 3, 3) orientations to end in.
        free: (m, s) manoeuvres still to come; the others are left out.
    """
    x = words.x.copy()
    best, least = x.copy(), np.full(len(x), np.inf)
    going = np.arange(len(x))
    for _ in range(_STEPS):
        rows = Words(words.last[going], x[going])
        turned = np.tile(np.eye(3), (*rows.last.shape, 1, 1))
        slopes = np.zeros((*rows.last.shape, 3, 2))
        some = jax.tree.map(lambda leaf, going=going: leaf[going], robots)
        run, slot, (turned_here, slopes_here) = _in_chunks(_slopes, some, rows, free[going])
        turned[run, slot], slopes[run, slot] = turned_here, slopes_here
        places = along(start[going], turned)
        miss = angle_left(places[:, -1], target[going])
        length = np.linalg.norm(miss, axis=1)
        better = length < least[going]
        best[going[better]], least[going[better]] = rows.x[better], length[better]
        after = places[:, -1].swapaxes(-1, -2)[:, None] @ places[:, 1:]
        jacobian = np.einsum("msab,msbd->masd", after, slopes) * LIMITS
        x[going] = _moved(rows.x / LIMITS, jacobian, miss, free[going]) * LIMITS
        going = going[length > 1e-9]
        if not len(going):
            break
    return Corrected(words._replace(x=best), least)


def _moved(share: np.ndarray, jacobian: np.ndarray, miss: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Amplitudes as shares of their limits after the least step; those that would leave the box go to its edge."""
    moving = np.broadcast_to(free[..., None], share.shape).copy()
    step = np.zeros_like(share)
    for _ in range(4):
        held = np.where(moving, 0.0, step)
        rest = miss - np.einsum("masd,msd->ma", jacobian, held)
        j = np.where(moving[:, None], jacobian, 0.0)
        gram = np.einsum("masd,mbsd->mab", j, j)
        gram += 1e-7 * (1e-3 + np.trace(gram, axis1=1, axis2=2))[:, None, None] * np.eye(3)
        least = np.einsum("masd,ma->msd", j, np.linalg.solve(gram, rest[..., None])[..., 0])
        step = np.where(moving, least, held)
        longest = np.abs(step).max((1, 2), keepdims=True)
        step *= np.minimum(1.0, _LONGEST / np.maximum(longest, 1e-12))
        beyond = np.abs(share + step) > 1
        step = np.where(beyond & moving, np.clip(share + step, -1, 1) - share, step)
        moving &= ~beyond
    return np.clip(share + step, -1, 1)

"""Words of A and B for many runs at once, each with a robot of its own: rotations, estimates, corrections.

What a manoeuvre turns is differentiated once, by the errors of the robot's inertias and by the amplitudes: the first
for the estimate, the second for the correction.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots, so3

LIMITS = np.deg2rad([270.0, 120.0])
"""Of twist and bend."""
SPREAD = 0.1
"""Standard deviation of the logarithm of an inertia."""
NOMINAL = robots.prototype()
LINKS = NOMINAL.mass.shape[0]
_CHUNK = 128
_STEPS, _LONGEST = 16, 0.5
"""Gauss-Newton steps of a correction, and the longest change of an amplitude in one, as a share of its limit."""
_ESTIMATING = 3
"""Gauss-Newton steps of an estimate."""


class Words(NamedTuple):
    """Words of m runs, s slots each; unused slots have amplitudes 0."""

    last: np.ndarray
    """(m, s) the last distal joint's angle per angle of the first: -1 in A, 1 in B."""
    x: np.ndarray
    """(m, s, 2) twist and bend [rad]."""

    @property
    def used(self) -> np.ndarray:
        """(m, s) which slots are used."""
        return (self.x != 0).any(axis=-1)


class Turns(NamedTuple):
    """What the manoeuvres of words do."""

    rotation: np.ndarray
    """(m, s, 3, 3) net rotations."""
    by_robot: np.ndarray
    """(m, s, 3, links) turn of the end, base frame, by the errors of the inertias in standard deviations."""
    by_x: np.ndarray
    """(m, s, 3, 2) the same by twist and bend."""


def _turn(z, last, x):
    robot = NOMINAL.replace(inertia=NOMINAL.inertia * jnp.exp(SPREAD * z)[:, None, None])
    a, b = reojax.manoeuvre_a(x[0], x[1]), reojax.manoeuvre_b(x[0], x[1])
    rotation = reojax.net_rotation(robot, reojax.Path(jnp.where(last < 0, a.waypoints, b.waypoints)))
    return rotation, rotation


@jax.jit
@jax.vmap
def _turn_and_slopes(z, last, x):
    slopes, rotation = jax.jacfwd(_turn, argnums=(0, 2), has_aux=True)(z, last, x)
    spin = jax.vmap(lambda slope: so3.vee(rotation.T @ slope), in_axes=2, out_axes=1)
    return rotation, *map(spin, slopes)


def turns(z: np.ndarray, words: Words) -> Turns:
    """What words (m) do on robots whose inertias are off by `z` (m, links) standard deviations."""
    m, s = words.last.shape
    found = Turns(np.tile(np.eye(3), (m, s, 1, 1)), np.zeros((m, s, 3, LINKS)), np.zeros((m, s, 3, 2)))
    run, slot = np.nonzero(words.used)
    for first in range(0, len(run), _CHUNK):
        take = np.minimum(np.arange(first, first + _CHUNK), len(run) - 1)
        i, j = run[take], slot[take]
        for field, value in zip(found, _turn_and_slopes(z[i], words.last[i, j], words.x[i, j]), strict=True):
            field[i, j] = value
    return found


def along(start: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Orientations (m, s + 1, 3, 3) before and after each of the rotations (m, s, 3, 3)."""
    places = [start]
    for slot in range(rotations.shape[1]):
        places.append(places[-1] @ rotations[:, slot])
    return np.stack(places, axis=1)


def angle_left(now: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3) from where it is to the target, base frame."""
    left = now.swapaxes(-1, -2) @ target
    return Rotation.from_matrix(left.reshape(-1, 3, 3)).as_rotvec().reshape(left.shape[:-1])


def estimate(
    words: Words, measured: np.ndarray, noise: float, start: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Most probable errors of the inertias (m, links), and orientations (m, 3, 3) at the end, from all readings.

    With z the errors in standard deviations, R_k(z) the orientation predicted after manoeuvre k and M_k (m, s, 3, 3)
    the one measured there, `|z|^2 + sum_k |log(R_k(z)^T M_k)|^2 / noise^2` is made least by Gauss-Newton steps
    from z = `start` (0 without one). The orientation is then R(z): early readings sharpen it, as every turn depends
    on the same numbers.
    """
    z = np.zeros((len(measured), LINKS)) if start is None else start
    upright = np.tile(np.eye(3), (len(measured), 1, 1))
    for _ in range(_ESTIMATING):
        found = turns(z, words)
        effect, slopes = np.zeros((len(z), 3, LINKS)), []
        for slot in range(words.last.shape[1]):
            effect = found.rotation[:, slot].swapaxes(1, 2) @ effect + found.by_robot[:, slot]
            slopes.append(effect)
        slope = np.stack(slopes, axis=1) * (words.used[..., None, None] / noise)
        miss = angle_left(along(upright, found.rotation)[:, 1:], measured) / noise
        normal = np.eye(LINKS) + np.einsum("mkan,mkap->mnp", slope, slope)
        z = z + np.linalg.solve(normal, (np.einsum("mkan,mka->mn", slope, miss) - z)[..., None])[..., 0]
    return z, along(upright, turns(z, words).rotation)[:, -1]


def correct(z: np.ndarray, words: Words, start: np.ndarray, target: np.ndarray) -> Words:
    """Words with the least changes of their amplitudes, by Gauss-Newton steps, that end on the targets.

    Args:
        z: (m, links) robots on which the words are to end on the targets.
        words: where the amplitudes start.
        start: (m, 3, 3) orientations before the words.
        target: (m, 3, 3) orientations to end in.
    """
    x = words.x.copy()
    best, least = x.copy(), np.full(len(x), np.inf)
    going = np.arange(len(x))
    for _ in range(_STEPS):
        rows = Words(words.last[going], x[going])
        found = turns(z[going], rows)
        places = along(start[going], found.rotation)
        miss = angle_left(places[:, -1], target[going])
        length = np.linalg.norm(miss, axis=1)
        better = length < least[going]
        best[going[better]], least[going[better]] = rows.x[better], length[better]
        after = places[:, -1].swapaxes(-1, -2)[:, None] @ places[:, 1:]
        jacobian = np.einsum("msab,msbd->masd", after, found.by_x) * LIMITS
        x[going] = _moved(rows.x / LIMITS, jacobian, miss, words.used[going]) * LIMITS
        going = going[length > 1e-9]
        if not len(going):
            break
    return words._replace(x=best)


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

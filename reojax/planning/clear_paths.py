"""Paths that must stay clear of the robot itself: which of many do, proven."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax.collision.clearance import clearances
from reojax.collision.constraint import with_spare
from reojax.collision.path_clearance import PathClearance, least_clearance, look_for
from reojax.mechanics.own_units import without_names
from reojax.robot import Robot

_SAMPLED, _SHARES = 1024, 6
"""Paths that are sampled in one call, and samples of an edge."""
_CALL = 64
"""Paths that are looked at in one call: one shape, one program."""


class Clear(NamedTuple):
    """A robot and the clearance that its paths must keep [m]."""

    robot: Robot
    margin: float
    have: Float[np.ndarray, " p"]
    """What each pair has at the postures that every path passes [m]."""

    def proven(self, paths: Float[np.ndarray, "m v j"], tolerance: float = 1e-4) -> Float[np.ndarray, " m"]:
        """Proven least clearance of each path, within `tolerance` of the true least [m], or the margin."""
        bound = np.asarray(self._look(paths, (tolerance, -np.inf, np.inf)).distance, float)
        short = np.flatnonzero((bound < self.margin) & (bound + tolerance >= self.margin))
        if len(short):
            bound[short] = np.maximum(bound[short], self._enough(paths[short]))
        return bound

    def keeps(self, paths: Float[np.ndarray, "m v j"]) -> np.ndarray:
        """Which paths (m,) are proven to keep the margin; quicker than `proven`."""
        return self._enough(paths) >= self.margin

    def _enough(self, paths: Float[np.ndarray, "m v j"]) -> Float[np.ndarray, " m"]:
        """Lower bounds on the clearance, made sharp only as far as it takes to tell whether the margin is kept [m]."""
        return np.asarray(self._look(paths, look_for(self.margin)).distance, float)

    def with_spare(self, spare: float) -> Float[np.ndarray, " p"]:
        """Clearance to ask of each pair at samples [m], up to `spare` more than the margin."""
        return with_spare(self.margin, spare, self.have)

    def keeps_at_samples(self, paths: Float[np.ndarray, "m v j"]) -> np.ndarray:
        """Which paths (m,) keep the margin at a few samples of each edge: much quicker, and no proof."""
        calls = [np.arange(i, i + _SAMPLED) for i in range(0, len(paths), _SAMPLED)]
        with jax.enable_x64(True):
            robot = without_names(self.robot, shapes=True)
            found = [np.asarray(_least_sample(robot, paths[np.minimum(call, len(paths) - 1)])) for call in calls]
        return np.concatenate(found)[: len(paths)] >= self.margin

    def _look(self, paths: np.ndarray, limits: tuple[float, float, float]) -> PathClearance:
        calls = [np.arange(i, i + _CALL) for i in range(0, len(paths), _CALL)]
        with jax.enable_x64(True):
            robot = without_names(self.robot, shapes=True)
            found = [_least(robot, paths[np.minimum(call, len(paths) - 1)], *limits) for call in calls]
        fields = zip(*found, strict=True)
        return PathClearance(*(np.concatenate([np.asarray(part) for part in field])[: len(paths)] for field in fields))


@jax.jit
def _least_sample(robot: Robot, paths: jax.Array) -> jax.Array:
    """Least clearance at the samples of each path (m,) [m]."""
    share = np.arange(_SHARES)[None, :, None] / _SHARES

    def one(path: jax.Array) -> jax.Array:
        postures = path[:-1, None] + share * (path[1:] - path[:-1])[:, None]
        return clearances(robot, postures.reshape(-1, path.shape[1])).min()

    return jax.lax.map(one, paths, batch_size=16)


@jax.jit
def _least(robot: Robot, paths: jax.Array, *limits: ArrayLike) -> PathClearance:
    return jax.vmap(partial(least_clearance, robot), (0, None, None, None))(paths, *limits)

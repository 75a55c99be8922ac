"""Joint paths replayed without reojax's own integrator: plain momentum equation or Pinocchio, textbook methods."""

import sys
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp
from tqdm import tqdm

import reojax
from reojax import so3

_CHUNK = 32
_STEPS = 32


def magnus(robot: reojax.Robot, paths: np.ndarray, *, progress: str | None = None) -> np.ndarray:
    """Rotations (m, 3, 3) after joint paths (m, v, j): fourth-order Magnus steps, extrapolated from two step sizes."""
    turned = []
    for first in tqdm(range(0, len(paths), _CHUNK), desc=progress, disable=progress is None):
        part = paths[first : first + _CHUNK]
        filled = np.concatenate([part, np.repeat(part[-1:], _CHUNK - len(part), axis=0)])
        turned.append(np.asarray(_extrapolated(robot, jnp.asarray(filled)))[: len(part)])
    return np.concatenate(turned)


@jax.jit
def _extrapolated(robot, paths):
    def of_one(path):
        coarse, fine = _fourth_order(robot, path, _STEPS), _fourth_order(robot, path, 2 * _STEPS)
        return fine @ so3.exp(so3.log(coarse.T @ fine) / 15)

    return jax.vmap(of_one)(paths)


def _fourth_order(robot, path, steps):
    nodes = (np.arange(steps)[:, None] + 0.5 + np.sqrt(3) / 6 * np.array([-1.0, 1.0])) / steps
    change = path[1:] - path[:-1]
    theta = path[:-1, None, None] + nodes[None, :, :, None] * change[:, None, None]
    rate = jnp.broadcast_to(change[:, None, None] / steps, theta.shape)
    flat = theta.reshape(-1, path.shape[1])
    omega = jax.vmap(lambda t, r: reojax.connection(robot, t) @ r)(flat, rate.reshape(flat.shape)).reshape(-1, 2, 3)
    first, second = omega[:, 0], omega[:, 1]
    turns = jax.vmap(so3.exp)(0.5 * (first + second) + np.sqrt(3) / 12 * jnp.cross(first, second))
    return jax.lax.scan(lambda r, turn: (r @ turn, None), jnp.eye(3), turns)[0]


def pinocchio(robot: reojax.Robot, path: np.ndarray) -> np.ndarray:
    """Rotation after one joint path (v, j): Pinocchio's momentum matrix, SciPy's DOP853 edge by edge."""
    sys.path.append(str(Path(__file__).parent.parent / "tests"))
    from oracles import pinocchio_model, pinocchio_momentum, split  # pyright: ignore[reportMissingImports]

    foreign = pinocchio_model(robot)
    rotation = np.eye(3)
    for start, end in zip(path[:-1], path[1:], strict=True):
        if (start != end).any():
            slope = partial(_slope, foreign, pinocchio_momentum, split, start, end - start)
            edge = solve_ivp(slope, (0, 1), rotation.ravel(), method="DOP853", rtol=1e-11, atol=1e-12)
            rotation = edge.y[:, -1].reshape(3, 3)
    return rotation


def _slope(foreign, momentum, split, start, change, s, flat):
    inertia, coupling, _ = split(momentum(foreign, start + s * change, np.zeros(3), np.eye(3)), np.eye(3))
    x, y, z = np.linalg.solve(inertia, coupling @ change)
    return (flat.reshape(3, 3) @ np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])).ravel()


def apart(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Angles (m,) [rad] between rotations that are nearly orthogonal."""
    left = np.einsum("mji,mjk->mik", p, q)
    vector = np.stack([left[:, 2, 1] - left[:, 1, 2], left[:, 0, 2] - left[:, 2, 0], left[:, 1, 0] - left[:, 0, 1]])
    return np.arctan2(np.sqrt((vector**2).sum(0)), np.trace(left, axis1=1, axis2=2) - 1)

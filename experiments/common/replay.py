"""Joint paths replayed without reojax's equations and integrator: momentum summed link by link, textbook methods."""

from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp
from tqdm import tqdm

import reojax
from reojax import interop
from reojax.planning import quaternions

_CHUNK = 64
_STEPS = 48


def replay(robot: reojax.Robot, paths: np.ndarray, *, progress: str | None = None) -> np.ndarray:
    """Rotations (m, 3, 3) after joint paths (m, v, j); edges that several paths have in common are integrated once."""
    ends = np.concatenate([paths[:, :-1], paths[:, 1:]], axis=2)
    edges, which = np.unique(ends.reshape(-1, ends.shape[2]), axis=0, return_inverse=True)
    chunks = [edges[first : first + _CHUNK].T for first in range(0, len(edges), _CHUNK)]
    with ThreadPoolExecutor(2) as pool:
        turns = pool.map(partial(_along, robot), chunks)
        turns = np.concatenate([*tqdm(turns, total=len(chunks), desc=progress, disable=progress is None)], axis=1)
    turned = np.array([1.0, 0, 0, 0])[:, None]
    for edge in np.moveaxis(turns[:, which].reshape(4, *ends.shape[:2]), 2, 0):
        turned = np.stack(quaternions.product(turned, edge))
    return quaternions.to_matrices(turned)


def _along(robot: reojax.Robot, ends: np.ndarray) -> np.ndarray:
    """Quaternions (4, m) along straight edges (2 j, m): Magnus steps of three sizes, extrapolated to eighth order."""
    start, end = np.split(ends, 2)
    s = np.linspace(0, 1, 2 * _STEPS + 1)[:, None]
    change = (end - start)[:, None]
    theta, rate = start[:, None] + s * change, np.broadcast_to(change, (len(start), len(s), start.shape[1]))
    omega = base_rate(robot, theta.reshape(len(start), -1), rate.reshape(len(start), -1)).reshape(3, *theta.shape[1:])
    coarse, middle, fine = (_fourth_order(omega[:, ::k]) for k in (4, 2, 1))
    return _extrapolated(_extrapolated(coarse, middle, 15), _extrapolated(middle, fine, 15), 63)


def base_rate(robot: reojax.Robot, theta: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Angular velocity (3, n) of the base for joint angles and rates (j, n), nothing having momentum at first."""
    nowhere = np.zeros((3, theta.shape[1]))
    turned, origin, spin, speed = [np.tile(np.eye(3)[:, :, None], theta.shape[1])], [nowhere], [nowhere], [nowhere]
    momentum, inertia = nowhere, 0 * turned[0]
    axes, anchors = np.asarray(robot.axis), np.asarray(robot.anchor)
    for k, parent in enumerate(robot.parent):
        axis = axes[k] / np.linalg.norm(axes[k])
        once = _hat(axis).T @ turned[parent]
        arm, hinge = anchors[k] @ turned[parent], axis @ turned[parent]
        turned.append(turned[parent] + np.sin(theta[k]) * once + (1 - np.cos(theta[k])) * (_hat(axis).T @ once))
        origin.append(origin[parent] + arm)
        spin.append(spin[parent] + hinge * rate[k])
        speed.append(speed[parent] + _cross(spin[parent], arm))
        turns = robot.gear_ratio[k] * (1 if robot.rotor_on[k] == "parent" else -1)
        momentum = momentum + robot.rotor_inertia[k] * turns * rate[k] * hinge
    masses, inertias = np.asarray(robot.mass), np.asarray(robot.inertia)
    lever = [com @ r for com, r in zip(np.asarray(robot.com), turned, strict=True)]
    middle = np.einsum("i,ian->an", masses / masses.sum(), np.array(origin) + np.array(lever))
    for i, mass in enumerate(masses):
        from_middle, moving = origin[i] + lever[i] - middle, speed[i] + _cross(spin[i], lever[i])
        half = inertias[i] @ turned[i]
        own = np.einsum("acn,dcn->adn", half, turned[i])
        momentum = momentum + np.einsum("acn,cn->an", own, spin[i]) + mass * _cross(from_middle, moving)
        inertia = inertia + own - mass * from_middle[:, None] * from_middle[None]
        inertia = inertia + mass * (from_middle**2).sum(0) * np.eye(3)[:, :, None]
    a, b, c = inertia
    x, y, z = _cross(b, c), _cross(c, a), _cross(a, b)
    return -(x * momentum[0] + y * momentum[1] + z * momentum[2]) / (a * x).sum(0)


def _hat(v: np.ndarray) -> np.ndarray:
    return np.cross(np.eye(3), v)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _fourth_order(omega: np.ndarray) -> np.ndarray:
    """Quaternions (4, m) of Magnus steps over every second of the points in s = 0..1 at which `omega` is given."""
    first, middle, last = omega[:, :-1:2], omega[:, 1::2], omega[:, 2::2]
    h = 1 / first.shape[1]
    turned = np.array([1.0, 0, 0, 0])[:, None]
    for turn in np.moveaxis(_exp(h / 6 * (first + 4 * middle + last) + h * h / 12 * _cross(first, last)), 1, 0):
        turned = np.stack(quaternions.product(turned, turn))
    return turned


def _exp(vector: np.ndarray) -> np.ndarray:
    half = 0.5 * np.sqrt((vector**2).sum(0))
    return np.concatenate([np.cos(half)[None], 0.5 * np.sinc(half / np.pi) * vector])


def _extrapolated(coarse: np.ndarray, fine: np.ndarray, divisor: int) -> np.ndarray:
    between = np.stack(quaternions.product(quaternions.inverse(coarse), fine))
    return np.stack(quaternions.product(fine, quaternions.power(between, np.array(1 / divisor))))


def pinocchio(robot: reojax.Robot, path: np.ndarray) -> np.ndarray:
    """Rotation after one joint path (v, j): Pinocchio's momentum matrix, SciPy's DOP853 edge by edge."""
    foreign = interop.pinocchio_model(robot)
    rotation = np.eye(3)
    for start, end in zip(path[:-1], path[1:], strict=True):
        if (start != end).any():
            slope = partial(_slope, foreign, start, end - start)
            edge = solve_ivp(slope, (0, 1), rotation.ravel(), method="DOP853", rtol=1e-11, atol=1e-12)
            rotation = edge.y[:, -1].reshape(3, 3)
    return rotation


def _slope(foreign, start, change, s, flat):
    momentum = interop.pinocchio_momentum
    inertia, coupling, _ = interop.split(momentum(foreign, start + s * change, np.zeros(3), np.eye(3)), np.eye(3))
    x, y, z = np.linalg.solve(inertia, coupling @ change)
    return (flat.reshape(3, 3) @ np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])).ravel()


def apart(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Angles (m,) [rad] between rotations that are nearly orthogonal."""
    left = np.einsum("mji,mjk->mik", p, q)
    vector = np.stack([left[:, 2, 1] - left[:, 1, 2], left[:, 0, 2] - left[:, 2, 0], left[:, 1, 0] - left[:, 0, 1]])
    return np.arctan2(np.sqrt((vector**2).sum(0)), np.trace(left, axis1=1, axis2=2) - 1)

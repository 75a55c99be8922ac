"""Families of smooth closed loops: Fourier series and periodic cubic B-splines, inside the joint limits everywhere.

A loop is handed on as the closed polygon through `samples` of its points, which keeps the limits too (they are a box).
Its joint travel is smoothed at joints at rest: |d| of an edge becomes sqrt(d^2 + EPSILON^2) - EPSILON, less than the
true one by at most `samples * joints * EPSILON`.
"""

import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax.design.loops import Loops, limits_of
from reojax.design.variables import Variable
from reojax.path import Path
from reojax.robot import Robot

EPSILON = 1e-4
"""Smoothing of the travel, per joint and edge [rad]."""
_OVERSAMPLING = 16


def fourier_loops(robot: Robot, degree: int, *, samples: int = 64, start: ArrayLike = 0.0, name: str = "loop") -> Loops:
    """Loops `theta_k(s) = start_k + sum over m of a_mk (cos 2 pi m s - 1) + b_mk sin 2 pi m s`, m up to `degree`.

    A trigonometric polynomial of degree M exceeds its largest value at N > 2 M even points by at most the factor
    1 / cos(pi M / N) (H. Ehlich, K. Zeller, Math. Z. 86, 41-44, 1964). So the limits, drawn in to cos(pi / 16) of their
    half width, are asked at 16 M points, and hold everywhere.

    Args:
        robot: its limits are kept.
        degree: highest frequency, at least 1; the loop has `2 * degree` coefficients per joint.
        samples: points of the path.
        start: number or (j,), where the loops begin and end [rad]; within 98 % of the limits.
        name: name of the coefficients.

    Raises:
        ValueError: for a degree or number of samples that is too small, a start outside, or a joint without limits.
    """
    _positive("degree", degree, 1)
    _positive("samples", samples, 2 * degree + 1)
    low, high, origin = limits_of(robot, start)
    middle, half = 0.5 * (low + high), 0.5 * (high - low) * np.cos(np.pi / _OVERSAMPLING)
    if (bad := np.flatnonzero(np.abs(origin - middle) > half)).size:
        raise ValueError(f"start[{bad[0]}] is {origin[bad[0]]:g} rad; that is too near to the joint's limit.")

    def basis(points: int) -> np.ndarray:
        angle = 2 * np.pi * np.outer(np.arange(points) / points, np.arange(1, degree + 1))
        return np.concatenate([np.cos(angle) - 1, np.sin(angle)], axis=1)

    # the limits at many points, within the points of the path
    dense = basis(_OVERSAMPLING * degree)
    bound = np.repeat(half[None], 2 * degree, axis=0).ravel()
    loops = _sample(f"Fourier loop of degree {degree}", robot, origin, basis(samples), np.tile(half, 2 * degree), name)

    def inequality(x: Array) -> Array:
        points = jnp.asarray(dense, x.dtype) @ x.reshape(2 * degree, -1) + jnp.asarray(origin - middle, x.dtype)[None]
        room = jnp.asarray(half, x.dtype)[None]
        return jnp.concatenate([points - room, -points - room]).reshape(-1)

    def random(rng: np.random.Generator, starts: int) -> np.ndarray:
        # coefficients that fall with the frequency, shrunk to what the limits leave
        fall = 1.0 / np.tile(np.arange(1, degree + 1), 2)
        x = rng.uniform(-1, 1, (starts, 2 * degree, robot.joints)) * (fall[:, None] * half)
        size = np.abs(np.einsum("sn,mnj->msj", dense, x)).max(1)
        room = half - np.abs(origin - middle)
        return (x * np.minimum(1, 0.9 * room / size)[:, None]).reshape(starts, -1).clip(-bound, bound)

    return loops._replace(inequality=inequality, random=random)


def spline_loops(robot: Robot, points: int, *, samples: int = 64, start: ArrayLike = 0.0, name: str = "loop") -> Loops:
    """Closed loops by uniform periodic cubic B-splines with `points` control points for every joint.

    All control points are within the limits, so the loop is, everywhere (it lies in their convex hull). That it
    begins at `start` is a linear equality.

    Args:
        robot: its limits are kept.
        points: control points, at least 4.
        samples: points of the path.
        start: number or (j,), where the loops begin and end [rad].
        name: name of the coefficients.

    Raises:
        ValueError: for too few control points or samples, a start outside, or a joint without limits.
    """
    _positive("points", points, 4)
    _positive("samples", samples, points)
    low, high, origin = limits_of(robot, start)
    # distance from each sample to each control point, in intervals, around the loop
    offset = np.arange(samples)[:, None] * points / samples - np.arange(points)[None]
    distance = np.abs((offset + points / 2) % points - points / 2)
    # the cubic B-spline: (4 - 6 d^2 + 3 d^3) / 6 up to 1, (2 - d)^3 / 6 up to 2
    near, far = (4 - 6 * distance**2 + 3 * distance**3) / 6, np.maximum(2 - distance, 0) ** 3 / 6
    weights = np.where(distance < 1, near, far)
    spread = np.repeat(np.maximum(high - origin, origin - low)[None], points, axis=0).ravel()
    loops = _sample(f"spline of {points} points", robot, origin, weights, spread, name)
    lower, upper = np.tile(low - origin, points), np.tile(high - origin, points)

    def equality(x: Array) -> Array:
        return jnp.asarray(weights[0], x.dtype) @ x.reshape(points, -1)

    def random(rng: np.random.Generator, starts: int) -> np.ndarray:
        return rng.uniform(lower, upper, (starts, points * robot.joints))

    return loops._replace(variable=Variable(name, lower, upper, "rad"), equality=equality, random=random)


def _sample(kind: str, robot: Robot, origin: np.ndarray, basis: np.ndarray, bound: np.ndarray, name: str) -> Loops:
    """Loops whose points are `origin + basis @ coefficients`, without further conditions."""

    def shape(x: Array) -> Array:
        return jnp.asarray(basis, x.dtype) @ x.reshape(basis.shape[1], robot.joints)

    def path(x: Array) -> Path:
        first = jnp.asarray(origin, x.dtype)[None]
        return Path(jnp.concatenate([first, shape(x)[1:] + first, first]))

    def travel(x: Array) -> Array:
        # |d| of each edge rounded off, sqrt(d^2 + e^2) - e
        points = shape(x)
        step = points - jnp.roll(points, 1, axis=0)
        return (jnp.sqrt(step * step + EPSILON**2) - EPSILON).sum()

    def nothing(x: Array) -> Array:
        return jnp.zeros(0, x.dtype)

    def without_scale(rng: np.random.Generator, starts: int) -> np.ndarray:
        return np.zeros((starts, basis.shape[1] * robot.joints))

    return Loops(kind, Variable(name, -bound, bound, "rad"), path, travel, nothing, nothing, without_scale)


def _positive(entry: str, value: int, least: int) -> None:
    checks.whole(entry, value, least)

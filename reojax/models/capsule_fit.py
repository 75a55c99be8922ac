"""Capsules that contain solids: in closed form for cylinders, boxes and ellipsoids, by search for clouds of points.

A capsule of radius `rho` with ends at `-+e` on its axis holds a point at height x and distance r from the axis exactly
if `r <= rho` and `|x| <= e + sqrt(rho^2 - r^2)`. Among those that hold everything the one of least volume is taken.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_SPLIT = 0.7
"""Two capsules are taken for one where they have less than this share of its volume."""
_MOST = 4
"""Capsules for one solid."""


class Fit(NamedTuple):
    """A capsule in the solid's frame."""

    start: np.ndarray
    end: np.ndarray
    radius: float

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return float(np.pi * self.radius**2 * (np.linalg.norm(self.end - self.start) + 4 / 3 * self.radius))


def around_cylinder(radius: float, half: float) -> Fit:
    """Capsule round a cylinder along z: its rims lie on the end spheres."""
    ends = half * np.linspace(0, 1, 257)
    rho = np.sqrt(radius**2 + (half - ends) ** 2)
    best = int(np.argmin(rho**2 * (2 * ends + 4 / 3 * rho)))
    return Fit(np.array([0, 0, -ends[best]]), np.array([0, 0, ends[best]]), _up(rho[best]))


def around_ellipsoid(half_axes: np.ndarray) -> Fit:
    """Capsule round an ellipsoid: it touches the tips of the longest axis and the widest section."""
    order = np.argsort(half_axes)
    along = np.zeros(3)
    along[order[2]] = half_axes[order[2]] - half_axes[order[1]]
    return Fit(-along, along, _up(float(half_axes[order[1]])))


def around_box(half: np.ndarray) -> list[Fit]:
    """Parallel capsules round a box, each round a slice of it; more than one where it is flat."""
    long, wide, thin = (int(i) for i in np.argsort(half)[::-1])
    best: list[Fit] = []
    for count in range(1, _MOST + 1):
        slice_ = around_cylinder(float(np.hypot(half[wide] / count, half[thin])), float(half[long]))
        fits = []
        for k in range(count):
            middle = np.zeros(3)
            middle[wide] = half[wide] * ((2 * k + 1) / count - 1)
            along = np.zeros(3)
            along[long] = slice_.end[2]
            fits.append(Fit(middle - along, middle + along, slice_.radius))
        if best and sum(f.volume for f in fits) > _SPLIT * sum(f.volume for f in best):
            break
        best = fits
    return best


def around_points(points: np.ndarray, *, finely: bool = True) -> Fit:
    """Capsule round points (v, 3): the best of several directions; then, finely, turned as long as it shrinks."""
    centred = points - points.mean(0)
    frame = np.linalg.svd(centred.T @ centred)[0].T
    candidates = [_along(points, direction) for direction in (*frame, *np.eye(3))]
    best = min(candidates, key=lambda fit: fit.volume)
    direction, step = _direction(best, frame[0]), 0.2 if finely else 0.0
    while step > 0.02:
        across = np.linalg.svd(direction[None])[2][1:]
        turned = [direction + step * sign * side for side in across for sign in (1, -1)]
        trial = min((_along(points, d / np.linalg.norm(d)) for d in turned), key=lambda fit: fit.volume)
        if trial.volume < best.volume * (1 - 1e-3):
            best, direction = trial, _direction(trial, direction)
        else:
            step /= 2
    return best


def around_mesh(vertices: np.ndarray, faces: np.ndarray) -> list[Fit]:
    """Capsules that hold the surface of a mesh: each face (three of the vertices) lies in one of them."""
    pieces = [(around_points(_corners(vertices, faces), finely=False), faces)]
    while len(pieces) < _MOST:
        largest = max(range(len(pieces)), key=lambda i: pieces[i][0].volume)
        whole, part = pieces[largest]
        halves = [
            [(around_points(_corners(vertices, half), finely=False), half) for half in both]
            for both in _halves(vertices, part)
        ]
        if not halves:
            break
        best = min(halves, key=lambda both: sum(fit.volume for fit, _ in both))
        if sum(fit.volume for fit, _ in best) > _SPLIT * whole.volume:
            break
        pieces[largest : largest + 1] = best
    return [around_points(_corners(vertices, part)) for _, part in pieces]


def _corners(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    return _hull(vertices[np.unique(faces)])


def _halves(vertices: np.ndarray, faces: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Faces on either side of the planes across the principal directions of a surface."""
    middle = vertices[faces].mean(1)
    centred = middle - middle.mean(0)
    found = []
    for direction in np.linalg.svd(centred.T @ centred)[0].T:
        height = centred @ direction
        upper = height > (height.min() + height.max()) / 2
        if upper.any() and not upper.all():
            found.append((faces[upper], faces[~upper]))
    return found


def _along(points: np.ndarray, direction: np.ndarray) -> Fit:
    """Least capsule with a given direction of its axis, which passes through the middle of the shadow's circle."""
    across = np.linalg.svd(direction[None])[2][1:]
    flat, height = points @ across.T, points @ direction
    centre, radius = _circle(flat)
    beside = np.linalg.norm(flat - centre, axis=1)
    radius = max(radius, float(beside.max()))
    best = None
    for rho in radius * np.array([1.0, 1.02, 1.05, 1.1, 1.2, 1.35, 1.6]):
        room = np.sqrt(np.maximum(rho**2 - beside**2, 0))
        low, high = float((height + room).min()), float((height - room).max())
        if low > high:  # one sphere holds all
            low = high = (low + high) / 2
        at = centre @ across
        fit = Fit(at + low * direction, at + high * direction, _up(rho))
        if best is None or fit.volume < best.volume:
            best = fit
    assert best is not None
    return best


def _circle(points: np.ndarray) -> tuple[np.ndarray, float]:
    """A circle round points in the plane, close to the least one (Badoiu and Clarkson 2003)."""
    centre = (points.min(0) + points.max(0)) / 2
    for k in range(1, 25):
        far = points[np.argmax(((points - centre) ** 2).sum(1))]
        centre = centre + (far - centre) / (k + 1) * 0.5
    return centre, float(np.sqrt(((points - centre) ** 2).sum(1).max()))


def _direction(fit: Fit, otherwise: np.ndarray) -> np.ndarray:
    along = fit.end - fit.start
    length = np.linalg.norm(along)
    return along / length if length > 1e-9 * fit.radius else otherwise


def _hull(points: np.ndarray) -> np.ndarray:
    """Corners of the convex hull; all points where they lie in a plane."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return points[ConvexHull(points).vertices]
    except (QhullError, ValueError):
        return points


def hull_volume(points: np.ndarray) -> float:
    """Volume of the convex hull, 0 for points in a plane [m^3]."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return float(ConvexHull(points).volume)
    except (QhullError, ValueError):
        return 0.0


def _up(radius: float) -> float:
    """Rounded up, so that what touches is inside."""
    return float(radius) * (1 + 1e-12)

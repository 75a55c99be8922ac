"""Curvature on the planes of A and B: how well its surface integral predicts what a loop does, and in which frame.

On the plane of a manoeuvre the shape is `theta = bend b + twist t`, and the connection is a pair of vectors, `Gamma_b`
and `Gamma_t`. Seen in a frame `beta(theta)` of the base, `R beta`, they become `beta^T Gamma_i + vee(beta^T d_i beta)`,
the curvature becomes `beta^T F`, and a loop that starts where `beta` is the identity still turns the base by the same
rotation. To first order that rotation is `exp` of the surface integral of `beta^T F`, and what is left grows with the
connection. So the frame in which the connection is smallest, in the mean square over the plane, should predict best
(minimum-perturbation coordinates: R. L. Hatton and H. Choset, IEEE Trans. Robotics 27, 2011, and Eur. Phys. J. Special
Topics 224, 2015, for plane motions; here for rotations in space).
"""

from functools import partial
from typing import Any, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np
from common.types import Array
from jaxtyping import Float
from numpy.polynomial import chebyshev, legendre
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from tqdm import tqdm

import reojax
from reojax import so3
from thesis.grids import ONCE, net

Vectors = Float[np.ndarray, "m 3"]
BATCH = 288
"""Everything runs in batches of one size, so that one compilation serves all."""


class Plane(NamedTuple):
    """Connection and curvature on a plane of shape space, at points (bend, twist)."""

    point: Float[np.ndarray, "m 2"]
    """Bend and twist [rad]."""
    gamma: Float[np.ndarray, "m 3 2"]
    """Connection along bend and along twist, base frame."""
    form: Vectors
    """Curvature F(bend, twist), base frame [rad/rad^2]."""


class Frame(NamedTuple):
    """A frame of the base that depends on the shape: half way between the middle links, and a further turn `exp(v)`."""

    coefficients: Float[np.ndarray, "c 3"]
    """Of v, by the polynomials of `basis`."""
    reach: Float[np.ndarray, "2"]
    """Largest bend and twist, which the polynomials count as one [rad]."""
    degree: int


MIDDLE = Frame(np.zeros((0, 3)), np.ones(2), 0)


def directions(last: float) -> Float[np.ndarray, "3 2"]:
    """Directions of bend and of twist in shape space; `last` is -1 for A and 1 for B."""
    return np.array([[0.0, 1.0], [1.0, 0.0], [0.0, last]])


def plane(robot: reojax.Robot, last: float, points: Float[np.ndarray, "m 2"]) -> Plane:
    """Connection and curvature of a robot at points (bend, twist) of the plane of A or B."""
    batches = np.resize(points, (-(-len(points) // BATCH), BATCH, 2))
    parts = [_local(robot, directions(last), batch) for batch in batches]
    return Plane(points, *(np.concatenate(field)[: len(points)] for field in zip(*parts, strict=True)))


@partial(jax.jit, compiler_options=ONCE)
@partial(jax.vmap, in_axes=(None, None, 0))
def _local(robot: reojax.Robot, across: jax.Array, point: jax.Array) -> tuple:
    theta = across @ point
    form = jnp.einsum("aik,i,k", reojax.curvature(robot, theta), across[:, 0], across[:, 1])
    return reojax.connection(robot, theta) @ across, form


def nodes(bend: float, twist: float) -> tuple[Float[np.ndarray, "m 2"], Float[np.ndarray, " m"]]:
    """Gauss-Legendre points (bend, twist) and weights on the rectangle of a loop."""
    (x, u), (y, v) = legendre.leggauss(12), legendre.leggauss(BATCH // 12)
    points = np.stack(np.meshgrid(bend * (1 + x) / 2, twist * (1 + y) / 2, indexing="ij"), axis=-1)
    return points.reshape(-1, 2), bend * twist / 4 * np.outer(u, v).ravel()


def middle(robot: reojax.Robot, where: Plane) -> Plane:
    """Connection and curvature in the frame half way between the middle links: joint 0 to its end, joint 1 half way."""
    twisting, bending = np.array(robot.axis[:2])
    half = Rotation.from_rotvec(where.point[:, :1] / 2 * bending)
    beta = (Rotation.from_rotvec(where.point[:, 1:] * twisting) * half).as_matrix()
    own = np.stack([np.broadcast_to(bending / 2, where.form.shape), half.apply(twisting, inverse=True)], axis=2)
    return Plane(
        where.point, np.einsum("mab,mai->mbi", beta, where.gamma) + own, np.einsum("mab,ma->mb", beta, where.form)
    )


def basis(point: Float[np.ndarray, "m 2"], reach: np.ndarray, degree: int) -> Float[np.ndarray, "m c 3"]:
    """Chebyshev polynomials up to a total `degree`, less their values at zero; last axis: value, both slopes."""
    terms = [(i, k) for i in range(degree + 1) for k in range(degree + 1 - i)][1:]
    unit = np.eye(degree + 1)

    def one(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return chebyshev.chebval(x, unit), chebyshev.chebval(x, chebyshev.chebder(unit) if degree else unit)

    (first, first_slope), (last, last_slope) = (one(x) for x in (point / reach).T)
    zero = one(np.zeros(1))[0][:, 0]
    columns = [
        (
            first[i] * last[k] - zero[i] * zero[k],
            first_slope[i] * last[k] / reach[0],
            first[i] * last_slope[k] / reach[1],
        )
        for i, k in terms
    ]
    return np.moveaxis(np.reshape(columns, (len(terms), 3, len(point))), 2, 0)


def _turned(v: jax.Array, slope: jax.Array, gamma: jax.Array) -> Array:
    """Connection (3, 2) after a further turn of the frame by `exp(v)`."""
    return so3.exp(v).T @ gamma + so3.left_jacobian(v).T @ slope


_seen = jax.jit(jax.vmap(_turned))
_slopes = jax.jit(jax.vmap(jax.jacfwd(_turned, (0, 1))), compiler_options=ONCE)
_exp = jax.jit(jax.vmap(so3.exp))


def _batched(function, *columns: np.ndarray):
    """Call a function of `BATCH` rows on any number of rows."""
    count = len(columns[0])
    whole = [np.resize(column, (-(-count // BATCH), BATCH, *column.shape[1:])) for column in columns]
    parts = [function(*batch) for batch in zip(*whole, strict=True)]
    return jax.tree.map(lambda *fields: np.concatenate(fields)[:count], *parts)


def seen(robot: reojax.Robot, where: Plane, frame: Frame | None) -> Plane:
    """Connection and curvature in a frame; None is the base frame."""
    if frame is None:
        return where
    where = middle(robot, where)
    if not frame.degree:
        return where
    v = np.einsum("mcd,ca->mad", basis(where.point, frame.reach, frame.degree), frame.coefficients)
    turn = _batched(_exp, v[..., 0])
    gamma = _batched(_seen, v[..., 0], v[..., 1:], where.gamma)
    return Plane(where.point, gamma, np.einsum("mab,ma->mb", turn, where.form))


def smallest(robot: reojax.Robot, where: Plane, weight: np.ndarray, *, degree: int) -> Frame:
    """Frame that makes the connection smallest in the mean square: Gauss-Newton from half way of the middle links."""
    reach = np.abs(where.point).max(0)
    polynomials = basis(where.point, reach, degree)
    gamma = middle(robot, where).gamma
    scale = np.sqrt(weight / weight.sum())

    def turn(x: np.ndarray) -> np.ndarray:
        return np.einsum("mcd,ca->mad", polynomials, x.reshape(-1, 3))

    def residual(x: np.ndarray) -> np.ndarray:
        v = turn(x)
        return (scale[:, None, None] * _batched(_seen, v[..., 0], v[..., 1:], gamma)).ravel()

    def slope(x: np.ndarray) -> np.ndarray:
        v = turn(x)
        by_v, by_slope = _batched(_slopes, v[..., 0], v[..., 1:], gamma)
        whole = np.einsum("mpqa,mc->mpqca", by_v, polynomials[..., 0])
        whole += np.einsum("mpqad,mcd->mpqca", by_slope, polynomials[..., 1:])
        return (scale[:, None, None, None, None] * whole).reshape(-1, x.size)

    start = np.zeros(3 * polynomials.shape[1])
    fit = least_squares(residual, start, jac=cast(Any, slope), method="lm", xtol=1e-10, ftol=1e-12)
    return Frame(fit.x.reshape(-1, 3), reach, degree)


def mean_size(gamma: np.ndarray, weight: np.ndarray) -> float:
    """Root mean square of the connection over a region [rad/rad]."""
    return float(np.sqrt(weight @ (gamma**2).sum((1, 2)) / weight.sum()))


class Map(NamedTuple):
    """Curvature over a plane, in a frame."""

    frame: str
    bend: np.ndarray
    """(b,) [rad]."""
    twist: np.ndarray
    """(t,) [rad]."""
    form: Float[np.ndarray, "t b 3"]
    """F(bend, twist) [rad/rad^2]."""


class Errors(NamedTuple):
    """How well the surface integral predicts loops of several sizes."""

    size: np.ndarray
    """(s,) share of the full amplitudes, 270 and 120 degrees."""
    angle: np.ndarray
    """(s,) of the net rotation [rad]."""
    frames: tuple[str, ...]
    """Names of f frames."""
    miss: np.ndarray
    """(f, s) angle between prediction and net rotation [rad]."""
    mean: dict[str, float]
    """Root mean square of the connection over the largest loop's plane, by frame [rad/rad]."""


NAMES = ("base frame", "between middle links", "minimum perturbation")


def study(robot: reojax.Robot, last: float, sizes: np.ndarray, reach: tuple[float, float], *, quick: bool) -> tuple:
    """Maps of the curvature, and errors of its integral for loops up to `reach` (bend, twist)."""
    points, weight = nodes(*reach)
    whole = plane(robot, last, points)
    frames = dict(zip(NAMES, (None, MIDDLE, smallest(robot, whole, weight, degree=6)), strict=True))
    sides = [np.linspace(0, side, count) for side, count in zip(reach, (13, 19) if quick else (31, 55), strict=True)]
    mesh = plane(robot, last, np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2))
    shape = (len(sides[0]), len(sides[1]), 3)
    bend, twist = sides
    maps = [
        Map(name, bend, twist, seen(robot, mesh, frames[name]).form.reshape(shape).swapaxes(0, 1))
        for name in NAMES[::2]
    ]
    angle, miss = np.zeros(len(sizes)), np.zeros((len(NAMES), len(sizes)))
    for i, size in enumerate(tqdm(sizes, desc="curvature", unit=" loops")):
        points, weights = nodes(size * reach[0], size * reach[1])
        local = plane(robot, last, points)
        corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]) * size * reach @ directions(last).T
        exact = net(robot, reojax.Path(corners))
        angle[i] = exact.magnitude()
        for k, frame in enumerate(frames.values()):
            guess = Rotation.from_rotvec(weights @ seen(robot, local, frame).form)
            miss[k, i] = (guess.inv() * exact).magnitude()
    mean = {name: mean_size(seen(robot, whole, frame).gamma, weight) for name, frame in frames.items()}
    return maps, Errors(sizes, angle, NAMES, miss, mean)

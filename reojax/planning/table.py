"""Net rotations of loops: the true ones, and a table of them that is cheap to read, with derivatives.

A loop has two or three amplitudes, so its rotation is tabulated once over the box of amplitudes, as a quaternion
that is continuous over the box (1 where nothing bends), and read by cubic B-splines. The table decides where to
search; what it finds is then solved on the true rotations.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax._internal.kept import Program
from reojax.manoeuvres import Layout, fold_angles
from reojax.mechanics._fast.parameters import Pattern, pattern_of
from reojax.mechanics.holonomy import DEFAULT_STEPS, _net_rotation, net_rotation, refinement
from reojax.mechanics.own_units import without_names
from reojax.path import polygon
from reojax.planning import quaternions
from reojax.planning.words import AmplitudeBox, last_twist, loop_corners
from reojax.robot import Robot
from reojax.session import usable_cores

_CHUNK = 128
"""Loops per call: one program for any number of them."""
_CELL = 0.16
"""Widest cell of a table [rad], up to `_MOST_NODES`."""
_FEWEST_NODES = {2: 65, 3: 33}
_MOST_NODES = {2: 513, 3: 65}


def true_rotations(
    robot: Robot, layout: Layout, amplitudes: Float[np.ndarray, "3 m"], accuracy: int = 2
) -> Float[np.ndarray, "4 m"]:
    """Quaternions of loops with amplitudes (twist, bend, last twist), feet folded, by `accuracy` times the default
    steps: twice for what is told, once for what is then looked at again."""
    twist, bend, last = amplitudes
    count = twist.shape[0]
    padded = -count % _CHUNK
    corners = np.pad(loop_corners(layout, twist, bend, last), ((0, padded), (0, 0), (0, 0)))
    steps = accuracy * DEFAULT_STEPS * refinement(float(np.abs(amplitudes).max(initial=0.0)))

    pattern = pattern_of(robot)

    def rotations(chunk: np.ndarray) -> np.ndarray:
        with jax.enable_x64(True):  # a thread of its own starts with JAX's default
            return np.asarray(_net_rotations(without_names(robot), chunk, steps, pattern))

    with ThreadPoolExecutor(usable_cores()) as pool:
        turned = list(pool.map(rotations, corners.reshape(-1, _CHUNK, *corners.shape[1:])))
    return quaternions.from_matrices(np.concatenate([np.zeros((0, 3, 3)), *turned])[:count])


@partial(Program, static_argnums=(2, 3))
def _net_rotations(robot: Robot, corners: Array, steps: int, pattern: Pattern) -> Array:
    return jax.vmap(lambda corners: _net_rotation(robot, corners, steps, pattern))(corners)


def fold_rotation(robot: Robot, layout: Layout) -> Float[np.ndarray, "4"]:
    """Quaternion of the rotation while the feet fold; that of the identity if there are none."""
    if layout.fold is None:
        return np.array([1.0, 0, 0, 0])
    path = polygon(np.stack([np.zeros(layout.joints), fold_angles(layout)]))
    return quaternions.from_matrices(np.asarray(net_rotation(robot, path, steps=2 * DEFAULT_STEPS))[None])[:, 0]


class Table(NamedTuple):
    """Rotations of the loops of all letters over the box of their amplitudes."""

    coefficients: Float[Array, "4 letter *node"]
    """Of cubic B-splines on a uniform grid, two more than nodes along each amplitude."""
    low: Float[Array, "letter d"]
    """Amplitudes at the first node [rad]."""
    step: Float[Array, "letter d"]
    """Distance of nodes [rad]."""


def tabulate(robot: Robot, layout: Layout, box: AmplitudeBox) -> Table:
    """Compute the table of a robot's loops over a box."""
    kinds, d = box.low.shape
    widest = (box.high - box.low).max(0)
    counts = [int(np.clip(np.ceil(w / _CELL) + 1, _FEWEST_NODES[d], _MOST_NODES[d])) for w in widest]
    # rotations at the nodes, of signs that do not jump
    values = []
    for kind in range(kinds):
        axes = [np.linspace(a, b, n) for a, b, n in zip(box.low[kind], box.high[kind], counts, strict=True)]
        x = np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")])
        last = last_twist(box.letters, np.full(x.shape[1], kind), x)
        q = true_rotations(robot, layout, np.stack([x[0], x[1], last])).reshape(4, *counts)
        values.append(_continuous(q, int(np.abs(axes[1]).argmin())))
    coefficients = np.stack(values, axis=1)
    # B-splines along one amplitude after the other
    for axis in range(d):
        coefficients = np.moveaxis(_spline(np.moveaxis(coefficients, 2 + axis, 0)), 0, 2 + axis)
    return Table(coefficients, box.low, (box.high - box.low) / (np.array(counts) - 1))


def _continuous(q: np.ndarray, start: int) -> np.ndarray:
    """Choose the sign of quaternions (4, twist, bend, ...) so that they vary continuously from bend node `start`."""
    q = q.copy()
    for way in (1, -1):
        stop = q.shape[2] if way == 1 else -1
        for k in range(start + way, stop, way):
            flip = (q[:, :, k] * q[:, :, k - way]).sum(0) < 0
            q[:, :, k] = np.where(flip, -q[:, :, k], q[:, :, k])
    return q


def _spline(values: np.ndarray) -> np.ndarray:
    """Coefficients (n + 2, ...) of the cubic spline through `values` (n, ...), with not-a-knot ends."""
    n = len(values)
    # (c_i-1 + 4 c_i + c_i+1) / 6 at each node; no jump of the third derivative at the last but one on each side
    matrix = np.zeros((n + 2, n + 2))
    for row in range(n):
        matrix[row, row : row + 3] = np.array([1, 4, 1]) / 6
    matrix[n, :5] = matrix[n + 1, -5:] = [1, -4, 6, -4, 1]
    right = np.concatenate([values.reshape(n, -1), np.zeros((2, values[0].size))])
    return np.linalg.solve(matrix, right).reshape(n + 2, *values.shape[1:])


def read(table: Table, word: Array, x: Array) -> tuple[Array, Array]:
    """Quaternions of loops and their derivatives.

    Args:
        table: the table.
        word: letters, integers of any shape `...`; -1 stands for no loop, the identity.
        x: (d, ...) amplitudes [rad].

    Returns:
        (4, ...) components, and (d, 4, ...) their derivatives by each amplitude.
    """
    kinds, *sizes = table.coefficients.shape[1:]
    letter = jnp.clip(word, 0, kinds - 1)
    index, bases = letter, []
    for axis, size in enumerate(sizes):
        step = table.step[:, axis][letter]
        u = (x[axis] - table.low[:, axis][letter]) / step
        cell = jnp.clip(jnp.floor(u), 0, size - 4)
        bases.append(_basis(u - cell, step))
        index = index * size + cell.astype(index.dtype)
    d = len(sizes)
    strides = [int(np.prod(sizes[axis + 1 :])) for axis in range(d)]
    offsets = np.tensordot(strides, np.indices((4,) * d), 1).astype(index.dtype)
    near = index.reshape(*(1,) * d, *index.shape) + offsets.reshape(*offsets.shape, *(1,) * index.ndim)
    # read once, not again for every sum
    values = jax.lax.optimization_barrier(table.coefficients.reshape(4, -1)[:, near])
    # sums over one amplitude after the other: of the value, and with the slopes of one amplitude each
    sums = [values]
    for axis in reversed(range(d)):
        weights, slopes = bases[axis]
        sums = [*(_sum(part, weights, axis) for part in sums), _sum(sums[0], slopes, axis)]
    value, *slopes = sums
    loop = (word >= 0)[None]
    one = jnp.zeros_like(value).at[0].set(1.0)
    return jnp.where(loop, value, one), jnp.stack([jnp.where(loop, slope, 0.0) for slope in reversed(slopes)])


def _sum(values: Array, weights: Array, axis: int) -> Array:
    """Sum `values` (4, 4, ..., rows) over the four nodes along the amplitude `axis`, written out: rows stay
    side by side, so that this takes half the time of a reduction."""
    before = 1 + axis  # the quaternion's components, and nodes along other amplitudes
    weights = weights.reshape(4, *(1,) * before, *weights.shape[1:])
    terms = [values[(slice(None),) * before + (node,)] * weights[node] for node in range(4)]
    return (terms[0] + terms[1]) + (terms[2] + terms[3])


def _basis(f: Array, step: Array) -> tuple[Array, Array]:
    """Return the four cubic B-splines (4, ...) of a cell at the fraction `f` of it, and their slopes."""
    g = 1 - f
    values = [g**3, 4 - 6 * f * f + 3 * f**3, 4 - 6 * g * g + 3 * g**3, f**3]
    slopes = [-g * g, f * (3 * f - 4), g * (4 - 3 * g), f * f]
    return jnp.stack(values) / 6, jnp.stack(slopes) / (2 * step)[None]

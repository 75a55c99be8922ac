"""The joints between two capsules, and how fast they can move one capsule against the other, in any posture.

Only the joints between the links of a pair move its capsules against each other. Seen from a link in the middle of
that chain, each capsule is moved by the joints of its own side alone.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax.robot import Robot


class Structure(NamedTuple):
    """What of a robot's shapes is static: compiled programs depend on this, not on its names."""

    parent: tuple[int, ...]
    capsule_link: tuple[int, ...]
    pairs: tuple[tuple[int, int], ...]


class Geometry(NamedTuple):
    """What of a robot's shapes is numbers."""

    axis: Float[Array, "j 3"]
    anchor: Float[Array, "j 3"]
    start: Float[Array, "c 3"]
    end: Float[Array, "c 3"]
    radius: Float[Array, " c"]


class Chains(NamedTuple):
    """For each pair: the link it is seen from, and the joints from there to either capsule, padded with -1."""

    frame: np.ndarray
    """(p,) link."""
    joint: np.ndarray
    """(p, 2, m) joints, the one next to the frame's link first."""
    link: np.ndarray
    """(p, 2, m) link on the far side of each."""


def structure_of(robot: Robot) -> Structure:
    """Return the static part of a robot's shapes."""
    return Structure(robot.parent, robot.capsule_link, robot.collision_pairs)


def geometry_of(robot: Robot) -> Geometry:
    """Return the numbers of a robot's shapes, as they are: `unit_axes` makes them fit to compute with."""
    return Geometry(robot.axis, robot.anchor, robot.capsule_start, robot.capsule_end, robot.capsule_radius)


def unit_axes(geometry: Geometry, dtype: np.dtype) -> Geometry:
    """Return the geometry as arrays of one dtype with joint axes of unit length."""
    axis, *others = (jnp.asarray(field, dtype) for field in geometry)
    return Geometry(axis / jnp.sqrt((axis * axis).sum(1, keepdims=True)), *others)


def links_between(parent: tuple[int, ...], first: int, second: int) -> list[int]:
    """Links from one to another along the tree, both included."""

    def to_base(link: int) -> list[int]:
        return [link] if not link else [link, *to_base(parent[link - 1])]

    up, down = to_base(first), to_base(second)
    common = next(link for link in up if link in down)
    return up[: up.index(common)] + down[: down.index(common) + 1][::-1]


@lru_cache(maxsize=64)
def chains_of(structure: Structure) -> Chains:
    """Find the chains of all pairs."""
    sides, frames = [], []
    for pair in structure.pairs:
        # seen from the link in the middle, both sides are short
        chain = links_between(structure.parent, *(structure.capsule_link[c] for c in pair))
        middle = (len(chain) - 1) // 2
        frames.append(chain[middle])
        sides += [_joints(structure.parent, chain[middle::-1]), _joints(structure.parent, chain[middle:])]
    # as arrays, filled up with -1
    longest = max((len(side) for side in sides), default=0)
    joint, link = (
        np.array([[item[k] for item in side] + [-1] * (longest - len(side)) for side in sides], int)
        .reshape(len(frames), 2, longest)
        for k in (0, 1)
    )  # fmt: skip
    return Chains(np.array(frames, int), joint, link)


def _joints(parent: tuple[int, ...], chain: list[int]) -> list[tuple[int, int]]:
    """Joints along a chain of links, each with the link beyond it."""
    steps = zip(chain, chain[1:], strict=False)
    return [(b - 1 if b and parent[b - 1] == a else a - 1, b) for a, b in steps]


def levers(structure: Structure, geometry: Geometry) -> Float[jax.Array, "p 2 m"]:
    """Bound on the distance of a capsule's centre line from the axis of each joint of its chain, in any posture [m].

    For the last joint the distance itself, as its capsule turns about it rigidly; for those before it the distance of
    the next joint from the axis, and from there the lengths along the chain. Padded with 0.
    """
    chains = chains_of(structure)
    pairs, _, longest = chains.joint.shape
    capsule = np.array(structure.pairs, int).reshape(pairs, 2)
    rho: list[jax.Array] = []
    beyond = jnp.zeros((pairs, 2), geometry.axis.dtype)  # reach of the capsule from the next joint
    for m in reversed(range(longest)):
        joint, link = chains.joint[:, :, m], chains.link[:, :, m]
        place = _place(geometry, joint, link)
        axis = geometry.axis[joint]
        # to the next joint, or to both ends of the capsule beyond the last
        following = chains.joint[:, :, m + 1] if m + 1 < longest else np.full_like(joint, -1)
        to_next = _place(geometry, following, link) - place
        ends = [side[capsule] - place for side in (geometry.start, geometry.end)]
        last = following < 0

        def reach(vectors: tuple[Array, Array, Array], last=last, beyond=beyond) -> jax.Array:
            first, second, to_next = map(_length, vectors)
            return jnp.where(last, jnp.maximum(first, second), to_next + beyond)

        # from the axis for this joint, from its place for those before it
        across = [v - (v * axis).sum(-1, keepdims=True) * axis for v in (*ends, to_next)]
        rho.append(jnp.where(joint < 0, 0, reach((across[0], across[1], across[2]))))
        beyond = jnp.where(joint < 0, 0, reach((ends[0], ends[1], to_next)))
    return jnp.stack(rho[::-1], -1) if rho else jnp.zeros((pairs, 2, 0), geometry.axis.dtype)


def moved_per_angle(structure: Structure, geometry: Geometry) -> Float[jax.Array, "p j"]:
    """How far the capsules of each pair move against each other at most, for each radian of each joint [m]."""
    joint = chains_of(structure).joint
    pair = np.broadcast_to(np.arange(len(joint))[:, None, None], joint.shape)
    rho = jnp.where(joint >= 0, levers(structure, geometry), 0)
    return jnp.zeros((len(joint), geometry.axis.shape[0]), rho.dtype).at[pair, np.maximum(joint, 0)].add(rho)


def _place(geometry: Geometry, joint: np.ndarray, link: np.ndarray) -> jax.Array:
    """Position of a joint in the frame of one of the two links that it joins."""
    return jnp.where((link == joint + 1)[..., None], 0, geometry.anchor[joint])


def _length(vectors: Array) -> jax.Array:
    square = (vectors * vectors).sum(-1)
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1)), 0)


def acceleration_bound(structure: Structure, geometry: Geometry, turn: Float[Array, "j e"]) -> Float[jax.Array, "p e"]:
    """Bound on the second derivative of the vector between any two points of a pair, along edges run in unit time [m].

    In the frame of the link that the pair is seen from, a point beyond joints 1, 2, ... at constant rates w_i has

        |x''| <= sum over i of  w_i rho_i (w_i + 2 sum over l < i of w_l),

    as x'' = sum over i of w_i O_i-1 x (e_i x r_i) + w_i e_i x (sum over l >= i of w_l e_l x r_l), r_i from joint i, O
    the angular velocity up to there.

    Args:
        structure: of the robot.
        geometry: of the robot.
        turn: angle that each joint turns by along each edge [rad].
    """
    rho = levers(structure, geometry)
    joint = chains_of(structure).joint
    rate = jnp.where((joint >= 0)[..., None], jnp.abs(turn)[joint], 0)  # (p, 2, m, e)
    before = jnp.cumsum(rate, axis=2) - rate
    return (rate * rho[..., None] * (rate + 2 * before)).sum((1, 2))

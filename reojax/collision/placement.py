"""Where the capsules of all pairs are, at many postures at once."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax.collision.chains import Geometry, Structure, chains_of
from reojax.mechanics._fast.sincos import sincos


class PairEnds(NamedTuple):
    """Ends of the centre lines of each pair's two capsules, components in front, postures last [m]."""

    a0: Float[jax.Array, "3 p s"]
    a1: Float[jax.Array, "3 p s"]
    b0: Float[jax.Array, "3 p s"]
    b1: Float[jax.Array, "3 p s"]


def pair_ends(structure: Structure, geometry: Geometry, theta: Float[Array, "j s"]) -> PairEnds:
    """Place the capsules of all pairs at postures `theta` [rad], in the base frame."""
    return _of_pairs(structure, *_ends(structure, geometry, _link_poses(structure.parent, geometry, theta)))


def pair_ends_from_between(structure: Structure, geometry: Geometry, theta: Float[Array, "j s"]) -> PairEnds:
    """The same, each pair seen from the link of its `chains_of`, between its two."""
    rotation, origin = poses = _link_poses(structure.parent, geometry, theta)
    frame = chains_of(structure).frame
    back, home = rotation[frame], origin[frame].swapaxes(0, 1)  # (p, 3, 3, s), (3, p, s)

    def from_frame(point: jax.Array) -> jax.Array:
        from_home = (point - home).swapaxes(0, 1)
        return (back * from_home[:, :, None]).sum(1).swapaxes(0, 1)

    return PairEnds(*map(from_frame, _of_pairs(structure, *_ends(structure, geometry, poses))))


def _of_pairs(structure: Structure, start: jax.Array, end: jax.Array) -> PairEnds:
    first, second = np.array(structure.pairs, int).reshape(-1, 2).T
    return PairEnds(start[:, first], end[:, first], start[:, second], end[:, second])


def _ends(
    structure: Structure, geometry: Geometry, poses: tuple[jax.Array, jax.Array]
) -> tuple[Float[jax.Array, "3 c s"], Float[jax.Array, "3 c s"]]:
    """Ends of the centre lines of all capsules, base frame."""
    link = np.array(structure.capsule_link, int)
    rotation, origin = (x[link] for x in poses)
    start, end = (
        (origin + (rotation * own[:, None, :, None]).sum(2)).swapaxes(0, 1) for own in (geometry.start, geometry.end)
    )
    return start, end


def _link_poses(
    parent: tuple[int, ...], geometry: Geometry, theta: Float[Array, "j s"]
) -> tuple[Float[jax.Array, "n 3 3 s"], Float[jax.Array, "n 3 s"]]:
    """Orientation and origin of every link's frame in the base frame (Rodrigues, link by link outwards)."""
    theta = jnp.asarray(theta)
    samples = theta.shape[1]
    rotation = [jnp.broadcast_to(jnp.eye(3, dtype=theta.dtype)[:, :, None], (3, 3, samples))]
    origin = [jnp.zeros((3, samples), theta.dtype)]
    if parent:
        # Rodrigues: e e^T + cos (1 - e e^T) + sin hat(e)
        sine, cosine = sincos(theta)
        e = geometry.axis
        x, y, z = e[:, 0], e[:, 1], e[:, 2]
        hat = jnp.stack([jnp.stack(row, -1) for row in ((0 * x, -z, y), (z, 0 * x, -x), (-y, x, 0 * x))], 1)
        along = e[:, :, None] * e[:, None, :]
        across = jnp.eye(3, dtype=e.dtype)[None] - along
        turn = along[..., None] + cosine[:, None, None] * across[..., None] + sine[:, None, None] * hat[..., None]
        # p_k = p_parent + R_parent anchor,  R_k = R_parent turn
        for k, p in enumerate(parent):
            origin.append(origin[p] + (rotation[p] * geometry.anchor[k][None, :, None]).sum(1))
            rotation.append((rotation[p][:, :, None] * turn[k][None]).sum(1) if p else turn[k])
    return jnp.stack(rotation), jnp.stack(origin)

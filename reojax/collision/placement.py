"""Where the capsules of all pairs are, each pair seen from a link between its two, at many postures at once."""

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
    """Place the capsules of all pairs at postures `theta` [rad], each pair in the frame of `chains_of`."""
    rotation, origin = _link_poses(structure.parent, geometry, jnp.asarray(theta))
    capsules = np.array(structure.pairs, int).reshape(-1, 2)
    link = np.array(structure.capsule_link, int)[capsules]
    frame = chains_of(structure).frame
    back, home = rotation[frame], origin[frame]  # (p, 3, 3, s), (p, 3, s)
    ends = []
    for side in (0, 1):
        turned, place = rotation[link[:, side]], origin[link[:, side]]
        for point in (geometry.start, geometry.end):
            own = point[capsules[:, side]]
            seen = place + (turned * own[:, None, :, None]).sum(2) - home
            ends.append((back * seen[:, :, None]).sum(1).swapaxes(0, 1))
    return PairEnds(*ends)


def _link_poses(
    parent: tuple[int, ...], geometry: Geometry, theta: Float[jax.Array, "j s"]
) -> tuple[Float[jax.Array, "n 3 3 s"], Float[jax.Array, "n 3 s"]]:
    """Orientation and origin of every link's frame in the base frame (Rodrigues, link by link outwards)."""
    samples = theta.shape[1]
    rotation = [jnp.broadcast_to(jnp.eye(3, dtype=theta.dtype)[:, :, None], (3, 3, samples))]
    origin = [jnp.zeros((3, samples), theta.dtype)]
    if parent:
        sine, cosine = sincos(theta)
        e = geometry.axis
        x, y, z = e[:, 0], e[:, 1], e[:, 2]
        hat = jnp.stack([jnp.stack(row, -1) for row in ((0 * x, -z, y), (z, 0 * x, -x), (-y, x, 0 * x))], 1)
        along = e[:, :, None] * e[:, None, :]
        across = jnp.eye(3, dtype=e.dtype)[None] - along
        turn = along[..., None] + cosine[:, None, None] * across[..., None] + sine[:, None, None] * hat[..., None]
        for k, p in enumerate(parent):
            origin.append(origin[p] + (rotation[p] * geometry.anchor[k][None, :, None]).sum(1))
            rotation.append((rotation[p][:, :, None] * turn[k][None]).sum(1) if p else turn[k])
    return jnp.stack(rotation), jnp.stack(origin)

"""Chains of uniform rods that move in one plane: robots with answers in closed form."""

import numpy as np
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import as_numbers
from reojax.capsules import Capsule
from reojax.robot import Robot, make_robot

_THICKNESS = 1e-2
"""Inertia of a rod about its length over that across it (chosen; it plays no part in the plane)."""


def planar(n: int, *, mass: ArrayLike = 1.0, length: ArrayLike = 1.0) -> Robot:
    """Build `n` uniform rods end to end, straight along x at `theta = 0`, every joint about z.

    The base turns about z only (call it yaw; x is roll, y pitch). Base frame: origin at the free end of rod 0. Rod i
    has inertia `mass * length^2 / 12` about y and z, exactly. Its capsule has the radius of a thin cylinder with its
    inertia about x, and ends on the joints. No motors' rotors, no joint limits. All numbers chosen.

    Args:
        n: number of rods, at least 2.
        mass: mass of every rod, or (n,) [kg].
        length: length of every rod, or (n,) [m].

    Raises:
        ValueError: if `n` is not an integer from 2 up, or a mass or length is not positive.
    """
    checks.whole("n", n, 2, 10**4)
    masses, lengths = _per_rod("mass", mass, n), _per_rod("length", length, n)
    along_x = lengths[:, None] * np.array([1.0, 0.0, 0.0])
    across = masses * lengths**2 / 12
    return make_robot(
        mass=masses,
        com=along_x / 2,
        inertia=across[:, None, None] * np.diag([_THICKNESS, 1.0, 1.0]),
        axis=[(0, 0, 1)] * (n - 1),
        anchor=along_x[:-1],
        capsules=[
            Capsule(i, np.zeros(3), end, length * np.sqrt(_THICKNESS / 6))
            for i, (end, length) in enumerate(zip(along_x, lengths, strict=True))
        ],
        name=f"planar{n}",
    )


def _per_rod(entry: str, value: ArrayLike, n: int) -> np.ndarray:
    array = np.asarray(as_numbers(entry, value), float)
    if array.shape not in ((), (n,)):
        raise ValueError(f"`{entry}` has shape {array.shape}; it must be one number or ({n},).")
    if not (np.isfinite(array) & (array > 0)).all():
        raise ValueError(f"`{entry}` is {checks.shorten(array.tolist())}; it must be positive and finite.")
    return np.broadcast_to(array, (n,))

"""Random robots that could be built: each link is a cloud of point masses, so its numbers go together."""

from typing import Any

import numpy as np

from reojax.robot import Robot, make_robot


def random_unit(rng: np.random.Generator, count: int) -> np.ndarray:
    """`count` uniformly random unit vectors, (count, 3)."""
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def random_link(rng: np.random.Generator) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre of mass and inertia about it of a cloud of eight point masses about 0.2 m wide."""
    mass = rng.uniform(0.05, 0.3, 8)
    point = rng.normal(size=(8, 3)) * rng.uniform(0.05, 0.12, 3) + 0.1 * rng.normal(size=3)
    com = mass @ point / mass.sum()
    arm = point - com
    inertia = np.einsum("i,ij,ij->", mass, arm, arm) * np.eye(3) - np.einsum("i,ij,ik->jk", mass, arm, arm)
    return mass.sum(), com, inertia


def random_robot(
    seed: int,
    joints: int,
    *,
    branched: bool = False,
    rotors: bool = True,
    limits: tuple[float, float] | None = None,
) -> Robot:
    """A random robot of `joints` joints, the same for the same arguments.

    Args:
        seed: seed of all its numbers.
        joints: number of joints, 0 or more.
        branched: hang each link on a random earlier one; default one serial chain.
        rotors: give the motors heavy rotors with ratios up to +-50, stators on random sides, and the
            last of three or more joints none; default. Each rotor's inertia is under 1 % of its
            stator link's, of which it is a part, so the link without it is a rigid body too.
        limits: lower and upper limit of every joint [rad]; default none.
    """
    rng = np.random.default_rng([seed, joints])
    links = [random_link(rng) for _ in range(joints + 1)]
    parent = [int(rng.integers(k + 1)) for k in range(joints)] if branched else list(range(joints))
    side: list[Any] = [str(s) for s in rng.choice(["parent", "child"], joints)] if rotors else ["parent"] * joints
    rotor = np.zeros(joints)
    if rotors:
        stator = [p if s == "parent" else k + 1 for k, (p, s) in enumerate(zip(parent, side, strict=True))]
        least = [np.linalg.eigvalsh(links[i][2])[0] for i in stator]
        rotor = rng.uniform(0.002, 0.008, joints) * least
        rotor[2:][-1:] = 0.0
    return make_robot(
        mass=[mass for mass, _, _ in links],
        com=[com for _, com, _ in links],
        inertia=[inertia for _, _, inertia in links],
        axis=random_unit(rng, joints),
        anchor=rng.normal(size=(joints, 3)) * 0.15,
        parent=parent,
        rotor_inertia=rotor,
        gear_ratio=rng.uniform(5, 50, joints) * rng.choice([-1.0, 1.0], joints),
        rotor_on=side,
        lower=None if limits is None else np.full(joints, limits[0]),
        upper=None if limits is None else np.full(joints, limits[1]),
        name="random",
    )

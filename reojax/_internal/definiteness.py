"""Is a robot's kinetic energy positive for every motion? Plain NumPy, at the door of `make_robot`.

The energy at zero linear momentum is `1/2 [omega, theta_dot] . M [omega, theta_dot]`. `M` (3 + j) is positive definite
exactly if the locked inertia `A` is (its first three rows and columns) and the joint inertia `D - B^T A^-1 B` is (its
Schur complement). Massless links, point masses and thin rods are legal as long as it is.
"""

from typing import Any

import numpy as np

_LEAST = 1e-11
"""Least eigenvalue of the scaled energy matrix that is told from rounding."""


def energy_matrix(fields: dict[str, Any], theta: np.ndarray) -> np.ndarray:
    """`M` (3 + j, 3 + j) of a robot's fields at joint angles `theta`, base frame [kg m^2]."""
    links, joints = len(fields["mass"]), len(fields["parent"])
    rotation, origin = [np.eye(3)], [np.zeros(3)]
    turn = [np.hstack([np.eye(3), np.zeros((3, joints))])]  # angular velocity of each link per [omega, theta_dot]
    moved: list[list[tuple[np.ndarray, np.ndarray, int]]] = [[]]
    for k, p in enumerate(fields["parent"]):
        axis = rotation[p] @ fields["axis"][k]
        rotation.append(rotation[p] @ turn_about(fields["axis"][k], theta[k]))
        origin.append(origin[p] + rotation[p] @ fields["anchor"][k])
        spun = turn[p].copy()
        spun[:, 3 + k] += axis
        turn.append(spun)
        moved.append([*moved[p], (axis, origin[-1], 3 + k)])
    centre = np.array([o + r @ c for o, r, c in zip(origin, rotation, fields["com"], strict=True)])
    centre -= fields["mass"] @ centre / fields["mass"].sum()
    shift = np.zeros((links, 3, 3 + joints))  # linear velocity of each centre of mass
    for i in range(links):
        shift[i, :, :3] = -cross_matrix(centre[i])
        for axis, point, column in moved[i]:
            arm = origin[i] + rotation[i] @ fields["com"][i] - point
            shift[i, :, column] = np.cross(axis, arm)
    shift -= np.einsum("i,iac->ac", fields["mass"], shift) / fields["mass"].sum()
    matrix = np.einsum("i,iac,iad->cd", fields["mass"], shift, shift)
    for i in range(links):
        matrix += turn[i].T @ rotation[i] @ fields["inertia"][i] @ rotation[i].T @ turn[i]
    for k, p in enumerate(fields["parent"]):  # each rotor spins relative to its stator's link
        on_parent = fields["rotor_on"][k] == "parent"
        spin = fields["gear_ratio"][k] * (1.0 if on_parent else -1.0)
        along = (rotation[p] @ fields["axis"][k]) @ turn[p if on_parent else k + 1]
        matrix[3 + k] += fields["rotor_inertia"][k] * spin * along
        matrix[:, 3 + k] += fields["rotor_inertia"][k] * spin * along
        matrix[3 + k, 3 + k] += fields["rotor_inertia"][k] * spin**2
    return matrix


def check_energy(fields: dict[str, Any]) -> tuple[str, ...]:
    """Refuse a robot that has a motion without kinetic energy at generic postures; return notes on `theta = 0`.

    Raises:
        ValueError: naming the joints, or the directions of the base, that such a motion moves.
    """
    joints = len(fields["parent"])
    rng = np.random.default_rng(0)
    for _ in range(3):
        if (culprit := _weakest(fields, rng.uniform(-1.3, 1.3, joints))) is not None:
            raise ValueError(
                f"the kinetic energy of {fields['name']!r:.60} is not positive for a motion of {culprit}: the links "
                "that it moves have no inertia against it, or a rotor has more than its link; massless links, point "
                "masses and thin rods are legal only where the rest of the robot makes up for them."
            )
    if (culprit := _weakest(fields, np.zeros(joints))) is not None:
        return (f"at theta = 0 the kinetic energy is not positive for a motion of {culprit}: start elsewhere",)
    return ()


def _weakest(fields: dict[str, Any], theta: np.ndarray) -> str | None:
    """What moves in the motion of least energy, where that energy is not positive."""
    with np.errstate(over="ignore", invalid="ignore"):
        matrix = energy_matrix(fields, theta)
    if not np.isfinite(matrix).all():
        raise ValueError(
            f"masses, lengths or inertias of {fields['name']!r:.60} are so large that its kinetic energy is no number."
        )
    size = np.diag(matrix).copy()
    names = [f"the base about {axis}" for axis in "xyz"] + [f"joint {name!r:.60}" for name in fields["joint_names"]]
    largest = size.max(initial=0.0)
    empty = np.flatnonzero(size <= 1e-200 + 1e-15 * largest * (size <= 0))
    if len(empty):
        return ", ".join(names[i] for i in empty[:4])
    scale = 1 / np.sqrt(size)
    value, vector = np.linalg.eigh(matrix * scale[:, None] * scale)
    if value[0] > _LEAST:
        return None
    part = np.abs(vector[:, 0])
    return ", ".join(names[i] for i in np.flatnonzero(part > 0.3 * part.max())[:4])


def turn_about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation by `angle` about the unit vector `axis` (Rodrigues)."""
    across = cross_matrix(axis)
    return np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across


def cross_matrix(v: np.ndarray) -> np.ndarray:
    """The matrix whose product with `u` is `v x u`."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0.0]])

"""The thesis's equations for a serial robot as it prints them (1.5 and 2.5): slow, plain, in NumPy.

The thesis numbers links 1..n and joints 1..n-1; lists here start at 0, so its link i is `[i - 1]`.
`r_i` and `l_i` run from link i's centre of mass to its outboard and its inboard joint. It puts motor
rotors into the momentum as spins about the joint axes (2.5). Nothing here knows reojax's formulas.
"""

import numpy as np

from reojax import Robot


def rotation_about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation by `angle` [rad] about the unit vector `axis`."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def momentum(robot: Robot, theta: np.ndarray, theta_dot: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Angular momentum h about the centre of mass, in the base frame, of a serial robot (thesis 1.5, 2.5)."""
    n = robot.links
    assert robot.parent == tuple(range(n - 1)), "the barycentric equations are for one chain"
    orientation = [np.eye(3)]
    for k in range(n - 1):
        orientation.append(orientation[k] @ rotation_about(robot.axis[k], theta[k]))
    e = [orientation[k] @ robot.axis[k] for k in range(n - 1)]
    m, M = robot.mass, robot.mass.sum()
    inertia = [Q @ robot.inertia[i] @ Q.T for i, Q in enumerate(orientation)]

    # From each centre of mass to the outboard joint (none on link n) and to the inboard one (none on link 1).
    r = [orientation[i] @ (robot.anchor[i] - robot.com[i]) for i in range(n - 1)] + [np.zeros(3)]
    l = [np.zeros(3)] + [orientation[i] @ -robot.com[i] for i in range(1, n)]

    # Thesis 1.5: mu_1 = 0, mu_i = sum of m_k / M over k < i, mu_(n+1) = 1.
    mu = [m[:i].sum() / M for i in range(n + 1)]
    # Barycentric vectors: c_i = l_i mu_i + r_i (1 - mu_(i+1));
    # c*_i = -c_i, r*_i = r_i - c_i, l*_i = l_i - c_i.
    c = [l[i] * mu[i] + r[i] * (1 - mu[i + 1]) for i in range(n)]
    c_star = [-c[i] for i in range(n)]
    r_star = [r[i] - c[i] for i in range(n)]
    l_star = [l[i] - c[i] for i in range(n)]

    def b(k: int, i: int) -> np.ndarray:
        """b_ki: l*_k for k > i, c*_k for k = i, r*_k for k < i."""
        return l_star[k] if k > i else c_star[k] if k == i else r_star[k]

    # w_i = w_(i-1) + e_(i-1) theta_dot_(i-1).
    w = [omega]
    for k in range(n - 1):
        w.append(w[k] + e[k] * theta_dot[k])
    # Centres of mass from the robot's own: r_i = sum_k b_ki; and v_i = sum_k w_k x b_ki.
    position = [sum(b(k, i) for k in range(n)) for i in range(n)]
    velocity = [sum(np.cross(w[k], b(k, i)) for k in range(n)) for i in range(n)]

    # h = sum (I_i w_i + m_i r_i x v_i), and the rotors' spins relative to their links (2.5).
    h = sum(inertia[i] @ w[i] + m[i] * np.cross(position[i], velocity[i]) for i in range(n))
    for k in range(n - 1):
        direction = 1 if robot.rotor_on[k] == "parent" else -1
        h = h + direction * robot.rotor_inertia[k] * robot.gear_ratio[k] * theta_dot[k] * e[k]
    return h


def momentum_matrices(robot: Robot, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`A` and `B` of `A w_1 = B theta_dot` (thesis eq. 2.14), collected from h one unit rate at a time."""
    still, rest = np.zeros(robot.joints), np.zeros(3)
    A = np.stack([momentum(robot, theta, still, unit) for unit in np.eye(3)], axis=1)
    B = [-momentum(robot, theta, unit, rest) for unit in np.eye(robot.joints)]
    return A, np.stack(B, axis=1) if B else np.zeros((3, 0))

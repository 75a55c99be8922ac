"""Somersaults and spinning satellites: what is exact, and what other integrators say."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import reojax
from reojax import robots, so3


def held(robot, theta, seconds: float, pieces: int = 12) -> reojax.Trajectory:
    """Joints that stay where they are."""
    coefficients = np.zeros((pieces, 1, robot.joints)) + np.asarray(theta)
    return reojax.Trajectory(np.linspace(0, seconds, pieces + 1), coefficients)


def twist_angle(rotation: np.ndarray, about: np.ndarray) -> np.ndarray:
    """Turn of the body about its long axis z (m,), counted on from where it began.

    The long axis goes round `about`; the body's x is measured from their common normal.
    """
    long = rotation[:, :, 2]
    normal = np.cross(about, long)
    return -np.unwrap(np.arctan2((rotation[:, :, 1] * normal).sum(1), (rotation[:, :, 0] * normal).sum(1)))


def test_tilt_and_twist_of_an_axisymmetric_body():
    """Somersault at H / I_t about H, twist at H sin(tau) (1/I_a - 1/I_t) about the long axis: exact, torque-free."""
    axial, transverse = 0.8, 11.0
    robot = reojax.make_robot(
        mass=[60.0, 1e-9],
        com=np.zeros((2, 3)),
        inertia=[np.diag([transverse, transverse, axial]), 1e-12 * np.eye(3)],
        axis=[(1, 0, 0)],
        anchor=np.zeros((1, 3)),
        rotor_inertia=[0.0],
        gear_ratio=[1.0],
    )
    tilt, size, seconds = 0.2, 60.0, 1.7
    momentum = size * np.array([0.0, np.cos(tilt), np.sin(tilt)])  # long axis out of the plane across it by the tilt
    motion = reojax.simulate(robot, held(robot, [0.0], seconds), momentum=momentum, samples=16)
    time = np.asarray(motion.time)
    somersault = np.array([so3.exp(jnp.asarray(momentum / transverse * t)) for t in time])
    rate = size * np.sin(tilt) * (1 / axial - 1 / transverse)
    twist = np.array([so3.exp(jnp.asarray([0, 0, rate * t])) for t in time])
    assert np.abs(np.asarray(motion.rotation) - somersault @ twist).max() < 1e-8
    turned = twist_angle(np.asarray(motion.rotation), momentum / size)
    np.testing.assert_allclose(turned - turned[0], rate * time, atol=1e-7)


def thrown(robot) -> tuple[reojax.Trajectory, np.ndarray]:
    """From arms stretched sideways: the left one up, the right one down, in a quarter of a second, then held."""
    names = list(robot.joint_names)
    first, last = np.zeros(robot.joints), np.zeros(robot.joints)
    for side, angle in (("left", 2.05), ("right", 0.0)):
        k = names.index(f"{side}_shoulder_abduction")
        first[k], last[k] = 1.5, angle
    there = reojax.along(reojax.polygon(np.stack([first, last])), "quintic", np.array([0.25]))
    rest = np.zeros((12, 6, robot.joints))
    rest[:, 0] = last
    breaks = np.concatenate([np.asarray(there.breaks), 0.25 + np.arange(1, 13) / 12])
    return reojax.Trajectory(breaks, np.concatenate([np.asarray(there.coefficients), rest])), last


def test_a_divers_arms_make_the_twist():
    """Without the throw a somersault has no twist; with it there are twists, as many as Euler's equations count."""
    robot = robots.astronaut()
    trajectory, last = thrown(robot)
    first = np.asarray(trajectory.at(0.0).theta)
    A = np.asarray(reojax.momentum_matrices(robot, first).A)
    momentum = A @ [0.0, 8.0, 0.0]  # a forward somersault: the body is mirror-symmetric, so this is about y alone
    plain = reojax.simulate(robot, held(robot, first, 1.25), momentum=momentum, samples=16)
    size = np.linalg.norm(momentum)
    still = twist_angle(np.asarray(plain.rotation), momentum / size)
    assert np.ptp(still) < 1e-6
    motion = reojax.simulate(robot, trajectory, momentum=momentum, samples=32)
    rotation, time = np.asarray(motion.rotation), np.asarray(motion.time)
    begin = int(np.argmin(np.abs(time - 0.25)))
    turned = twist_angle(rotation, momentum / size)
    twists = abs(turned[-1] - turned[begin]) / (2 * np.pi)
    assert twists > 0.5
    # rigid from there on: Euler's equations by SciPy, from the same orientation
    inertia = np.asarray(reojax.momentum_matrices(robot, last).A)

    def slope(_, flat):
        r = flat.reshape(3, 3)
        x, y, z = np.linalg.solve(inertia, r.T @ momentum)
        return (r @ np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])).ravel()

    span = (time[begin], time[-1])
    known = solve_ivp(slope, span, rotation[begin].ravel(), method="DOP853", rtol=1e-11, atol=1e-12)
    assert np.abs(known.y[:, -1].reshape(3, 3) - rotation[-1]).max() < 1e-6
    # the relation of the axisymmetric body, with the mean of the transverse inertias: right to a fifth
    values, vectors = np.linalg.eigh(inertia)
    axial, transverse = values[0], values[1:].mean()
    sine = abs(vectors[:, 0] @ rotation[begin].T @ momentum) / size
    expected = size * sine * (1 / axial - 1 / transverse) * (span[1] - span[0]) / (2 * np.pi)
    assert abs(twists - expected) < 0.2 * expected


@pytest.mark.slow
def test_a_satellite_ends_in_a_spin_without_nutation():
    """The arm brings a principal axis of its end posture along the momentum: from there on the spin is steady."""
    robot = robots.satellite_arm()
    end = np.array([0.0, 0.9, 0.0, 1.2, 0.0, -0.8, 0.0])
    inertia = np.asarray(reojax.momentum_matrices(robot, end).A)
    values, vectors = np.linalg.eigh(inertia)
    momentum = np.asarray(reojax.momentum_matrices(robot, np.zeros(7)).A) @ [0.02, 0.01, 0.03]
    size, seconds = np.linalg.norm(momentum), 20.0
    drift = np.asarray(reojax.simulate(robot, held(robot, np.zeros(7), seconds), momentum=momentum).rotation[-1])
    goals = []
    for axis in (*vectors.T, *-vectors.T):  # the least turn from where it drifts that puts the axis along the momentum
        now, wanted = drift @ axis, momentum / size
        cross = np.cross(now, wanted)
        angle = np.arctan2(np.linalg.norm(cross), now @ wanted)
        goals.append((angle, np.asarray(so3.exp(jnp.asarray(cross / np.linalg.norm(cross) * angle))) @ drift, axis))
    angle, goal, axis = min(goals, key=lambda g: g[0])
    found = reojax.righting(robot, goal, momentum=momentum, duration=seconds, end=end, pieces=6)
    assert found.converged
    number = int(np.argmax(np.abs(vectors.T @ axis)))
    assert abs(np.linalg.norm(found.omega) - size / values[number]) < 1e-6
    after = reojax.simulate(robot, held(robot, end, 200.0), momentum=found.rotation.T @ momentum)
    spin = np.asarray(after.omega)
    np.testing.assert_allclose(spin, np.tile(spin[0], (len(spin), 1)), atol=1e-6)

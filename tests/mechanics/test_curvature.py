"""Curvature of the local connection: what small loops do, and the laws of every connection."""

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import reojax
from reojax import polygon, robots, so3
from reojax.robots.random import random_robot

ROBOT = random_robot(3, 3)
THETA = np.array([0.7, -0.4, 1.1])
curved = jax.jit(reojax.curvature)
connected = jax.jit(reojax.connection)


def slope(function, theta=THETA, step=2e-3) -> np.ndarray:
    """Derivatives by the joint angles, on a new last axis: central differences of fourth order."""

    def along(i):
        near, far = np.eye(3)[i] * step, np.eye(3)[i] * 2 * step
        inner, outer = function(theta + near) - function(theta - near), function(theta + far) - function(theta - far)
        return (8 * inner - outer) / (12 * step)

    return np.stack([along(i) for i in range(3)], axis=-1)


def test_a_small_rectangle_turns_the_base_by_its_area_times_the_curvature():
    """Joint i first, then k: the net rotation, measured by the integrator, tends to exp(a b F[:, i, k])."""
    exact = np.asarray(curved(ROBOT, THETA))
    miss = []
    for size in (0.02, 0.01):
        side = np.eye(3) * [size, 0.7 * size, -0.8 * size]
        for i, k in ((0, 1), (0, 2), (1, 2), (2, 0)):
            corners = THETA + np.array([0 * side[i], side[i], side[i] + side[k], side[k], 0 * side[i]])
            turn = np.asarray(so3.log(reojax.net_rotation(ROBOT, polygon(corners))))
            area = side[i, i] * side[k, k]
            miss.append(np.abs(turn / area - exact[:, i, k]).max())
    coarse, fine = np.reshape(miss, (2, 4))
    assert np.abs(exact).max() > 0.1
    assert (fine < 0.02).all()
    np.testing.assert_allclose(coarse / fine, 2, rtol=0.2)  # third order is left


def test_antisymmetric_and_bianchi():
    """F_ik = -F_ki, and the covariant derivatives d_i F_kl + Gamma_i x F_kl, cyclic, add up to zero."""
    exact, gamma = np.asarray(curved(ROBOT, THETA)), np.asarray(connected(ROBOT, THETA))
    np.testing.assert_allclose(exact, -np.swapaxes(exact, 1, 2), atol=1e-15)
    change = slope(lambda theta: np.asarray(curved(ROBOT, theta)))  # [:, k, l, i] = d_i F_kl
    cyclic = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    parts = [change[:, k, l, i] + np.cross(gamma[:, i], exact[:, k, l]) for i, k, l in cyclic]
    assert np.abs(parts).max() > 0.01
    np.testing.assert_allclose(sum(parts), 0, atol=1e-9)


def test_another_frame_of_the_base_only_rotates_it():
    """Gauge covariance: in a frame beta(theta) of the base, Gamma changes altogether, and F is beta^T F."""

    def beta(theta):
        return Rotation.from_rotvec([theta[0] * theta[1], np.sin(theta[2]), theta[1]]).as_matrix()

    def gamma(theta):
        spin = np.einsum("ab,acj->bcj", beta(theta), slope(beta, theta))
        return beta(theta).T @ np.asarray(connected(ROBOT, theta)) + spin[[2, 0, 1], [1, 2, 0]]

    own, change = gamma(THETA), slope(gamma)  # [:, k, i] = d_i Gamma_k
    form = np.swapaxes(change, 1, 2) - change + np.cross(own[:, :, None], own[:, None, :], axis=0)
    exact = np.asarray(curved(ROBOT, THETA))
    np.testing.assert_allclose(form, np.einsum("ab,aik->bik", beta(THETA), exact), atol=1e-8)
    assert np.abs(form - exact).max() > 0.05


def test_in_a_plane_stokes_is_exact():
    """There all rotations commute: the net rotation is the surface integral of the curvature, at any size.

    Three equal rods, the last one in two halves that stay in line; joints 0 and 1 round a rectangle 60 by -120 degrees.
    """
    rods = robots.planar(4, mass=[1, 1, 0.5, 0.5], length=[1, 1, 0.5, 0.5])
    robot = rods.replace(name=ROBOT.name, rotor_on=ROBOT.rotor_on)  # one compiled program
    node, weight = np.polynomial.legendre.leggauss(12)
    a, b = np.deg2rad([60.0, -120.0])
    total = sum(
        u * v * curved(robot, np.array([a * (1 + x) / 2, b * (1 + y) / 2, 0.0]))[:, 0, 1]
        for x, u in zip(node, weight, strict=True)
        for y, v in zip(node, weight, strict=True)
    )
    np.testing.assert_allclose(np.rad2deg(a * b / 4 * total), [0, 0, -1.634222061396], atol=1e-9)


def test_one_joint_has_no_curvature_and_the_dtype_stays():
    single = jax.tree.map(np.float32, random_robot(0, 1))
    exact = curved(single, THETA[:1])
    assert exact.dtype == np.float32
    assert exact.shape == (3, 1, 1)
    np.testing.assert_allclose(exact, 0, atol=1e-6)


@pytest.mark.parametrize(
    ("theta", "message"), [(np.zeros(2), r"`theta` has shape \(2,\)"), ([0, np.nan, 0], "`theta`.*must be finite")]
)
def test_bad_input_is_named(theta, message):
    with pytest.raises(ValueError, match=message):
        reojax.curvature(ROBOT, theta)
    with pytest.raises(ValueError, match="`robot` is a str"):
        reojax.curvature("cat", THETA)  # type: ignore

"""Righting where the momentum is not known beforehand: one motion for all, and a table to look motions up in."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import robots, so3
from reojax.steering.least_squares import cubature

ROBOT = robots.prototype()
INERTIA = np.asarray(reojax.momentum_matrices(ROBOT, np.zeros(3)).A)
TARGET = np.asarray(so3.exp(jnp.asarray([0.2, -0.1, 0.8])))
MEAN = INERTIA @ [0.2, 0.1, 0.6]
COVARIANCE = np.diag(0.2 * np.diag(INERTIA)) ** 2


def end_of(trajectory, momentum) -> np.ndarray:
    return np.asarray(reojax.simulate(ROBOT, trajectory, momentum=momentum, samples=32).rotation[-1])


def test_cubature_has_the_mean_and_the_covariance():
    rng = np.random.default_rng(0)
    root = rng.normal(size=(3, 3))
    points, shares = cubature(MEAN, root @ root.T)
    np.testing.assert_allclose(shares @ points, MEAN, atol=1e-12)
    np.testing.assert_allclose((points - MEAN).T @ (shares[:, None] * (points - MEAN)), root @ root.T, atol=1e-12)


@pytest.mark.slow
def test_one_motion_for_all_misses_less_than_that_for_the_mean():
    """In the mean square, over its own momenta by another simulation, and over others with the same covariance."""
    found = reojax.righting_for_all(
        ROBOT, TARGET, momentum=MEAN, covariance=COVARIANCE, duration=0.62, tries=2, max_steps=25
    )
    assert found.motion.converged
    assert found.rms < 0.98 * found.rms_for_mean
    misses = [so3.angle(end_of(found.motion.trajectory, h).T @ TARGET) for h in found.momenta]
    np.testing.assert_allclose(misses, found.miss, atol=1e-4)
    assert abs(found.rms - np.sqrt(found.shares @ found.miss**2)) < 1e-12
    assert (found.motion.points <= ROBOT.upper + 1e-4).all()
    assert (found.motion.points >= ROBOT.lower - 1e-4).all()
    drawn = np.random.default_rng(0).multivariate_normal(MEAN, COVARIANCE, 12)
    others = [so3.angle(end_of(found.motion.trajectory, h).T @ TARGET) for h in drawn]
    assert 0.6 * found.rms < np.sqrt(np.mean(np.square(others))) < 1.5 * found.rms


def test_a_single_try_keeps_to_the_limits():
    """Where the least miss lies near them: converged means within, in float64 whatever JAX's default."""
    robot = ROBOT.replace(lower=np.maximum(ROBOT.lower, -3.5), upper=np.minimum(ROBOT.upper, 3.5))
    with jax.enable_x64(False):
        found = reojax.righting_for_all(robot, TARGET, momentum=MEAN, covariance=COVARIANCE, duration=0.62, tries=1)
    assert found.motion.points.dtype == np.float64
    fine = np.asarray(jax.vmap(found.motion.trajectory.at)(np.linspace(0, 0.62, 400)).theta)
    beyond = max((fine - np.asarray(robot.upper)).max(), (np.asarray(robot.lower) - fine).max())
    assert beyond > -0.05
    assert found.motion.converged
    assert beyond < 3e-4


@pytest.mark.slow
def test_a_table_is_exact_at_its_corners_and_within_its_bound_between():
    """Random momenta in the grid, by `simulate`: none misses by more than the cell says, and the bound is not idle."""
    axes = [m + 0.5 * s * np.array([-1.0, 1.0]) for m, s in zip(MEAN, 0.4 * np.diag(INERTIA), strict=True)]
    axes[2] = np.linspace(axes[2][0], axes[2][1], 3)
    table = reojax.righting_table(ROBOT, TARGET, momenta=axes, duration=0.62)
    assert table.points.shape[:3] == (2, 2, 3)
    assert table.converged.all()
    corner = np.array([axis[-1] for axis in axes])
    assert so3.angle(end_of(table.trajectory(corner), corner).T @ TARGET) < 1e-5
    rng, worst = np.random.default_rng(1), 0.0
    for _ in range(10):
        h = np.array([rng.uniform(axis[0], axis[-1]) for axis in axes])
        miss = so3.angle(end_of(table.trajectory(h), h).T @ TARGET)
        bound = table.miss[0, 0, int(h[2] > axes[2][1])]
        assert miss < bound
        worst = max(worst, float(miss / bound))
    assert worst > 0.05
    with pytest.raises(ValueError, match=r"momentum\[1\]"):
        table.at(corner + [0, 1, 0])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"covariance": -np.eye(3)}, "no negative eigenvalue"),
        ({"covariance": np.eye(2)}, "covariance"),
        ({"momentum": [[np.nan, 0, 0]]}, "momentum"),
        ({"momentum": [[0.0, 0, 5.0]]}, "body rate"),
        ({"tries": 0}, "tries"),
        ({"duration": 0.0}, "positive"),
    ],
)
def test_what_one_motion_for_all_refuses(options, said):
    with pytest.raises(ValueError, match=said):
        reojax.righting_for_all(ROBOT, TARGET, **({"momentum": np.zeros((2, 3)), "duration": 0.5} | options))


@pytest.mark.parametrize(
    ("momenta", "said"),
    [([[0, 1]] * 2, "axes"), ([[0, 1], [0], [0, 1]], "increase"), ([[0, 1], [1, 0], [0, 1]], "increase")],
)
def test_what_a_table_refuses(momenta, said):
    with pytest.raises(ValueError, match=said):
        reojax.righting_table(ROBOT, TARGET, momenta=momenta, duration=0.5)

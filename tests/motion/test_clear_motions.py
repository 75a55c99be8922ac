"""Motions in time that stay clear of the robot itself: the bound is proven, and fastest motions keep what is asked."""

import jax
import numpy as np
import pytest

import reojax
from reojax import RE_MAX_17
from reojax.collision.clearance import clearances

PROTOTYPE = reojax.robots.prototype()
A = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
MEETING = reojax.manoeuvre_b(np.deg2rad(-270), np.deg2rad(120))


def sampled(trajectory, count=10_000):
    """Least clearance and its pair at many instants."""
    at = jax.jit(jax.vmap(lambda t: trajectory.at(t).theta))
    gap = np.asarray(jax.jit(clearances)(PROTOTYPE, at(np.linspace(0, float(trajectory.duration), count))))
    return gap.min(), gap.min(1).argmin()


def curves():
    rng = np.random.default_rng(0)
    for k in range(4):
        corners = np.concatenate([np.zeros((1, 3)), rng.uniform(-1, 1, (4, 3)) * [3, 1.5, 3], np.zeros((1, 3))])
        yield reojax.through(reojax.polygon(corners), 0.1 + 0.02 * k)


@pytest.mark.parametrize("number", range(4))
def test_the_bound_is_below_ten_thousand_samples_and_near_them(number):
    trajectory = list(curves())[number]
    least, pair = sampled(trajectory)
    found = reojax.trajectory_clearance(PROTOTYPE, trajectory)
    assert least - 1.1e-4 < found.distance <= least + 1e-12
    assert found.distance <= found.found <= found.distance + 1e-4
    assert found.pair == pair
    here = reojax.clearance(PROTOTYPE, trajectory.at(found.time).theta)
    np.testing.assert_allclose(found.found, np.min(here), atol=1e-12)


def test_a_law_along_a_path_has_the_clearance_of_the_path():
    along = reojax.trajectory_clearance(PROTOTYPE, reojax.along(MEETING, "quintic", 0.1))
    path = reojax.path_clearance(PROTOTYPE, MEETING)
    np.testing.assert_allclose(along.found, path.found, atol=1e-4)
    assert along.pair == path.pair
    assert 0.1 < along.time < 0.2  # on the second edge


def test_robots_without_pairs_never_meet():
    still = reojax.along(reojax.polygon([[0.0], [1.0]]), "quintic", 1.0)
    found = reojax.trajectory_clearance(reojax.robots.planar(2), still)
    assert np.isinf(found.distance)
    assert found.pair == -1


def test_bad_input_is_refused():
    trajectory = reojax.along(A, "quintic", 0.1)
    with pytest.raises(ValueError, match="`trajectory` moves 3 joints; 'planar2' has 1"):
        reojax.trajectory_clearance(reojax.robots.planar(2), trajectory)
    with pytest.raises(ValueError, match="`tolerance`"):
        reojax.trajectory_clearance(PROTOTYPE, trajectory, tolerance=0)
    with pytest.raises(ValueError, match="these are traced"):
        jax.jit(lambda t: reojax.trajectory_clearance(PROTOTYPE, t).distance)(trajectory)
    with pytest.raises(ValueError, match="not finite"):
        reojax.trajectory_clearance(PROTOTYPE, reojax.Trajectory(trajectory.breaks, np.full((4, 6, 3), np.nan)))


@pytest.mark.parametrize("solve", [reojax.overlap, reojax.free_law])
def test_what_cannot_be_kept_is_refused(solve):
    with pytest.raises(ValueError, match=r"`clearance` is 0.04 m, which .* link0"):
        solve(PROTOTYPE, A, RE_MAX_17, clearance=0.04)


def test_least_time_says_the_proven_clearance():
    assert reojax.minimum_time(PROTOTYPE, A, RE_MAX_17, clearance=0.005).clearance >= 0.016
    assert reojax.minimum_time(PROTOTYPE, A, RE_MAX_17).clearance is None


@pytest.mark.slow
def test_fastest_motions_keep_their_clearance():
    target = reojax.net_rotation(PROTOTYPE, A)
    found = reojax.fastest_loop(PROTOTYPE, target, RE_MAX_17, A, knots=8, starts=1, clearance=0.005)
    assert found.converged
    assert found.clearance >= 0.005
    assert sampled(found.trajectory)[0] >= found.clearance


@pytest.mark.slow
def test_overlapped_edges_keep_their_clearance():
    found = reojax.overlap(PROTOTYPE, A, RE_MAX_17, clearance=0.01)
    assert found.converged
    assert found.clearance >= 0.01
    assert sampled(found.trajectory)[0] >= found.clearance


@pytest.mark.slow
def test_free_laws_keep_their_clearance():
    found = reojax.free_law(PROTOTYPE, A, RE_MAX_17, points=2, clearance=0.016)
    assert found.converged
    assert found.clearance >= 0.016

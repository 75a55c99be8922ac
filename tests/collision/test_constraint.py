"""Clearance as a condition of an optimiser: its values, its derivatives, and what an answer proves to keep."""

import jax
import numpy as np
import pytest

import reojax
from reojax.collision.constraint import clearance_shortfall

PROTOTYPE = reojax.robots.prototype()
SIZE = np.mean([PROTOTYPE.capsule_radius[list(pair)].sum() for pair in PROTOTYPE.collision_pairs])
WAYPOINTS = np.asarray(reojax.manoeuvre_b(-4.5, 2.0).waypoints) + 0.01 * np.random.default_rng(0).normal(size=(5, 3))


@pytest.mark.slow
def test_shortfall_is_on_the_safe_side_of_the_least_sample():
    """Rounded off by a tenth of a radius at most, never above the least; more of it with what lies between."""
    short = clearance_shortfall(PROTOTYPE, WAYPOINTS, 0.005, samples=32)
    share = np.linspace(0, 1, 33)[None, :, None]
    postures = WAYPOINTS[:-1, None] + share * np.diff(WAYPOINTS, axis=0)[:, None]
    clearance = jax.vmap(lambda theta: reojax.clearance(PROTOTYPE, theta))(postures.reshape(-1, 3))
    least = np.asarray(clearance).reshape(4, -1).min(1)
    kept = 0.005 - np.asarray(short) * SIZE
    assert (kept <= least).all()
    assert (kept >= least - 0.1 * SIZE).all()
    assert (clearance_shortfall(PROTOTYPE, WAYPOINTS, 0.005, samples=32, between=2.0) > short).all()


def test_shortfall_has_its_derivative():
    short = jax.jit(lambda points: clearance_shortfall(PROTOTYPE, points, 0.005, samples=16, between=2.0).sum())
    change = np.random.default_rng(1).normal(size=WAYPOINTS.shape)
    h = 1e-6
    numeric = (short(WAYPOINTS + h * change) - short(WAYPOINTS - h * change)) / (2 * h)
    np.testing.assert_allclose((jax.jit(jax.grad(short))(WAYPOINTS) * change).sum(), numeric, rtol=1e-5)


def test_long_paths_share_conditions():
    curve = np.linspace(0, 1, 101)[:, None] * np.ones(3)
    rows = lambda robot, curve: jax.eval_shape(lambda curve: clearance_shortfall(robot, curve, 0.0), curve).shape
    assert rows(PROTOTYPE, curve) == (12,)
    assert rows(reojax.robots.planar(2), curve[:, :1]) == (0,)


@pytest.mark.slow
def test_design_keeps_its_margin_provably():
    """The most bend of manoeuvre A whose feet pass 20 mm apart: proven along the whole loop, and little is given away.

    At 270/120 degrees they pass at 16 mm.
    """
    problem = reojax.design.Problem(
        lambda v: (PROTOTYPE, reojax.manoeuvre_a(v["twist"], v["bend"])),
        [
            reojax.design.Variable("twist", 240.0, 270.0, unit="deg"),
            reojax.design.Variable("bend", 100.0, 120.0, unit="deg"),
        ],
        objective=lambda outcome: -outcome.values["bend"],
        inequality=[reojax.design.clear_by(0.02, samples=48)],
    )
    found = problem.solve(3, seed=1)
    assert found.converged[found.best]
    clearance = problem.outcome(found.value[found.best]).clearance
    assert 0.02 <= clearance.distance <= 0.0225
    assert np.rad2deg(found.value[found.best][1]) < 119


@pytest.mark.parametrize("margin", [np.nan, "5mm", [0.1, 0.2]])
def test_margin_is_one_number(margin):
    with pytest.raises(ValueError, match="`margin`"):
        reojax.design.clear_by(margin)

"""`clear_by` in a design problem: answers are proven, and what falls short between samples is solved again."""

import numpy as np
import pytest

import reojax
from reojax.optimisation.functions import _program
from reojax.optimisation.status import Status

PROTOTYPE = reojax.robots.prototype()
MARGIN = 0.02


def problem():
    """The most bend of manoeuvre A whose feet pass 20 mm apart, looked at thirteen times an edge."""
    return reojax.design.Problem(
        lambda v: (PROTOTYPE, reojax.manoeuvre_a(v["twist"], v["bend"])),
        [
            reojax.design.Variable("twist", 240.0, 270.0, unit="deg"),
            reojax.design.Variable("bend", 100.0, 120.0, unit="deg"),
        ],
        objective=lambda outcome: -outcome.values["bend"],
        inequality=[reojax.design.clear_by(MARGIN, samples=12)],
    )


@pytest.fixture
def careless(monkeypatch):
    """Nothing kept in hand for what lies between samples."""
    monkeypatch.setattr("reojax.design.self_clearance._BETWEEN", 0.0)


@pytest.mark.usefixtures("careless")
def test_what_falls_short_between_samples_is_solved_again_or_has_not_converged(monkeypatch):
    posed, before = problem(), _program.cache_info().misses
    found = posed.solve(2)
    assert _program.cache_info().misses - before <= 3  # values, and derivatives of one start or two: of every level
    proven = np.array([float(posed.outcome(x).clearance.distance) for x in found.value])
    assert found.converged[found.best]
    assert (proven[found.converged] >= MARGIN).all()
    monkeypatch.setattr("reojax.design.self_clearance.TIGHTENED", 0)
    plain = posed.solve(2)
    assert (found.steps >= plain.steps).all()
    assert not plain.converged.any()
    assert (plain.status == Status.NOT_FOUND).all()


def test_a_robot_without_pairs_is_refused_rather_than_called_clear():
    robot, variable = reojax.robots.planar(2), reojax.design.Variable("bend", 0.1, 1.0)
    posed = reojax.design.Problem(
        lambda v: (robot, reojax.Path(v["bend"] * np.array([[0.0], [1.0], [0.0]]))),
        [variable],
        objective=lambda outcome: outcome.values["bend"],
        inequality=[reojax.design.clear_by(0.01)],
    )
    with pytest.raises(ValueError, match="`clear_by` asks for 0.01 m, but 'planar2' has no pairs"):
        posed.solve(1)

"""Late authority as a measure of a design: the Gramian of the gains, and loops that are made for it."""

import jax
import numpy as np
import pytest

import reojax
from reojax import design, robots
from reojax.design.authority import late_authority

ROBOT = robots.prototype()


def test_it_is_the_authority_of_the_gains():
    """At the start and at a corner, but for the window of the gains at the whole's two ends."""
    path = reojax.manoeuvre_a(np.deg2rad(250), np.deg2rad(110))
    gains = reojax.correction_gains(ROBOT, path, samples=32, window=0.0)
    for after, sample in ((0.0, 0), (0.5, 64)):
        assert abs(late_authority(ROBOT, path, after) / gains.authority[sample] - 1) < 1e-2


@pytest.mark.slow
def test_its_derivative():
    path = reojax.manoeuvre_a(np.deg2rad(250), np.deg2rad(110))
    change = np.random.default_rng(0).normal(size=path.waypoints.shape)

    def value(share):
        return late_authority(ROBOT, reojax.Path(path.waypoints + share * change), 0.5)

    _, slope = jax.jvp(value, (0.0,), (1.0,))
    assert abs(slope - (value(1e-5) - value(-1e-5)) / 2e-5) < 1e-5 * abs(slope)


@pytest.mark.slow
def test_a_loop_can_be_made_to_have_it():
    """The least twist of A that has the late authority of 250/110, with the bend free: it twists no more."""
    variables = [design.Variable("twist", 1.0, 4.5, "rad"), design.Variable("bend", 0.5, 2.0, "rad")]

    def build(values):
        return ROBOT, reojax.manoeuvre_a(values["twist"], values["bend"])

    measure = design.authority(after=0.5)
    least = float(late_authority(ROBOT, reojax.manoeuvre_a(np.deg2rad(250), np.deg2rad(110)), 0.5))
    problem = design.Problem(
        build, variables, objective=design.value_of("twist"), inequality=[design.authority_above(least, after=0.5)]
    )
    found = problem.solve(starts=4, seed=0)
    outcome = problem.outcome(found.value[found.best])
    assert found.converged[found.best]
    assert abs(measure(outcome) / least - 1) < 1e-5
    assert outcome.values["twist"] < np.deg2rad(250) + 1e-3


def test_what_it_refuses():
    with pytest.raises(ValueError, match="`after`"):
        design.authority(after=1.5)
    with pytest.raises(ValueError, match="nothing is left"):
        design.authority(after=1.0)
    with pytest.raises(ValueError, match="`least`"):
        design.authority_above(0.0)


def test_problems_are_for_zero_momentum():
    variables = [design.Variable("twist", 1.0, 4.5, "rad")]
    with pytest.raises(ValueError, match=r"reojax\.righting"):
        design.Problem(
            lambda v: (ROBOT, reojax.manoeuvre_a(v["twist"], 1.0)),
            variables,
            objective=design.value_of("twist"),
            momentum=[0, 0, 1e-4],
        )

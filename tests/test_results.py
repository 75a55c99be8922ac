"""Every solver's result has one vocabulary, and says in words how it ended."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import RE_MAX_17
from reojax.design.solutions import Solutions
from reojax.optimisation.optimise import Solution
from reojax.optimisation.status import Status

SOLVERS = (
    Solution, Solutions, reojax.Fastest, reojax.Plan, reojax.FreePaths, reojax.Righting, reojax.Calibration,
    reojax.LeastTime, reojax.Tracking,
)  # fmt: skip
INTEGRATORS = (reojax.Motion, reojax.Released)
LOOP = reojax.manoeuvre_a(1.0, 0.8)


@pytest.mark.parametrize("kind", SOLVERS)
def test_solvers_have_one_vocabulary(kind):
    assert {"value", "cost", "violation", "error", "converged", "status", "message"} <= set(dir(kind))


@pytest.mark.parametrize("kind", INTEGRATORS)
def test_integrators_say_how_well_they_did(kind):
    assert {"value", "error", "converged", "status", "message"} <= set(dir(kind))


def test_every_status_has_a_text():
    assert all(status.text for status in Status)


def test_a_motion_that_is_not_resolved_is_out_of_steps():
    robot = reojax.robots.prototype()
    run = {"durations": 0.3, "samples": 2, "momentum": np.array([0.0, 0.0, 1e-4])}
    coarse, chosen = reojax.simulate(robot, LOOP, substeps=1, **run), reojax.simulate(robot, LOOP, **run)
    assert float(np.asarray(coarse.error)) > 1e-8
    assert (int(coarse.status), bool(coarse.converged)) == (Status.OUT_OF_STEPS, False)
    assert coarse.message.startswith("out of steps")
    assert float(np.asarray(chosen.error)) < 1e-8
    assert (int(chosen.status), chosen.message) == (Status.CONVERGED, "converged")


def test_results_are_printed_as_a_line_with_figures_and_the_verdict():
    robot = reojax.robots.prototype()
    motion = reojax.simulate(robot, LOOP, durations=0.3, samples=2)
    assert re.fullmatch(
        r"9 samples over 1\.2 s, turned by 0\.\d+ rad in the end, within \S+ rad; converged", str(motion)
    )
    least = reojax.minimum_time(robot, LOOP, RE_MAX_17)
    assert str(least).startswith(f"{float(least.duration):.6g} s, of the edges ")
    assert str(least).endswith("; converged")
    problem = Solution(np.zeros((2, 1)), np.array([3.0, 2.0]), np.zeros(2), np.zeros(2), np.ones(2, int),
                       np.array([False, True]), 1, np.array([2, 0]))  # fmt: skip
    assert str(problem) == "1 of 2 converged; the best: cost 2, violation 0.0e+00, slope 0.0e+00; converged"
    printed = []
    jax.jit(lambda error: printed.append(str(motion._replace(error=error))))(1e-9)
    assert printed[0].startswith("Motion(time=")


def test_a_motor_that_is_asked_too_much_is_saturated():
    robot = reojax.robots.prototype()

    def tracked(supply):
        motors, motion = RE_MAX_17._replace(supply=supply), reojax.along(LOOP, "quintic", 0.2)
        return reojax.track(robot, motion, motors, reojax.gains(robot, 20.0), feedforward=True, sample_time=2e-3)

    slow, quick = tracked(12.0), tracked(1.0)
    assert (slow.message, float(slow.violation)) == ("converged", 0.0)
    assert quick.saturated.any()
    assert not quick.converged
    assert quick.violation > 0
    assert quick.message.startswith("saturated")


def test_least_time_where_no_time_is_enough():
    found = reojax.minimum_time(reojax.robots.prototype(), LOOP, RE_MAX_17)
    assert (found.message, float(found.cost)) == ("converged", float(found.durations.sum()))
    assert found._replace(duration=jnp.array(np.inf)).message.startswith("unreachable")
    assert not found._replace(duration=jnp.array(np.inf)).converged
    assert found._replace(duration=np.float64(np.nan)).message.startswith("not finite")

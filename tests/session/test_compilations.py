"""What needs no other program compiles none: other names, other numbers of targets, other goals and starts."""

from collections.abc import Callable

import jax
import numpy as np
import pytest

import reojax
from reojax import design, robots, so3

LIMITS = {"twist_limit": np.deg2rad(270), "bend_limit": np.deg2rad(120), "max_manoeuvres": 5}
_compiled: list[str] = []


@pytest.fixture(autouse=True, scope="module")
def _listen():
    """To every program that XLA makes, or finds in the cache of compiled programs."""

    def note(event: str, _: float, **__: object) -> None:
        if event.endswith("backend_compile_duration"):
            _compiled.append(event)

    jax.monitoring.register_event_duration_secs_listener(note)
    yield
    jax.monitoring.unregister_event_duration_listener(note)


def _count(work: Callable[[], object]) -> int:
    before = len(_compiled)
    work()
    return len(_compiled) - before


def test_the_count_sees_programs():
    assert _count(lambda: jax.jit(lambda x: 3 * x - 1)(2.0)) >= 1


@pytest.mark.slow
def test_plans_of_any_number_of_targets_have_one_set_of_programs():
    """Also of a robot with other names."""
    robot = robots.prototype()
    target = np.asarray(so3.exp(np.array([0.0, np.pi / 2, 0.0])))
    assert _count(lambda: reojax.plan(robot, target, **LIMITS)) > 0
    for count in (2, 7, 40):
        assert _count(lambda count=count: reojax.plan_many(robot, np.tile(target, (count, 1, 1)), **LIMITS)) == 0
    assert _count(lambda: reojax.plan(robot.replace(name="other", joint_names=("a", "b", "c")), target, **LIMITS)) == 0


@pytest.mark.slow
def test_a_design_problem_has_two_programs_whatever_the_goal_and_the_number_of_starts():
    """From eight starts on; a block of fewer is a program of its own."""
    robot = robots.prototype()
    loop = design.polygons(robot, 2)
    problem = design.Problem(
        lambda values: (robot, loop.path(values["loop"])),
        [loop, design.Variable("target", [-4.0] * 3, [4.0] * 3, "rad")],
        objective=design.travel(loop),
        equality=[design.turned_to("target")],
        steps=1,
    )

    def solve(roll: float, starts: int) -> object:
        return problem.solve(starts, seed=1, hold={"target": [0.0, 0.0, roll]}, max_steps=2)

    first = _count(lambda: solve(1.0, 8))
    assert first >= 2
    assert [_count(lambda roll=roll, n=n: solve(roll, n)) for roll, n in ((1.5, 8), (1.0, 9), (2.0, 30))] == [0, 0, 0]

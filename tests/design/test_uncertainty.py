"""Sensitivities against differences, and the spread by the linear rule against sampling and by hand."""

import jax
import numpy as np
import pytest

import reojax
from reojax import design, net_rotation, so3
from reojax.design.uncertainty import _jacobian, _turns
from reojax.robots.random import random_robot

ROBOT = random_robot(1, 2)
PATH = reojax.polygon(np.random.default_rng(0).uniform(-2, 2, (4, 2))[[0, 1, 2, 0]])
NOMINAL = np.asarray(net_rotation(ROBOT, PATH))
rotate = jax.jit(lambda robot: net_rotation(robot, PATH))
UNITS = {"mass": "kg", "com": "m", "inertia": "kg m^2", "axis": "rad", "anchor": "m", "rotor_inertia": "kg m^2"}


def turn(robot) -> np.ndarray:
    return np.asarray(so3.log(rotate(robot) @ NOMINAL.T))


def changed(name: str, by: float):
    """The robot with one number of the table changed by hand."""
    field, index = name.split("[")[0], int(name.split("[")[1].split("]")[0])
    part = name.partition(".")[2]
    array = np.array(getattr(ROBOT, field))
    if field == "inertia":
        a, b = ("xyz".index(letter) for letter in part)
        array[index, a, b] += by
        array[index, b, a] += by * (a != b)
    elif field == "axis":
        one = np.cross(array[index], np.eye(3)[np.argmin(np.abs(array[index]))])
        one /= np.linalg.norm(one)
        side = one if part == "tilt1" else np.cross(array[index], one)
        array[index] = np.cos(by) * array[index] + np.sin(by) * side
    elif part:
        array[index, "xyz".index(part)] += by
    else:
        array[index] += by
    return ROBOT.replace(**{field: array})


@pytest.mark.slow
def test_table_agrees_with_differences_and_is_sorted():
    table = design.sensitivities(ROBOT, PATH)
    assert len(table.name) == len(set(table.name)) == 3 + 9 + 18 + 4 + 6 + 2 + 2
    assert (np.diff(table.effect) <= 0).all()
    assert table.effect[0] > 1e-3
    for name, unit, slope, size, effect in zip(
        table.name, table.unit, table.derivative, table.size, table.effect, strict=True
    ):
        step = 1e-4 * size
        difference = (turn(changed(name, step)) - turn(changed(name, -step))) / (2 * step)
        np.testing.assert_allclose(slope, difference, atol=1e-6 * max(np.abs(slope).max(), 0.01 / size))
        np.testing.assert_allclose(effect, 0.01 * size * np.linalg.norm(slope))
        assert unit == UNITS.get(name.split("[")[0], "")
    assert str(table).count("\n") == len(table.name)


def test_frame_at_the_end():
    start, end = (design.sensitivities(ROBOT, PATH, frame=frame) for frame in ("start", "end"))
    turned = dict(zip(start.name, start.derivative @ NOMINAL, strict=True))
    for name, slope in zip(end.name, end.derivative, strict=True):
        np.testing.assert_allclose(slope, turned[name], atol=1e-9 * np.abs(slope).max() + 1e-12)


TOLERANCES = {"mass": 0.01, "inertia": [0.02, 0.0, 0.03], "com": 1e-3, "axis": 2e-3, "gear_ratio": 0.01}


@pytest.mark.slow
def test_linear_rule_and_monte_carlo_agree():
    found = design.spread(ROBOT, PATH, TOLERANCES, draws=4000, seed=1)
    assert len(found.source) == 3 + 3 + 9 + 4 + 2
    np.testing.assert_allclose(found.share.sum(), 1)
    assert found.share[found.source.index("inertia[1]")] == 0
    size = np.trace(found.covariance)
    np.testing.assert_allclose(found.sampled, found.covariance, atol=0.08 * size)
    assert np.abs(found.sampled - found.covariance).max() > 1e-4 * size
    np.testing.assert_allclose(found.deviation**2, np.diag(found.covariance))
    np.testing.assert_allclose(design.scatter(ROBOT, PATH, TOLERANCES), size, rtol=1e-6)


def test_one_error_by_hand():
    """A mass with its inertia, both a per cent up and down."""
    up, down = (
        ROBOT.replace(
            mass=np.array(ROBOT.mass) * [1, k, 1], inertia=np.array(ROBOT.inertia) * np.reshape([1, k, 1], (3, 1, 1))
        )
        for k in (np.exp(0.001), np.exp(-0.001))
    )
    slope = (turn(up) - turn(down)) / 0.002
    found = design.spread(ROBOT, PATH, {"mass": [0, 0.01, 0]}, draws=10)
    np.testing.assert_allclose(found.covariance, np.outer(slope, slope) * 1e-4, atol=1e-6 * slope @ slope * 1e-4)
    errors = np.random.default_rng(0).normal(size=(10, 3))[:, 1]
    np.testing.assert_allclose(found.turns, np.outer(errors, slope) * 1e-2, atol=1e-3 * np.linalg.norm(slope))


def test_other_robots_and_paths_of_the_same_form_compile_nothing(monkeypatch):
    """And draws in rounds are the draws in one."""
    tolerances = {"mass": [0, 0.01, 0]}
    design.spread(ROBOT, PATH, tolerances, draws=10)
    before = _turns._cache_size(), _jacobian._cache_size()
    other = ROBOT.replace(mass=1.1 * np.array(ROBOT.mass), name="other")
    one = design.spread(other, reojax.Path(0.9 * np.asarray(PATH.waypoints)), tolerances, draws=10, seed=3)
    assert (_turns._cache_size(), _jacobian._cache_size()) == before
    monkeypatch.setattr("reojax.design.uncertainty._DRAWS", 10)
    more = design.spread(other, reojax.Path(0.9 * np.asarray(PATH.waypoints)), tolerances, draws=19, seed=3)
    assert more.turns.shape == (19, 3)
    np.testing.assert_allclose(more.turns[:10], one.turns, atol=1e-15)
    assert _turns._cache_size() == before[0]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: design.sensitivities(ROBOT, PATH, frame="world"), "`frame` is 'world'"),
        (lambda: design.spread(ROBOT, PATH, {"colour": 0.1}), "no tolerances for 'colour'"),
        (lambda: design.spread(ROBOT, PATH, {"mass": -0.1}), "must not be negative"),
        (lambda: design.spread(ROBOT, PATH, {"mass": [0.1, 0.2]}), "has shape"),
        (lambda: design.spread(ROBOT, PATH, {}), "`tolerances` is empty"),
        (lambda: design.spread(ROBOT, PATH, {"mass": 0.1}, draws=1), "`draws` is 1"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()

"""With float64 off every solver computes in float64 all the same, or warns once, at the user's line, how to switch.

REOJAX_TEST_X64=0 pytest -m float32
"""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import shapes
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots

pytestmark = [
    pytest.mark.float32,
    pytest.mark.skipif(bool(jax.config.values["jax_enable_x64"]), reason="float64 is on"),
]

MOTOR = reojax.RE_MAX_17
TARGET = Rotation.from_rotvec([0.05, -0.02, 0.1]).as_matrix()
NEAR = [reojax.Capsule(link, np.zeros(3), [0, 0, 0.01], 0.002) for link in (0, 3)]


def _robot():
    return reojax.with_motors(robots.prototype(), MOTOR)


def _calibrate(robot, path):
    time = np.arange(30) / 300
    theta = np.sin(np.outer(time, [40.0, 30.0, 50.0]))
    seen = reojax.joints_simulated(robot, reojax.make_capture(time, theta)).rotation
    return reojax.calibrate(robot, reojax.make_capture(time, theta, seen), clock=False, max_steps=2)


DOUBLE = {
    "plan": lambda robot, path: reojax.plan(robot, TARGET, twist_limit=4.0, bend_limit=2.0, max_manoeuvres=3),
    "free_path": lambda robot, path: reojax.free_path(robot, TARGET, starts=1, max_steps=5),
    "righting": lambda robot, path: reojax.righting(
        robot, TARGET, momentum=[0, 0, 1e-4], duration=1.0, starts=1, max_steps=2
    ),
    "calibrate": _calibrate,
    "sensitivities": lambda robot, path: reojax.design.sensitivities(robot, path),
    "nearest_parts": lambda robot, path: reojax.nearest_parts(robots.with_capsules(robot, NEAR, [(0, 1)]), path),
    "controllable_directions": lambda robot, path: reojax.controllable_directions(robot, np.zeros(3)),
    "overlap": lambda robot, path: reojax.overlap(robot, path, MOTOR, max_steps=1),
}
"""Solvers that compute in float64 whatever JAX's default, here with few steps."""
SLOW = ("overlap", "righting")
USES = {
    "net_rotation": lambda robot, path: reojax.net_rotation(robot, path),
    "under vmap": lambda robot, path: jax.vmap(lambda m: reojax.net_rotation(robot.replace(mass=m), path))(
        jnp.asarray(np.stack([robot.mass] * 2))
    ),
    "arrays": lambda robot, path: jnp.asarray(robot.inertia) * jnp.asarray(path.waypoints).sum(),
}


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow if n in SLOW else ()) for n in DOUBLE])
def test_arrays_of_a_robot_serve_both_defaults(name):
    """A solver that switches to float64 leaves no trace in arrays that are used in float32 before and after.

    JAX remembers by the array object for which float a NumPy array in a live program was taken.
    """
    solve = DOUBLE[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        robot, path = _robot(), reojax.polygon(np.array(reojax.manoeuvre_a(1.0, 0.8).waypoints))
        mine = jax.jit(lambda share: [share * jnp.asarray(leaf) for leaf in jax.tree.leaves((robot, path))])
        mine(1.0)
        solve(robot, path)
        robot, path = _robot(), reojax.polygon(np.array(path.waypoints))
        solve(robot, path)
        for use in USES.values():
            assert use(robot, path).dtype == jnp.float32
    assert mine(1.0)[0].dtype == jnp.float32
    assert not jax.config.values["jax_enable_x64"]


def _solved(robot, path):
    twist, bend = (reojax.design.Variable(name, -1.0, 1.0, "rad") for name in ("twist", "bend"))
    return reojax.design.Problem(
        lambda values: (robot, reojax.manoeuvre_a(values["twist"], values["bend"])),
        [twist, bend],
        objective=reojax.design.travel(),
        equality=[reojax.design.turned_about([0, 0, 1.0], 0.1)],
    ).solve(2, max_steps=2)


SINGLE = {
    "optimise": lambda robot, path: reojax.design.optimise(
        lambda x: (x**2).sum(), np.ones((2, 2)), lower=-1.0, upper=1.0
    ),
    "Problem.solve": _solved,
    "certify": lambda robot, path: reojax.certify(robot, path, samples=16),
    "scatter": lambda robot, path: reojax.design.scatter(robot, path, {"mass": 1e-3}),
}
"""Solvers of functions that the user has written, or that JAX differentiates: they stay in float32, and say so."""


@pytest.mark.parametrize("name", SINGLE)
def test_one_warning_at_the_line_that_asks_for_more_than_float32_gives(name):
    with pytest.warns(UserWarning, match="single precision") as told:
        SINGLE[name](_robot(), reojax.manoeuvre_a(1.0, 0.8))
    assert len(told) == 1
    assert 'jax.config.update("jax_enable_x64", True)' in str(told[0].message)
    assert told[0].filename in (__file__, shapes.__file__)  # what checks all shapes in tests stands between


def test_what_is_computed_in_float32_is_right_to_float32():
    """Functions that work under `jit` and `grad`: right to some 1e-6 (the largest gains to 1e-4), with no word."""
    robot, path = _robot(), reojax.manoeuvre_a(1.0, 0.8)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        single = _numbers(robot, path)
    with jax.enable_x64(True):
        double = _numbers(_robot(), reojax.manoeuvre_a(1.0, 0.8))
    for name, value in single.items():
        assert value.dtype == jnp.float32, name
        size = np.abs(double[name]).max()
        np.testing.assert_allclose(value, double[name], rtol=0, atol=2e-4 * size, err_msg=name)


def _numbers(robot, path):
    gains = reojax.correction_gains(robot, path, samples=8)
    return {
        "minimum_time": reojax.minimum_time(robot, path, MOTOR).durations,
        "gain": gains.gain,
        "simulate": reojax.simulate(robot, path, durations=0.3).rotation,
        "curvature": reojax.curvature(robot, np.array([0.1, 0.5, 0.2])),
    }

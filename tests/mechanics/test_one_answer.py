"""The same robot and motion written in different ways have one answer, whatever is known while tracing."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax.mechanics._fast.parameters import known_parameters, parameters, pattern_of
from reojax.mechanics.holonomy import _net_rotation
from reojax.robots.random import random_robot

PATH = reojax.manoeuvre_a(2.0, 1.2)
THETA, RATE, ACCELERATION = np.array([[0.4, -0.9, 1.3], [1.0, 0.5, -0.7], [-2.0, 1.0, 3.0]])
OMEGA = np.array([0.2, -0.3, 0.5])


def signed(sign: float) -> reojax.Robot:
    """The prototype, its first axis and its last one pointing the other way for a sign of -1."""
    robot = reojax.robots.prototype()
    return robot.replace(axis=robot.axis * np.array([sign, 1, sign])[:, None])


WAYS = {
    "lengths 2": lambda r: r.replace(axis=2 * r.axis),
    "lengths of their own": lambda r: r.replace(axis=r.axis * np.array([0.3, 7.0, 1e-30])[:, None]),
    "float32 rounding": lambda r: r.replace(axis=r.axis * -np.nextafter(np.float32(-1), np.float32(0))),
    "integers": lambda r: r.replace(axis=np.round(3 * r.axis).astype(int)),
    "JAX arrays": lambda r: jax.tree.map(jnp.asarray, r),
    "other names": lambda r: r.replace(name="x", link_names=tuple("abcd"), joint_names=tuple("uvw")),
}
"""The prototype's axes are those of its frame."""


def answers(robot: reojax.Robot) -> dict[str, jax.Array]:
    """What every public function of the mechanics says of a robot."""
    dynamics = (THETA, RATE, ACCELERATION)
    return {
        "net_rotation": reojax.net_rotation(robot, PATH),
        "rotation_history": reojax.rotation_history(robot, PATH, samples=4),
        "connection": reojax.connection(robot, THETA),
        "momentum_matrices": jnp.concatenate(reojax.momentum_matrices(robot, THETA), axis=1),
        "angular_momentum": reojax.angular_momentum(robot, THETA, RATE, OMEGA),
        "curvature": reojax.curvature(robot, THETA),
        "inverse_dynamics": reojax.inverse_dynamics(robot, *dynamics),
        "forward_dynamics": reojax.forward_dynamics(robot, *dynamics),
        "joint_inertia": reojax.joint_inertia(robot, THETA),
        "kinetic_energy": reojax.kinetic_energy(robot, THETA, RATE),
        "base_velocity": reojax.base_velocity(robot, THETA, RATE),
        "link_poses": reojax.link_poses(robot, THETA).rotation,
        "centre_of_mass": reojax.centre_of_mass(robot, THETA),
    }


def same(found: dict[str, jax.Array], expected: dict[str, np.ndarray], atol: float = 1e-12) -> None:
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], value, rtol=1e-10, atol=atol * np.abs(value).max(), err_msg=name)


traced_answers = jax.jit(answers)
EXPECTED = {sign: jax.tree.map(np.asarray, traced_answers(signed(sign))) for sign in (1.0, -1.0)}
"""Everything traced, nothing known."""


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS.keys())
def test_ways_to_write_a_robot(way, sign):
    robot = way(signed(sign))
    fine = {"net_rotation": reojax.net_rotation(robot, PATH), "connection": reojax.connection(robot, THETA)}
    same(fine, {name: EXPECTED[sign][name] for name in fine})
    same(traced_answers(robot), EXPECTED[sign])


def test_the_sign_of_an_axis_matters():
    """Or else the tests above compare nothing."""
    assert np.abs(EXPECTED[1.0]["net_rotation"] - EXPECTED[-1.0]["net_rotation"]).max() > 0.1


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_without_tracing(sign):
    same(answers(signed(sign)), EXPECTED[sign])


@pytest.mark.parametrize("seed", range(5))
def test_what_is_known_is_so(seed):
    """On robots with zeros at random places: known entries are those of the arrays, and no zero is missed."""
    rng = np.random.default_rng(seed)
    robot = random_robot(seed, 4, branched=True)
    axis = rng.normal(size=(4, 3)) * (rng.random((4, 3)) < 0.5)
    axis[~axis.any(1)] = [0, -0.3, 0]
    symmetric = rng.random((5, 3, 3)) < 0.6
    symmetric = symmetric | symmetric.swapaxes(1, 2) | np.eye(3, dtype=bool)
    robot = robot.replace(
        axis=axis,
        com=robot.com * (rng.random((5, 3)) < 0.5),
        anchor=robot.anchor * (rng.random((4, 3)) < 0.5),
        inertia=robot.inertia * symmetric,
    )
    values = parameters(jax.tree.map(jnp.asarray, robot))
    flat = np.concatenate([np.ravel(x) for x in values])
    known = np.array([np.nan if k is None else k for k in known_parameters(pattern_of(robot))])
    np.testing.assert_array_equal(known[~np.isnan(known)], flat[~np.isnan(known)])
    of_mass, of_rotor = len(robot.mass), len(robot.gear_ratio)
    assert np.isnan(known[:of_mass]).all()
    assert np.isnan(known[-of_rotor:]).all()
    assert set(np.flatnonzero(flat == 0)) - set(range(len(flat) - of_rotor, len(flat))) <= set(
        np.flatnonzero(known == 0)
    )


def test_partly_traced_robots():
    """Whatever arrays are traced, the rotation is the same."""
    robot = signed(-1.0)
    for field in ("mass", "com", "inertia", "axis", "anchor"):
        turned = jax.jit(lambda value, field=field: reojax.net_rotation(robot.replace(**{field: value}), PATH))(
            getattr(robot, field)
        )
        np.testing.assert_allclose(turned, EXPECTED[-1.0]["net_rotation"], atol=1e-13)


def test_one_program_serves_a_tree():
    """New names, notes, gear ratios of 1, masses of 1, no rotors: nothing is compiled. Another zero: something is."""
    robot = reojax.robots.prototype()
    reojax.net_rotation(robot, PATH)
    compiled = _net_rotation._cache_size()
    others = [
        robot.replace(name="other", notes=("a note",), layout=None),
        robot.replace(link_names=tuple("abcd"), joint_names=tuple("uvw")),
        robot.replace(gear_ratio=np.ones(3)),
        robot.replace(mass=np.array([1.0, 0.0, 1.0, 1.0])),
        robot.replace(rotor_inertia=np.zeros(3)),
        robot.replace(axis=2 * robot.axis),
        robot.replace(lower=np.full(3, -1.0)),
    ]
    for other in others:
        reojax.net_rotation(other, PATH)
    assert _net_rotation._cache_size() == compiled
    reojax.net_rotation(robot.replace(com=robot.com + 0.01), PATH)
    assert _net_rotation._cache_size() == compiled + 1


def test_an_axis_of_zeros_has_no_answer():
    robot = reojax.robots.prototype()
    with jax.debug_nans(False):
        turned = reojax.net_rotation(robot.replace(axis=robot.axis * 0), PATH)
    assert np.isnan(turned).all()

"""A robot's arrays take `.at`, robots compare by value, print as tables, and refuse nonsense in `replace`."""

import pickle
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import robots
from reojax.robots.random import random_robot

ROBOT = robots.prototype()


# --- at --------------------------------------------------------------------------------------------------


def test_at_changes_a_copy_and_keeps_float64():
    """Without JAX's 64-bit mode too: the numbers never leave NumPy."""
    changed = ROBOT.inertia.at[0, 0, 0].set(1 / 3)
    assert changed[0, 0, 0] == 1 / 3
    assert changed.dtype == np.float64
    assert ROBOT.inertia[0, 0, 0] != 1 / 3
    copy = ROBOT.replace(inertia=changed)
    assert copy.inertia.at[0, 0, 0].add(1.0)[0, 0, 0] == 1 / 3 + 1
    assert not changed.flags.writeable


@pytest.mark.parametrize("name", ["set", "add", "subtract", "multiply", "mul", "divide", "power", "min", "max"])
def test_at_does_what_jax_s_does(name):
    values = np.arange(1.0, 5.0)
    robot = ROBOT.replace(mass=values)
    for index in (1, slice(1, 3), np.array([0, 2])):
        got = getattr(robot.mass.at[index], name)(2.5)
        np.testing.assert_allclose(got, getattr(jnp.asarray(values).at[index], name)(2.5))
    np.testing.assert_allclose(robot.mass.at[1].apply(jnp.sqrt), jnp.asarray(values).at[1].apply(jnp.sqrt))
    assert robot.mass.at[1].get() == 2.0


def test_at_takes_traced_values_and_indices():
    slope = jax.jit(jax.grad(lambda x: ROBOT.replace(mass=ROBOT.mass.at[1].set(x)).mass.sum()))(0.5)
    assert slope == 1.0
    np.testing.assert_allclose(jax.jit(lambda k: ROBOT.mass.at[k].set(7.0))(2)[2], 7.0)
    many = jax.vmap(lambda x: ROBOT.mass.at[0].set(x))(jnp.array([1.0, 2.0]))
    np.testing.assert_allclose(many[:, 0], [1, 2])


def test_jax_takes_a_robot_s_arrays_everywhere():
    """jit, vmap, grad, tree.map, jnp and np functions, pickling."""
    total = jax.jit(lambda robot: robot.mass.sum())
    np.testing.assert_allclose(total(ROBOT), 0.3)
    assert jax.tree.map(lambda leaf: leaf * 2, ROBOT).mass.at[0].get() == 2 * ROBOT.mass[0]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), ROBOT, ROBOT)
    np.testing.assert_allclose(jax.vmap(total)(stacked), [0.3, 0.3])
    np.testing.assert_allclose(jax.grad(lambda robot: robot.mass.sum())(ROBOT).mass, np.ones(4))
    np.testing.assert_allclose(jnp.concatenate([ROBOT.mass, ROBOT.mass]).sum(), 0.6)
    again = pickle.loads(pickle.dumps(ROBOT))
    assert again == ROBOT
    assert again.mass.at[0].set(1.0)[0] == 1.0


# --- equal -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", robots.NAMES)
def test_a_robot_equals_its_twin(name):
    robot, twin = robots.by_name(name), robots.by_name(name)
    assert robot == twin
    assert hash(robot) == hash(twin)
    assert robot == robot.replace(mass=np.array(robot.mass))


def test_robots_that_differ_in_one_bit_or_one_name_differ():
    for seed in range(5):
        robot = random_robot(seed, 4)
        for key in ("mass", "com", "inertia", "axis", "anchor", "gear_ratio"):
            value = np.array(getattr(robot, key))
            value.flat[-1] = np.nextafter(value.flat[-1], np.inf)
            assert robot != robot.replace(**{key: value})
        assert robot != robot.replace(name="other")
        assert robot != robot.replace(notes=("one",))
    assert ROBOT != ROBOT.replace(mass=np.asarray(ROBOT.mass, np.float32))
    assert ROBOT != "prototype"


# --- print -----------------------------------------------------------------------------------------------


def test_a_printed_robot_is_a_table():
    """One line a link, with joint, parent, limits in degrees, motors and capsules; notes at the end."""
    text = str(robots.satellite_arm())
    lines = text.splitlines()
    assert lines[0].startswith("satellite_arm: 8 links, 7 joints, 108.052 kg")
    (row,) = [line for line in lines if line.startswith("half_arm_1 ")]
    assert re.search(r"1\.1636 +1 +joint_2 +shoulder +-138\.1 \.\. 138\.1 +100 +5e-06 +parent", row)
    assert lines[-1].startswith("note: ")
    assert max(map(len, lines)) < 160


def test_the_short_form_stays_short_and_tells_notes():
    assert repr(robots.astronaut()).count("\n") == 0
    assert len(repr(robots.astronaut())) < 700
    assert "and 6 more" in repr(robots.astronaut())
    assert "segments: de Leva" in repr(robots.astronaut())


def test_printing_works_while_tracing():
    seen = []
    jax.jit(lambda robot: seen.append(f"{robot} {robot!r}") or robot.mass.sum())(ROBOT)
    assert "prototype" in seen[0]


# --- what is refused -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("mass", "abc", "`mass` is 'abc'; it must be an array of real numbers"),
        ("mass", ["a"] * 4, "real numbers"),
        ("mass", [True] * 4, "real numbers"),
        ("mass", [1j] * 4, "real numbers"),
        ("mass", None, "real numbers"),
        ("mass", [[1], [1, 2]], "real numbers"),
        ("mass", [0.1, -0.1, 0.1, 0.1], r"mass\[1\] \(link1\) is -0.1; it must not be negative"),
        ("mass", [0.1, np.nan, 0.1, 0.1], r"mass\[1\] \(link1\) is nan"),
        ("rotor_inertia", [0, 0, -1.0], r"rotor_inertia\[2\] \(twist2\)"),
        ("rotor_on", ("left", "parent", "child"), r"rotor_on\[0\] is 'left'"),
        ("rotor_on", "parent", "must list 3"),
        ("rotor_on", 3, "must list 3"),
        ("parent", (0, 5, 2), r"parent\[1\] is 5"),
        ("parent", (0, True, 2), r"parent\[1\] is True"),
        ("joint_names", ("a", "a", "b"), r"joint_names\[1\] is 'a'"),
        ("name", 3, "`name` is 3"),
        ("mass", "x" * 10**6, "real numbers"),
    ],
)
def test_replace_refuses_nonsense(field, value, words):
    with pytest.raises(ValueError, match=words) as caught:
        ROBOT.replace(**{field: value})
    assert len(str(caught.value)) < 500


def test_make_robot_under_jit_says_what_to_do_instead():
    def build(mass):
        parts = {key: getattr(ROBOT, key) for key in ("com", "inertia", "axis", "anchor")}
        return reojax.make_robot(mass=mass, **parts).mass.sum()

    with pytest.raises(ValueError, match=r"`mass` is traced.*robot\.replace\(mass=\.\.\.\).*with_"):
        jax.jit(build)(np.ones(4))
    assert build(jnp.ones(4)) == 4

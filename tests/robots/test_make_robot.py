"""The door of the library: what `make_robot` refuses and in which words, and what a `Robot` is afterwards."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from reojax import Capsule, Robot, make_robot, momentum_matrices

GOOD = {
    "mass": [2.0, 1.0, 0.5],
    "com": [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.2, 0.0]],
    "inertia": [np.diag([1.0, 2.0, 2.5]), np.diag([0.1, 0.2, 0.2]), np.diag([0.3, 0.2, 0.4])],
    "axis": [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]],
    "anchor": [[0.5, 0.0, 0.0], [0.3, 0.0, 0.1]],
    "parent": [0, 1],
    "rotor_inertia": [1e-4, 0.0],
    "gear_ratio": [24.0, -3.0],
    "rotor_on": ["parent", "child"],
    "lower": [-1.0, -2.0],
    "upper": [1.0, 2.0],
    "link_names": ["body", "arm", "hand"],
    "joint_names": ["shoulder", "wrist"],
    "name": "waver",
}
ROBOT = make_robot(**GOOD)
ARRAYS = {
    "mass": (3,),
    "com": (3, 3),
    "inertia": (3, 3, 3),
    "axis": (2, 3),
    "anchor": (2, 3),
    "rotor_inertia": (2,),
    "gear_ratio": (2,),
    "lower": (2,),
    "upper": (2,),
}
REQUIRED = ("mass", "com", "inertia", "axis", "anchor")
OPTIONAL = tuple(key for key in ARRAYS if key not in REQUIRED)


def refusal(**changes) -> str:
    """The message with which `make_robot` refuses the good robot with `changes`."""
    with pytest.raises(ValueError, match=".") as caught:
        make_robot(**GOOD | changes)
    return str(caught.value)


def changed(entry: str, index, value) -> np.ndarray:
    """The entry of the good robot with one element changed."""
    array = np.array(GOOD[entry], float)
    array[index] = value
    return array


# --- what is refused ------------------------------------------------------------------------------------


def test_the_good_robot_is_accepted_as_it_is():
    """The refusals below are then due to the change that each makes."""
    for key in ARRAYS:
        np.testing.assert_allclose(getattr(ROBOT, key), GOOD[key], rtol=1e-15)
    assert ROBOT.parent == (0, 1)
    assert ROBOT.rotor_on == ("parent", "child")
    assert ROBOT.link_names == ("body", "arm", "hand")
    assert ROBOT.joint_names == ("shoulder", "wrist")
    assert (ROBOT.name, ROBOT.links, ROBOT.joints) == ("waver", 3, 2)


NOT_FINITE = [(entry, bad) for entry in ARRAYS for bad in (np.nan, np.inf, -np.inf)]
UNLIMITED = [("lower", -np.inf), ("upper", np.inf)]
"""Limits alone may be infinite, each on its own side."""


@pytest.mark.parametrize(("entry", "bad"), [case for case in NOT_FINITE if case not in UNLIMITED])
def test_a_number_that_is_not_finite(entry, bad):
    index = (1,) + (0,) * (len(ARRAYS[entry]) - 1)
    message = refusal(**{entry: changed(entry, index, bad)})
    if (entry, bad) == ("upper", -np.inf):
        assert message == "lower[1] (wrist) is -2.0 rad; it must be below `upper`."
    else:
        assert message.replace(" (wrist)", "").startswith(f"{entry}[{', '.join(map(str, index))}] is {bad}")


@pytest.mark.parametrize(("entry", "bad"), UNLIMITED)
def test_a_joint_without_a_limit(entry, bad):
    assert np.array_equal(getattr(make_robot(**GOOD | {entry: changed(entry, 1, bad)}), entry)[1], bad)


@pytest.mark.parametrize("entry", ARRAYS)
@pytest.mark.parametrize("change", ["longer", "scalar", "deeper"])
def test_a_wrong_shape(entry, change):
    """The message gives the shape that came and the right one; mass sets the number of links."""
    array = np.array(GOOD[entry], float)
    wrong = {"longer": np.concatenate([array, array[:1]]), "scalar": 1.0, "deeper": array[None]}[change]
    message = refusal(**{entry: wrong})
    if entry == "mass" and change == "longer":
        assert "`axis` has shape (2, 3); it must be (3, 3)" in message
    else:
        right = "(n,)" if entry == "mass" else ARRAYS[entry]
        assert f"`{entry}` has shape {np.shape(wrong)}; it must be {right}" in message


@pytest.mark.parametrize("entry", ARRAYS)
@pytest.mark.parametrize(
    "make",
    [
        lambda a: a.astype(str),
        lambda a: "many",
        lambda a: [[1.0], [1.0, 2.0]],
        lambda a: a * 1j,
        lambda a: a > 0,
    ],
)
def test_what_is_no_array_of_numbers(entry, make):
    """Strings (those of digits too), ragged lists, complex numbers and truth values are not real numbers."""
    assert f"`{entry}`" in refusal(**{entry: make(np.array(GOOD[entry], float))})


@pytest.mark.parametrize("entry", REQUIRED)
def test_none_where_a_number_belongs(entry):
    assert f"`{entry}`" in refusal(**{entry: None})


@pytest.mark.parametrize("entry", REQUIRED)
def test_a_required_entry_is_missing(entry):
    with pytest.raises(TypeError, match=entry):
        make_robot(**{key: value for key, value in GOOD.items() if key != entry})


def test_no_links_at_all():
    assert "`mass` is empty" in refusal(mass=[])


def test_a_negative_mass():
    message = refusal(mass=[2.0, -1.5, 0.5])
    assert message == "mass[1] (arm) is -1.5 kg; a link's mass must not be negative."


def test_a_robot_without_any_mass():
    assert "`mass` is 0 kg for every link" in refusal(mass=[0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("axis", "length"), [([0.0, 0.5, 0.0], "0.5"), ([0.0, 0.0, 0.0], "0"), ([0.0, 1.00001, 0.0], "1.00001")]
)
def test_an_axis_that_is_not_a_unit_vector(axis, length):
    message = refusal(axis=[[1.0, 0.0, 0.0], axis])
    assert f"axis[1] (wrist) is {axis}, of length {length};" in message
    assert "unit length" in message


def test_an_axis_rounded_to_float32_is_made_a_unit_vector():
    axis = np.array(GOOD["axis"], np.float32)
    assert abs(np.linalg.norm(axis[1].astype(float)) - 1) > 1e-9
    length = np.linalg.norm(make_robot(**GOOD | {"axis": axis}).axis, axis=1)
    np.testing.assert_allclose(length, 1, rtol=1e-15)


@pytest.mark.parametrize(
    ("matrix", "rule", "value"),
    [
        (np.diag([1.0, 1.0, 2.1]), "sum of the other two", "2.1"),
        (np.diag([1.0, -0.5, 1.0]), "negative", "-0.5"),
        (-np.eye(3), "negative", "-1"),
        ([[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "symmetric", "0.1"),
        (
            [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            "sum of the other two",
            "2",
        ),  # a singular one, not diagonal
    ],
)
def test_an_inertia_that_no_rigid_body_has(matrix, rule, value):
    message = refusal(inertia=[GOOD["inertia"][0], matrix, GOOD["inertia"][2]])
    assert "inertia[1] (arm)" in message
    assert rule in message
    assert value in message


@pytest.mark.parametrize("inertia", [np.zeros((3, 3)), np.diag([0.0, 1.0, 1.0]), np.outer([0, 0, 1], [0, 0, 1]) * 0.0])
@pytest.mark.parametrize("mass", [0.0, 1.0])
def test_massless_links_point_masses_and_rods_are_legal_where_the_rest_moves_with_them(inertia, mass):
    """A link in the middle: the hand has inertia against every joint."""
    robot = make_robot(
        **GOOD | {"mass": [2.0, mass, 0.5], "inertia": [GOOD["inertia"][0], inertia, GOOD["inertia"][2]]}
    )
    A, B = momentum_matrices(robot, np.array([0.3, -0.4]))
    assert np.isfinite(A).all()
    assert np.linalg.eigvalsh(np.asarray(A))[0] > 0


def test_what_has_no_kinetic_energy_is_named():
    """A massless last link, a point mass on its own joint's axis, a lone point mass, and a rotor beyond its link."""
    none = np.zeros((3, 3))
    last = refusal(mass=[2.0, 1.0, 0.0], inertia=[*GOOD["inertia"][:2], none])
    assert "not positive for a motion of joint 'wrist'" in last
    on_axis = {"mass": [2.0, 1.0, 0.5], "inertia": [*GOOD["inertia"][:2], none], "com": [[0.0] * 3] * 3}
    assert "joint 'wrist'" in refusal(**on_axis)
    empty = np.zeros((0, 3))
    with pytest.raises(ValueError, match="the base about x, the base about y, the base about z"):
        make_robot(mass=[1.0], com=[[0, 0, 0]], inertia=[none], axis=empty, anchor=empty)
    assert "rotor has more than its link" in refusal(rotor_inertia=[9.0, 0.0], gear_ratio=[1.0, 1.0])


def test_a_posture_without_inertia_is_noted():
    """Thin rods in line have none about the line; bent they do."""
    rods = {"mass": [1.0] * 3, "com": [[0.5, 0, 0]] * 3, "inertia": [np.diag([0, 1, 1]) / 12] * 3}
    robot = make_robot(**rods, axis=[[0, 0, 1]] * 2, anchor=[[1, 0, 0]] * 2)
    assert robot.notes == (
        "at theta = 0 the kinetic energy is not positive for a motion of the base about x: start elsewhere",
    )


def test_limits_of_many_turns_are_asked_about():
    with pytest.warns(UserWarning, match=r"lower\[0\] \(shoulder\) is -170 rad, 27.1 turns: are these degrees"):
        make_robot(**GOOD | {"lower": [-170.0, -2.0]})
    make_robot(**GOOD | {"lower": [-20.0, -np.inf], "upper": [20.0, np.inf]})


def test_pairs_that_touch_at_rest_are_told_in_one_note():
    """Six spheres of links in a row, all at the same place: ten pairs of links that are not joined directly."""
    spheres = [Capsule(i, (0, 0, 0), (0, 0, 0), 1.0) for i in range(6)]
    chain = {"axis": [(0, 0, 1)] * 5, "anchor": [(0.01, 0, 0)] * 5, "com": np.zeros((6, 3))}
    robot = make_robot(mass=np.ones(6), inertia=[np.eye(3)] * 6, **chain, capsules=spheres)
    (note,) = robot.notes
    assert note.startswith("10 pairs of capsules touch at rest, and so not kept apart: of 'link0' and 'link2', ")
    assert note.endswith(", and of 7 more pairs of links")


@pytest.mark.parametrize("entry", [*GOOD, "capsules", "collision_pairs", "couplings", "notes"])
def test_a_megabyte_of_input_makes_a_short_message(entry):
    for huge in ("x" * 1_000_000, ["x" * 1_000_000] * 3, [["x" * 1_000_000]] * 2):
        if entry == "name" and isinstance(huge, str) or entry in ("link_names", "joint_names", "notes"):
            continue  # legal, or refused for its length
        assert len(refusal(**{entry: huge})) < 600


def test_a_flat_inertia_is_a_limit_that_is_allowed():
    """A plate's largest moment is the sum of the other two, whatever the rounding and the size."""
    for size in (1e-9, 1.0, 1e9):
        for turn in np.linalg.qr(np.random.default_rng(0).normal(size=(20, 3, 3)))[0]:
            plate = size * turn @ np.diag([0.1, 0.2, 0.1 + 0.2]) @ turn.T
            robot = make_robot(**GOOD | {"inertia": [plate, plate, plate]})
            np.testing.assert_allclose(robot.inertia[2], plate, rtol=0, atol=1e-15 * size)


@pytest.mark.parametrize(
    ("parent", "index", "value"),
    [
        ([0, 2], 1, "2"),
        ([1, 0], 0, "1"),
        ([0, -1], 1, "-1"),
        ([0, 0.0], 1, "0.0"),
        ([0, "0"], 1, "'0'"),
        ([0, True], 1, "True"),
    ],
)
def test_a_parent_that_is_no_earlier_link(parent, index, value):
    message = refusal(parent=parent)
    assert f"parent[{index}] is {value}" in message
    assert f"from 0 to {index}" in message


@pytest.mark.parametrize("entry", ["parent", "rotor_on", "link_names", "joint_names"])
@pytest.mark.parametrize("value", [[], ["parent"] * 4, 3])
def test_a_list_of_the_wrong_length(entry, value):
    assert f"`{entry}`" in refusal(**{entry: value})


def test_a_rotor_on_an_unknown_link():
    message = refusal(rotor_on=["parent", "base"])
    assert "rotor_on[1] is 'base'" in message
    assert "'parent' or 'child'" in message


def test_one_word_where_a_list_of_sides_belongs():
    assert "`rotor_on` is 'parent'" in refusal(rotor_on="parent")


def test_a_negative_rotor_inertia():
    message = refusal(rotor_inertia=[0.0, -1e-7])
    assert "rotor_inertia[1] (wrist) is -1e-07 kg m^2" in message
    assert "negative" in message


@pytest.mark.parametrize(("lower", "upper"), [([-1.0, 2.0], [1.0, 2.0]), ([-1.0, 2.5], [1.0, 2.0])])
def test_limits_that_leave_no_room(lower, upper):
    message = refusal(lower=lower, upper=upper)
    assert f"lower[1] (wrist) is {lower[1]} rad" in message
    assert "below `upper`" in message


@pytest.mark.parametrize("entry", ["link_names", "joint_names"])
def test_names(entry):
    """Distinct, strings, not empty."""
    good = GOOD[entry]
    assert f"{entry}[1] is {good[0]!r}" in refusal(**{entry: [good[0], *good[:-1]]})
    assert f"{entry}[1] is 7" in refusal(**{entry: [good[0], 7, *good[2:]]})
    assert f"{entry}[0] is ''" in refusal(**{entry: ["", *good[1:]]})
    one_word = "abc"[: len(good)]
    assert f"`{entry}` is {one_word!r}" in refusal(**{entry: one_word})


def test_a_robot_s_name_is_a_string():
    assert "`name` is 3" in refusal(name=3)


# --- defaults -------------------------------------------------------------------------------------------


def test_defaults():
    """A serial chain without rotors, gears or limits."""
    robot = make_robot(**{key: GOOD[key] for key in REQUIRED})
    assert robot.parent == (0, 1)
    assert robot.rotor_on == ("parent", "parent")
    assert np.array_equal(robot.rotor_inertia, [0, 0])
    assert np.array_equal(robot.gear_ratio, [1, 1])
    assert np.array_equal(robot.lower, [-np.inf, -np.inf])
    assert np.array_equal(robot.upper, [np.inf, np.inf])
    assert len(set(robot.link_names)) == 3
    assert len(set(robot.joint_names)) == 2
    assert robot.name == "robot"


def test_one_link_is_a_robot():
    none = np.zeros((0, 3))
    robot = make_robot(mass=[1.0], com=[[0, 0, 0]], inertia=[np.eye(3)], axis=none, anchor=none)
    assert (robot.links, robot.joints, robot.parent) == (1, 0, ())


# --- what a robot is ------------------------------------------------------------------------------------


def test_a_robot_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        ROBOT.mass = np.ones(3)
    for key in ARRAYS:
        with pytest.raises(ValueError, match="read-only"):
            getattr(ROBOT, key)[0] = 1.0


def test_a_robot_owns_its_numbers():
    """Changing the arrays it was made from does not change it."""
    given = {key: np.array(GOOD[key], float) for key in ARRAYS}
    robot = make_robot(**GOOD | given)
    for key, array in given.items():
        array *= 2
        np.testing.assert_allclose(getattr(robot, key), GOOD[key], rtol=1e-15)


def test_a_robot_is_a_tree_of_its_arrays():
    leaves = jax.tree.leaves(ROBOT)
    shapes = (0, 3), (0, 3), (0,), (0,), (0,)  # no capsules, no coupled joints
    assert sorted(leaf.shape for leaf in leaves) == sorted([*ARRAYS.values(), *shapes])
    assert all(leaf.dtype == np.float64 for leaf in leaves)
    double = jax.tree.map(lambda leaf: 2 * leaf, ROBOT)
    assert isinstance(double, Robot)
    for key in ARRAYS:
        assert np.array_equal(getattr(double, key), 2 * getattr(ROBOT, key))
    for key in set(GOOD) - set(ARRAYS):
        assert getattr(double, key) == getattr(ROBOT, key)
    assert jax.tree.structure(double) == jax.tree.structure(ROBOT)
    assert jax.tree.structure(ROBOT.replace(parent=(0, 0))) != jax.tree.structure(ROBOT)


def roll_inertia(robot: Robot) -> jax.Array:
    return momentum_matrices(robot, np.array([0.3, -0.4])).A[0, 0]


def test_the_gradient_with_respect_to_a_robot_is_a_robot():
    slope = jax.jit(jax.grad(roll_inertia))(ROBOT)
    assert isinstance(slope, Robot)
    assert jax.tree.structure(slope) == jax.tree.structure(ROBOT)
    for key, shape in ARRAYS.items():
        assert getattr(slope, key).shape == shape
        assert np.isfinite(getattr(slope, key)).all()
    assert slope.inertia[0, 0, 0] == 1
    assert np.array_equal(slope.lower, [0, 0])
    assert np.all(np.asarray(slope.mass) > 0)


def test_vmap_over_one_array():
    masses = jnp.array([GOOD["mass"], [3.0, 1.0, 0.1]])
    got = jax.jit(jax.vmap(lambda mass: roll_inertia(ROBOT.replace(mass=mass))))(masses)
    one_by_one = [float(roll_inertia(make_robot(**GOOD | {"mass": mass}))) for mass in np.asarray(masses)]
    np.testing.assert_allclose(got, one_by_one, rtol=1e-13)


# --- replace --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("entry", ARRAYS)
def test_replace_changes_one_field_of_a_copy(entry):
    new = np.array(getattr(ROBOT, entry)) * 0.5
    copy = ROBOT.replace(**{entry: new.tolist()})
    assert np.array_equal(getattr(copy, entry), new)
    assert np.array_equal(getattr(ROBOT, entry), 2 * new)
    for other in set(GOOD) - {entry}:
        assert getattr(copy, other) is getattr(ROBOT, other)


def test_replace_changes_names_and_structure():
    copy = ROBOT.replace(name="twin", parent=[0, 0], rotor_on=["child", "child"])
    assert (copy.name, copy.parent, copy.rotor_on) == ("twin", (0, 0), ("child", "child"))
    assert copy.mass is ROBOT.mass


@pytest.mark.parametrize("entry", [*ARRAYS, "parent", "rotor_on", "link_names", "joint_names"])
def test_replace_refuses_a_wrong_shape(entry):
    new = [*GOOD[entry], GOOD[entry][0]]
    expected = ARRAYS.get(entry, (len(GOOD[entry]),))
    with pytest.raises(ValueError, match=f"`{entry}` has shape") as caught:
        ROBOT.replace(**{entry: new})
    assert str(expected) in str(caught.value)
    assert str((expected[0] + 1, *expected[1:])) in str(caught.value)


def test_replace_refuses_an_unknown_field():
    with pytest.raises(ValueError, match="no field 'weight'.*mass"):
        ROBOT.replace(weight=1.0)


def test_replace_takes_traced_values():
    """Under jit and grad; the slope along a mass is that of differences."""

    @jax.jit
    def slope(size):
        return jax.grad(lambda m: roll_inertia(ROBOT.replace(mass=jnp.stack([2.0, 1.0, m]))))(size)

    step = 1e-6
    ends = [roll_inertia(ROBOT.replace(mass=[2.0, 1.0, 0.5 + d])) for d in (step, -step)]
    np.testing.assert_allclose(slope(0.5), (ends[0] - ends[1]) / (2 * step), rtol=1e-8)
    assert float(slope(0.5)) > 0


def test_repr_names_the_robot_and_its_joints():
    assert repr(ROBOT) == "Robot('waver', 3 links, joints shoulder, wrist)"

"""The named robots: published numbers kept, the thesis's trends shown, exact answers met."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.typing import ArrayLike

import reojax
from reojax import robots, so3
from reojax.mechanics.kinematics import kinematics
from reojax.robots.prototype import Chosen

PROTOTYPE = robots.prototype()
TWIST, BEND = np.deg2rad(270), np.deg2rad(120)
FULL = reojax.manoeuvre_a(TWIST, BEND).waypoints
MM2 = 1e-6  # kg mm^2 in kg m^2
END_INERTIAS = np.arange(10, 191, 30) * MM2  # thesis figure 2.8
RATIOS = np.array([1.0, 12, 24, 36, 48])  # thesis figure 2.9
ROTORS = 70 * MM2 / np.array([1400, 700, 350, 175, 87.5])


def roll_and_tilt(history):
    """Roll about z, unwrapped along the path, and the angle between the roll axis before and after [rad]."""
    about_z = jnp.arctan2(history[:, 1, 0] - history[:, 0, 1], history[:, 0, 0] + history[:, 1, 1])
    last = history[-1]
    tilt = jnp.arctan2(jnp.sqrt(last[0, 2] ** 2 + last[1, 2] ** 2 + 1e-300), last[2, 2])
    return jnp.unwrap(about_z)[-1], tilt


@jax.jit
@jax.vmap
def _turns(inertia, ratio, rotor, waypoints):
    robot = robots.with_rotor_inertia(robots.with_gear_ratio(PROTOTYPE, ratio), rotor)
    robot = robots.with_end_inertia(robot, inertia)
    history = reojax.rotation_history(robot, reojax.Path(waypoints), samples=8)
    return *roll_and_tilt(history), so3.log(history[-1])


def turns(
    inertia: ArrayLike = 70 * MM2,
    ratio: ArrayLike = 24.0,
    rotor: ArrayLike = 0.1 * MM2,
    waypoints: ArrayLike = FULL,
) -> list[np.ndarray]:
    """Roll, tilt and rotation vector [deg] of the prototype, for columns of designs or paths."""
    shapes = [np.shape(inertia), np.shape(ratio), np.shape(rotor), np.shape(waypoints)[:-2]]
    (count,) = np.broadcast_shapes(*shapes, (1,))
    some = np.resize(np.arange(count), 25)  # one batch size, one compilation
    columns = [np.broadcast_to(np.asarray(x, float), (count,))[some] for x in (inertia, ratio, rotor)]
    paths = np.broadcast_to(waypoints, (count, *FULL.shape))[some]
    return [np.rad2deg(np.asarray(column))[:count] for column in _turns(*columns, paths)]


net_rotation = jax.jit(reojax.net_rotation)


# --- the prototype ---------------------------------------------------------------------------------------


def distal_inertia(robot):
    """Inertia of both end links about their distal joints, by the parallel axis theorem [kg m^2]."""
    return [robot.inertia[i, 2, 2] + robot.mass[i] * (robot.com[i, :2] ** 2).sum() for i in (0, 3)]


def test_prototype_keeps_the_published_numbers():
    assert (PROTOTYPE.links, PROTOTYPE.joints) == (4, 3)
    assert PROTOTYPE.mass.sum() == pytest.approx(0.3, rel=1e-12)
    assert distal_inertia(PROTOTYPE) == pytest.approx([70 * MM2] * 2, rel=1e-12)
    np.testing.assert_array_equal(PROTOTYPE.rotor_inertia, 0.1 * MM2)
    np.testing.assert_array_equal(PROTOTYPE.gear_ratio, 24)
    # the motors of joints 0 and 2 sit in links 1 and 2, the centre joint's in one of these
    assert PROTOTYPE.rotor_on == ("child", "parent", "parent")
    np.testing.assert_allclose(PROTOTYPE.upper, np.deg2rad([270, 120, 270]), rtol=1e-15)
    np.testing.assert_allclose(PROTOTYPE.lower, -PROTOTYPE.upper, rtol=1e-15)


def test_rotors_are_small_parts_of_their_links():
    for joint, link in enumerate((1, 1, 2)):
        along = PROTOTYPE.axis[joint]
        assert ROTORS.max() < 0.1 * along @ PROTOTYPE.inertia[link] @ along


def test_prototype_s_halves_are_a_half_turn_apart():
    turn = np.diag([-1.0, 1.0, -1.0])
    np.testing.assert_array_equal(PROTOTYPE.mass, PROTOTYPE.mass[::-1])
    np.testing.assert_allclose(PROTOTYPE.com[3], turn @ PROTOTYPE.com[0], atol=1e-18)
    np.testing.assert_allclose(PROTOTYPE.inertia[3], turn @ PROTOTYPE.inertia[0] @ turn, atol=1e-20)
    np.testing.assert_array_equal(PROTOTYPE.inertia[1], PROTOTYPE.inertia[2])


@pytest.mark.parametrize("sign", [1, -1])
def test_manoeuvre_a_rolls_about_half_a_turn_with_the_sign_of_its_twist(sign):
    (roll,), (tilt,), _ = turns(waypoints=reojax.manoeuvre_a(sign * TWIST, BEND).waypoints[None])
    assert 174 < sign * roll < 192
    assert 0.5 < tilt < 5


def test_bent_backwards_a_rolls_the_same_way():
    (roll,), (tilt,), _ = turns(waypoints=reojax.manoeuvre_a(TWIST, -BEND).waypoints[None])
    assert 120 < roll < 140
    assert tilt < 8


@pytest.mark.parametrize(("twist", "bend"), [(TWIST, BEND), (-TWIST, BEND), (TWIST, -BEND)])
def test_manoeuvre_b_is_smaller_and_yaw(twist, bend):
    _, _, vector = turns(waypoints=reojax.manoeuvre_b(twist, bend).waypoints[None])
    pitch, yaw, roll = np.abs(vector[0])
    assert yaw > 50 * max(pitch, roll)
    assert 30 < yaw < 90


def test_without_the_centre_rotor_b_is_pure_yaw():
    """Symmetric under a half turn about y but for that rotor."""
    robot = PROTOTYPE.replace(rotor_inertia=PROTOTYPE.rotor_inertia * [1, 0, 1])
    pitch, yaw, roll = so3.log(net_rotation(robot, reojax.manoeuvre_b(TWIST, BEND)))
    assert abs(yaw) > 0.5
    assert max(abs(pitch), abs(roll)) < 1e-9


def test_roll_grows_smoothly_with_the_amplitudes_and_its_axis_hardly_varies():
    """Thesis figure 2.7."""
    twists, bends = np.deg2rad(np.linspace(0, 270, 5)), np.deg2rad(np.linspace(0, 120, 5))
    paths = np.stack([reojax.manoeuvre_a(t, b).waypoints for t in twists for b in bends])
    roll, _, vector = turns(waypoints=paths)
    roll = roll.reshape(5, 5)
    assert np.abs(roll[0]).max() < 1e-9  # nothing twists
    assert np.abs(roll[:, 0]).max() < 1e-9  # nothing bends
    assert (np.diff(roll[:, 1:], axis=0) > 0).all()
    assert (np.diff(roll[1:], axis=1) > 0).all()
    axes = vector[np.outer(twists, bends).ravel() > 0]
    axes = axes * np.sign(axes[:, 2:]) / np.linalg.norm(axes, axis=1, keepdims=True)
    assert axes @ axes.mean(0) == pytest.approx(1, abs=1 - np.cos(np.deg2rad(6)))


def test_end_inertia_helps_up_to_about_100_and_costs_past_it():
    """Thesis figure 2.8: past the peak less roll and more off-axis rotation."""
    roll, tilt, _ = turns(inertia=END_INERTIAS)
    best = np.argmax(roll)
    assert 90 <= END_INERTIAS[best] / MM2 <= 130
    assert (np.diff(roll[: best + 1]) > 0).all()
    assert (np.diff(roll[best:]) < 0).all()
    assert roll[best] - roll[-1] > 5
    assert (np.diff(tilt) > 0).all()
    assert tilt[-1] > 1.5 * tilt[2]


def test_gear_ratio_and_rotor_inertia_both_help():
    """Thesis figure 2.9."""
    ratio, rotor = (grid.ravel() for grid in np.meshgrid(RATIOS, ROTORS, indexing="ij"))
    roll = turns(ratio=ratio, rotor=rotor)[0].reshape(5, 5)
    assert (np.diff(roll, axis=0) > 0).all()
    assert (np.diff(roll, axis=1) > 0).all()


def test_heavy_middle_links_end_in_no_reorientation():
    """Thesis 2.7.2."""
    heavy = PROTOTYPE.replace(inertia=PROTOTYPE.inertia * np.array([1, 1e6, 1e6, 1])[:, None, None])
    assert so3.angle(net_rotation(heavy, reojax.Path(FULL))) < np.deg2rad(0.5)


def test_chosen_numbers_can_be_changed_and_published_ones_stay():
    robot = robots.prototype(Chosen(middle_mass=0.07, shank_mass=0.06, foot_angle=0.0))
    assert robot.mass.sum() == pytest.approx(0.3, rel=1e-12)
    assert distal_inertia(robot) == pytest.approx([70 * MM2] * 2, rel=1e-12)
    assert robot.com[0, 0] == 0
    with pytest.raises(ValueError, match="leave .* kg for each steel insert"):
        robots.prototype(Chosen(middle_mass=0.16))


# --- changing its design ---------------------------------------------------------------------------------


def test_end_inertia_is_set_and_the_rest_stays():
    for inertia in (*END_INERTIAS, 1e-9, 1.0):
        robot = robots.with_end_inertia(PROTOTYPE, inertia)
        assert distal_inertia(robot) == pytest.approx([inertia] * 2, rel=1e-12)
        np.testing.assert_array_equal(robot.mass, PROTOTYPE.mass)
        np.testing.assert_array_equal(robot.com[1:3], PROTOTYPE.com[1:3])
        np.testing.assert_array_equal(robot.inertia[1:3], PROTOTYPE.inertia[1:3])
        np.testing.assert_allclose(robot.com[:, 2], PROTOTYPE.com[:, 2], rtol=1e-15)
        for moment in robot.inertia:  # a body can have it
            small, middle, large = np.linalg.eigvalsh(moment)
            assert small > 0
            assert large <= (small + middle) * (1 + 1e-9)


def test_end_inertia_of_the_prototype_changes_nothing():
    robot = robots.with_end_inertia(PROTOTYPE, 70 * MM2)
    for new, old in zip(jax.tree.leaves(robot), jax.tree.leaves(PROTOTYPE), strict=True):
        np.testing.assert_allclose(new, old, rtol=1e-13, atol=1e-19)


def test_end_inertia_may_be_changed_twice():
    robot = robots.with_end_inertia(robots.with_end_inertia(PROTOTYPE, 10 * MM2), 190 * MM2)
    for new, old in zip(
        jax.tree.leaves(robot), jax.tree.leaves(robots.with_end_inertia(PROTOTYPE, 190 * MM2)), strict=True
    ):
        np.testing.assert_allclose(new, old, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize(
    ("change", "value", "fields"),
    [
        (robots.with_end_inertia, 100e-6, {"com", "inertia"}),
        (robots.with_gear_ratio, 12.0, {"gear_ratio"}),
        (robots.with_rotor_inertia, 2e-7, {"rotor_inertia"}),
    ],
)
def test_changes_keep_other_leaves_and_dtypes(change, value, fields):
    plain = change(PROTOTYPE, value)
    for field in ("mass", "com", "inertia", "axis", "anchor", "rotor_inertia", "gear_ratio", "lower", "upper"):
        old, new = getattr(PROTOTYPE, field), getattr(plain, field)
        assert (new is old) == (field not in fields)
        assert isinstance(new, np.ndarray)
        assert new.dtype == np.float64
        assert (not np.array_equal(new, old)) == (field in fields)
    traced = jax.jit(change)(PROTOTYPE, value)
    single = jax.jit(change)(PROTOTYPE, np.float32(value))
    for field in fields:
        np.testing.assert_allclose(getattr(traced, field), getattr(plain, field), rtol=1e-12, atol=1e-18)
        assert getattr(traced, field).dtype == np.float64
        assert getattr(single, field).dtype == np.float32
        np.testing.assert_allclose(getattr(single, field), getattr(plain, field), rtol=1e-5, atol=1e-10)


def test_changes_have_right_derivatives():
    size = jnp.array([70 * MM2, 24.0, 0.1 * MM2])

    @jax.jit
    def momenta(scale):
        inertia, ratio, rotor = scale * size
        robot = robots.with_rotor_inertia(robots.with_gear_ratio(PROTOTYPE, ratio), rotor)
        A, B = reojax.momentum_matrices(robots.with_end_inertia(robot, inertia), jnp.array([0.3, 0.5, -0.2]))
        return 1e6 * jnp.concatenate([A, B], axis=1)

    one, step = jnp.ones(3), 1e-4
    exact = jax.jit(jax.jacrev(momenta))(one)
    for k in range(3):
        move = step * jnp.eye(3)[k]
        numeric = (momenta(one + move) - momenta(one - move)) / (2 * step)
        np.testing.assert_allclose(exact[..., k], numeric, atol=1e-4)
        assert np.abs(exact[..., k]).max() > 0.1


def test_one_value_a_joint():
    robot = robots.with_gear_ratio(robots.with_rotor_inertia(PROTOTYPE, [1e-7, 0, 3e-7]), [1, 2, 3])
    np.testing.assert_array_equal(robot.rotor_inertia, [1e-7, 0, 3e-7])
    np.testing.assert_array_equal(robot.gear_ratio, [1, 2, 3])


@pytest.mark.parametrize(
    ("change", "value", "message"),
    [
        (robots.with_end_inertia, 0.0, "`inertia` is 0.0; it must be one positive, finite number"),
        (robots.with_end_inertia, np.nan, "`inertia` is nan"),
        (robots.with_end_inertia, np.inf, "`inertia` is inf"),
        (robots.with_end_inertia, [1e-6, 2e-6], "must be one positive, finite number"),
        (robots.with_gear_ratio, np.inf, "`ratio` is inf; it must be finite"),
        (robots.with_gear_ratio, [1.0, 2.0], r"`ratio` has shape \(2,\)"),
        (robots.with_rotor_inertia, -1e-7, "`inertia` is -1e-07; it must be finite and not negative"),
    ],
)
def test_impossible_designs_are_named(change, value, message):
    with pytest.raises(ValueError, match=message):
        change(PROTOTYPE, value)


def test_end_inertia_is_for_the_four_link_robot():
    with pytest.raises(ValueError, match="'six_body' has 6 links"):
        robots.with_end_inertia(robots.six_body(), 70 * MM2)


# --- the six-link cat ------------------------------------------------------------------------------------


def test_folded_feet_make_the_prototype():
    """Same masses in the same places, seen from the shank."""
    robot = robots.six_body()
    theta = np.zeros(5)
    theta[[0, 4]] = reojax.SIX_BODY.fold_angle
    theta[[1, 2, 3]] = shape = np.array([0.4, 1.1, -2.0])
    six, four = jax.jit(kinematics)(robot, theta), jax.jit(kinematics)(PROTOTYPE, shape)
    assert robot.mass[:2].sum() == pytest.approx(PROTOTYPE.mass[0], rel=1e-12)

    # mass tensors about the common centre of mass, both in the frame of the first shank
    def spread(robot, pose, turn, links):
        centre = np.asarray(pose.com)[links] @ turn
        inertia = turn.T @ np.asarray(pose.rotation)[links] @ robot.inertia[links]
        inertia = inertia @ np.asarray(pose.rotation)[links].transpose(0, 2, 1) @ turn
        lever = np.einsum("ia,ia,bc->ibc", centre, centre, np.eye(3)) - np.einsum("ib,ic->ibc", centre, centre)
        return (inertia + robot.mass[links, None, None] * lever).sum(0)

    shank = np.asarray(six.rotation[1])
    for those, these in (([0, 1], [0]), ([2], [1]), ([3], [2]), ([4, 5], [3])):
        np.testing.assert_allclose(
            spread(robot, six, shank, those), spread(PROTOTYPE, four, np.eye(3), these), atol=1e-15
        )


@pytest.mark.parametrize(("manoeuvre", "least", "most"), [(reojax.manoeuvre_a, 174, 192), (reojax.manoeuvre_b, -5, 5)])
def test_six_links_turn_as_far_as_four(manoeuvre, least, most):
    """The same loop, seen from the folded foot, between folding and unfolding: a conjugate rotation."""
    history = reojax.rotation_history(robots.six_body(), manoeuvre(TWIST, BEND, reojax.SIX_BODY), samples=8)
    four = net_rotation(PROTOTYPE, manoeuvre(TWIST, BEND))
    assert float(so3.angle(history[-1])) == pytest.approx(float(so3.angle(four)), abs=1e-9)
    roll, tilt = np.rad2deg(roll_and_tilt(history))
    assert least < roll < most
    assert tilt < (8 if manoeuvre is reojax.manoeuvre_a else 90)


# --- planar rods -----------------------------------------------------------------------------------------


def yaw_along(robot, degrees):
    history = np.asarray(reojax.rotation_history(robot, reojax.polygon(np.deg2rad(degrees)), samples=8))
    return np.rad2deg(np.unwrap(np.arctan2(history[:, 1, 0], history[:, 0, 0])))[-1]


def test_two_unequal_rods():
    robot = robots.planar(2, mass=(2, 1), length=(1, 0.5))
    assert yaw_along(robot, [[0.0], [90]]) == pytest.approx(-20.44674731982584, abs=1e-9)
    assert yaw_along(robot, [[0.0], [360]]) == pytest.approx(-44.21942835455569, abs=1e-9)


def test_two_equal_rods():
    assert yaw_along(robots.planar(2), [[0.0], [360]]) == pytest.approx(-180, abs=1e-9)


@pytest.mark.parametrize(
    ("sides", "exact"), [((90, 90), -7.508704554953), ((60, -120), -1.634222061396), ((70, -70), 0)]
)
def test_three_equal_rods(sides, exact):
    a, b = sides
    corners = [[0.0, 0], [a, 0], [a, b], [0, b], [0, 0]]
    assert yaw_along(robots.planar(3), corners) == pytest.approx(exact, abs=1e-9)
    # sizes play no part
    assert yaw_along(robots.planar(3, mass=0.2, length=3.0), corners) == pytest.approx(exact, abs=1e-9)


@pytest.mark.parametrize("n", [1, 0, -2, 2.5, 2.0, True, "3", None])
def test_a_number_of_rods_is_an_integer_from_two(n):
    with pytest.raises(ValueError, match="`n` is .*at least 2"):
        robots.planar(n)


@pytest.mark.parametrize("sizes", [{"mass": 0.0}, {"mass": (1, 2, 3)}, {"length": -1.0}, {"length": (1, np.inf)}])
def test_sizes_of_rods_are_positive(sizes):
    with pytest.raises(ValueError, match="|".join(sizes)):
        robots.planar(2, **sizes)


# --- the two-cylinder cat --------------------------------------------------------------------------------


def kane_and_scher(ratio, bend):
    """Turn of the bent cat about its long axis, both halves rolled once (Kane and Scher 1969) [rad]."""
    return 2 * np.pi * ratio * np.cos(bend / 2) / (np.sin(bend / 2) ** 2 + ratio * np.cos(bend / 2) ** 2)


def turned_cat(ratio, path):
    return reojax.net_rotation(robots.two_cylinder_cat(ratio), path, steps=20)  # full turns of flat discs too


def test_the_cat_turns_half_a_turn():
    rotation = turned_cat(0.25, reojax.manoeuvre_a(-2 * np.pi, np.deg2rad(60)))
    x, y, z = np.rad2deg(so3.log(rotation))
    assert z == pytest.approx(178.15379734994, abs=1e-7)
    assert max(abs(x), abs(y)) < 1e-7


@pytest.mark.parametrize(("ratio", "bend"), [(0.25, 60), (0.25, -60), (0.1, 100), (1.0, 40), (1.9, 120), (0.02, 150)])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_cat_meets_the_formula(ratio, bend, sign):
    bend = np.deg2rad(bend)
    rotation = turned_cat(ratio, reojax.manoeuvre_a(-sign * 2 * np.pi, bend))
    exact = so3.exp(np.array([0, 0, sign * kane_and_scher(ratio, bend)]))
    np.testing.assert_allclose(rotation, exact, atol=1e-9)


def test_the_cat_s_halves_are_cylinders_of_the_ratio():
    cat = robots.two_cylinder_cat(0.4)
    for front, waist in ((0, 1), (3, 2)):
        np.testing.assert_allclose(cat.com[front], cat.com[waist], rtol=1e-12)
        x, y, z = np.diag(cat.inertia[front] + cat.inertia[waist])
        assert (z / x, z / y) == pytest.approx((0.4, 0.4), rel=1e-12)


@pytest.mark.parametrize("ratio", [0.0, -0.25, 2.0, np.nan, np.inf])
def test_a_ratio_that_no_cylinder_has(ratio):
    with pytest.raises(ValueError, match="`axial_to_transverse` is"):
        robots.two_cylinder_cat(ratio)


# --- by name ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", robots.NAMES)
def test_every_name_is_a_robot_that_can_be(name):
    """Of its name; it has inertia about every axis, and its rest posture is within its limits."""
    robot = robots.by_name(name)
    assert robot.name == name
    assert ((robot.lower <= 0) & (robot.upper >= 0)).all()
    locked, _ = reojax.momentum_matrices(robot, np.full(robot.joints, 0.1))
    assert np.linalg.eigvalsh(locked)[0] > 0


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(ValueError, match="no robot named 'cat'.*prototype, six_body, planar2"):
        robots.by_name("cat")


def test_capsules_of_the_ends_go_with_their_mass():
    """A heavier end is a longer foot: its farthest capsule end moves out from the axis by the mass's factor."""
    robot = robots.prototype()
    present = 70e-6
    changed = robots.with_end_inertia(robot, 4 * present)
    last = [k for k, link in enumerate(robot.capsule_link) if link == 3]
    for ends in ("capsule_start", "capsule_end"):
        before, after = (np.asarray(getattr(r, ends), float) for r in (robot, changed))
        np.testing.assert_allclose(after[last][:, :2], 2 * before[last][:, :2], atol=1e-12)  # the axis is z
        np.testing.assert_allclose(after[last][:, 2], before[last][:, 2], atol=1e-12)
        middle = [k for k, link in enumerate(robot.capsule_link) if link in (1, 2)]
        np.testing.assert_array_equal(after[middle], before[middle])

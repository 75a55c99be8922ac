"""Variables, loops, measures and edits: what they promise, and design problems with known answers."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import design, joint_travel, so3
from reojax.design import Problem, Variable
from reojax.optimisation.status import Status
from reojax.robots.random import random_robot

ROBOT = random_robot(3, 3, limits=(-1.5, 2.0)).replace(layout=reojax.FOUR_BODY)
PROTOTYPE = reojax.robots.prototype()
FAMILIES = {
    "rectangle": design.rectangles(ROBOT),
    "rectangle with a lead": design.rectangles(ROBOT, lead=True, start=0.2),
    "polygon": design.polygons(ROBOT, 3, start=[0.1, 0.0, -0.2]),
    "Fourier": design.fourier_loops(ROBOT, 3, start=0.1),
    "spline": design.spline_loops(ROBOT, 6, start=0.1, samples=40),
}
ORIGIN = {"rectangle": 0.0, "rectangle with a lead": 0.2, "polygon": [0.1, 0.0, -0.2], "Fourier": 0.1, "spline": 0.1}


@pytest.mark.parametrize("family", FAMILIES)
def test_loops_close_and_keep_the_limits(family):
    """Random loops begin and end at the start exactly, and where the conditions hold they are inside."""
    loop = FAMILIES[family]
    x = loop.random(np.random.default_rng(0), 20)
    assert x.shape == (20, np.size(loop.variable.lower))
    assert ((loop.variable.lower <= x) & (x <= loop.variable.upper)).all()
    wild = np.random.default_rng(1).uniform(loop.variable.lower, loop.variable.upper, x.shape)
    points = jax.vmap(lambda x: loop.path(x).waypoints)(np.concatenate([x, wild]))
    origin = np.broadcast_to(ORIGIN[family], 3)
    assert (np.asarray(points[:, 0]) == origin).all()
    assert (np.asarray(points[:, -1]) == origin).all()
    broken = jax.vmap(loop.inequality)(np.concatenate([x, wild])).max(1, initial=-1) > 1e-12
    outside = ((points < -1.5 - 1e-12) | (points > 2 + 1e-12)).any((1, 2))
    assert not (outside & ~broken).any()
    assert not broken[:20].any()
    assert np.ptp(np.asarray(points[:20]), axis=1).min(axis=1).max() > 0.1


@pytest.mark.parametrize("family", ["rectangle", "rectangle with a lead", "polygon"])
def test_travel_of_parts_is_joint_travel(family):
    loop = FAMILIES[family]
    for x in loop.random(np.random.default_rng(0), 5):
        np.testing.assert_allclose(loop.equality(x), 0, atol=1e-12)
        np.testing.assert_allclose(loop.travel(x), joint_travel(loop.path(x)), rtol=1e-12)


@pytest.mark.parametrize("family", ["Fourier", "spline"])
def test_travel_of_smooth_loops(family):
    """Smoothed: short of the true one by at most samples * joints * epsilon."""
    loop = FAMILIES[family]
    for x in loop.random(np.random.default_rng(0), 5):
        if family == "spline":  # the loop that begins at the start needs its condition met
            x = (x.reshape(6, 3) - np.asarray(loop.equality(x))).ravel()
        short = float(joint_travel(loop.path(x)) - loop.travel(x))
        assert 0 < short < 64 * 3 * design.smooth.EPSILON


def test_smooth_loops_are_inside_between_their_samples():
    """Loops that touch their conditions, looked at 20 times as finely."""
    degree, rng = 4, np.random.default_rng(5)
    loop = design.fourier_loops(ROBOT, degree, samples=9)
    fine = 2 * np.pi * np.linspace(0, 1, 1281)[:, None] * np.arange(1, degree + 1)
    basis = np.concatenate([np.cos(fine) - 1, np.sin(fine)], axis=1)
    multiples = np.linspace(0, 3, 400)
    most = jax.jit(lambda x: jax.vmap(loop.inequality)(multiples[:, None] * x[None]).max(1) <= 0)
    for _ in range(20):
        x = rng.normal(size=6 * degree)
        theta = basis @ (multiples[np.asarray(most(x))].max() * x).reshape(-1, 3)
        assert theta.min() > -1.5
        assert theta.max() < 2
        assert max((theta / 2).max(), (theta / -1.5).max()) > 0.9


# --- measures --------------------------------------------------------------------------------------------------


class Fixed:
    """An outcome with a given rotation."""

    robot = PROTOTYPE

    def __init__(self, rotation, path=None, values=None):
        self.rotation, self.path, self.values = jnp.asarray(rotation), path, values


@pytest.mark.parametrize("angle", [np.pi, -np.pi, 2.5 * np.pi])
def test_turn_about_an_axis(angle):
    """Twist less the target, on the near side, half turns included; the tilt does not count."""
    axis = np.array([0.0, 0.6, 0.8])
    measure = design.turned_about(axis * 2, angle)

    def of(extra, tilt):
        rotation = so3.exp(tilt * np.array([1.0, 0, 0])) @ so3.exp((angle + extra) * axis)
        return measure(Fixed(rotation))

    extras, tilts = np.repeat([-0.4, 0.0, 0.3], 2), np.tile([0.0, 0.2], 3)
    values, slopes = jax.jit(jax.vmap(jax.value_and_grad(of)))(extras, tilts)
    np.testing.assert_allclose(values, extras, atol=1e-12)
    np.testing.assert_allclose(slopes, 1, atol=1e-12)


def test_tilt_of_an_axis():
    inside, axis = design.off_axis_within([0, 0, 1], 0.2), np.array([0, 0, 1.0])
    for tilt in (0.1, 0.2, 0.4):
        rotation = so3.exp(np.array([tilt, 0, 0])) @ so3.exp(2 * axis)
        expected = (np.sin(tilt / 2) / np.sin(0.1)) ** 2 - 1
        np.testing.assert_allclose(inside(Fixed(rotation)), expected, atol=1e-12)


def test_distance_to_a_half_turn_is_smooth():
    target = so3.exp(np.array([0, 0, np.pi]))
    near = lambda v: design.turned_to(np.asarray(target))(Fixed(target @ so3.exp(v)))
    np.testing.assert_allclose(near(jnp.array([0.01, -0.02, 0.03])), [0.01, -0.02, 0.03], atol=1e-14)
    np.testing.assert_allclose(jax.jacrev(near)(jnp.zeros(3)), np.eye(3), atol=1e-12)


def test_area_and_weights():
    """A rectangle's area, wherever it stands; in a plane askew the parts add up as a vector."""
    square = np.array([[1, 1, 0], [3, 1, 0], [3, 4, 0], [1, 4, 0], [1, 1, 0.0]])
    np.testing.assert_allclose(design.loop_area(Fixed(np.eye(3), reojax.polygon(square))), 6, rtol=1e-12)
    turned = square @ np.asarray(so3.exp(np.array([0.3, -0.8, 0.5]))).T
    tilted = Fixed(np.eye(3), reojax.polygon(turned), {"most": 2.0})
    np.testing.assert_allclose(design.loop_area(tilted), 6, rtol=1e-12)
    both = design.weighted({design.loop_area: 0.5, design.travel(): 2.0})
    np.testing.assert_allclose(both(tilted), 3 + 2 * joint_travel(tilted.path), rtol=1e-12)
    np.testing.assert_allclose(design.bend_within(1, "most")(tilted)[:5], turned[:, 1] - 2)


# --- edits -----------------------------------------------------------------------------------------------------


def possible(robot):
    """Build it again through the door that refuses impossible bodies."""
    fields = ("mass", "com", "inertia", "axis", "anchor", "rotor_inertia", "gear_ratio", "lower", "upper")
    numbers = {field: np.asarray(getattr(robot, field)) for field in fields}
    return reojax.make_robot(**numbers, parent=robot.parent, rotor_on=robot.rotor_on)


TREE = random_robot(4, 3, branched=True)
EDITS = {
    "mass": lambda robot, k: design.with_mass(robot, 1, k * robot.mass[1]),
    "com": lambda robot, k: design.with_com_offset(robot, 1, np.array([0.1, -0.2, 0.05]) * (k - 1)),
    "length": lambda robot, k: design.with_length(robot, 1, k),
    "length along": lambda robot, k: design.with_length(robot, 1, k, along=[1, 2, 0.5]),
    "joint inertia": lambda robot, k: design.with_joint_inertia(robot, 0, k * about_joint(robot, 0)),
}


def about_joint(robot, joint):
    axis, link = np.asarray(robot.axis[joint]), joint + 1
    lever = np.cross(axis, robot.com[link])
    return float(axis @ robot.inertia[link] @ axis + robot.mass[link] * lever @ lever)


@pytest.mark.parametrize("name", EDITS)
@pytest.mark.parametrize("factor", [0.05, 1.0, 20.0])
def test_edits_leave_possible_bodies(name, factor):
    changed = possible(EDITS[name](TREE, factor))
    fields = ("mass", "com", "inertia", "anchor")
    same = all(np.allclose(getattr(changed, field), getattr(TREE, field), atol=1e-12) for field in fields)
    assert same == (factor == 1.0)
    others = [i for i in range(TREE.links) if i != 1]
    np.testing.assert_array_equal(np.asarray(changed.com)[others], TREE.com[others])


def test_what_the_edits_change():
    """Scaling length and mass as by similarity changes no rotation; inertia about the joint becomes what is asked."""
    np.testing.assert_allclose(about_joint(EDITS["joint inertia"](TREE, 3.0), 0), 3 * about_joint(TREE, 0), rtol=1e-12)
    by_name = design.with_mass(TREE, TREE.link_names[1], 3.0), design.with_joint_inertia(TREE, TREE.joint_names[0], 2.0)
    by_number = design.with_mass(TREE, 1, 3.0), design.with_joint_inertia(TREE, 0, 2.0)
    for ours, theirs in zip(by_name, by_number, strict=True):
        np.testing.assert_array_equal(ours.inertia, theirs.inertia)
    robot = TREE
    for link in range(robot.links):
        robot = design.with_mass(design.with_length(robot, link, 2.0), link, 5 * robot.mass[link])
    robot = reojax.robots.with_rotor_inertia(robot, 20 * TREE.rotor_inertia)
    after, before = (reojax.momentum_matrices(r, np.ones(3)) for r in (robot, TREE))
    for ours, theirs in zip(after, before, strict=True):
        np.testing.assert_allclose(ours, 20 * theirs, rtol=1e-10)


# --- whole problems --------------------------------------------------------------------------------------------


def build(values):
    robot = reojax.robots.with_gear_ratio(PROTOTYPE, values["gear"])
    return robot, reojax.manoeuvre_a(values["twist"], values["bend"])


GEARS = (4.0, 9.0, 14.0, 19.0, 24.0)
ROLL = Problem(
    build,
    [Variable("twist", 10, 270, "deg"), Variable("bend", 5, 120, "deg"), Variable("gear", 1, 30, catalogue=GEARS)],
    objective=lambda o: design.travel()(o) + 0.02 * o.values["gear"],
    equality=[design.turned_about([0, 0, 1], np.deg2rad(100))],
    inequality=[design.off_axis_within([0, 0, 1], np.deg2rad(5))],
    steps=4,
)


@pytest.mark.slow
def test_a_design_with_a_catalogue():
    """The ratio is one that can be bought, and no other one of the catalogue gives a cheaper design."""
    found = ROLL.solve(8, seed=3)
    best = found.value[found.best]
    values = ROLL.space.named(best)
    assert found.converged[found.best]
    assert float(values["gear"]) in GEARS
    outcome = ROLL.outcome(best)
    np.testing.assert_allclose(so3.log(outcome.rotation)[2], np.deg2rad(100), atol=2e-2)
    np.testing.assert_allclose(design.turned_about([0, 0, 1], np.deg2rad(100))(outcome), 0, atol=1e-8)
    assert found.residual[found.best] <= 1e-8
    held = [ROLL.solve(8, seed=3, hold={"gear": gear}) for gear in GEARS]
    costs = [answer.cost[answer.best] if answer.converged[answer.best] else np.inf for answer in held]
    np.testing.assert_allclose(found.cost[found.best], min(costs), rtol=1e-6)


@pytest.mark.slow
def test_many_problems_side_by_side_are_those_solved_alone():
    """A trade-off over the gear ratio, the twist held in one problem and free in the others."""
    gears, twist = np.array([4.0, 9.0, 24.0]), np.array([np.nan, np.deg2rad(200), np.nan])
    each = ROLL.solve_each({"gear": gears, "twist": twist}, 4, seed=3)
    assert each.value.shape == (3, 4, 3)
    picked = each.pick()
    for k in range(3):
        hold = {"gear": gears[k]} | ({} if np.isnan(twist[k]) else {"twist": twist[k]})
        alone = ROLL.solve(4, seed=3, hold=hold)
        np.testing.assert_array_equal(alone.converged, each.converged[k])
        np.testing.assert_allclose(alone.value, each.value[k], rtol=1e-12)
        assert alone.best == each.best[k]
        np.testing.assert_allclose(picked.cost[k], alone.cost[alone.best], rtol=1e-12)
    np.testing.assert_allclose(picked.value[:, 2], gears, rtol=1e-12)


@pytest.mark.slow
def test_held_variables_have_no_influence():
    """A target 0.283 degrees away is reached whether it is a matrix or the value of a variable with wide bounds."""
    near = PROTOTYPE.replace(lower=np.full(3, -np.deg2rad(20)), upper=np.full(3, np.deg2rad(20)))
    loop, vector = design.polygons(near, 3), np.deg2rad([0.021, 0.03, -0.281])
    target = Variable("target", [-3.2] * 3, [3.2] * 3, "rad")

    def problem(variables, aim):
        build = lambda values: (near, loop.path(values["loop"]))
        objective = design.travel(loop)
        return Problem(build, variables, objective=objective, equality=[design.turned_to(aim)], steps=2)

    held, fixed = problem([loop, target], "target"), problem([loop], np.asarray(so3.exp(vector)))
    starts = fixed.starts(8, seed=0)
    ours = held.solve(np.concatenate([starts, np.zeros((8, 3))], axis=1), hold={"target": vector})
    theirs = fixed.solve(starts)
    assert ours.converged.sum() >= 7
    np.testing.assert_array_equal(ours.converged, theirs.converged)
    # rounding may send a start to another local answer
    assert (abs(ours.cost / theirs.cost - 1) < 1e-6).sum() >= 7


def test_unreachable_roll_says_by_how_much():
    far = ROLL.solve(8, seed=3, hold={"twist": np.deg2rad(30), "gear": 24.0})
    assert not far.converged.any()
    assert (far.status == Status.INFEASIBLE).all()
    values = ROLL.space.named(far.value[far.best])
    np.testing.assert_allclose(values["twist"], np.deg2rad(30), atol=1e-12)
    assert 0.5 < far.residual[far.best] < np.deg2rad(100)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ROLL.solve(8, hold={"ratio": 3.0}), "no variable 'ratio'.*twist, bend, gear"),
        (lambda: ROLL.solve(8, hold={"gear": 99.0}), "'gear' is held at 99"),
        (lambda: ROLL.solve_each({}), "`holds` has nothing"),
        (lambda: ROLL.solve_each({"gear": [4.0], "twist": [1.0, 2.0]}), "`holds` has {'gear': 1, 'twist': 2}"),
        (lambda: ROLL.solve(0), "`starts` is 0"),
        (lambda: ROLL.solve(np.zeros((2, 5))), r"`starts` has shape \(2, 5\); it must be \(m, 3\)"),
        (lambda: ROLL.space.vector({"twist": 1, "bend": 1, "gears": 2}), "no variable 'gears'"),
        (lambda: ROLL.space.vector({"twist": 1, "bend": 1}), "'gear' is missing"),
        (lambda: ROLL.space.vector({"twist": [1, 2], "bend": 1, "gear": 1}), "`twist` has shape"),
        (lambda: design.Space([Variable("a", 2, 1)]), "'a' has bounds"),
        (lambda: design.Space([Variable("a", 0, np.inf)]), "'a' has bounds"),
        (lambda: design.Space([Variable("a", 0, 1, "inch")]), "unit 'inch'"),
        (lambda: design.Space([Variable("a", 0, 1), Variable("a", 0, 2)]), "names must differ"),
        (lambda: design.Space([]), "at least one"),
        (lambda: design.Space([Variable("a", 0, 1, catalogue=(0.5, 2))]), "catalogue"),
        (lambda: design.polygons(ROBOT, 1), "`corners` is 1"),
        (lambda: design.polygons(ROBOT, 3, start=9.0), r"start\[0\] is 9"),
        (lambda: design.polygons(reojax.robots.planar(3), 3), "has no limits"),
        (lambda: design.fourier_loops(ROBOT, 0), "`degree` is 0"),
        (lambda: design.fourier_loops(ROBOT, 2, start=[2.0, 0, 0]), r"start\[0\] is 2"),
        (lambda: design.spline_loops(ROBOT, 3), "`points` is 3"),
        (lambda: design.turned_to(np.eye(3) * 2), "`target` is no rotation"),
        (lambda: design.turned_about([0, np.nan, 1], 1.0), "`axis`|axis"),
        (lambda: design.turned_about([0, 0, 1], np.nan), "`angle` is nan"),
        (lambda: design.turned_about([0, 0, 0], 1.0), "`axis` is zero"),
        (lambda: design.off_axis_within([0, 0, 1], 0.0), "`angle` is 0"),
        (lambda: design.with_mass(TREE, 9, 1.0), "`link` is 9"),
        (lambda: design.with_mass(TREE, 1, -1.0), "`mass` is -1"),
        (lambda: design.with_length(TREE, 1, 2.0, along=[0, 0, 0]), "`along`"),
        (lambda: design.with_joint_inertia(TREE, 3, 1.0), "`joint` is 3"),
        (lambda: design.with_mass(TREE, "foot", 1.0), "`link` is 'foot'; it must be a link of the robot"),
        (lambda: design.with_com_offset(TREE, 1, [1.0, 2.0]), r"`offset` has shape \(2,\)"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()

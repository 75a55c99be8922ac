"""Imperfect releases: exact cases, the laws of momentum, and spreads by derivatives and by draws."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import reojax
from reojax import Release, release_spread, released, robots, so3
from reojax.mechanics.kinematics import kinematics
from reojax.motion import _resolution

ROBOT = robots.prototype()
PATH = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
PLAN = reojax.along(PATH, "quintic", [0.12, 0.18, 0.12, 0.18])
STILL = reojax.along(reojax.polygon(np.zeros((2, 3))), "quintic", 0.6)
FALLING = Release(momentum=(2e-5, -1e-5, 3e-5), pull=(0.0, 2e-3, -1e-3), tied=(0.0, 0.02, 0.05), drag=1e-6)


def test_a_perfect_release_is_the_net_rotation():
    motion = released(ROBOT, PLAN)
    np.testing.assert_allclose(motion.rotation[-1], reojax.net_rotation(ROBOT, PATH), atol=2e-6)
    finer = released(ROBOT, PLAN, samples=64)
    np.testing.assert_allclose(finer.rotation[-1], reojax.net_rotation(ROBOT, PATH), atol=2e-7)
    assert motion.time[-1] == pytest.approx(0.6)
    np.testing.assert_array_equal(motion.momentum, 0)


def test_momentum_alone_is_what_simulate_does():
    momentum = np.array([1e-4, 2e-4, -1e-4])
    expected = reojax.simulate(ROBOT, PLAN, momentum=momentum, samples=64).rotation
    motion = released(ROBOT, PLAN, Release(momentum), samples=64)
    np.testing.assert_allclose(motion.rotation, expected, atol=3e-7)
    np.testing.assert_allclose(motion.momentum, np.tile(momentum, (len(motion.time), 1)), rtol=1e-14)


def test_drag_stops_a_spin_exponentially():
    """About a principal axis, a rigid body: `H = H0 exp(-c t / I)`, and the angle is its integral over I."""
    still = robots.two_cylinder_cat(0.25)
    trajectory = reojax.along(reojax.polygon(np.zeros((2, still.joints))), "quintic", 2.0)
    inertia = np.asarray(reojax.momentum_matrices(still, np.zeros(still.joints)).A)
    k = int(np.argmin(np.abs(inertia - np.diag(np.diag(inertia))).sum(0)))
    size = inertia[k, k]
    spin, drag = np.eye(3)[k] * size, 0.7 * size
    motion = released(still, trajectory, Release(spin, drag=drag))
    np.testing.assert_allclose(motion.momentum[-1], spin * np.exp(-1.4), rtol=1e-6, atol=1e-9 * size)
    np.testing.assert_allclose(so3.log(motion.rotation[-1])[k], (1 - np.exp(-1.4)) / 0.7, rtol=1e-6)


def test_a_wire_turns_the_momentum_by_its_moment():
    """`H' = r x F` about the centre of mass, which the joints shift in the base."""
    wire = FALLING._replace(drag=0.0)
    motion = released(ROBOT, PLAN, wire)
    theta = np.asarray(jax.vmap(PLAN.at)(motion.time).theta)
    middle = ROBOT.com[0] - np.asarray(jax.vmap(lambda t: kinematics(ROBOT, t).com[0])(theta))
    moment = np.cross(np.einsum("mab,mb->ma", motion.rotation, np.asarray(wire.tied) - middle), wire.pull)
    time = np.asarray(motion.time)
    gained = np.concatenate([[np.zeros(3)], np.cumsum(0.5 * (moment[1:] + moment[:-1]) * np.diff(time)[:, None], 0)])
    np.testing.assert_allclose(motion.momentum, np.asarray(wire.momentum) + gained, atol=2e-3 * np.abs(gained).max())


def test_slower_motions_turn_further_from_a_spin():
    """With momentum, time matters: the thesis's rule is of zero momentum only."""
    spin = Release((0.0, 0.0, 5e-5))
    ends = []
    for duration in (0.15, 0.3):
        perfect, spun = (
            released(ROBOT, reojax.along(PATH, "quintic", duration), r).rotation[-1] for r in (Release(), spin)
        )
        ends.append(float(so3.angle(perfect.T @ spun)))
    assert 1.9 < ends[1] / ends[0] < 2.1


def test_spread_by_derivatives_and_by_draws():
    deviation = Release((2e-6, 2e-6, 2e-6), (2e-4, 2e-4, 2e-4), (1e-3, 1e-3, 1e-3), 1e-7)
    wire = Release(pull=(0.0, 0.0, 2e-3), tied=(0.0, 0.0, 0.05))
    spread = release_spread(ROBOT, PLAN, deviation, jax.random.key(0), expected=wire, draws=512)
    same = released(ROBOT, PLAN, wire, substeps=1)
    np.testing.assert_allclose(spread.rotation, same.rotation[-1], atol=1e-12)
    scale = np.sqrt(np.diag(spread.covariance))
    drawn = np.sqrt(np.diag(spread.drawn_covariance))
    np.testing.assert_allclose(drawn, scale, rtol=0.12)  # 512 draws: 3 %
    assert spread.drawn_angle_rms == pytest.approx(float(spread.angle_rms), rel=0.1)
    assert spread.angle_rms > 1e-3
    none = release_spread(ROBOT, PLAN, Release(), jax.random.key(0), expected=wire, draws=512)
    np.testing.assert_array_equal(none.covariance, 0)
    np.testing.assert_allclose(none.drawn, 0, atol=1e-14)
    np.testing.assert_array_equal(none.sensitivity, spread.sensitivity)


def test_a_spread_tells_how_uncertain_its_ends_are():
    """Against four times as many steps, the same draws: no end is farther off than is told."""
    deviation = Release((1e-4, 1e-4, 1e-4))
    runs = [release_spread(ROBOT, PLAN, deviation, jax.random.key(0), draws=16, steps=steps) for steps in (16, 64)]
    ends = [[run.rotation, *(run.rotation @ so3.exp(v) for v in run.drawn)] for run in runs]
    off = max(float(so3.angle(a.T @ b)) for a, b in zip(*ends, strict=True))
    assert off < runs[0].error < 100 * off
    assert runs[1].error < 0.02 * runs[0].error


def test_sensitivities_agree_with_differences():
    spread = release_spread(ROBOT, PLAN, Release(), jax.random.key(0), expected=FALLING, draws=512)
    ends = jax.jit(lambda pull: released(ROBOT, PLAN, FALLING._replace(pull=pull)).rotation[-1])
    for k, step in enumerate(1e-5 * np.eye(3)):
        turns = [ends(jnp.asarray(FALLING.pull) + sign * step) for sign in (1, -1)]
        column = (so3.log(spread.rotation.T @ turns[0]) - so3.log(spread.rotation.T @ turns[1])) / 2e-5
        np.testing.assert_allclose(spread.sensitivity[:, 3 + k], column, rtol=1e-4, atol=1e-4)


def test_float32():
    plan = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), PLAN)
    motion = released(ROBOT, plan, FALLING)
    assert {leaf.dtype for leaf in motion} == {jnp.dtype(jnp.float32)}
    np.testing.assert_allclose(motion.rotation[-1], released(ROBOT, PLAN, FALLING).rotation[-1], atol=2e-4)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((ROBOT, PLAN, Release((0, 0))), r"release.momentum has shape \(2,\)"),
        ((ROBOT, PLAN, Release(drag=np.inf)), "release.drag is inf; it must be finite"),
        ((ROBOT, PLAN, Release(pull="up")), "`release.pull` is 'up'"),
        ((ROBOT, PLAN, 3), "`release` is a int"),
        ((ROBOT, PATH), "`trajectory` is a Path"),
        ((robots.planar(2), PLAN), "`trajectory` moves 3 joints; 'planar2' has 1"),
        ((None, PLAN), "`robot` is a NoneType"),
    ],
)
def test_bad_input(arguments, message):
    with pytest.raises(ValueError, match=message):
        released(*arguments)


def test_more_bad_input():
    with pytest.raises(ValueError, match="`samples` is 0"):
        released(ROBOT, PLAN, samples=0)
    with pytest.raises(ValueError, match="`draws` is 0"):
        release_spread(ROBOT, PLAN, Release(), jax.random.key(0), draws=0)
    with pytest.raises(ValueError, match="standard deviations must not be negative"):
        release_spread(ROBOT, PLAN, Release(drag=-1.0), jax.random.key(0))


def test_a_wire_that_brakes_hard_is_resolved_or_refused():
    """The robot follows its wire, which holds it: it hardly turns. No drag gives a number that is none."""
    motion = released(ROBOT, PLAN, Release(drag=1.0))
    assert motion.error < 1e-6
    assert 0 < so3.angle(motion.rotation[-1]) < 1e-3
    with pytest.raises(ValueError, match="is braked, too fast to be resolved: with .* steps a step still has"):
        released(ROBOT, PLAN, Release(drag=1e12))
    with pytest.raises(ValueError, match="more than .* steps of 0.1 rad would be taken. Give `steps`"):
        release_spread(ROBOT, PLAN, Release(drag=1.0), jax.random.key(0), draws=1)


@pytest.mark.parametrize("duration", [20.0, pytest.param(40.0, marks=pytest.mark.slow)])
def test_a_tumbling_body_near_its_middle_axis(duration):
    """Moments 1, 2, 3, spinning almost about the second: as SciPy's DOP853 has it, within what the estimates say."""
    moments, spin = np.array([1.0, 2.0, 3.0]), np.array([1e-3, 2.0, 1e-3])
    body = reojax.make_robot(
        mass=[1.0], com=np.zeros((1, 3)), inertia=[np.diag(moments)], axis=np.zeros((0, 3)), anchor=np.zeros((0, 3))
    )

    def slope(_, q):
        omega = Rotation.from_quat(q).inv().apply(spin) / moments
        return 0.5 * (np.append(np.cross(q[:3], omega), -q[:3] @ omega) + np.append(q[3] * omega, 0))

    end = solve_ivp(slope, (0, duration), [0, 0, 0, 1.0], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    exact, path = Rotation.from_quat(end).as_matrix(), reojax.polygon(np.zeros((2, 0)))
    trajectory = reojax.along(path, "quintic", duration)
    for motion in (
        reojax.simulate(body, path, durations=duration, momentum=spin),
        released(body, trajectory, Release(spin)),
        reojax.simulate(body, path, durations=duration, momentum=spin, substeps=1),
        released(body, trajectory, Release(spin), substeps=4),
    ):
        apart = float(so3.angle(exact.T @ motion.rotation[-1]))
        assert apart < max(float(motion.error), 1e-6)
    assert motion.error > 1e-5  # the last one has too few steps, and knows


def test_what_the_steps_do_not_resolve_is_told(monkeypatch):
    monkeypatch.setattr(_resolution, "MOST", 512)
    with pytest.warns(UserWarning, match="too fast to be resolved: with 512 steps its orientation is uncertain by"):
        motion = reojax.simulate(ROBOT, PATH, durations=1.0, momentum=[1e-2, 3e-2, 1e-2])
    assert motion.error > 1e-3

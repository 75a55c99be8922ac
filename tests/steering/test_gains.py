"""Correction gains: the first variation of the rotation by the curvature, and the law that it gives."""

import shutil
import subprocess

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers.first_variation import first_variation

import reojax
from reojax import robots, so3
from reojax.steering import onboard
from reojax.steering.tables import gain_table, write_gains

ROBOT = robots.prototype()
PATH = reojax.manoeuvre_a(np.deg2rad(250), np.deg2rad(110))
TRAJECTORY = reojax.along(PATH, "quintic", np.array([0.12, 0.19, 0.12, 0.19]))
GAINS = reojax.correction_gains(ROBOT, PATH, samples=16)
TIMED = reojax.correction_gains(ROBOT, TRAJECTORY, samples=8)
MOMENTUM = np.array([2e-5, -3e-5, 4e-5])


def turned_off(rotation, planned) -> np.ndarray:
    """Error seen from the start."""
    return np.asarray(so3.log(jnp.asarray(rotation) @ jnp.asarray(planned).T))


def test_the_curvature_gives_the_derivative_of_the_net_rotation():
    """Against differentiating the integrator through the path's corners, and central differences of it."""
    change = np.random.default_rng(0).normal(size=PATH.waypoints.shape)
    planned = reojax.net_rotation(ROBOT, PATH, steps=8)

    def turn(corners):
        return reojax.net_rotation(ROBOT, reojax.Path(corners), steps=8)

    _, slope = jax.jvp(turn, (jnp.asarray(PATH.waypoints),), (jnp.asarray(change),))
    direct = np.asarray(so3.vee(slope @ planned.T))
    found = np.asarray(first_variation(ROBOT, PATH, change))
    assert np.abs(found - direct).max() < 1e-9 * np.abs(direct).max()
    step = 1e-4
    ends = [turned_off(turn(jnp.asarray(PATH.waypoints + k * step * change)), planned) for k in (1, -1)]
    assert np.abs(found - (ends[0] - ends[1]) / (2 * step)).max() < 1e-6 * np.abs(direct).max()


def test_a_change_that_only_carries_the_ends_along_is_a_boundary_term():
    """A constant shift of a path that stays put turns the base by the connection, and back."""
    still = reojax.polygon(np.tile([0.3, 0.5, -0.2], (3, 1)))
    change = np.array([[0.0, 0, 0], [0.4, 0.1, 0.2], [0.7, -0.3, 0.1]])
    expected = reojax.connection(ROBOT, still.waypoints[0]) @ change[-1]
    np.testing.assert_allclose(first_variation(ROBOT, still, change), expected, atol=1e-14)


def test_the_change_takes_back_an_error_up_to_second_order():
    """Added to the path, it turns the end by minus the error; what is left falls with the square of the error."""
    error = np.array([0.3, -0.2, 0.4])
    turn = jax.jit(lambda corners: reojax.net_rotation(ROBOT, reojax.Path(corners), steps=1))
    sharp = reojax.correction_gains(ROBOT, PATH, samples=96, left=1e-4)
    left = []
    for size in (2e-3, 1e-3):
        changed = turn(sharp.theta + sharp.change(0, size * error))
        left.append(np.linalg.norm(turned_off(so3.exp(jnp.asarray(size * error)) @ changed, GAINS.rotation[-1])) / size)
    assert left[0] < 0.05
    assert 1.7 < left[0] / left[1] < 2.3
    assert (np.asarray(GAINS.change(20, error))[:20] == 0).all()


def test_gain_is_window_times_curvature_over_gramian():
    """The formula, with the Gramian by another quadrature over the same samples."""
    k = 19  # within the second edge
    forms = np.asarray(reojax.curvature(ROBOT, GAINS.theta[k]))
    g = np.asarray(GAINS.rotation[k]) @ np.einsum("aik,k->ai", forms, np.asarray(GAINS.theta_dot[k]))
    window = 30 * (3 / 16) ** 2 * (13 / 16) ** 2
    np.testing.assert_allclose(GAINS.direction[k], window * g.T, rtol=1e-9, atol=1e-12)
    stiff = GAINS.gramian[k] + GAINS.rest * np.eye(3)
    np.testing.assert_allclose(GAINS.gain[k] @ stiff, GAINS.direction[k], atol=1e-12)
    lowest = np.linalg.eigvalsh(np.asarray(GAINS.gramian))[:, 0]
    np.testing.assert_allclose(GAINS.authority, lowest, atol=1e-12)
    assert (np.diff(GAINS.authority) <= 1e-12).all()
    assert GAINS.authority[-1] == GAINS.reach[-1] == 0


def closed_loop(gains, error, momentum=None) -> np.ndarray:
    """Error left where the law is fed by the first variation itself: `e' = G p`, p by `gain`, by the trapezoid rule."""
    e = np.array(error)
    for k in range(len(gains.at) - 1):
        h = gains.at[k + 1] - gains.at[k]
        mean = 0.5 * (gains.gramian[k] - gains.gramian[k + 1])
        stiff = gains.gramian[k] + gains.rest * np.eye(3)
        e = e - 2 * mean @ np.linalg.solve(stiff, e) if h > 0 else e
    return e


def test_the_law_shrinks_an_error_to_its_share():
    """`left` of the error about the hardest axis stays, as the regulator of least effort has it."""
    soft = reojax.correction_gains(ROBOT, PATH, samples=16, left=0.05)
    values, vectors = np.linalg.eigh(np.asarray(soft.gramian[0]))
    assert abs(float(soft.rest) - 0.05 * values[0]) < 1e-12
    left = np.linalg.norm(closed_loop(soft, vectors[:, 0]))
    assert left < 0.06


def test_gains_with_momentum_match_differences_of_the_simulated_motion():
    """An error at the start and a smooth change of the joints, each by central differences of `simulate`."""
    gains = reojax.correction_gains(ROBOT, TRAJECTORY, samples=32, momentum=MOMENTUM)
    corners = jnp.asarray(PATH.waypoints)
    change = np.zeros_like(PATH.waypoints)
    change[2] = [0.3, -0.2, 0.1]

    @jax.jit
    def end(corners, momentum):
        motion = reojax.along(reojax.Path(corners), "quintic", np.array([0.12, 0.19, 0.12, 0.19]))
        return reojax.simulate(ROBOT, motion, momentum=momentum, samples=64).rotation[-1]

    planned, step = end(corners, MOMENTUM), 1e-4
    turn = [np.asarray(so3.exp(k * step * jnp.asarray([1.0, 2.0, -1.0]))) for k in (1, -1)]
    # turned at the start by e, the momentum is H seen from exp(-e)
    ends = [turned_off(r @ np.asarray(end(corners, r.T @ MOMENTUM)), planned) for r in turn]
    expected = (ends[0] - ends[1]) / (2 * step)
    np.testing.assert_allclose(gains.to_end[0] @ np.array([1.0, 2.0, -1.0]), expected, atol=1e-6)
    assert np.abs(np.asarray(gains.to_end[0]) - np.eye(3)).max() > 1e-3
    # G p, integrated over the whole motion; G from the direction where the window is 1, from gains without one
    open_gains = reojax.correction_gains(ROBOT, TRAJECTORY, samples=32, momentum=MOMENTUM, window=0.0)
    moved = jax.vmap(reojax.along(reojax.Path(jnp.asarray(change)), "quintic", np.diff(TRAJECTORY.breaks)).at)
    p = np.asarray(moved(open_gains.at).theta)
    rate = np.einsum("mja,mj->ma", np.asarray(open_gains.direction), p)
    simpson = np.tile([2, 4], len(rate) // 2 + 1)[: len(rate)] * 1.0
    simpson[[0, -1]] = 1
    pieces = [slice(32 * i, 32 * i + 33) for i in range(4)]
    simpson = np.array([1, *[4, 2] * 15, 4, 1]) / 3
    found = sum(float(open_gains.at[i][1] - open_gains.at[i][0]) * simpson @ rate[i] for i in pieces)
    ends = [turned_off(end(corners + k * step * change, MOMENTUM), planned) for k in (1, -1)]
    np.testing.assert_allclose(found, (ends[0] - ends[1]) / (2 * step), rtol=2e-5)


def test_a_motion_gives_what_its_trajectory_gives():
    """Samples of `simulate`, with their own momentum, against the trajectory."""
    motion = reojax.simulate(ROBOT, TRAJECTORY, momentum=MOMENTUM, samples=64)
    found = reojax.correction_gains(ROBOT, motion)
    fine = reojax.correction_gains(ROBOT, TRAJECTORY, momentum=MOMENTUM, samples=64)
    np.testing.assert_allclose(found.gramian[0], fine.gramian[0], atol=2e-3 * np.abs(fine.gramian[0]).max())
    np.testing.assert_allclose(found.direction[100], fine.direction[100], rtol=1e-3, atol=1e-6)


def test_coupled_and_held_joints():
    """A joint that mimics another is told the same; a joint of infinite price is left alone."""
    coupled = reojax.make_robot(
        mass=ROBOT.mass, com=ROBOT.com, inertia=ROBOT.inertia, axis=ROBOT.axis, anchor=ROBOT.anchor,
        couplings={2: (0, -1.0, 0.0)},
    )  # fmt: skip
    change = np.asarray(reojax.correction_gains(coupled, PATH, samples=16).change(0, [0.01, 0.0, 0.02]))
    np.testing.assert_allclose(change[:, 2], -change[:, 0], atol=1e-15)
    assert np.abs(change[:, 0]).max() > 1e-4
    held = reojax.correction_gains(ROBOT, PATH, samples=16, weights=[1, np.inf, 1])
    assert (np.asarray(held.gain)[:, 1] == 0).all()
    assert np.abs(held.gain[:, 0]).max() > 0


def test_a_robot_that_cannot_turn_about_an_axis_has_no_authority():
    """A planar robot: all gains are finite, and only the plane's axis is corrected."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])
    gains = reojax.correction_gains(robots.planar(3), reojax.polygon(corners), samples=16)
    assert np.isfinite(gains.gain).all()
    assert np.abs(gains.authority).max() < 1e-12
    assert (gains.reach == 0).all()
    assert np.abs(gains.gain).max() > 0.1


def test_single_precision_and_other_dtypes():
    """Gains come in the precision of what goes in, and agree."""
    single = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), (ROBOT, PATH))
    found = reojax.correction_gains(*single, samples=16)
    assert {leaf.dtype for leaf in jax.tree.leaves(found)} == {jnp.dtype("float32")}
    np.testing.assert_allclose(found.gain[:40], GAINS.gain[:40], atol=2e-2 * np.abs(GAINS.gain).max())


def test_the_files_hold_the_table(tmp_path):
    """CSV to the last bit; the header compiles, is a few kilobytes, and holds the same numbers in single precision."""
    write_gains(TIMED, tmp_path / "gains.csv")
    table, again = gain_table(TIMED), onboard.read(tmp_path / "gains.csv")
    assert table.keys() == again.keys()
    assert all((table[name] == again[name]).all() for name in table)
    write_gains(TIMED, tmp_path / "gains.h", name="turn")
    once = table["momentum"].size - 3  # in the header there is one row of it
    assert (sum(values.size for values in table.values()) - once) * 4 < 6000
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "gains.h"\nint main(void) { for (int k = 0; k < TURN_SAMPLES; k++)'
        ' for (int i = 0; i < 3 * TURN_JOINTS; i++) printf("%.9g\\n", ((const float *)turn_direction[k])[i]);'
        " return 0; }"
    )
    subprocess.run([compiler, "-o", tmp_path / "main", tmp_path / "main.c"], check=True)
    printed = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True).stdout
    np.testing.assert_array_equal(np.array(printed.split(), np.float32), table["direction"].ravel().astype(np.float32))


def test_the_files_say_which_momentum_they_are_made_for(tmp_path):
    """In the CSV and in the header; with momentum `to_end` is there too, and the law on board uses it."""
    gains = reojax.correction_gains(ROBOT, TRAJECTORY, samples=8, momentum=MOMENTUM)
    write_gains(gains, tmp_path / "gains.csv")
    table = onboard.read(tmp_path / "gains.csv")
    np.testing.assert_array_equal(table["momentum"][3], MOMENTUM)
    np.testing.assert_array_equal(table["to_end"], np.asarray(gains.to_end))
    np.testing.assert_array_equal(onboard.at(table, 0.0)["to_end"], np.asarray(gains.to_end[0]))
    write_gains(gains, tmp_path / "gains.h", name="turn")
    text = (tmp_path / "gains.h").read_text()
    assert str(MOMENTUM.tolist()) in text
    assert "static const float turn_momentum[3]" in text
    assert "turn_to_end[33][3][3]" in text
    write_gains(TIMED, tmp_path / "still.h", name="turn")
    assert "to_end" not in (tmp_path / "still.h").read_text().split("#ifndef")[1]


@pytest.mark.parametrize("lag", [1, 4])
def test_the_onboard_law_takes_an_error_back(lag):
    """Fed by true orientations that are `lag` ticks old, smooth joints end on the planned orientation."""
    table, tick = gain_table(reojax.correction_gains(ROBOT, TRAJECTORY, samples=16)), 2e-3
    nearby = [onboard.at(table, time)["theta"] - TRAJECTORY.at(time).theta for time in (0.05, 0.21, 0.4)]
    assert np.abs(nearby).max() < 2e-3
    off = onboard.exp(4e-3 * np.array([1.0, 0.7, -1.0]))
    law = onboard.OnboardLaw(table)
    state, joints, rotations = law.start(), [np.asarray(TRAJECTORY.at(0.0).theta)], [off]
    turn = jax.jit(lambda a, b: reojax.net_rotation(ROBOT, reojax.Path(jnp.stack([a, b])), steps=1))
    for k in range(1, 311):
        seen = (rotations[-lag], (k - lag) * tick) if k >= lag else None
        state, told = law.step(state, k * tick, seen)
        rotations.append(rotations[-1] @ np.asarray(turn(joints[-1], told)))
        joints.append(told)
    left = np.linalg.norm(onboard.log(rotations[-1] @ np.asarray(TIMED.rotation[-1]).T))
    assert left < 0.02 * np.linalg.norm(onboard.log(off))
    np.testing.assert_allclose(joints[-1], PATH.waypoints[-1], atol=1e-12)
    change = np.array(joints) - [TRAJECTORY.at(k * tick).theta for k in range(311)]
    assert 0.01 < np.abs(change).max() < 0.3
    assert np.abs(np.diff(change, axis=0, n=2)).max() < 2e-2  # a jump of the change would be 0.1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"weights": [1, -1, 1]}, "positive"),
        ({"weights": [1, 1]}, "3 joints"),
        ({"window": 0.7}, "at most 0.5"),
        ({"left": 0}, "positive"),
        ({"samples": 1}, "at least 2"),
        ({"momentum": [0, 0, 1]}, "trajectory"),
        ({"motion": reojax.polygon([[0.0, 0, 0]])}, "one waypoint"),
        ({"motion": reojax.polygon([[0.0, 0], [1, 1]])}, "2 joints"),
        ({"motion": 3}, "a Path, a Trajectory or a Motion"),
        ({"motion": TRAJECTORY, "momentum": [0, np.nan, 0]}, "finite"),
    ],
)
def test_what_it_refuses(arguments, said):
    with pytest.raises(ValueError, match=said):
        reojax.correction_gains(ROBOT, **{"motion": PATH} | arguments)

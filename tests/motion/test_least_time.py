"""Least times: the motors are just at their curve, a little faster is beyond it, and what cannot be is said."""

import json

import jax
import numpy as np
import pytest

import reojax
from reojax import RE_MAX_17
from reojax.cli import main
from reojax.motion.least_time import AVAILABLE, minimum_stretch, minimum_time
from reojax.motion.motor import no_load_speed

PROTOTYPE = reojax.robots.prototype()
A = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))


@pytest.fixture(scope="module")
def least():
    return minimum_time(PROTOTYPE, A, RE_MAX_17, samples=128)


def test_the_motors_are_at_their_curve(least):
    """Simulated at the least durations every edge has a margin of zero, at the joint and place that are said."""
    motion = reojax.simulate(PROTOTYPE, A, durations=least.durations, motors=RE_MAX_17)
    margin = np.asarray(motion.margin)
    for edge in range(4):
        part = margin[128 * edge : 128 * (edge + 1) + 1]
        assert part.min() == pytest.approx(0, abs=1e-9)
        sample, joint = np.unravel_index(part.argmin(), part.shape)
        assert (joint, sample / 128) == (least.joint[edge], pytest.approx(float(least.place[edge])))
    np.testing.assert_allclose(least.duration, least.durations.sum())
    np.testing.assert_allclose(least.needs.max(axis=1), least.durations)


def test_a_little_faster_is_too_fast_and_slower_is_not(least):
    for factor, expected in ((0.999, False), (1.001, True), (1.5, True)):
        motion = reojax.simulate(PROTOTYPE, A, durations=factor * least.durations, motors=RE_MAX_17)
        for edge in range(4):
            part = np.asarray(motion.margin)[128 * edge : 128 * (edge + 1) + 1]
            assert (part.min() >= 0) == expected


def test_a_motor_with_nothing_to_move():
    """No inertia: the speed decides, 15/8 of the mean. With the rotor's own, the thesis's figure 3.2."""
    robot = reojax.make_robot(
        mass=[1.0, 1e-9], com=np.zeros((2, 3)), inertia=[np.eye(3), 1e-12 * np.eye(3)], axis=[(0, 0, 1)],
        anchor=[(0, 0, 0)], rotor_inertia=[1e-12], gear_ratio=[24.0],
    )  # fmt: skip
    path = reojax.polygon([[0.0], [2 * np.pi / 3]])
    motor = RE_MAX_17._replace(rotor_inertia=1e-12)
    fast = minimum_time(robot, path, motor, samples=128).duration
    np.testing.assert_allclose(fast, 15 / 8 * 2 * np.pi / 3 * 24 / no_load_speed(motor), rtol=1e-5)
    with_rotor = robot.replace(rotor_inertia=np.array([1e-7]))
    assert 0.08 < minimum_time(with_rotor, path, RE_MAX_17, samples=128).duration < 0.09


def test_time_and_supply_scale_as_they_must():
    """Twice all inertias are as a quarter of the squared speed: without induced voltage, T goes with the root."""
    motor = RE_MAX_17._replace(drag=0.0, torque_constant=1e-9, supply=12e4, efficiency=0.7)
    heavy = PROTOTYPE.replace(
        **{field: 4 * np.asarray(getattr(PROTOTYPE, field)) for field in ("mass", "inertia", "rotor_inertia")}
    )
    one = minimum_time(PROTOTYPE, A, motor, samples=128).durations
    four = minimum_time(heavy, A, motor._replace(rotor_inertia=4e-7), samples=128).durations
    np.testing.assert_allclose(four, 2 * one, rtol=1e-9)
    np.testing.assert_allclose(
        minimum_time(PROTOTYPE, A, motor._replace(supply=48e4), samples=128).durations, one / 2, rtol=1e-9
    )


def test_friction_takes_time(least):
    rubbing = minimum_time(PROTOTYPE, A, RE_MAX_17._replace(friction=1e-3), samples=128)
    assert (rubbing.durations > 1.01 * least.durations).all()
    motion = reojax.simulate(PROTOTYPE, A, durations=rubbing.durations, motors=RE_MAX_17._replace(friction=1e-3))
    assert np.asarray(motion.margin).min() == pytest.approx(0, abs=1e-9)


def test_least_time_differentiates(least):
    """By the supply and by the bend, against differences."""

    @jax.jit
    def total(supply, bend):
        path = reojax.manoeuvre_a(np.deg2rad(270), bend)
        return minimum_time(PROTOTYPE, path, RE_MAX_17._replace(supply=supply), samples=128).duration

    supply, bend = 12.0, np.deg2rad(120)
    np.testing.assert_allclose(total(supply, bend), least.duration, rtol=1e-12)
    slope = jax.jit(jax.grad(total, argnums=(0, 1)))(supply, bend)
    assert slope[0] < 0 < slope[1]
    for k, nudge in enumerate(([1e-4, 0.0], [0.0, 1e-5])):
        up, down = total(supply + nudge[0], bend + nudge[1]), total(supply - nudge[0], bend - nudge[1])
        np.testing.assert_allclose(slope[k], (up - down) / (2 * sum(nudge)), rtol=1e-5)


def test_an_edge_that_stays_put_takes_no_time():
    path = reojax.polygon(A.waypoints[[0, 1, 1, 2, 3]])
    durations = minimum_time(PROTOTYPE, path, RE_MAX_17, samples=128).durations
    assert durations[1] == 0
    assert (np.delete(durations, 1) > 0.1).all()
    assert np.isfinite(reojax.simulate(PROTOTYPE, path, durations=durations, motors=RE_MAX_17).torque).all()


def test_a_path_that_stays_put_takes_no_time():
    """Nothing is asked of the motors, with friction or without: an answer, where `overlap` has nothing to make fast."""
    path = reojax.polygon(np.zeros((5, 3)))
    for motors in (RE_MAX_17, RE_MAX_17._replace(friction=1e-4)):
        still = minimum_time(PROTOTYPE, path, motors, samples=128)
        assert still.converged
        assert still.duration == 0
        np.testing.assert_array_equal(still.needs, np.zeros((4, 3)))
    assert reojax.simulate(PROTOTYPE, path, durations=still.durations, motors=RE_MAX_17).time[-1] == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"supply": 1.0, "friction": 2e-3}, "supply is 1 V at joint 0, too weak to do the move in any time: .* 1.55 V"),
        ({"supply": -3.0}, "motors.supply is -3.0; it must be positive"),
        ({"resistance": 0.0}, "motors.resistance is 0.0; it must be positive"),
        ({"torque_constant": np.nan}, "motors.torque_constant is nan"),
    ],
)
def test_motors_that_cannot_are_named(change, message):
    with pytest.raises(ValueError, match=message):
        minimum_time(PROTOTYPE, A, RE_MAX_17._replace(**change))


def test_bad_paths_and_samples_are_named():
    with pytest.raises(ValueError, match="one waypoint"):
        minimum_time(PROTOTYPE, reojax.polygon(np.zeros((1, 3))), RE_MAX_17)
    with pytest.raises(ValueError, match="`samples` is 0"):
        minimum_time(PROTOTYPE, A, RE_MAX_17, samples=0)
    with pytest.raises(ValueError, match="`path` moves 1 joints"):
        minimum_time(PROTOTYPE, reojax.polygon([[0.0], [1.0]]), RE_MAX_17)
    with pytest.raises(ValueError, match="`robot` is a str"):
        minimum_time("cat", A, RE_MAX_17)
    with pytest.raises(ValueError, match="`path` moves 1 joints"):
        minimum_stretch(PROTOTYPE, reojax.along(reojax.polygon([[0.0], [1.0]]), "quintic", 1.0), RE_MAX_17)


def test_the_command_line_says_what_the_library_says(monkeypatch, capsys, tmp_path):
    monkeypatch.setenv("REOJAX_CACHE", "0")
    out = tmp_path / "a.svg"
    assert main(["time", "--json", "--law", "trapezoid", "--out", str(out)]) == 0
    report = json.loads(capsys.readouterr().out)
    expected = minimum_time(PROTOTYPE, A, RE_MAX_17, "trapezoid")
    np.testing.assert_allclose([edge["duration_s"] for edge in report["edges"]], expected.durations)
    assert [edge["joint"] for edge in report["edges"]] == ["bend", "twist1", "bend", "twist2"]
    assert report["fits"] == (expected.duration <= AVAILABLE)
    assert out.read_text().startswith("<?xml")


def test_simulate_by_time_on_the_command_line(monkeypatch, capsys):
    """The first lines stay as they are without a duration; then what the motors do."""
    monkeypatch.setenv("REOJAX_CACHE", "0")
    assert main(["simulate", "--duration", "0.8", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    motion = report["motion"]
    assert (motion["duration_s"], motion["law"]) == (pytest.approx(0.8), "quintic")
    np.testing.assert_allclose(motion["rotation_vector_deg"], report["rotation_vector_deg"], atol=1e-6)
    assert motion["possible"] == (min(motion["least_margin"]) >= 0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["time", "--supply", "0"], "reojax time: argument --supply: '0' is not a supply voltage"),
        (
            ["time", "--supply", "1e-300"],
            "reojax time: argument --supply: '1e-300' is not a supply voltage",
        ),
        (["simulate", "--duration", "1e-9"], "reojax simulate: argument --duration: '1e-9' is not a duration"),
        (["time", "--supply", "twelve"], "reojax time: argument --supply: 'twelve' is not a number"),
        (["time", "--law", "jump"], "reojax time: there is no time law named 'jump'"),
        (["time", "--twist", "0", "--bend", "0"], "reojax time: nothing moves"),
        (["time", "--robot", "planar3"], "reojax time: 'planar3' has no layout of its own"),
        (["time", "--out", "a.txt"], "reojax time: cannot write 'a.txt'"),
        (["simulate", "--law", "quintic"], "reojax simulate: argument --law: a time law needs a --duration"),
        (["simulate", "--duration", "0"], "reojax simulate: argument --duration: '0' is not a duration"),
        (["simulate", "--duration", "1", "--law", "x"], "reojax simulate: there is no time law named 'x'"),
    ],
)
def test_bad_arguments_are_one_line_and_status_2(monkeypatch, capsys, arguments, message):
    monkeypatch.setenv("REOJAX_CACHE", "0")
    assert main(arguments) == 2
    out, complaint = capsys.readouterr()
    assert out == ""
    assert complaint.startswith(message)
    assert complaint.count("\n") == 1

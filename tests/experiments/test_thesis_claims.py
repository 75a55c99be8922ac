"""The table of the thesis's claims: verdicts follow the numbers, none is left out; the frames of the curvature."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from thesis import claim_table, claims, curvature as curved

from reojax import robots

FULL = (np.deg2rad(120), np.deg2rad(270))


class Numbers(dict):
    """Zero for every number but those given: enough to judge by."""

    def __missing__(self, key):
        return 0.0

    def get(self, key, default=None):
        return self[key] if key in self else default


def verdicts(**numbers):
    return {claim.text: claim.agrees for claim in claims.judge(Numbers(numbers))}


@pytest.mark.parametrize(
    ("text", "good", "bad"),
    [
        ("about 180", {"a_roll_deg": 185.0}, {"a_roll_deg": 130.0}),
        ("gear ratio increases", {"gear_least_step_deg": 0.1}, {"gear_least_step_deg": -0.1}),
        ("rotor inertia increases", {"rotor_least_step_deg": 0.1}, {"rotor_least_step_deg": -0.1}),
        ("less net roll", {"end_loss_least_step_deg": 1.0}, {"end_loss_least_step_deg": -1.0}),
        ("more off-axis", {"end_tip_least_step_deg": 0.2}, {"end_tip_least_step_deg": -0.2}),
        ("mainly yaw at all", {"b_largest_off_axis_share": 0.03}, {"b_largest_off_axis_share": 0.3}),
        ("hardly varies", {"a_axis_spread_deg": 4.0}, {"a_axis_spread_deg": 40.0}),
        ("how fast", {"time_law_rad": 1e-9}, {"time_law_rad": 1e-3}),
        ("mirror image", {"mirrored_a_deg": 170.0}, {"mirrored_a_deg": 170.0, "mirrored_a_off_axis_deg": 2.0}),
        ("ends without feet", {"cat_a_power_of_twist": 1.0, "cat_a_power_of_bend": 2.0}, {"cat_a_power_of_bend": 1.0}),
        ("thin part", {"one_rectangle_within_3_deg": 0.01}, {"one_rectangle_within_3_deg": 0.4}),
    ],
)
def test_a_verdict_follows_its_numbers(text, good, bad):
    for numbers, expected in ((good, True), (bad, False)):
        (agrees,) = (agrees for claim, agrees in verdicts(**numbers).items() if text in claim)
        assert agrees is expected


def test_what_was_not_measured_is_not_tested():
    found = verdicts()
    assert sum(agrees is None for agrees in found.values()) == 4


def test_no_claim_is_left_out_of_the_table_and_each_failure_has_a_reason():
    judged = claims.judge(Numbers())
    rows = claim_table.markdown(judged).splitlines()
    assert len(rows) == 2 + len(judged)
    assert {row.count("|") for row in rows} == {1 + len(claim_table.COLUMNS)}
    for word in ("1.5", "2.4", "2.7.2", "2.8", "2.9", "2.10", "1.9"):
        assert any(word in claim.section for claim in judged)
    untested = [claim for claim in judged if claim.agrees is None]
    assert all(claim.why and claim.verdict == "not tested" for claim in untested)
    assert f"{len(untested)} not tested" in claim_table.text(judged)


def test_the_frame_between_the_middle_links_is_a_change_of_frame():
    """Its connection is beta^T Gamma + vee(beta^T d beta), with beta by differences."""
    robot = robots.prototype()
    point, step = np.array([[1.1, 2.0]]), 1e-6
    where = curved.plane(robot, -1.0, point)
    axes = np.asarray(robot.axis)

    def beta(bend, twist):
        return (Rotation.from_rotvec(twist * axes[0]) * Rotation.from_rotvec(bend / 2 * axes[1])).as_matrix()

    here = beta(*point[0])
    rates = [(beta(*(point[0] + h)) - beta(*(point[0] - h))) / (2 * step) for h in step * np.eye(2)]
    spins = [(here.T @ rate)[[2, 0, 1], [1, 2, 0]] for rate in rates]
    seen = curved.seen(robot, where, curved.MIDDLE)
    np.testing.assert_allclose(seen.gamma[0], here.T @ where.gamma[0] + np.transpose(spins), atol=1e-8)
    np.testing.assert_allclose(seen.form[0], here.T @ where.form[0], atol=1e-12)


def test_the_best_frame_is_smaller_than_others_and_predicts_better():
    """No small change of its coefficients makes the connection smaller; A comes out within 5 degrees."""
    robot = robots.prototype()
    points, weight = curved.nodes(*FULL)
    where = curved.plane(robot, -1.0, points)
    best = curved.smallest(robot, where, weight, degree=3)

    def size(frame):
        return curved.mean_size(curved.seen(robot, where, frame).gamma, weight)

    least = size(best)
    assert least < 0.6 * size(curved.MIDDLE) < 0.6 * size(None)
    rng = np.random.default_rng(0)
    for _ in range(4):
        change = 1e-3 * rng.normal(size=best.coefficients.shape)
        around = [size(best._replace(coefficients=best.coefficients + sign * change)) for sign in (1, -1)]
        assert min(around) > least
        assert abs(around[0] - around[1]) < 0.05 * (sum(around) - 2 * least)
    guess = Rotation.from_rotvec(weight @ curved.seen(robot, where, best).form)
    assert np.rad2deg(guess.magnitude()) == pytest.approx(174.96, abs=5)

"""What the feedback experiment rests on: slopes of turns, the estimate from readings, the correction of a word."""

import numpy as np
import pytest
from feedback_parts.correcting import LINKS, Words, along, angle_left, correct, estimate, turns

RNG = np.random.default_rng(0)
WORDS = Words(np.array([[-1.0, 1.0, -1.0], [1.0, -1.0, 1.0]]), RNG.uniform(0.5, 1.5, (2, 3, 2)))
WORDS.x[1, 2] = 0.0
TRUTH = RNG.normal(size=(2, LINKS))
START = np.tile(np.eye(3), (2, 1, 1))


@pytest.mark.slow
def test_slopes_are_those_of_differences():
    found = turns(TRUTH, WORDS)
    for k in range(LINKS):
        step = 1e-4 * np.eye(LINKS)[k]
        ahead, behind = turns(TRUTH + step, WORDS), turns(TRUTH - step, WORDS)
        slope = angle_left(behind.rotation, ahead.rotation) / 2e-4
        np.testing.assert_allclose(found.by_robot[..., k], slope, atol=1e-7)
    for k in range(2):
        step = 1e-4 * np.eye(2)[k] * WORDS.used[..., None]
        ahead, behind = (turns(TRUTH, WORDS._replace(x=x)) for x in (WORDS.x + step, WORDS.x - step))
        slope = angle_left(behind.rotation, ahead.rotation) / 2e-4
        np.testing.assert_allclose(found.by_x[..., k], slope, atol=1e-7)


def test_an_unused_slot_does_nothing():
    found = turns(TRUTH, WORDS)
    np.testing.assert_array_equal(found.rotation[1, 2], np.eye(3))
    assert not found.by_x[1, 2].any()


@pytest.mark.parametrize("noise", [1e-6, 1e6])
def test_estimate_believes_good_readings_and_ignores_bad_ones(noise):
    places = along(START, turns(TRUTH, WORDS).rotation)[:, 1:]
    z, seen = estimate(WORDS, places, noise)
    if noise < 1:
        assert np.linalg.norm(angle_left(seen, places[:, -1]), axis=1).max() < 1e-6
    else:
        np.testing.assert_allclose(z, 0, atol=1e-9)
        nominal = along(START, turns(0 * TRUTH, WORDS).rotation)[:, -1]
        assert np.linalg.norm(angle_left(seen, nominal), axis=1).max() < 1e-9


def test_corrected_words_end_on_the_target_of_the_robot_that_they_are_for():
    """What the words reach with other amplitudes, they reach."""
    other = WORDS._replace(x=WORDS.x + 0.1 * RNG.normal(size=WORDS.x.shape) * WORDS.used[..., None])
    target = along(START, turns(TRUTH, other).rotation)[:, -1]
    corrected = correct(TRUTH, WORDS, START, target)
    assert np.linalg.norm(angle_left(target, along(START, turns(TRUTH, WORDS).rotation)[:, -1]), axis=1).min() > 0.01
    reached = along(START, turns(TRUTH, corrected).rotation)[:, -1]
    assert np.linalg.norm(angle_left(reached, target), axis=1).max() < 1e-8
    assert not corrected.x[1, 2].any()

"""Words near a target: looked through one by one for few targets, looked up in a tree for many."""

import numpy as np

from reojax.planning.initial_guesses import _FEW, _Words


def _quaternions(count: int, seed: int) -> np.ndarray:
    q = np.random.default_rng(seed).normal(size=(4, count))
    return q / np.sqrt((q * q).sum(0))


def test_both_ways_find_the_same_words():
    """The nearest by the angle between rotations, whatever the signs; a tree once made serves few targets, too."""
    words, targets = _quaternions(3000, 0), _quaternions(_FEW + 1, 1)
    few, many = (_Words(np.arange(3000)[None], words) for _ in range(2))
    chord, word = many.nearest(targets, 7)
    for k, target in enumerate(targets.T):
        for found in (few.nearest(target[:, None], 7), many.nearest(-target[:, None], 7)):
            np.testing.assert_allclose(found[0][0], chord[k], atol=1e-12)
            np.testing.assert_array_equal(found[1][0], word[k])
    angle = 2 * np.arccos(np.minimum(1, np.abs(targets.T @ words)))
    np.testing.assert_allclose(4 * np.arcsin(chord / 2), np.sort(angle, axis=1)[:, :7], atol=1e-6)


def test_nothing_is_near_within_less_than_the_nearest():
    words, targets = _quaternions(100, 2), _quaternions(40, 3)
    some = _Words(np.arange(100)[None], words)
    nearest = some.nearest(targets, 1)[0][:, 0]
    within = float(np.median(nearest))
    np.testing.assert_array_equal(some.nearest(targets, 1, within)[0][:, 0] < within, nearest < within)


def test_no_targets_have_no_words_near():
    some = _Words(np.arange(9)[None], _quaternions(9, 4))
    for _ in range(2):  # before there is a tree, and after
        chord, word = some.nearest(np.zeros((4, 0)), 3)
        assert chord.shape == word.shape == (0, 3)
        some.nearest(_quaternions(40, 5), 3)

"""One rule for the rectangle: manoeuvres, the letters of plans and the loops of designs are the same polygon."""

import numpy as np
import pytest

import reojax
from reojax import FOUR_BODY, SIX_BODY, design
from reojax.manoeuvres import rectangle
from reojax.planning.words import last_twist, word_corners

TWIST, BEND = 1.3, 0.7
MADE = {"A": reojax.manoeuvre_a, "B": reojax.manoeuvre_b}


def test_corners_of_the_thesis():
    last = {"A": -TWIST, "B": TWIST}
    for letter, make in MADE.items():
        expected = [(0, 0, 0), (0, BEND, 0), (TWIST, BEND, last[letter]), (TWIST, 0, last[letter]), (0, 0, 0)]
        np.testing.assert_array_equal(make(TWIST, BEND).waypoints, expected)


def test_feet_fold_before_and_unfold_after():
    feet = SIX_BODY.fold_angle
    folded = np.array([feet[0], 0, 0, 0, feet[1]])
    path = reojax.manoeuvre_a(TWIST, BEND, SIX_BODY).waypoints
    assert path.shape == (7, 5)
    np.testing.assert_array_equal(path[[0, 6]], 0)
    np.testing.assert_array_equal(path[[1, 5]], [folded, folded])
    np.testing.assert_array_equal(path[3], folded + [0, TWIST, BEND, -TWIST, 0])


@pytest.mark.parametrize("layout", [FOUR_BODY, SIX_BODY])
@pytest.mark.parametrize("letter", "ABR")
def test_letters_of_plans_are_the_manoeuvres(layout, letter):
    amplitudes = np.array([[TWIST], [BEND], [0.4]] if letter == "R" else [[TWIST], [BEND]])
    last = last_twist(letter, np.zeros(1, int), amplitudes)
    made = rectangle(TWIST, BEND, 0.4, layout) if letter == "R" else MADE[letter](TWIST, BEND, layout)
    np.testing.assert_array_equal(word_corners(layout, amplitudes[0], amplitudes[1], last), made.waypoints)


def test_loops_of_designs_are_the_rectangle():
    loops = design.rectangles(reojax.robots.prototype())
    up, down = np.array([BEND, 0, 0.4]), np.array([0, TWIST, 0])
    path = loops.path(np.concatenate([up, down]))
    np.testing.assert_allclose(path.waypoints, rectangle(-TWIST, BEND, 0.4).waypoints, atol=1e-15)


def test_last_twist_is_checked():
    with pytest.raises(ValueError, match="`last_twist` is nan"):
        rectangle(1.0, 1.0, np.nan)
    with pytest.raises(ValueError, match=r"`layout` is for 5 joints; .* 3 joints"):
        design.rectangles(reojax.robots.prototype(), layout=SIX_BODY)

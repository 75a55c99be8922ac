"""Pictures of grids, histories and curvature: what is drawn, on the axes given, with units; bad input named."""

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure

import reojax
from reojax import plot, robots

PROTOTYPE = robots.prototype()
LOOP = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
X, Y = np.linspace(0, 270, 7), np.linspace(0, 120, 4)
Z = np.outer(Y, X)
TURNS = np.broadcast_to(np.eye(3), (2, 3, 3, 3))


def test_a_map_is_filled_has_lines_and_a_bar_with_the_unit():
    axes = Figure().add_subplot()
    assert plot.draw_map(axes, X, Y, Z, label="roll [deg]") is axes
    assert axes.get_xlim() == (0, 270)
    assert axes.get_ylim() == (0, 120)
    (bar,) = (other for other in axes.figure.axes if other is not axes)
    assert bar.get_ylabel() == "roll [deg]"
    plot.draw_map(axes, X, Y, 0 * Z, label=None)  # nothing but one value
    assert len(axes.figure.axes) == 2


def test_signed_maps_are_white_at_zero():
    axes = Figure().add_subplot()
    plot.draw_map(axes, X, Y, Z - Z.max() / 4, label=None, diverging=True)
    (filled,) = (drawn for drawn in axes.collections if isinstance(drawn, ContourSet) and drawn.filled)
    np.testing.assert_allclose(filled.to_rgba(0.0)[:3], 0.97, atol=0.03)


def test_lines_are_told_apart_by_more_than_colour():
    axes = Figure().add_subplot()
    labels = [f"line {k}" for k in range(7)]
    plot.draw_lines(axes, X, np.outer(np.arange(7), X), labels=labels, points=slice(None, None, 2))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == labels
    assert len({line.get_marker() for line in axes.lines}) == len({line.get_color() for line in axes.lines}) == 7
    assert axes.lines[0].get_markevery() == [0, 2, 4, 6]


def test_a_loop_has_an_arrow_on_every_edge():
    axes = Figure().add_subplot()
    plot.draw_loop(axes, [[0, 0], [0, 120], [270, 120], [270, 0], [0, 0]])
    assert len(axes.texts) == 4
    assert len(axes.lines[0].get_xdata()) == 5


def test_one_robot_for_every_point_of_a_grid():
    axes = Figure().add_subplot()
    each = [robots.with_end_inertia(PROTOTYPE, i) for i in np.linspace(10e-6, 190e-6, 6)]
    plot.draw_poses(axes, each, TURNS, columns=list("abc"), rows=list("de"), texts=[["1°"] * 3] * 2)
    drawn = [c for c in axes.collections if isinstance(c, PolyCollection)]
    assert len(drawn) == 6
    assert len(axes.texts) == 6
    assert [label.get_text() for label in axes.get_xticklabels()] == list("abc")
    places = [np.concatenate([path.vertices for path in body.get_paths()]) for body in drawn]
    for k, points in enumerate(places):
        assert np.abs(points - [k % 3, k // 3]).max() < 0.5
    assert np.ptp(places[0], axis=0)[1] < np.ptp(places[5], axis=0)[1]  # one scale for all: feet get longer


def test_histories_in_both_sets_of_angles():
    frames = plot.frames_along(PROTOTYPE, LOOP, per_edge=16)
    labels = {}
    for angles in ("tilt", "zxz"):
        axes = Figure().add_subplot()
        assert plot.draw_orientation(axes, frames.rotation, edges=4, angles=angles) is axes
        assert "[deg]" in axes.get_ylabel()
        labels[angles] = {line.get_label(): np.asarray(line.get_ydata()) for line in axes.lines}
    roll, total = labels["tilt"]["roll about z"], labels["zxz"]["first + third"]
    np.testing.assert_allclose(total, roll, atol=1e-9)
    assert roll[-1] == pytest.approx(185.0, abs=0.1)
    assert len(axes.collections) == 1  # where first and third mean nothing on their own
    joints = plot.draw_joints(Figure().add_subplot(), PROTOTYPE, LOOP)
    assert [line.get_label() for line in joints.lines[:3]] == ["twist1", "bend", "twist2"]


BAD = {
    "make it (rows, columns)": lambda axes: plot.draw_map(axes, X, Y, Z.T, label=None),
    "finite everywhere": lambda axes: plot.draw_map(axes, X, Y, np.where(Z == 0, np.nan, Z), label=None),
    "2 labels": lambda axes: plot.draw_lines(axes, X, Z, labels=["one", "two"]),
    "`corners` has shape (3,)": lambda axes: plot.draw_loop(axes, [0, 1, 2]),
    "the labels make it (2, 2, 3, 3)": lambda axes: plot.draw_poses(axes, PROTOTYPE, TURNS, columns="ab", rows="de"),
    "1 robots for 6": lambda axes: plot.draw_poses(axes, [PROTOTYPE], TURNS, columns="abc", rows="de"),
    "must be (m, 3, 3)": lambda axes: plot.draw_orientation(axes, np.eye(3), edges=1),
    "must be one of 'tilt', 'zxz'": lambda axes: plot.draw_orientation(axes, TURNS[0], edges=1, angles="xyz"),
    "has 3 joints": lambda axes: plot.draw_joints(axes, PROTOTYPE, reojax.polygon(np.zeros((2, 2)))),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_input_is_named(message):
    with pytest.raises(ValueError) as caught:  # noqa: PT011  (the message is looked for below)
        BAD[message](Figure().add_subplot())
    assert message in str(caught.value)

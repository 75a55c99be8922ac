"""Where a robot comes nearest to itself: the posture, the pair, and two points of the surfaces; told and drawn."""

import numpy as np
import pytest
from mpl_toolkits.mplot3d.axes3d import Axes3D

import reojax
from reojax import plot

PROTOTYPE = reojax.robots.prototype()
PASSING = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
MEETING = reojax.manoeuvre_b(np.deg2rad(-270), np.deg2rad(120))


@pytest.mark.parametrize("path", [PASSING, MEETING])
def test_the_two_points_lie_on_the_surfaces_as_far_apart_as_is_told(path):
    near = reojax.nearest_parts(PROTOTYPE, path)
    assert near.distance <= near.found <= near.distance + 1e-4
    np.testing.assert_allclose(reojax.clearance(PROTOTYPE, near.theta)[near.pair], near.found, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(near.points[1] - near.points[0]), abs(near.found), atol=1e-12)
    rotation, position = map(np.asarray, reojax.link_poses(PROTOTYPE, near.theta))
    for capsule, point in zip(PROTOTYPE.collision_pairs[near.pair], near.points, strict=True):
        link, start, end, radius = PROTOTYPE.capsules[capsule]
        assert link in near.links
        own = rotation[link].T @ (point - position[link])
        along = np.asarray(end) - start
        share = np.clip((own - start) @ along / max(along @ along, 1e-300), 0, 1)
        np.testing.assert_allclose(np.linalg.norm(own - start - share * along), radius, atol=1e-12)


def test_robots_without_pairs_have_no_nearest_parts():
    with pytest.raises(ValueError, match="'planar2' has no pairs of shapes"):
        reojax.nearest_parts(reojax.robots.planar(2), reojax.polygon([[0.0], [1.0]]))


def test_pictures_mark_the_place():
    near = reojax.nearest_parts(PROTOTYPE, MEETING)
    figure = plot.history_figure(PROTOTYPE, MEETING, clearance=True)
    flat = [axes for axes in figure.axes if not isinstance(axes, Axes3D)]
    space = next(axes for axes in figure.axes if isinstance(axes, Axes3D))
    for axes in flat:
        assert any(np.allclose(line.get_xdata(), near.at) for line in axes.lines)
    drawn = np.array(space.lines[0].get_data_3d()).T
    np.testing.assert_allclose(drawn[1] - drawn[0], near.points[1] - near.points[0], atol=1e-12)
    assert "overlap by 12.0 mm" in space.get_title()
    assert not any(isinstance(axes, Axes3D) for axes in plot.history_figure(PROTOTYPE, MEETING).axes)

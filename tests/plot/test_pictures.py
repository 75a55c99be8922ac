"""Pictures of robots: every part where mechanics says it is, files whole or not at all, bad input named."""

import os
import shutil
import subprocess

import numpy as np
import pytest
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from PIL import Image

import reojax
from reojax import plot, robots
from reojax.drawing import solids
from reojax.mechanics.kinematics import kinematics
from reojax.plot.robots import faces_at_pose, poses
from reojax.robots.random import random_robot

PROTOTYPE = robots.prototype()
LOOP = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def space(figure=None):
    return (figure or Figure()).add_subplot(projection="3d")


def extent(points):
    return points.reshape(-1, 3).min(0), points.reshape(-1, 3).max(0)


def test_poses_are_those_of_the_mechanics():
    robot = random_robot(5, 3, branched=True)
    theta = np.array([0.4, -1.1, 2.0])
    exact = kinematics(robot, theta)
    turned, origin = poses(robot, theta)
    np.testing.assert_allclose(turned, exact.rotation, atol=1e-14)
    centre = origin + np.einsum("nij,nj->ni", turned, robot.com)
    np.testing.assert_allclose(centre, exact.com, atol=1e-14)
    np.testing.assert_allclose(robot.mass @ centre, 0, atol=1e-14)


def test_a_middle_link_is_its_cylinder():
    """A uniform cylinder is drawn as itself: 64 mm long, 25.6 mm in radius, hanging from its joint."""
    low, high = extent(solids.link_faces(PROTOTYPE)[1])
    np.testing.assert_allclose([low[2], high[2]], [-0.064, 0], atol=1e-12)
    np.testing.assert_allclose(np.abs([low[:2], high[:2]]), 0.0256, rtol=0.02)


def test_an_l_shaped_end_link_looks_like_one():
    """Shank along z up to the foot, foot out to the insert, nothing between: as the prototype was built."""
    chosen = robots.prototype.__globals__["Chosen"]()
    points = solids.link_faces(PROTOTYPE)[0].reshape(-1, 3)
    along_foot = points @ chosen.foot_direction
    assert along_foot.max() == pytest.approx(chosen.foot_length, rel=0.05)
    assert points[:, 2].max() == pytest.approx(chosen.shank_length, rel=0.2)
    low = points[points[:, 2] < 0.6 * chosen.shank_length]
    assert len(low)
    assert np.abs(low @ chosen.foot_direction).max() < 2 * chosen.rod_radius
    mirrored = solids.link_faces(PROTOTYPE)[3].reshape(-1, 3) * [-1, 1, -1]
    np.testing.assert_allclose(np.sort(mirrored, axis=0), np.sort(points, axis=0), atol=1e-12)


def test_straight_rods_stay_straight():
    """A rod that sticks out at a right angle from its joint is no L."""
    for link, faces in enumerate(solids.link_faces(robots.planar(3))):
        low, high = extent(faces)
        np.testing.assert_allclose([low[0], high[0]], [0, 1], atol=2e-3, err_msg=str(link))
        assert np.abs([low[1:], high[1:]]).max() < 0.1


@pytest.mark.parametrize("robot", [random_robot(s, 4, branched=True) for s in (1, 2)] + [robots.two_cylinder_cat(0.25)])
def test_faces_are_closed_and_face_outwards(robot):
    """By Gauss the faces of one link enclose a positive volume, and their areas balance."""
    for faces in solids.link_faces(robot) + solids.joint_faces(robot):
        area = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1]) / 2
        np.testing.assert_allclose(area.sum(0), 0, atol=1e-12)
        assert np.einsum("fi,fi", faces.mean(1), area) > 0


def test_links_reach_their_joints():
    """No gap: on every link there is a point close to each of its joints."""
    for seed in range(6):
        robot = random_robot(seed, 4, branched=True)
        thick = 0.06 * solids.size(robot)
        for link, faces in enumerate(solids.link_faces(robot)):
            points = faces.reshape(-1, 3)
            low, high = points.min(0) - thick, points.max(0) + thick
            joints = [np.zeros(3)] * (link > 0) + [robot.anchor[k] for k, p in enumerate(robot.parent) if p == link]
            for joint in joints:
                assert ((low <= joint) & (joint <= high)).all()


def test_draw_robot_draws_onto_the_axes_it_is_given():
    axes = space()
    assert plot.draw_robot(axes, PROTOTYPE, [0.1, 0.2, 0.3], TURN, centres=True) is axes
    (body,) = (c for c in axes.collections if isinstance(c, Poly3DCollection))
    faces, colours = faces_at_pose(PROTOTYPE, [0.1, 0.2, 0.3], TURN)
    assert len(faces) == len(colours) == len(body.get_facecolor())
    low, high = extent(faces)
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    assert (limits[:, 0] <= low + 1e-12).all()
    assert (limits[:, 1] >= high - 1e-12).all()
    np.testing.assert_allclose(np.ptp(limits, axis=1), np.ptp(limits, axis=1)[0])
    plot.draw_robot(axes, PROTOTYPE, [0.1, 0.2, 0.3], position=(1.0, 0, 0))
    assert axes.get_xlim()[1] > 1
    assert axes.get_xlim()[0] <= limits[0, 0] + 1e-12


def test_a_rotation_turns_everything():
    straight, _ = faces_at_pose(PROTOTYPE, np.zeros(3))
    np.testing.assert_allclose(faces_at_pose(PROTOTYPE, np.zeros(3), TURN)[0], straight @ TURN.T, atol=1e-15)


def test_flat_and_spatial_pictures_agree():
    """What points right, up and to the eye in flat axes is what 3-D axes show there."""
    from mpl_toolkits.mplot3d import proj3d

    view = plot.View(33.0, -40.0, "z")
    axes = space()
    plot.draw_robot(axes, PROTOTYPE, np.zeros(3), view=view)
    projection = axes.get_proj()
    points = np.vstack([np.zeros(3), view.camera()])
    page = np.array([proj3d.proj_transform(*point, projection)[:2] for point in points])
    right, up, eye = page[1:] - page[0]
    np.testing.assert_allclose([right[1], up[0], *eye], 0, atol=1e-9)
    assert up[1] == pytest.approx(right[0])
    assert right[0] > 0
    flat = Figure().add_subplot()
    assert plot.draw_robot_flat(flat, PROTOTYPE, np.zeros(3), at=(5, 7), scale=2.0, view=view) is flat
    (body,) = flat.collections
    corners = np.concatenate([path.vertices for path in body.get_paths()])
    seen = faces_at_pose(PROTOTYPE, np.zeros(3))[0].reshape(-1, 3) @ view.camera().T[:, :2] * 2 + [5, 7]
    np.testing.assert_allclose(corners.max(0), seen.max(0), atol=2e-3)


def test_frames_follow_the_path():
    frames = plot.frames_along(PROTOTYPE, LOOP, per_edge=2)
    np.testing.assert_allclose(frames.theta[::2], LOOP.waypoints, atol=1e-12)
    np.testing.assert_allclose(frames.theta[1], LOOP.waypoints[1] / 2, atol=1e-12)
    np.testing.assert_allclose(frames.rotation[-1], reojax.net_rotation(PROTOTYPE, LOOP), atol=1e-9)
    figure = plot.frames_figure(PROTOTYPE, LOOP, title="A", titles=list("abcde"))
    assert [axes.get_title() for axes in figure.axes] == list("abcde")
    limits = {axes.get_xlim() for axes in figure.axes}
    assert len(limits) == 1
    assert any("mm" in text.get_text() for text in figure.axes[0].texts)


def test_an_animation_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    out = tmp_path / "a.gif"
    frames = plot.Frames(np.zeros((3, 3)), np.stack([np.eye(3), TURN, TURN @ TURN]))
    plot.animate(PROTOTYPE, frames, out, seconds=1.0, titles=list("abc"))
    with Image.open(out) as image:
        assert image.size == (960, 720)
        assert image.n_frames >= 3
        assert image.info["loop"] == 0
    before = out.read_bytes()

    def broken(*arguments, **options):
        raise OSError("disk full")

    monkeypatch.setattr(Image.Image, "save", broken)
    with pytest.raises(OSError, match="disk full"):
        plot.animate(PROTOTYPE, frames, out)
    assert out.read_bytes() == before
    assert os.listdir(tmp_path) == ["a.gif"]


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="no ffmpeg, so no .mp4")
def test_a_film_tells_its_time(tmp_path, monkeypatch):
    """An MP4 of 960 x 720 with the times that the poses have; without ffmpeg it is refused with what to do."""
    frames = plot.Frames(np.zeros((3, 3)), np.stack([np.eye(3), TURN, TURN @ TURN]))
    out, told = tmp_path / "a.mp4", set()
    real = Figure.savefig

    def look(figure, *arguments, **options):
        told.update(text.get_text() for text in figure.texts)
        return real(figure, *arguments, **options)

    monkeypatch.setattr(Figure, "savefig", look)
    plot.animate(PROTOTYPE, frames, out, seconds=1.0, time=[0.0, 0.2, 0.4], title="A turn")
    assert {"A turn", "0.000 s", "0.200 s", "0.400 s"} <= told
    shape = "ffprobe -v error -select_streams v -show_entries stream=width,height -of csv=p=0".split()
    assert subprocess.run([*shape, out], capture_output=True, text=True, check=True).stdout.strip() == "960,720"
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(ValueError, match="needs the program ffmpeg, which is missing; .gif does not"):
        plot.check_animation(out)


BAD = {
    "3-D axes": lambda tmp: plot.draw_robot(Figure().add_subplot(), PROTOTYPE, np.zeros(3)),
    r"`theta`.*3 finite": lambda tmp: plot.draw_robot(space(), PROTOTYPE, np.zeros(2)),
    r"`theta` is array": lambda tmp: plot.draw_robot(space(), PROTOTYPE, [np.nan, 0, 0]),
    "`rotation`": lambda tmp: plot.draw_robot(space(), PROTOTYPE, np.zeros(3), np.ones((3, 3))),
    "`position`": lambda tmp: plot.draw_robot(space(), PROTOTYPE, np.zeros(3), position=(0, 0)),
    "`view`": lambda tmp: plot.draw_robot(space(), PROTOTYPE, np.zeros(3), view=plot.View(up="w")),  # type: ignore
    "elevation": lambda tmp: plot.draw_robot_flat(space(), PROTOTYPE, np.zeros(3), view=plot.View(elevation=90)),
    "`robot`": lambda tmp: plot.draw_robot(space(), "cat", np.zeros(3)),  # type: ignore
    "each frame needs its own": lambda tmp: plot.draw_frames([space()], PROTOTYPE, plot.Frames(*TWO)),
    "(m, 3)": lambda tmp: plot.draw_frames([space()], PROTOTYPE, plot.Frames(np.zeros((1, 2)), TURN[None])),
    "3 titles": lambda tmp: plot.draw_frames([space()] * 2, PROTOTYPE, plot.Frames(*TWO), titles=list("abc")),
    "ends in one of .mp4, .gif": lambda tmp: plot.animation(PROTOTYPE, LOOP, tmp / "a.png"),
    "no folder": lambda tmp: plot.animation(PROTOTYPE, LOOP, tmp / "none" / "a.gif"),
    "needs an edge": lambda tmp: plot.animation(PROTOTYPE, reojax.polygon(np.zeros((1, 3))), tmp / "a.gif"),
    "`frames`": lambda tmp: plot.animation(PROTOTYPE, LOOP, tmp / "a.gif", frames=0),
    "4 edges": lambda tmp: plot.animation(PROTOTYPE, LOOP, tmp / "a.gif", titles=["bend"]),
    "`seconds`": lambda tmp: plot.animate(PROTOTYPE, plot.Frames(*TWO), tmp / "a.gif", seconds=0),
    "`path`": lambda tmp: plot.frames_figure(PROTOTYPE, reojax.polygon(np.zeros((2, 2)))),
}
TWO = (np.zeros((2, 3)), np.stack([np.eye(3), TURN]))


@pytest.mark.parametrize("message", BAD)
def test_bad_input_is_named(message, tmp_path):
    import re

    pattern = message if "`" in message or "." in message else re.escape(message)
    with pytest.raises(ValueError, match=pattern):
        BAD[message](tmp_path)
    assert not os.listdir(tmp_path)


def test_three_axes_of_a_sweep_are_small_multiples():
    """A column for each of up to four values of the third axis, all of a row on one scale, each saying its value."""
    grid = {"u": np.linspace(0, 1, 6), "v": np.linspace(0, 1, 5), "w": np.array([1.0, 2.0, 4.0])}
    found = reojax.sweep(lambda u, v, w: {"product": w * (u + v)}, grid)
    figure = plot.sweep_figure(found, title="A sweep")
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert [title for title in titles if title] == ["product\nat w 1", "product\nat w 2", "product\nat w 4"]
    panels = [axes for axes in figure.axes if axes.get_title(loc="left")]
    scales = {(axes.collections[0].norm.vmin, axes.collections[0].norm.vmax) for axes in panels}
    assert len(scales) == 1
    assert scales.pop()[1] >= 8

"""Robots in space: their links at a pose, about their centre of mass."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import as_numbers
from reojax.drawing.capsules import capsule_faces
from reojax.drawing.colours import INK, link_colour
from reojax.drawing.solids import Faces, joint_faces, link_faces
from reojax.drawing.view import View, check_view, default_view
from reojax.plot._arguments import check_arguments
from reojax.plot._light import shade
from reojax.robot import Robot


@check_arguments
def draw_robot(
    axes: Axes3D,
    robot: Robot,
    theta: ArrayLike,
    rotation: ArrayLike | None = None,
    *,
    position: ArrayLike = (0.0, 0.0, 0.0),
    view: View | None = None,
    alpha: float = 1.0,
    centres: bool = False,
) -> Axes3D:
    """Draw a robot in 3-D axes, its centre of mass at `position`; equal scales, in metres.

    Links are their capsules, or, where they have none, solids of the right mass and inertia between the joints; the
    base (link 0) is red, dark pins are joint axes. At zero momentum the centre of mass of a free-falling robot stays
    where it is, so robots at one position are one robot at different times.

    Args:
        axes: 3-D axes, `figure.add_subplot(projection="3d")`.
        robot: the robot.
        theta: (j,) joint angles [rad].
        rotation: (3, 3) of the base, base components to inertial ones; default the identity.
        position: (3,) of the robot's centre of mass [m].
        view: from where to look; default from the front. A later call may turn the view of all.
        alpha: opacity, 0 to 1.
        centres: mark the centres of mass of the links with dots, in front of everything.

    Returns:
        The axes, their limits widened to show this robot whole.

    Raises:
        ValueError: if the axes are flat, or an argument has the wrong shape or is not finite.
    """
    if not isinstance(axes, Axes3D):
        raise ValueError(f"`axes` is a {type(axes).__name__}; robots need 3-D axes, projection='3d'.")
    view = default_view(robot) if view is None else view
    check_view(view)
    place = _vector("position", position, 3)
    faces, colours = faces_at_pose(robot, theta, rotation)
    rgb = shade(faces, colours, view)
    body = Poly3DCollection(faces + place, facecolors=rgb, edgecolors=rgb, linewidths=0.3, alpha=alpha)
    body.set_gid(f"robot {robot.name}")
    axes.add_collection3d(body)
    axes.set_proj_type("ortho")
    axes.view_init(elev=view.elevation, azim=view.azimuth, vertical_axis=view.up)
    if centres:
        turned, origin = poses(robot, np.asarray(theta, float))
        dots = origin + np.einsum("nij,nj->ni", turned, np.asarray(robot.com, float))
        dots = dots @ (np.eye(3) if rotation is None else np.asarray(rotation, float)).T + place
        style = {"marker": "o", "markersize": 3.5, "markerfacecolor": "white", "markeredgecolor": INK}
        axes.plot(*dots.T, linestyle="none", markeredgewidth=0.8, zorder=1000, **style)
    _show(axes, (faces + place).reshape(-1, 3))
    return axes


@check_arguments
def draw_robot_flat(
    axes: Axes,
    robot: Robot,
    theta: ArrayLike,
    rotation: ArrayLike | None = None,
    *,
    at: tuple[float, float] = (0.0, 0.0),
    scale: ArrayLike = 1.0,
    view: View | None = None,
    alpha: float = 1.0,
) -> Axes:
    """Draw a robot in flat axes as seen from `view`, its centre of mass at the point `at`.

    Args:
        axes: flat axes, whose limits stay as they are.
        robot: the robot.
        theta: (j,) joint angles [rad].
        rotation: (3, 3) of the base, base components to inertial ones; default the identity.
        at: where, in the axes' units.
        scale: axes' units per metre, or one for each direction of the page.
        view: from where to look; default from the front.
        alpha: opacity, 0 to 1.

    Raises:
        ValueError: if an argument has the wrong shape or is not finite.
    """
    view = default_view(robot) if view is None else view
    check_view(view)
    size = checks.numbers("scale", scale, () if checks.rank(scale) == 0 else (2,))
    faces, colours = faces_at_pose(robot, theta, rotation)
    camera = view.camera()
    seen = faces @ camera.T
    towards = np.cross(seen[:, 2] - seen[:, 0], seen[:, 3] - seen[:, 1])[:, 2] > 0
    order = np.flatnonzero(towards)[np.argsort(seen[towards, :, 2].mean(1))]
    rgb = shade(faces, colours, view)[order]
    polygons = seen[order][:, :, :2] * np.broadcast_to(size, 2) + _vector("at", at, 2)
    body = PolyCollection(list(polygons), facecolors=rgb, edgecolors=rgb, linewidths=0.3, alpha=alpha, zorder=2)
    body.set_gid(f"robot {robot.name}")
    axes.add_collection(body, autolim=False)
    return axes


@check_arguments
def draw_axes(axes: Axes3D, length: float, *, at: ArrayLike = (0.0, 0.0, 0.0), names: Sequence[str] = "xyz") -> Axes3D:
    """Draw the directions x, y and z as lines of `length` [m] with their names at the ends.

    Args:
        axes: 3-D axes.
        length: of the lines [m].
        at: (3,) where they begin [m].
        names: three, of x, y and z.

    Raises:
        ValueError: if an argument is not what it must be.
    """
    corner = _vector("at", at, 3)
    ends = corner + length * np.eye(3)
    axes.add_collection3d(Line3DCollection([(corner, end) for end in ends], colors=INK, linewidths=1.0))
    for end, name in zip(corner + 1.3 * length * np.eye(3), names, strict=True):
        axes.text(end[0], end[1], end[2], name, color=INK, fontsize=8, ha="center", va="center")
    return axes


def faces_at_pose(robot: Robot, theta: ArrayLike, rotation: ArrayLike | None = None) -> tuple[Faces, list[str]]:
    """Faces of a robot at a pose about its centre of mass, in inertial components [m], and their colours.

    Raises:
        ValueError: if an argument has the wrong shape or is not finite.
    """
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    turned, origin = poses(robot, _vector("theta", theta, robot.joints))
    base = np.eye(3) if rotation is None else np.asarray(as_numbers("rotation", rotation), float)
    if base.shape != (3, 3) or not np.isfinite(base).all() or np.abs(base @ base.T - np.eye(3)).max() > 1e-3:
        raise ValueError(f"`rotation` is {checks.shorten(base)}; it must be a rotation matrix, (3, 3).")
    faces, colours = [], []
    links, pins = _parts(robot)
    for link, own in enumerate(links):
        faces.append(own @ turned[link].T + origin[link])
        colours += [link_colour(link)] * len(own)
    for joint, own in enumerate(pins):
        faces.append(own @ turned[joint + 1].T + origin[joint + 1])
        colours += [INK] * len(own)
    return np.concatenate(faces) @ base.T, colours


@lru_cache(maxsize=32)
def _parts(robot: Robot) -> tuple[list[Faces], list[Faces]]:
    """Faces of links and joints; kept, as frames and animations draw one robot many times."""
    links, pins = link_faces(robot), joint_faces(robot)
    for link in set(robot.capsule_link):
        links[link] = np.concatenate([capsule_faces(*shape) for on, *shape in robot.capsules if on == link])
        if link:
            pins[link - 1] = pins[link - 1][:0]
    return links, pins


def poses(robot: Robot, theta: np.ndarray) -> tuple[Float[np.ndarray, "n 3 3"], Float[np.ndarray, "n 3"]]:
    """Orientation and origin of each link's frame, from the robot's centre of mass, in the base frame.

    As `reojax.link_poses`, which is for JAX to compile; a picture needs a pose at once.
    """
    turned, origin = [np.eye(3)], [np.zeros(3)]
    axis, anchor, com = (np.asarray(x, float) for x in (robot.axis, robot.anchor, robot.com))
    for k, p in enumerate(robot.parent):
        x, y, z = e = axis[k] / np.linalg.norm(axis[k])
        hat = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        c, s = np.cos(theta[k]), np.sin(theta[k])
        turned.append(turned[p] @ (c * np.eye(3) + s * hat + (1 - c) * np.outer(e, e)))
        origin.append(origin[p] + turned[p] @ anchor[k])
    turned, origin = np.stack(turned), np.stack(origin)
    centre = origin + np.einsum("nij,nj->ni", turned, com)
    mass = np.asarray(robot.mass, float)
    return turned, origin - mass @ centre / mass.sum()


def _show(axes: Axes3D, points: np.ndarray) -> None:
    """Widen limits to the cube about all robots so far."""
    low, high = points.min(0), points.max(0)
    if not axes.get_autoscalex_on():
        limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
        low, high = np.minimum(low, limits[:, 0]), np.maximum(high, limits[:, 1])
    middle, half = (low + high) / 2, max(high - low) / 2
    for limit, centre in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), middle, strict=True):
        limit(centre - half, centre + half)
    for axis, name in zip((axes.xaxis, axes.yaxis, axes.zaxis), "xyz", strict=True):
        axis.set_label_text(f"{name} [m]", color=INK)
        axis.set_major_locator(MaxNLocator(4))
    axes.tick_params(labelsize=8)
    axes.set_box_aspect((1, 1, 1), zoom=1.1)  # pyright: ignore[reportArgumentType]  (zoom is a float)


def _vector(entry: str, value: Any, length: int) -> np.ndarray:
    vector = np.asarray(as_numbers(entry, value), float)
    if vector.shape != (length,) or not np.isfinite(vector).all():
        raise ValueError(f"`{entry}` is {checks.shorten(vector)}; it must be {length} finite numbers.")
    return vector

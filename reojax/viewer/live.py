"""The live viewer: sliders for the joints in a browser, served by viser (extra `viser`) on the loopback only."""

from __future__ import annotations

import threading
import time
from functools import partial
from typing import Any

import numpy as np

from reojax import so3
from reojax._internal import checks
from reojax.drawing.colours import AXES, INK, link_colour
from reojax.drawing.solids import beam, joint_faces, link_faces, size
from reojax.drawing.view import default_view
from reojax.manoeuvres import BY_NAME
from reojax.mechanics.holonomy import net_rotation
from reojax.mechanics.kinematics import centre_of_mass, link_poses
from reojax.path import Path
from reojax.robot import Robot, layout_of
from reojax.robots import with_end_inertia, with_gear_ratio
from reojax.viewer.dragging import Dragging

LOOPBACK = "127.0.0.1"
_UNLIMITED = 360.0
"""Range of the slider of a joint without limits, either way [deg]."""
_STEP = 0.5
"""Step of a joint's slider [deg]."""
_FRAMES = 40
"""Moves for each edge of a manoeuvre that is run."""
_TRACK = 4000
"""Most points of the track that stay drawn."""


class Live:
    """A page with a robot and its sliders, until `stop`; built by `serve`."""

    def __init__(self, robot: Robot, server: Any) -> None:
        self.server = server
        self.dragging = Dragging(robot)
        self._lock = threading.RLock()
        self._base = robot
        self._reach = size(robot)
        self._stopped = threading.Event()
        server.gui.configure_theme(control_width="large", show_share_button=False)
        view = default_view(robot)
        server.scene.set_up_direction(f"+{view.up}")
        server.initial_camera.position = tuple(4.0 * self._reach * view.camera()[2])
        server.initial_camera.look_at = (0.0, 0.0, 0.0)
        self.joints = self._add_joints()
        self.report = server.gui.add_markdown("")
        self.inertia: Any = None
        self.gear: Any = None
        if robot.layout is not None:
            self._add_manoeuvres()
        self._draw_links()
        self.show()

    def stop(self) -> None:
        """Close the page."""
        self._stopped.set()
        self.server.stop()

    def show(self) -> None:
        """Put the links, the axes and the track where the present posture and orientation have them."""
        robot, theta, rotation = self.dragging.robot, self.dragging.theta, self.dragging.rotation
        turned, origin = (np.asarray(x, float) for x in link_poses(robot, theta))
        centre = np.asarray(centre_of_mass(robot, theta), float)
        with self.server.atomic():
            for k, frame in enumerate(self.frames):
                frame.wxyz = np.asarray(so3.to_quaternion(rotation @ turned[k]), float)
                frame.position = rotation @ (origin[k] - centre)
            self.axes.wxyz = np.asarray(so3.to_quaternion(rotation), float)
            self._draw_track()
            vector = np.rad2deg(np.asarray(so3.log(rotation), float))
            self.report.content = (
                f"**Base has turned** {np.linalg.norm(vector):.2f}°, rotation vector "
                f"({vector[0]:.2f}, {vector[1]:.2f}, {vector[2]:.2f})°"
            )

    def move(self, theta: np.ndarray) -> None:
        """Go straight to joint angles [rad], and show it."""
        with self._lock:
            self.dragging.move(theta)
            self.show()

    def drag(self, joint: int, angle: float) -> None:
        """Turn one joint to an angle [rad] and leave the others, as its slider does."""
        with self._lock:
            theta = self.dragging.theta.copy()
            theta[joint] = angle
            self.move(theta)

    def _add_joints(self) -> dict[int, Any]:
        robot, gui = self._base, self.server.gui
        coupled = {joint for joint, _ in robot.couplings}
        sliders = {}
        with gui.add_folder("Joints [deg]"):
            for k, name in enumerate(robot.joint_names):
                if k in coupled:
                    continue
                low, high = (np.rad2deg(float(np.asarray(x)[k])) for x in (robot.lower, robot.upper))
                low, high = max(low, -_UNLIMITED), min(high, _UNLIMITED)
                slider = gui.add_slider(name, low, high, _STEP, float(np.rad2deg(self.dragging.theta[k])))
                slider.on_update(partial(self._slider_moved, k))
                sliders[k] = slider
            gui.add_button("Joints to zero").on_click(lambda _: self._set_joints(np.zeros(robot.joints)))
            gui.add_button("Start from here: forget how it has turned").on_click(lambda _: self._forget())
        return sliders

    def _slider_moved(self, joint: int, event: Any) -> None:
        if event.client is not None:  # moved by hand, and not by `_set_joints`, which has moved the robot already
            self.drag(joint, float(np.deg2rad(event.target.value)))

    def _set_joints(self, theta: np.ndarray) -> None:
        self.move(theta)
        for joint, slider in self.joints.items():
            slider.value = float(np.rad2deg(theta[joint]))

    def _forget(self) -> None:
        with self._lock:
            self.dragging.forget()
            self.show()

    def _add_manoeuvres(self) -> None:
        """Sliders that change the robot and the loops, and run A and B again at once."""
        gui = self.server.gui
        gear = float(np.asarray(self._base.gear_ratio)[0])
        with gui.add_folder("Manoeuvres A and B"):
            self.twist = gui.add_slider("twist [deg]", 0.0, 360.0, 1.0, 270.0)
            self.bend = gui.add_slider("bend [deg]", 0.0, 150.0, 1.0, 120.0)
            self.gear = gui.add_slider("gear ratio", 1.0, max(100.0, 2 * gear), 0.5, max(1.0, gear))
            handles = [self.twist, self.bend, self.gear]
            scale = self._end_inertia()
            if scale is not None:
                now = round(scale * 1e6, 3)
                self.inertia = gui.add_slider("end inertia [kg mm²]", now / 100, 5 * now, now / 100, now)
                handles.append(self.inertia)
            self.turns = gui.add_markdown("")
            gui.add_button("Run A").on_click(lambda _: self.run("a"))
            gui.add_button("Run B").on_click(lambda _: self.run("b"))
        for handle in handles:
            handle.on_update(lambda _: self.rerun())
        self.rerun()

    def _end_inertia(self) -> float | None:
        """Inertia of the end links that the sliders change [kg m^2], None where the robot has no such ends."""
        layout = self._base.layout
        if layout is None:
            return None
        link = layout.twist[1] + 1
        axis = np.asarray(self._base.axis, float)[layout.twist[1]]
        com, inertia = (np.asarray(x, float)[link] for x in (self._base.com, self._base.inertia))
        across = com - axis * (axis @ com)
        value = float(axis @ inertia @ axis + np.asarray(self._base.mass, float)[link] * across @ across)
        try:
            with_end_inertia(self._base, value)
        except ValueError:
            return None
        return value

    def changed_robot(self) -> Robot:
        """The robot as the sliders have it."""
        if self.gear is None:
            return self._base
        robot = with_gear_ratio(self._base, self.gear.value)
        if self.inertia is None:
            return robot
        return with_end_inertia(robot, self.inertia.value * 1e-6)

    def rerun(self) -> None:
        """Net rotations of A and B by the robot that the sliders say, in the table; it moves like that from now on."""
        with self._lock:
            robot = self.changed_robot()
            lines = ["| | angle | rotation vector [deg] |", "|---|---|---|"]
            for name, loop in self._loops(robot).items():
                vector = np.rad2deg(np.asarray(so3.log(net_rotation(robot, loop)), float))
                told = ", ".join(f"{x:.2f}" for x in vector)
                lines.append(f"| {name.upper()} | {np.linalg.norm(vector):.2f}° | {told} |")
            self.turns.content = "\n".join(lines)
            self.dragging.robot = robot
            if hasattr(self, "frames"):
                self._draw_links()
                self.show()

    def _loops(self, robot: Robot) -> dict[str, Path]:
        twist, bend = np.deg2rad(self.twist.value), np.deg2rad(self.bend.value)
        return {name: manoeuvre(twist, bend, layout_of(robot)) for name, manoeuvre in BY_NAME.items()}

    def run(self, manoeuvre: str) -> None:
        """Go through a manoeuvre, from wherever the joints are."""
        corners = np.asarray(self._loops(self._base)[manoeuvre].waypoints, float)
        for end in corners:
            start = self.dragging.theta.copy()
            steps = 1 if np.allclose(start, end) else _FRAMES
            for k in range(1, steps + 1):
                if self._stopped.is_set():
                    return
                self._set_joints(start + (end - start) * k / steps)
                time.sleep(1 / 30)

    def _draw_links(self) -> None:
        robot, scene = self.dragging.robot, self.server.scene
        solids, pins = link_faces(robot), [np.zeros((0, 4, 3)), *joint_faces(robot)]
        self.frames = []
        for k in range(robot.links):
            self.frames.append(scene.add_frame(f"/robot/link{k}", show_axes=False))
            own = [c for c in robot.capsules if c.link == k]
            for i, (_, start, end, radius) in enumerate(own):
                middle, along = np.add(start, end) / 2, np.subtract(end, start)
                ball = {"radius": float(np.asarray(radius)), "color": _rgb(link_colour(k))}
                scene.add_icosphere(f"/robot/link{k}/start{i}", position=np.asarray(start), **ball)
                scene.add_icosphere(f"/robot/link{k}/end{i}", position=np.asarray(end), **ball)
                if np.linalg.norm(along) > 0:
                    faces = beam(middle - along / 2, middle + along / 2, float(np.asarray(radius)))
                    self._add_faces(f"/robot/link{k}/rod{i}", faces, link_colour(k))
            if not own:
                self._add_faces(f"/robot/link{k}/solid", solids[k], link_colour(k))
                self._add_faces(f"/robot/link{k}/pin", pins[k], INK)
        self.axes = scene.add_frame("/base axes", show_axes=False)
        reach = 1.3 * self._reach
        for colour, way in zip(AXES, np.eye(3), strict=True):
            rod = beam(np.zeros(3), reach * way, 0.008 * self._reach, sides=8)
            self._add_faces(f"/base axes/{'xyz'[int(np.argmax(way))]}", rod, colour)

    def _add_faces(self, name: str, faces: np.ndarray, colour: str) -> None:
        if not len(faces):
            return
        corners = 4 * np.arange(len(faces))[:, None]
        triangles = np.concatenate([corners + [0, 1, 2], corners + [0, 2, 3]])
        self.server.scene.add_mesh_simple(
            name, faces.reshape(-1, 3), triangles, color=_rgb(colour), flat_shading=True, side="double"
        )

    def _draw_track(self) -> None:
        """Where the tips of the base's axes have been on a sphere."""
        turns = np.stack(self.dragging.track[-_TRACK:])
        if len(turns) < 2:
            turns = np.repeat(turns, 2, axis=0)
        for k, colour in enumerate(AXES):
            tips = 1.3 * self._reach * turns[:, :, k]
            segments = np.stack([tips[:-1], tips[1:]], axis=1).astype(np.float32)
            self.server.scene.add_line_segments(
                f"/track/{'xyz'[k]}",
                segments,
                np.array(_rgb(colour), np.uint8),
                thickness=3.0,
                thickness_units="screen",
            )


def serve(robot: Robot, *, port: int = 8080) -> Live:
    """Serve a page on the loopback in which one drags a robot's joints and sees its base turn.

    Args:
        robot: the robot; where it has a layout, manoeuvres A and B run again whenever its end inertia, its gear
            ratio, twist or bend is changed.
        port: where, or the next one that is free.

    Returns:
        What serves it, with `.server` of viser, until its `stop()`.

    Raises:
        ValueError: if viser is not installed or the port is none.
    """
    checks.instance("robot", robot, Robot, "make_robot makes")
    checks.whole("port", port, 1, 65535)
    try:
        import viser
    except ImportError as error:
        raise ValueError("the live viewer needs viser: pip install 'reojax[viser]'.") from error
    return Live(robot, viser.ViserServer(host=LOOPBACK, port=port, label=robot.name, verbose=False))


def _rgb(colour: str) -> tuple[int, int, int]:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue

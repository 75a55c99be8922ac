"""Functions that draw, with arguments that are right."""

from collections.abc import Callable
from typing import Any

import matplotlib
import numpy as np

import reojax
from fuzz.values import CAPTURE, MOTION, PATH, ROBOT, TURN

matplotlib.use("agg")

from matplotlib import pyplot


def _figure(name: str) -> Callable[..., Any]:
    def drawn(**arguments: Any) -> bool:
        pyplot.close("all")
        return getattr(reojax.plot, name)(**arguments) is not None

    return drawn


def _on_axes(name: str, kind: str | None = None) -> Callable[..., Any]:
    def drawn(**arguments: Any) -> bool:
        axes = _axes(kind)
        return getattr(reojax.plot, name)(**({"axes": axes} | arguments)) is not None

    return drawn


def _axes(kind: str | None) -> Any:
    pyplot.close("all")
    figure = pyplot.figure()
    return figure.add_subplot(projection=kind) if kind else figure.add_subplot()


def _save(path: Any, figure: Any) -> None:
    pyplot.close("all")
    reojax.plot.save(pyplot.figure() if figure is None else figure, path)


def _compared(robot: Any, title: Any) -> bool:
    pyplot.close("all")
    comparison = reojax.compare(ROBOT, CAPTURE, MOTION, offset=0.0)
    return reojax.plot.comparison_figure(robot, comparison, title=title) is not None


HISTORY = np.broadcast_to(np.eye(3), (9, 3, 3))
PICTURES: dict[str, tuple[Any, dict[str, Any]]] = {
    "save": (_save, {"path": "x.png", "figure": None}),
    "check_picture": ("plot.check_picture", {"path": "x.png"}),
    "check_animation": (lambda file: str(reojax.plot.check_animation(file)), {"file": "x.gif"}),
    "comparison_figure": (_compared, {"robot": ROBOT, "title": None}),
    "frames_figure": (
        _figure("frames_figure"),
        {"robot": ROBOT, "path": PATH, "per_edge": 1, "title": None, "titles": None, "columns": None, "view": None},
    ),
    "history_figure": (
        _figure("history_figure"),
        {"robot": ROBOT, "path": PATH, "title": None, "edge_names": None, "rotations": None, "angles": "tilt",
         "clearance": False},
    ),
    "motion_figure": (_figure("motion_figure"), {"robot": ROBOT, "motion": MOTION, "title": None}),
    "draw_robot": (
        _on_axes("draw_robot", "3d"),
        {"robot": ROBOT, "theta": np.zeros(3), "rotation": None, "position": np.zeros(3), "alpha": 1.0,
         "centres": False, "view": None},
    ),
    "draw_robot_flat": (
        _on_axes("draw_robot_flat"),
        {"robot": ROBOT, "theta": np.zeros(3), "rotation": None, "at": (0.0, 0.0), "scale": 1.0, "alpha": 1.0},
    ),
    "draw_axes": (_on_axes("draw_axes", "3d"), {"length": 1.0, "at": (0.0, 0.0, 0.0), "names": "xyz"}),
    "draw_joints": (_on_axes("draw_joints"), {"robot": ROBOT, "path": PATH}),
    "draw_lines": (_on_axes("draw_lines"), {"x": np.arange(3.0), "values": np.ones((3, 1)), "labels": ["a"]}),
    "draw_loop": (_on_axes("draw_loop"), {"corners": np.zeros((3, 2)), "label": None}),
    "draw_map": (
        _on_axes("draw_map"),
        {"x": np.arange(3.0), "y": np.arange(2.0), "values": np.arange(6.0).reshape(2, 3), "label": "a",
         "levels": 4},
    ),
    "draw_orientation": (
        _on_axes("draw_orientation"), {"rotations": HISTORY, "edges": 4, "angles": "tilt"}
    ),
    "draw_poses": (
        _on_axes("draw_poses"),
        {"robots": ROBOT, "rotations": TURN[None, None], "columns": ["a"], "rows": ["b"], "theta": None,
         "texts": None},
    ),
    "draw_frames": (
        lambda **k: reojax.plot.draw_frames([_axes("3d")], **k) is not None,
        {"robot": ROBOT, "frames": reojax.plot.Frames(np.zeros((1, 3)), np.eye(3)[None]), "titles": None},
    ),
    "frames_along": ("plot.frames_along", {"robot": ROBOT, "path": PATH, "per_edge": 1}),
    "animation": (
        "plot.animation",
        {"robot": ROBOT, "path": PATH, "file": "x.nothing", "frames": 2, "seconds": 0.1, "titles": None},
    ),
    "sweep_figure": (_figure("sweep_figure"), {"sweep": None, "title": None, "results": None}),
    "bandwidth_figure": (
        _figure("bandwidth_figure"), {"bandwidth": [1.0, 2.0], "lag": {"a": np.ones(2)}, "chosen": {"a": 1.0}}
    ),
    "torque_speed_figure": (
        _figure("torque_speed_figure"),
        {"motor": reojax.RE_MAX_17, "runs": [("a", MOTION)], "joint_names": ["a", "b", "c"], "joints": None,
         "title": None},
    ),
}  # fmt: skip

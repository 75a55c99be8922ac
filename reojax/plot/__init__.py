"""Pictures. The only package that imports matplotlib, and without its global state.

Functions named `draw_...` draw onto given axes and return them; those named `..._figure` make a figure, and `save`
and `animation` write files. Robots are drawn from their numbers, see `reojax.drawing.solids`.
"""

from reojax.drawing.view import View as View
from reojax.plot.capture import comparison_figure as comparison_figure
from reojax.plot.control import bandwidth_figure as bandwidth_figure, tracking_figure as tracking_figure
from reojax.plot.files import FORMATS as FORMATS, check_picture as check_picture, save as save
from reojax.plot.frames import (
    Frames as Frames,
    draw_frames as draw_frames,
    frames_along as frames_along,
    frames_figure as frames_figure,
)
from reojax.plot.history import (
    draw_joints as draw_joints,
    draw_orientation as draw_orientation,
    history_figure as history_figure,
)
from reojax.plot.maps import (
    draw_lines as draw_lines,
    draw_loop as draw_loop,
    draw_map as draw_map,
    draw_poses as draw_poses,
)
from reojax.plot.motion import motion_figure as motion_figure, torque_speed_figure as torque_speed_figure
from reojax.plot.nearest import draw_nearest as draw_nearest, mark_nearest as mark_nearest
from reojax.plot.plans import plan_figure as plan_figure
from reojax.plot.robots import draw_axes as draw_axes, draw_robot as draw_robot, draw_robot_flat as draw_robot_flat
from reojax.plot.sweeps import sweep_figure as sweep_figure
from reojax.plot.video import animate as animate, animation as animation, check_animation as check_animation

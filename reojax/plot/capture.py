"""Measured against simulated motion over time, as in thesis figures 1.9 and 2.13."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reojax.captures.comparison import Comparison
from reojax.drawing.colours import ANGLES, AXES, DASHES, INK, JOINTS
from reojax.plot._arguments import check_arguments
from reojax.plot._style import dress, legend_above
from reojax.robot import Robot


@check_arguments
def comparison_figure(robot: Robot, comparison: Comparison, *, title: str | None = None) -> Figure:
    """Draw a comparison: lines are simulated, dots measured.

    From above: ZXZ angles of link 1, its roll and tilt (which have no jumps), the joint angles. RMS differences are in
    the legends.

    Args:
        robot: the robot.
        comparison: what `compare` returns.
        title: first line of the title; default the robot's name.

    Raises:
        ValueError: if an argument is not what it must be.
    """
    figure = Figure(figsize=(7.2, 8.6), layout="constrained", facecolor="white")
    zxz, roll, joints = figure.subplots(3, 1, sharex=True, height_ratios=(1.15, 1, 1))
    c = comparison
    names = ("first, z", "second, x'", "third, z''")
    _draw(zxz, c.time, c.simulated_zxz, c.measured_zxz, c.zxz_rms, names, AXES[-1:] + AXES[:-1])
    names, colours = zip(*ANGLES, strict=True)
    _draw(roll, c.time, c.simulated_tilt_roll, c.measured_tilt_roll, c.tilt_roll_rms, names, colours)
    _draw(joints, c.time, c.simulated_theta, c.measured_theta, c.theta_rms, robot.joint_names, JOINTS)
    zxz.set_ylabel("ZXZ angles of link 1 [deg]", color=INK)
    roll.set_ylabel("tilt and roll of link 1 [deg]", color=INK)
    joints.set_ylabel("joint angles [deg]", color=INK)
    joints.set_xlabel("time on the clock of the simulation [s]", color=INK)
    zxz.set_title(title or robot.name, loc="left", pad=48, fontsize=13, fontweight="bold", color=INK)
    text = f"lines simulated, dots measured; RMS angle between the two orientations {_degrees(c.angle_rms)}"
    if not np.isfinite(c.angle_rms):
        text = "lines simulated, dots measured; no orientation was measured"
    zxz.annotate(text, (0, 1), (0, 30), "axes fraction", "offset points", fontsize=10.5, color=INK)
    return figure


def _draw(
    axes: Axes,
    time: np.ndarray,
    simulated: np.ndarray,
    measured: np.ndarray,
    rms: np.ndarray,
    names: Sequence[str],
    colours: Sequence[str],
) -> None:
    for k, name in enumerate(names):
        colour = colours[k % len(colours)]
        label = name if not np.isfinite(rms[k]) else f"{name}, RMS {_degrees(rms[k])}"
        axes.plot(
            time, np.rad2deg(simulated[:, k]), color=colour, label=label, linewidth=1.8, dashes=DASHES[k % len(DASHES)]
        )
        axes.plot(time, np.rad2deg(measured[:, k]), ".", color=colour, markersize=3.2, alpha=0.55)
    dress(axes)
    axes.margins(x=0)
    legend_above(axes, columns=3)


def _degrees(angle: float) -> str:
    return f"{np.rad2deg(angle):.2g}\u00b0"

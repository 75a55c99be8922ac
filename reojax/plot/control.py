"""Joints under control, and the orientation that follows, beside what was planned."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax.drawing.colours import ANGLES, INK, JOINTS
from reojax.mechanics.attitude import tilt_and_roll
from reojax.motion.closed_loop import Tracking
from reojax.plot._arguments import check_arguments
from reojax.plot._style import dress, legend_above
from reojax.robot import Robot

_DASHED = (4, 2)


@check_arguments
def tracking_figure(
    robot: Robot, tracking: Tracking, planned: Float[Array, "m 3 3"], *, title: str | None = None
) -> Figure:
    """Draw joints, orientation and motor torques of a motion under control; planned ones are dashed.

    Args:
        robot: the robot.
        tracking: what `track` returns.
        planned: (m, 3, 3) orientation that the planned motion has at the same times.
        title: first line of the title; default the robot's name.

    Raises:
        ValueError: if an argument is not what it must be.
    """
    figure = Figure(figsize=(7.2, 8.2), layout="constrained", facecolor="white")
    joints, base, torque = figure.subplots(3, 1, sharex=True, height_ratios=(1, 1, 0.9))
    time = np.asarray(tracking.time)
    done = tilt_and_roll(tracking.rotation)
    wanted = tilt_and_roll(planned)
    for k, name in enumerate(robot.joint_names):
        colour = JOINTS[k % len(JOINTS)]
        joints.plot(time, np.rad2deg(tracking.theta[:, k]), color=colour, label=name, linewidth=2)
        joints.plot(time, np.rad2deg(tracking.planned[:, k]), color=colour, linewidth=1.2, dashes=_DASHED)
        torque.plot(time, 1e3 * np.asarray(tracking.motor_torque)[:, k], color=colour, label=name, linewidth=1.2)
    for k, (name, colour) in enumerate(ANGLES):
        base.plot(time, np.rad2deg(done[:, k]), color=colour, label=name, linewidth=2)
        base.plot(time, np.rad2deg(wanted[:, k]), color=colour, linewidth=1.2, dashes=_DASHED)
    joints.set_ylabel("joint angles [deg]", color=INK)
    base.set_ylabel("base orientation [deg]", color=INK)
    torque.set_ylabel("motor torque [mN m]", color=INK)
    torque.set_xlabel("time [s]", color=INK)
    for axes in (joints, base, torque):
        dress(axes)
        axes.margins(x=0)
        legend_above(axes)
    joints.set_title(title or robot.name, loc="left", pad=46, fontsize=13, fontweight="bold", color=INK)
    lag = np.rad2deg(np.abs(np.asarray(tracking.theta) - np.asarray(tracking.planned)).max())
    last = np.asarray(tracking.rotation)[-1].T @ np.asarray(planned)[-1]
    miss = np.rad2deg(np.arccos(np.clip(0.5 * (np.trace(last) - 1), -1, 1)))
    text = f"dashed: as planned. The joints lag by up to {lag:.0f}°, and the orientation ends {miss:.1f}° off"
    joints.annotate(text, (0, 1), (0, 28), "axes fraction", "offset points", fontsize=10.5, color=INK)
    return figure


@check_arguments
def bandwidth_figure(bandwidth: ArrayLike, lag: dict[str, np.ndarray], chosen: dict[str, float]) -> Figure:
    """Draw RMS errors of the joints against the controllers' bandwidth, and the ones that were chosen.

    Args:
        bandwidth: (m,) the bandwidths that were tried [rad/s].
        lag: for each controller, (m,) RMS errors [rad].
        chosen: for each controller, the tuned bandwidth [rad/s].

    Raises:
        ValueError: if an array has another shape or a number that is not finite, or a controller has no bandwidth.
    """
    along = checks.numbers("bandwidth", bandwidth, (-1,))
    for name, values in lag.items():
        checks.numbers(f"lag[{name!r}]", values, (len(along),))
        checks.number(f"chosen[{name!r}]", chosen.get(name))
    figure = Figure(figsize=(6.4, 4.2), layout="constrained", facecolor="white")
    axes = figure.subplots()
    for (name, values), colour in zip(lag.items(), JOINTS, strict=False):
        axes.plot(bandwidth, np.rad2deg(values), "o-", color=colour, label=name, markersize=4)
        axes.axvline(chosen[name], color=colour, linewidth=1, linestyle=":")
    axes.set_xscale("log")
    dress(axes)
    legend_above(axes, columns=2)
    axes.set_xticks([25, 50, 100, 200, 400])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.margins(x=0.05)
    axes.set_xlabel("bandwidth of the controller [rad/s] (dotted: tuned)", color=INK)
    axes.set_ylabel("RMS error of the joints [deg]", color=INK)
    return figure

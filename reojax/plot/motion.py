"""Motions by time: what the motors do against their torque-speed curves, and what joints and base do."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from reojax._internal import checks
from reojax._internal.display_units import RPM
from reojax.drawing.colours import ANGLES, DASHES, GREY, INK, JOINTS
from reojax.mechanics.attitude import tilt_and_roll
from reojax.motion.motor import Motor
from reojax.motion.simulation import Motion
from reojax.plot._arguments import check_arguments
from reojax.plot._style import dress, legend_above
from reojax.robot import Robot


@check_arguments
def torque_speed_figure(
    motor: Motor,
    runs: Sequence[tuple[str, Motion]],
    *,
    joint_names: Sequence[str],
    joints: Sequence[int] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw motor torque against motor speed, one panel for each run, with what the supply allows (thesis figure 3.2).

    Between the two lines a motor stays within its supply; beyond them it cannot follow.

    Args:
        motor: one motor, that of all joints.
        runs: a title and a motion, with motors, for each panel.
        joint_names: the robot's.
        joints: which joints to draw; default all.
        title: first line of the title.

    Raises:
        ValueError: if a motion has no motors.
    """
    for i, run in enumerate(runs):
        if not (isinstance(run, tuple | list) and len(run) == 2 and isinstance(run[1], Motion)):
            raise ValueError(f"runs[{i}] is {checks.shorten(run)}; it must be a title and a Motion.")
    if not runs:
        raise ValueError("`runs` is empty; it must have a title and a Motion for each panel.")
    figure = Figure(figsize=(9.0 if len(runs) > 1 else 7.2, 4.1 * -(-len(runs) // 2) + 0.5), layout="constrained")
    panels = figure.subplots(-(-len(runs) // 2), min(len(runs), 2), squeeze=False, sharex=True, sharey=True)
    shown = range(len(joint_names)) if joints is None else joints
    k, resistance, supply = (float(np.ravel(x)[0]) for x in (motor.torque_constant, motor.resistance, motor.supply))
    widest = 1.0
    for axes, (name, motion) in zip(panels.ravel(), runs, strict=False):
        if motion.motor_torque is None:
            raise ValueError(f"the motion of {name!r} has no motors; give `motors` to `simulate`.")
        speed, torque = np.asarray(motion.motor_speed) * RPM, np.asarray(motion.motor_torque) * 1e3
        for i in shown:
            axes.plot(
                speed[:, i], torque[:, i], color=JOINTS[i % len(JOINTS)], linewidth=1.8, label=joint_names[i],
                dashes=DASHES[i % len(DASHES)],
            )  # fmt: skip
        widest = max(widest, float(np.abs(speed[:, list(shown)]).max()))
        axes.set_title(name, loc="left", fontsize=10.5, color=INK)
    reach = 1.12 * max(widest, supply / k * RPM)
    along = np.array([-reach, reach])
    for n, axes in enumerate(panels.ravel()):
        if n >= len(runs):
            axes.set_visible(False)
            continue
        for sign in (1, -1):
            limit = k * (sign * supply - k * along / RPM) / resistance * 1e3
            label = f"limit at {supply:g} V" if sign > 0 else None
            axes.plot(along, limit, color=INK, linewidth=1.2, linestyle="--", label=label)
        axes.set_xlim(-reach, reach)
        dress(axes, grid="both")
        axes.axvline(0, color=GREY, linewidth=0.8, zorder=0.9)
    for axes in panels[-1]:
        axes.set_xlabel("motor speed [rpm]", color=INK)
    for axes in panels[:, 0]:
        axes.set_ylabel("motor torque [mN m]", color=INK)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, frameon=False, fontsize=9.5, labelcolor=INK)
    if title:
        figure.suptitle(title, x=0.01, ha="left", fontsize=11.5, fontweight="bold", color=INK)
    return figure


@check_arguments
def motion_figure(robot: Robot, motion: Motion, *, title: str | None = None) -> Figure:
    """Draw a motion by time: orientation of the base, joint angles, joint rates and joint torques.

    Args:
        robot: the robot.
        motion: what `simulate` gives.
        title: first line of the title; default the robot's name.

    Raises:
        ValueError: if an argument is not what it must be.
    """
    figure = Figure(figsize=(7.2, 9.2), layout="constrained", facecolor="white")
    base, *joints = figure.subplots(4, 1, sharex=True)
    time = np.asarray(motion.time) * 1e3
    for (label, colour), values in zip(ANGLES, np.rad2deg(tilt_and_roll(motion.rotation)).T, strict=True):
        base.plot(time, values, color=colour, label=label, linewidth=2)
    base.set_ylabel("base orientation [deg]", color=INK)
    rows = (
        ("joint angles [deg]", np.rad2deg(np.asarray(motion.theta))),
        ("joint rates [rad/s]", motion.theta_dot),
        ("joint torques [N m]", motion.torque),
    )
    for axes, (label, values) in zip(joints, rows, strict=True):
        for k, name in enumerate(robot.joint_names):
            colour, dashes = JOINTS[k % len(JOINTS)], DASHES[k % len(DASHES)]
            axes.plot(time, np.asarray(values)[:, k], color=colour, label=name, linewidth=1.8, dashes=dashes)
        axes.set_ylabel(label, color=INK)
    for axes in (base, *joints):
        axes.set_xlim(time[0], time[-1])
        dress(axes, grid="both")
    for axes in (base, joints[0]):
        legend_above(axes)
    joints[-1].set_xlabel("time [ms]", color=INK)
    base.set_title(title or robot.name, loc="left", pad=26, fontsize=12, fontweight="bold", color=INK)
    return figure

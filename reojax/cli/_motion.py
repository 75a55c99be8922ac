"""What `reojax simulate` adds when a duration is given: the manoeuvre by time, and what it takes of the motors."""

import argparse
import warnings
from typing import TYPE_CHECKING, Any

from reojax._internal.display_units import RPM
from reojax.cli._motors import motor_of
from reojax.cli._planned import durations_of

if TYPE_CHECKING:
    from reojax.motion.simulation import Motion
    from reojax.path import Path
    from reojax.robot import Robot

LAW = "quintic"
"""The law where only a duration is given."""
_RESOLVED = 1e-4
"""Largest error of an orientation for which a spin counts as resolved [rad]."""


def check_law(args: argparse.Namespace) -> None:
    """Refuse a time law that there is none of, and a time law or a momentum that has no time.

    Raises:
        ValueError: saying so.
    """
    from reojax.motion.time_laws import by_name

    if args.law is not None:
        by_name(args.law)
        if args.duration is None:
            raise ValueError("argument --law: a time law needs a --duration")
    if args.momentum is not None and args.duration is None:
        raise ValueError("argument --momentum: how far a spin turns needs a --duration")


def motion_of(robot: "Robot", path: "Path", args: argparse.Namespace) -> "Motion | None":
    """The manoeuvre by time, if a duration is given.

    Raises:
        ValueError: if nothing moves, the motors do not fit the robot, or it spins too fast for the samples.
    """
    from reojax.motion.simulation import simulate

    if args.duration is None:
        return None
    durations = durations_of(path, args.duration)
    with warnings.catch_warnings():  # said below, as an error
        warnings.simplefilter("ignore", UserWarning)
        motion = simulate(
            robot,
            path,
            args.law or LAW,
            durations=durations,
            motors=motor_of(robot, args),
            momentum=args.momentum,
        )
    if motion.error is not None and float(motion.error) > _RESOLVED:
        raise ValueError(
            f"argument --momentum: {args.momentum} kg m^2/s for {durations.sum():g} s spins too fast to be resolved "
            f"(the orientation is uncertain by about {float(motion.error):.1g} rad)"
        )
    return motion


def motion_report(robot: "Robot", motion: "Motion", args: argparse.Namespace) -> dict[str, Any]:
    """What the motion takes, joint by joint, as plain numbers."""
    import numpy as np

    from reojax import so3

    def peaks(values: Any) -> list[float]:
        return np.abs(np.asarray(values)).max(axis=0).tolist()

    margin = np.asarray(motion.margin)
    return {
        "law": args.law or LAW,
        "duration_s": float(motion.time[-1]),
        "supply_V": args.supply,
        "momentum_kg_m2_s": args.momentum or [0.0, 0.0, 0.0],
        "rotation_vector_deg": np.rad2deg(np.asarray(so3.log(motion.rotation[-1]))).tolist(),
        "joints": list(robot.joint_names),
        "peak_rate_rad_s": peaks(motion.theta_dot),
        "peak_torque_Nm": peaks(motion.torque),
        "peak_motor_speed_rad_s": peaks(motion.motor_speed),
        "peak_current_A": peaks(motion.current),
        "least_margin": margin.min(axis=0).tolist(),
        "least_margin_at_s": np.asarray(motion.time)[margin.argmin(axis=0)].tolist(),
        "possible": bool(margin.min() >= 0),
        "error_rad": float(np.asarray(motion.error)),
    }


def motion_text(motion: dict[str, Any]) -> list[str]:
    """Lines of `motion_report`."""
    lines = [
        "",
        f"in {motion['duration_s']:g} s, {motion['law']}, {motion['supply_V']:g} V",
        "  joint         peak rate       torque  motor speed    current   margin",
    ]
    columns = ("peak_rate_rad_s", "peak_torque_Nm", "peak_motor_speed_rad_s", "peak_current_A", "least_margin")
    for k, name in enumerate(motion["joints"]):
        rate, torque, speed, current, margin = (motion[column][k] for column in columns)
        cells = f"{rate:>9.2f} rad/s{torque:>9.4f} N m{speed * RPM:>9.0f} rpm{current:>9.3f} A{margin:>9.3f}"
        lines.append(f"  {name:<8}{cells} at {1000 * motion['least_margin_at_s'][k]:.0f} ms")
    if any(motion["momentum_kg_m2_s"]):
        turned = ", ".join(f"{x:.4f}" for x in motion["rotation_vector_deg"])
        spin = ", ".join(f"{x:g}" for x in motion["momentum_kg_m2_s"])
        lines.append(f"  released with angular momentum {spin} kg m^2/s, it turns by ({turned}) deg, not as above")
    verdict = "the motors can do it" if motion["possible"] else "beyond the motors: a margin is negative"
    return [*lines, f"  {verdict} (margin: share of the supply that is left where it is least)"]

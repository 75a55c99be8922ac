"""Section of the drop tower: how far do an imperfect release and the wire turn the robot?"""

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

import reojax
from drop_tower_parts.tracking import DURATIONS, plans
from reojax import Release, robots, so3

SPIN = 0.05  # rad/s about each axis, chosen: left over when the robot is let go
PULL, TIED, DRAG = 2e-3, (0.0, 0.0, 0.055), 2e-7  # N (a fifth of a gram), m, N m s/rad; chosen


def section(*, quick: bool, durations: Sequence[float] = DURATIONS) -> dict[str, Any]:
    """Spread of the net rotation of A by momentum and wire, and how much more a slower motion suffers."""
    robot = robots.prototype()
    inertia = np.asarray(reojax.momentum_matrices(robot, np.zeros(3)).A)
    momentum = SPIN * np.diag(inertia)
    parts = {
        "momentum": Release(momentum),
        "wire": Release(pull=(PULL,) * 3, drag=DRAG),
        "both": Release(momentum, (PULL,) * 3, drag=DRAG),
    }
    expected = Release(tied=TIED)
    plan = plans(durations)["A"]
    result: dict[str, Any] = {"momentum_std_kg_m2_s": momentum, "pull_std_n": PULL, "drag_std": DRAG, "rows": []}
    for name, deviation in parts.items():
        spread = reojax.release_spread(robot, plan, deviation, jax.random.key(0), expected=expected, draws=256)
        linear, drawn = (float(np.rad2deg(x)) for x in (spread.angle_rms, spread.drawn_angle_rms))
        result[name] = {"linear_rms_deg": linear, "drawn_rms_deg": drawn}
        result["rows"].append(
            (f"release, {name}: spread of A, linear and drawn [deg]", "", f"{linear:.2f}, {drawn:.2f}")
        )
    spin = Release(momentum)
    ends = []
    for factor in (1.0, 2.0):
        slower = plans([factor * x for x in durations])["A"]
        ends.append(reojax.released(robot, slower, spin, samples=64).rotation[-1])
    perfect = reojax.released(robot, plan, samples=64).rotation[-1]
    off = [float(np.rad2deg(so3.angle(perfect.T @ end))) for end in ends]
    result["spinning_deg"] = off
    text = f"{off[0]:.1f}, {off[1]:.1f}"
    result["rows"].append(
        (f"spinning at {SPIN:g} rad/s: A turns off by, as fast and half as fast [deg]", "open question", text)
    )
    return result

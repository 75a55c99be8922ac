"""What does the thesis's drop tower ask of robot, motors and controllers, and what would the cameras see?

    python experiments/drop_tower.py --out out          # 2 to 8 minutes on 2 cores; --quick: half a one

The whole story of thesis 1.8 in one run: the fall, the plan, least times and figure 3.2, joints under control in closed
loop, an imperfect release, and a capture beside the simulation. Its sections are the modules `_drop_tower_*.py`. One
table holds what the thesis measured or said against what comes out here; the capture is synthetic, and says so.

Expected: A fits into the fall with free time laws or overlapped edges, not as a rectangle of quintics. With a soft
controller the joints lag by some 0.4 rad and the ZXZ angles differ on the way by 0.05 to 0.1 rad RMS, less than the
thesis measured; the orientation ends within 0.1 rad of the planned one all the same, and within 0.01 rad under tuned
controllers, though the motors saturate.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from common.script import options, run
from drop_tower_parts import (
    capture as capture_part,
    release as release_part,
    time as time_part,
    tracking as tracking_part,
)

import reojax
from reojax import robots
from reojax.files import check_writable, write_json
from reojax.mechanics.attitude import tilt_and_roll

HEIGHT, GRAVITY = 2.0, 9.80665  # m, m/s^2; thesis 1.8
DELAY = 0.02  # s from the release to the start of the motion, thesis 1.8
CAMERA, CAPTURE = 800.0, 300.0  # frames per second, thesis 1.8


def the_fall() -> dict[str, Any]:
    """How long there is, how many frames it makes, and whether the planned motion fits."""
    fall = float(np.sqrt(2 * HEIGHT / GRAVITY))
    planned = float(np.sum(tracking_part.DURATIONS))
    over = planned - (fall - DELAY)
    verdict = f"{planned:.3f}, " + (f"{1e3 * over:.1f} ms too long" if over > 0 else "fits")
    rows = [
        ("fall of 2 m [s]", "about 0.6", f"{fall:.3f}"),
        ("left for the motion [s]", "starts 0.02 after release", f"{fall - DELAY:.3f}"),
        ("A as tracked here lasts [s]", "", verdict),
        ("frames of the camera in the fall", f"{CAMERA:g} per second", f"{fall * CAMERA:.0f}"),
        ("frames of the motion capture in the fall", f"{CAPTURE:g} per second", f"{fall * CAPTURE:.0f}"),
    ]
    return {"fall_s": fall, "available_s": fall - DELAY, "rows": rows}


def the_plan() -> dict[str, Any]:
    """Net rotations of A and B at 270/120."""
    robot, rows, result = robots.prototype(), [], {}
    for name, plan in tracking_part.plans().items():
        turns = np.asarray(reojax.released(robot, plan, samples=64).rotation)
        roll = float(tilt_and_roll(turns)[-1, 2])
        vector = np.asarray(reojax.so3.log(turns[-1]))
        said = {"A": "+3.35 (measured)", "B": "mainly yaw"}[name]
        value = f"{roll:+.2f}" if name == "A" else f"yaw {vector[1]:+.2f}, roll {vector[2]:+.2f}"
        rows.append((f"{name} at 270/120: {'roll' if name == 'A' else 'turn'} [rad]", said, value))
        result[name] = {"roll_rad": roll, "vector_rad": vector}
    return result | {"rows": rows}


def main(out: Path, *, quick: bool = False) -> dict[str, Any]:
    """Run all sections; write `drop_tower.json`, anew after each section, and pictures to `out`; return the numbers."""
    table = check_writable(out / "drop_tower.json")
    parts: dict[str, Callable[[], dict[str, Any]]] = {
        "fall": the_fall,
        "plan": the_plan,
        "time": lambda: time_part.section(out, quick=quick),
        "tracking": lambda: tracking_part.section(out, quick=quick),
        "release": lambda: release_part.section(quick=quick),
        "capture": lambda: capture_part.section(out, quick=quick),
    }
    sections: dict[str, Any] = {}
    for name, part in parts.items():
        sections[name] = part()
        write_json(table, sections)
    print(f"{'what':58}{'thesis':29}here")
    for section in sections.values():
        for what, said, found in section["rows"]:
            print(f"{what:58}{said:29}{found}")
    sections["converged"] = all(section.get("converged", True) for section in sections.values())
    write_json(table, sections)
    return sections


if __name__ == "__main__":
    run(main, options(__doc__))

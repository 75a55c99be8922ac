"""Which closed loop turns the prototype by 90 degrees about pitch, and nothing else, with the least joint travel?

    python experiments/pure_pitch.py                # a minute or two on 2 cores, compilation included

No rectangle of the thesis gives it: manoeuvres A and B turn about roll and yaw. Polygons with five free corners, 64
random starts, least joint travel subject to the whole net rotation being 90 degrees about x, within 270/120.

Expected: all three components to 1e-8, from most starts; the replay by Pinocchio agrees to 1e-8. For comparison, the
largest pitch of the manoeuvres A and B over their amplitudes is printed.
"""

from pathlib import Path

import jax
import numpy as np
from common.script import options, run
from common.tables import least_travel, summary, table
from common.types import Array
from matplotlib.figure import Figure

import reojax
from reojax import design, plot, so3
from reojax.files import check_writable, write_json
from reojax.robots import prototype

TARGET = np.array([np.pi / 2, 0, 0])
CORNERS = 5


def main(out: Path, *, quick: bool = False) -> dict:
    """Print the loop, write `pure_pitch.json` and `pure_pitch.png`."""
    picture, record = plot.check_picture(out / "pure_pitch.png"), check_writable(out / "pure_pitch.json")
    robot = prototype()
    loop = design.polygons(robot, 3 if quick else CORNERS)
    steps = 1 if quick else 4
    target = TARGET / 3 if quick else TARGET  # 90 degrees are out of reach of three corners
    problem = least_travel(robot, loop, steps=steps)
    found = problem.solve(32 if quick else 64, hold={"target": target}, progress=loop.name, max_steps=100)
    answer = summary(problem, loop, found, target, steps=4)
    answer |= {"target_deg": np.rad2deg(target), "converged": answer["best_converged"]}
    answer["rectangle_pitch_deg"] = rectangle_pitch(robot, 5 if quick else 13)

    print(f"\nLeast travel to {np.rad2deg(target[0]):.0f} degrees of pitch, prototype within 270/120\n")
    rows = ("starts", "starts_converged", "starts_at_best", "travel_deg", "residual_rad", "slope", "miss_along_rad",
            "miss_off_axis_rad", "replay_rad")  # fmt: skip
    table(["", answer["loop"]], [[row, answer[row]] for row in rows], width=24)
    print("\ncorners [deg]: twist1, bend, twist2")
    for corner in answer["waypoints_deg"]:
        print("".join(f"{angle:10.3f}" for angle in corner))
    for name, pitch in answer["rectangle_pitch_deg"].items():
        print(f"largest pitch component of manoeuvre {name} within 270/120: {pitch:.3f} deg")
    plot.save(_picture(np.array(answer["waypoints_deg"])), picture)
    write_json(record, answer)
    print(f"\nwrote {picture} and {record}")
    return answer


def rectangle_pitch(robot: reojax.Robot, grid: int) -> dict[str, float]:
    """Largest pitch component of the rotation vector of A and B over their amplitudes, either sign [deg]."""
    twist, bend = np.deg2rad(np.meshgrid(np.linspace(-270, 270, grid), np.linspace(-120, 120, grid)))

    @jax.jit
    @jax.vmap
    def turn(corners: Array) -> Array:
        return so3.log(reojax.net_rotation(robot, reojax.polygon(corners)))

    loops = {"A": reojax.manoeuvre_a, "B": reojax.manoeuvre_b}
    corners = {
        name: np.stack([np.asarray(loop(t, b).waypoints) for t, b in zip(twist.ravel(), bend.ravel(), strict=True)])
        for name, loop in loops.items()
    }
    return {name: float(np.rad2deg(np.abs(turn(points)[:, 0]).max())) for name, points in corners.items()}


def _picture(corners: np.ndarray) -> Figure:
    figure = Figure(figsize=(7, 4), layout="constrained", facecolor="white")
    axes = figure.subplots()
    for name, angle, colour, line in zip(
        ("twist 1", "bend", "twist 2"), corners.T, ("#0072b2", "#e69f00", "#7f3c8d"), ("-", "--", "-."), strict=True
    ):
        axes.plot(angle, line, color=colour, label=name, linewidth=2)
    axes.set(xlabel="corner", ylabel="joint angle [deg]", title="Least travel to 90° of pitch")
    axes.set_xticks(range(len(corners)))
    axes.grid(axis="y", color="#dddddd")
    axes.legend(frameon=False, loc="best")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


if __name__ == "__main__":
    run(main, options(__doc__))

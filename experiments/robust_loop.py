"""Which loop turns the prototype by 180 degrees of roll and is least sensitive to errors of 5 % in every inertia?

    python experiments/robust_loop.py               # some minutes on 2 cores, compilation included

Polygons with four free corners within 270/120. The plain optimum has least joint travel, the robust one least mean
square turn of the result when the inertia of every link and of every rotor has an independent error of 5 %, with no
more travel than the thesis's 270/120 loop (1320 degrees). Both hit the target exactly with the nominal robot. The
spread of both is then computed by the linear rule and by sampling robots.

Expected: the robust loop's spread is smaller; the linear rule and the samples agree to a few per cent.
"""

from pathlib import Path
from typing import Any

import numpy as np
from common.script import options, run
from common.tables import TARGET, least_travel, replay, table
from matplotlib.figure import Figure

import reojax
from reojax import design, plot, so3
from reojax.design import Problem
from reojax.files import check_writable, write_json
from reojax.robots import prototype

HALF_TURN = np.array([0.0, 0.0, np.pi])
TOLERANCES = {"inertia": 0.05, "rotor_inertia": 0.05}
MOST_TRAVEL = np.deg2rad(4 * 270 + 2 * 120)
STEPS = 2


def main(out: Path, *, quick: bool = False) -> dict:
    """Print both loops and their spreads, write `robust_loop.json` and `robust_loop.png`."""
    picture, record = plot.check_picture(out / "robust_loop.png"), check_writable(out / "robust_loop.json")
    robot = prototype()
    loop = design.polygons(robot, 3 if quick else 4)
    steps = 1 if quick else STEPS
    plain = least_travel(robot, loop, steps=steps)
    starts, hold = (8 if quick else 24), {"target": HALF_TURN}
    least = plain.solve(starts, seed=1, hold=hold, progress="least travel", max_steps=30 if quick else 100)
    robust = Problem(
        lambda values: (robot, loop.path(values["loop"])),
        [loop, TARGET],
        objective=lambda o: 1e3 * design.scatter(o.robot, o.path, TOLERANCES, steps=steps),
        equality=[design.turned_to("target")],
        inequality=[lambda o: design.travel(loop)(o) - MOST_TRAVEL],
        steps=steps,
    )
    near = least.value[np.argsort(np.where(least.converged, least.cost, np.inf))][: 2 if quick else None]
    steady = robust.solve(near, hold=hold, progress="least spread", max_steps=5 if quick else 60)

    rows, spreads = {}, {}
    for name, found in (("least travel", least), ("least spread", steady)):
        path = loop.path(plain.space.named(found.value[found.best])["loop"])
        spreads[name] = design.spread(robot, path, TOLERANCES, draws=200 if quick else 2000, steps=4)
        rows[name] = _figures(robot, path, found, spreads[name])
    print("\n180 deg of roll, 5 % errors of all inertias\n")
    keys = [key for key, value in rows["least travel"].items() if not isinstance(value, list | dict)]
    table(["", *rows], [[key, *(row[key] for row in rows.values())] for key in keys], width=16)
    print("\nshare of each error in the spread (linear rule)")
    for i, source in enumerate(spreads["least travel"].source):
        print(f"{source:30}" + "".join(f"{100 * s.share[i]:15.1f}%" for s in spreads.values()))
    answer = {"converged": bool(least.converged[least.best]) and (quick or bool(steady.converged[steady.best])), **rows}
    plot.save(_picture(rows, spreads), picture)
    write_json(record, answer)
    print(f"\nwrote {picture} and {record}")
    return answer


def _figures(robot: reojax.Robot, path: reojax.Path, found: design.Solution, spread: design.Spread) -> dict[str, Any]:
    rotation = np.asarray(reojax.net_rotation(robot, path))
    again = replay(robot, np.asarray(path.waypoints))
    size = np.linalg.norm(spread.turns, axis=1)
    return {
        "starts": len(found.cost),
        "converged": int(found.converged.sum()),
        "travel [deg]": float(np.rad2deg(reojax.joint_travel(path))),
        "residual [rad]": float(found.residual[found.best]),
        "slope": float(found.slope[found.best]),
        "miss [rad]": float(so3.angle(np.diag([-1.0, -1.0, 1.0]) @ rotation)),
        "replay [rad]": None if again is None else float(so3.angle(again.T @ rotation)),
        "rms turn, linear [deg]": float(np.rad2deg(np.sqrt(np.trace(spread.covariance)))),
        "rms turn, sampled [deg]": float(np.rad2deg(np.sqrt(np.trace(spread.sampled)))),
        "roll deviation [deg]": float(np.rad2deg(spread.deviation[2])),
        "off-axis deviation [deg]": float(np.rad2deg(np.hypot(*spread.deviation[:2]))),
        "95 % of samples within [deg]": float(np.rad2deg(np.quantile(size, 0.95))),
        "samples": len(size),
        "waypoints_deg": np.rad2deg(np.asarray(path.waypoints)).tolist(),
    }


def _picture(rows: dict[str, dict[str, Any]], spreads: dict[str, design.Spread]) -> Figure:
    figure = Figure(figsize=(11, 4), layout="constrained", facecolor="white")
    *joints, cloud = figure.subplots(1, 3)
    for axes, (name, row) in zip(joints, rows.items(), strict=True):
        corners = np.array(row["waypoints_deg"])
        for joint, angle, colour, line in zip(
            ("twist 1", "bend", "twist 2"), corners.T, ("#0072b2", "#e69f00", "#7f3c8d"), ("-", "--", "-."), strict=True
        ):
            axes.plot(angle, line, color=colour, label=joint, linewidth=1.8)
        axes.set(xlabel="corner", ylabel="joint angle [deg]", title=f"{name}: {row['travel [deg]']:.0f}° of travel")
        axes.set_xticks(range(len(corners)))
        axes.grid(axis="y", color="#dddddd")
    joints[0].legend(frameon=False, fontsize=8)
    for (name, spread), colour, mark in zip(spreads.items(), ("#0072b2", "#d55e00"), "o^", strict=True):
        turns = np.rad2deg(spread.turns)[:500]
        cloud.plot(
            turns[:, 2], np.hypot(turns[:, 0], turns[:, 1]), mark, color=colour, alpha=0.45, markersize=3, label=name
        )
    cloud.set(xlabel="error of the roll [deg]", ylabel="off-axis turn [deg]", title="Sampled robots, inertias ± 5 %")
    cloud.legend(framealpha=0.95)
    cloud.grid(color="#dddddd")
    for axes in figure.axes:
        axes.spines[["top", "right"]].set_visible(False)
    return figure


if __name__ == "__main__":
    run(main, options(__doc__))

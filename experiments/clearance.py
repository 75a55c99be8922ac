"""What does staying clear of itself cost a robot? Maps of contact, single targets, many targets, and an arm on a bus.

    python experiments/clearance.py             # everything
    python experiments/clearance.py --quick     # coarser maps, few targets, words alone; no arm, no overhead
    python experiments/clearance.py --part map  # or targets, many, arm, overhead: one part alone

1. `map`: least clearance of manoeuvres A and B of the prototype over twist within 270 and bend within 120 degrees.
2. `targets`: half a turn of roll and a quarter turn of pitch with 5 mm of proven clearance, as words and as free paths.
3. `many`: uniformly random targets with 5 mm and without, at most 5 manoeuvres.
4. `arm`: a satellite with a 7-joint arm turned by 30 degrees about each axis with a 20 mm margin.
5. `overhead`: how much longer planning and design take with a clearance, by turns, compilation left out.

Every clearance is proven along the whole path. Figures of a run are in docs/clearance.md.
"""

import itertools
import time
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from common.script import options, run
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import reojax
from reojax import design, robots, so3
from reojax.files import check_writable, write_json
from reojax.plot import draw_map

TWIST, BEND = np.deg2rad(270), np.deg2rad(120)
LIMITS = {"twist_limit": TWIST, "bend_limit": BEND}
ROBOT = robots.prototype()
MARGIN, ARM_MARGIN = 0.005, 0.02
CORNERS, CALL = 21, 64
"""Corners of five manoeuvres, and paths in one call."""
PARTS = ("map", "targets", "many", "arm", "overhead")


def proven(paths: np.ndarray) -> np.ndarray:
    """Least clearance (m,) along each of many paths (m, v, 3) of the prototype, all by one program."""
    corners = np.repeat(paths[:, -1:], CORNERS, axis=1)  # a path that stays put at its end is no nearer
    corners[:, : paths.shape[1]] = paths
    calls = [corners[i : i + CALL] for i in range(0, len(corners), CALL)]
    full = [np.concatenate([call, np.repeat(call[-1:], CALL - len(call), axis=0)]) for call in calls]
    return np.concatenate([np.asarray(_least(call)) for call in full])[: len(paths)]


@jax.jit
def _least(corners: jax.Array) -> jax.Array:
    return jax.vmap(lambda points: jnp.asarray(reojax.path_clearance(ROBOT, reojax.Path(points)).distance))(corners)


def maps(quick: bool) -> dict:
    """Least clearance (bend, twist) [m] of A and B over the whole box."""
    twists, bends = np.linspace(-TWIST, TWIST, 13 if quick else 73), np.linspace(-BEND, BEND, 7 if quick else 49)
    answer: dict = {"twist_deg": np.rad2deg(twists).tolist(), "bend_deg": np.rad2deg(bends).tolist()}
    grid = [x.ravel() for x in np.meshgrid(twists, bends)]
    for name, manoeuvre in (("a", reojax.manoeuvre_a), ("b", reojax.manoeuvre_b)):
        corners = np.asarray(jax.vmap(lambda t, b, loop=manoeuvre: loop(t, b).waypoints)(*grid))
        least = proven(corners).reshape(len(bends), len(twists))
        answer[name] = least.tolist()
        answer[f"share_clear_{name}"] = float((least > 0).mean())
        answer[f"share_5mm_{name}"] = float((least >= MARGIN).mean())
    return answer


def targets(quick: bool) -> list[dict]:
    """Roll and pitch, by words and by free paths, with clearance and without."""
    rows = []
    for name, vector in (("roll 180", [0, 0, np.pi]), ("pitch 90", [np.pi / 2, 0, 0]))[: 1 if quick else 2]:
        turn = np.asarray(so3.exp(np.array(vector, float)))
        for margin in (MARGIN,) if quick else (None, MARGIN):
            for kind in ("word",) if quick else ("word", "free"):
                if kind == "word":
                    found = reojax.plan(ROBOT, turn, **LIMITS, max_manoeuvres=5, objective="travel", clearance=margin)
                else:
                    starts = 2 if quick else 16
                    found = reojax.free_path(ROBOT, turn, **LIMITS, starts=starts, clearance=margin)
                least = proven(np.asarray(found.waypoints)[None])[0]
                rows.append(_row(found, least) | {"target": name, "kind": kind, "asked_m": margin})
                print(rows[-1], flush=True)
    return rows


def _row(found: reojax.Plan | reojax.FreePaths, least: Any) -> dict:
    return {
        "converged": bool(found.converged),
        "travel_deg": float(np.rad2deg(found.travel)),
        "proven_m": float(least),
        "word": " ".join(getattr(found, "word", ())),
    }


def many(quick: bool) -> dict:
    """Random targets: how many are reached, with how many manoeuvres and how much travel; time of a second call."""
    count = 8 if quick else 1000
    turns = Rotation.from_quat(np.random.default_rng(0).normal(size=(count, 4))).as_matrix()
    answer: dict = {"targets": count}
    for name, margin in (("without", None), ("with_5mm", MARGIN)):
        reojax.plan_many(ROBOT, turns, **LIMITS, max_manoeuvres=5, clearance=margin)
        begun = time.process_time()
        found = reojax.plan_many(ROBOT, turns, **LIMITS, max_manoeuvres=5, clearance=margin)
        seconds = time.process_time() - begun
        least, reached = proven(found.waypoints), found.converged
        answer[name] = {
            "reached": int(reached.sum()),
            "manoeuvres_mean": float(found.manoeuvres[reached].mean()),
            "travel_mean_deg": float(np.rad2deg(found.travel[reached].mean())),
            "reached_and_clear_by_5mm": int((reached & (least >= MARGIN)).sum()),
            "reached_in_contact": int((reached & (least <= 0)).sum()),
            "cpu_s": seconds,
        }
        print(name, answer[name], flush=True)
    answer["cpu_ratio"] = answer["with_5mm"]["cpu_s"] / answer["without"]["cpu_s"]
    return answer


def arm(quick: bool) -> list[dict]:
    """The satellite turned by 30 degrees about each axis, from a posture with the arm bent, with margin and without."""
    robot, rows = robots.satellite_arm(), []
    start = np.array([0.0, 0.6, 0.0, 1.2, 0.0, 0.8, 0.0])
    for seed, axis, margin in itertools.product(range(1 if quick else 4), (0, 1, 2), (None, ARM_MARGIN)):
        turn = np.asarray(so3.exp(np.deg2rad(30) * np.eye(3)[axis]))
        begun = time.process_time()
        found = reojax.free_path(robot, turn, start=start, clearance=margin, seed=seed)
        seconds = time.process_time() - begun
        least = reojax.path_clearance(robot, reojax.Path(found.waypoints)).distance
        rows.append(_row(found, least) | {"axis": "xyz"[axis], "seed": seed, "asked_m": margin, "cpu_s": seconds})
        print(rows[-1], flush=True)
    return rows


def overhead(quick: bool) -> dict:
    """Processor time of planning and design with clearance and without, by turns, of second calls: all is compiled."""
    turns = Rotation.from_quat(np.random.default_rng(1).normal(size=(3 if quick else 8, 4))).as_matrix()
    loops = {name: loop_problem(margin) for name, margin in (("without", None), ("with", MARGIN))}
    work = {
        "plan": lambda turn, margin: reojax.plan(ROBOT, turn, **LIMITS, max_manoeuvres=5, clearance=margin),
        "free_path": lambda turn, margin: reojax.free_path(ROBOT, turn, **LIMITS, clearance=margin),
        "design": lambda turn, margin: loops["with" if margin else "without"].solve(
            8, hold={"target": np.asarray(so3.log(turn))}
        ),
    }
    answer = {}
    for name, one in work.items():
        seconds: dict = {None: [], MARGIN: []}
        for turn, margin in itertools.product(turns, (None, MARGIN)):
            one(turn, margin)
            begun = time.process_time()
            one(turn, margin)
            seconds[margin].append(time.process_time() - begun)
        without, within = (np.array(seconds[margin]) for margin in (None, MARGIN))
        answer[name] = {
            "without_s": float(without.sum()),
            "with_s": float(within.sum()),
            "ratio": float(within.sum() / without.sum()),
            "ratios": np.sort(within / without).round(2).tolist(),
        }
        print(name, answer[name], flush=True)
    return answer


def loop_problem(margin: float | None) -> design.Problem:
    """The smooth loop of least travel that turns the prototype by a target, with a clearance or without."""
    robot = ROBOT.replace(lower=-np.array([TWIST, BEND, TWIST]), upper=np.array([TWIST, BEND, TWIST]))
    loop = design.fourier_loops(robot, 3)
    target = design.Variable("target", [-np.pi] * 3, [np.pi] * 3)
    return design.Problem(
        lambda values: (robot, loop.path(values["loop"])),
        [loop, target],
        objective=design.travel(loop),
        equality=[design.turned_to("target")],
        inequality=[] if margin is None else [design.clear_by(margin)],
        steps=1,
    )


def main(out: Path, *, quick: bool = False, part: str | None = None) -> dict:
    """Run the parts, write `clearance.json` and `clearance.png` to `out`, and return the numbers."""
    table, picture = check_writable(out / "clearance.json"), check_writable(out / "clearance.png")
    answer = {}
    for name, work in zip(PARTS, (maps, targets, many, arm, overhead), strict=True):
        if part == name or (part is None and not (quick and name in ("arm", "overhead"))):
            answer[name] = work(quick)
            write_json(table, answer)
    if "map" in answer:
        print({key: value for key, value in answer["map"].items() if key.startswith("share")})
        draw(answer["map"]).savefig(picture, dpi=130)
    return answer


def draw(found: dict) -> Figure:
    """Maps of A and B side by side, contact outlined."""
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    for axes, name in zip(figure.subplots(1, 2), "ab", strict=True):
        least = 1e3 * np.array(found[name])
        draw_map(
            axes, found["twist_deg"], found["bend_deg"], least, label="least clearance [mm]", levels=range(-20, 40, 5)
        )
        axes.contour(found["twist_deg"], found["bend_deg"], least, [0.0], colors="#d55e00", linewidths=2)
        share = 100 * found[f"share_clear_{name}"]
        axes.set(
            xlabel="twist [deg]", ylabel="bend [deg]", title=f"Manoeuvre {name.upper()}: {share:.0f} % free of contact"
        )
    return figure


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--part", choices=PARTS, help="one part alone")
    run(main, parser)

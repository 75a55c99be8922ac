"""How much less do the joints move on a free closed path than in manoeuvres A and B, to the same orientation?

    python experiments/free_paths.py            # 75 s on 2 cores
    python experiments/free_paths.py --quick    # 4 targets that two manoeuvres reach

Uniformly random targets (Haar), the prototype, twist within 270 degrees and bend within 120. For each target the word
of least joint travel that is found with up to 5 manoeuvres, and one closed polygon of 8 free corners (`free_paths`).
All free paths are replayed by another integrator, without reojax's equations. Expected: at least 30 % less in the
median (docs/planning.md has a run's figures).
"""

import time
from pathlib import Path

import numpy as np
from common.replay import apart, replay
from common.script import options, run
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation
from tqdm import tqdm

import reojax
from reojax import robots
from reojax.files import check_writable, write_json

LIMITS = {"twist_limit": np.deg2rad(270), "bend_limit": np.deg2rad(120)}
ROBOT = robots.prototype()
AT_ONCE = 40
"""Targets between two writings of the results."""


def random_targets(count: int, quick: bool) -> np.ndarray:
    """Rotations (m, 3, 3): uniformly random; in a quick run what an A and a B of random amplitudes make."""
    rng = np.random.default_rng(0)
    if not quick:
        return Rotation.from_quat(rng.normal(size=(count, 4))).as_matrix()
    corners = []
    for first, second in rng.uniform(-1, 1, (count, 2, 2)) * list(LIMITS.values()):
        word = reojax.manoeuvre_a(*first), reojax.manoeuvre_b(*second)
        corners.append(np.concatenate([path.waypoints for path in word]))
    return replay(ROBOT, np.array(corners))


def main(out: Path, *, quick: bool = False) -> dict:
    """Plan, replay, print the table, write `free_paths.json` and `.png` to `out`, and return the numbers."""
    table, picture = check_writable(out / "free_paths.json"), check_writable(out / "free_paths.png")
    targets = random_targets(4 if quick else 200, quick)
    most, starts = (2, 4) if quick else (5, 4)
    words = reojax.plan_many(ROBOT, targets, **LIMITS, max_manoeuvres=most, objective="travel", progress=not quick)
    rows, largest, begun = [], 0.0, time.perf_counter()
    for first in tqdm(range(0, len(targets), AT_ONCE), desc="groups of targets", disable=quick):
        part = slice(first, first + AT_ONCE)
        free = reojax.free_paths(ROBOT, targets[part], **LIMITS, starts=starts, progress=not quick)
        replayed = apart(replay(ROBOT, free.waypoints), targets[part])
        largest = max(largest, float(replayed[free.converged].max(initial=0.0)))
        rows += [
            {
                "word_deg": float(np.rad2deg(words.travel[k])) if words.converged[k] else None,
                "free_deg": float(np.rad2deg(free.travel[k - first])) if free.converged[k - first] else None,
            }
            for k in range(first, first + len(free.travel))
        ]
        write_json(table, {"rows": rows})
    answer = summary(rows) | {"largest_replayed_error_rad": largest}
    answer["seconds_per_free_path"] = (time.perf_counter() - begun) / len(targets)
    for name, value in answer.items():
        print(f"{name.replace('_', ' '):38}{value if isinstance(value, int | bool) else format(value, '.4g')}")
    write_json(table, answer | {"rows": rows})
    _draw(rows, answer).savefig(picture, dpi=130)
    return answer


def summary(rows: list[dict]) -> dict:
    """Travel and saving over the targets that both reach."""
    both = np.array([[row["word_deg"], row["free_deg"]] for row in rows if None not in row.values()]).reshape(-1, 2)
    saving = 100 * (1 - both[:, 1] / both[:, 0])
    found = [sum(row[kind] is not None for row in rows) for kind in ("word_deg", "free_deg")]
    return {
        "targets": len(rows),
        "reached_by_words": found[0],
        "reached_by_free_paths": found[1],
        "word_travel_median_deg": float(np.median(both[:, 0])),
        "word_travel_most_deg": float(both[:, 0].max()),
        "free_travel_median_deg": float(np.median(both[:, 1])),
        "free_travel_most_deg": float(both[:, 1].max()),
        "saving_median_percent": float(np.median(saving)),
        "saving_worst_percent": float(saving.min()),
        "share_improved_percent": float(100 * (saving > 0).mean()),
        "share_saving_30_percent": float(100 * (saving >= 30).mean()),
        "converged": found[1] == len(rows),
    }


def _draw(rows: list[dict], answer: dict) -> Figure:
    both = np.array([[row["word_deg"], row["free_deg"]] for row in rows if None not in row.values()])
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    most = 1.05 * both.max()
    left.plot(*both.T, "o", ms=4, color="#0072b2", alpha=0.6)
    for share, style in ((1.0, "-"), (0.7, "--"), (0.4, ":")):
        left.plot(
            [0, most],
            [0, share * most],
            style,
            color="0.4",
            lw=1,
            label=f"{100 * (1 - share):.0f} % less" if share < 1 else "equal",
        )
    left.set(xlabel="joint travel of the best word of A and B [deg]", ylabel="joint travel of the free path [deg]")
    left.set(xlim=(0, most), ylim=(0, most), title="Each dot is one target")
    left.legend(frameon=False, loc="upper left")
    saving = np.sort(100 * (1 - both[:, 1] / both[:, 0]))
    right.plot(saving, 100 * (np.arange(len(saving)) + 0.5) / len(saving), color="#d55e00")
    right.axvline(answer["saving_median_percent"], color="0.4", lw=1, ls="--")
    right.set(xlabel="saving [%]", ylabel="targets with less saving [%]", ylim=(0, 100))
    right.set_title(f"Median {answer['saving_median_percent']:.0f} %, worst {answer['saving_worst_percent']:.0f} %")
    return figure


if __name__ == "__main__":
    run(main, options(__doc__))

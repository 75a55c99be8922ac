"""What share of all orientations does the prototype reach with 1, 2, 3, 4 manoeuvres?

    python experiments/so3_share.py            # a minute on 2 cores
    python experiments/so3_share.py --quick    # fewer targets, up to 2 manoeuvres, no rectangles
    python experiments/so3_share.py --clearance 5mm      # what is left once the robot may not touch itself; minutes

Uniformly random targets (Haar), twist within 270 degrees and bend within 120; words of A and B, and words of
rectangles whose distal joints have amplitudes of their own. A share is that of targets whose plan has so many
manoeuvres or fewer. "Not with fewer" is a numerical decision, so a share is a lower bound. How often it is wrong is
tried on targets made of n random manoeuvres, all amplitudes and letters uniform: the share not solved with n.
That is not the share of all orientations wrongly refused, whose words are others.

With `--clearance` 1000 targets are asked for with and without it, by words of A and B; each number of manoeuvres by
itself, as a search that may take more of them gives fewer up sooner. That row is without the wrongly given up.

Expected: 0 with one A or B, as their rotations are surfaces in SO(3); more with rectangles; practically all with 5,
and with 6 of them clear of the robot itself.
"""

from pathlib import Path

import numpy as np
from common.script import length, options, run
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots
from reojax.files import check_writable, write_json
from reojax.planning import quaternions
from reojax.planning.table import true_rotations

ROBOT = robots.prototype()
LIMITS = {"twist_limit": np.deg2rad(270), "bend_limit": np.deg2rad(120)}
NAMES = {"manoeuvres": "A and B", "rectangles": "rectangles"}


def share(hits: np.ndarray) -> dict:
    """Share of hits, and its binomial standard error."""
    p = float(np.mean(hits))
    return {"share": p, "standard_error": float(np.sqrt(p * (1 - p) / len(hits)))}


def random_targets(count: int) -> np.ndarray:
    """Uniformly random rotations (count, 3, 3)."""
    return Rotation.from_quat(np.random.default_rng(0).normal(size=(count, 4))).as_matrix()


def shares_reached(targets: np.ndarray, most: int, clearance: float | None) -> list[float]:
    """Shares of targets reached with at most 1, 2, ... `most` manoeuvres of A and B that keep a clearance [m].

    Each number is asked for by itself.
    """
    reached, shares = np.full(len(targets), False), []
    for number in range(1, most + 1):
        left = np.flatnonzero(~reached)
        if len(left):
            found = reojax.plan_many(ROBOT, targets[left], **LIMITS, max_manoeuvres=number, clearance=clearance)
            reached[left] = found.converged
        shares.append(float(reached.mean()))
    return shares


def planted(vocabulary: str, manoeuvres: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Rotations (count, 3, 3) after words of so many random manoeuvres."""
    x = rng.uniform(-1, 1, (3, manoeuvres * count))
    if vocabulary == "manoeuvres":
        x[2] = x[0] * rng.choice([-1, 1], manoeuvres * count)
    twist, bend = LIMITS.values()
    loops = true_rotations(ROBOT, reojax.FOUR_BODY, x * np.array([[twist], [bend], [twist]]))
    q, *others = np.moveaxis(loops.reshape(4, manoeuvres, count), 1, 0)
    for other in others:
        q = np.stack(quaternions.product(q, other))
    return quaternions.to_matrices(q)


def measure(vocabulary: str, most: int, count: int, planted_count: int) -> dict:
    """Shares by number of manoeuvres, and how often the number is given up wrongly."""
    targets = random_targets(count)
    plan = reojax.plan_many(ROBOT, targets, **LIMITS, max_manoeuvres=most, vocabulary=vocabulary, progress=True)
    reached = [{"at_most": n, **share(plan.converged & (plan.manoeuvres <= n))} for n in range(1, most + 1)]
    rng, given_up = np.random.default_rng(1), []
    for n in range(1, min(most, 4) + 1):
        made = planted(vocabulary, n, planted_count, rng)
        found = reojax.plan_many(ROBOT, made, **LIMITS, max_manoeuvres=n, vocabulary=vocabulary, progress=True)
        missed = found.error[~found.converged]
        by = np.quantile(missed, [0.5, 1.0]).tolist() if len(missed) else None
        given_up.append({"manoeuvres": n, **share(~found.converged), "missed_by_median_and_most_rad": by})
    return {"vocabulary": vocabulary, "targets": count, "reached": reached,
            "planted_targets_each": planted_count, "planted_not_solved": given_up}  # fmt: skip


def main(out: Path, *, quick: bool = False, clearance: float | None = None) -> dict:
    """Plan, print the table, write `so3_share.json` and `so3_share.png` to `out`, and return the numbers."""
    if clearance is not None:
        return _with_clearance(out, clearance, quick=quick)
    table, picture = check_writable(out / "so3_share.json"), check_writable(out / "so3_share.png")
    cases = (("manoeuvres", 2, 64, 16),) if quick else (("manoeuvres", 5, 2_000, 1_000), ("rectangles", 5, 500, 250))
    rows = []
    for case in cases:
        rows.append(measure(*case))
        write_json(table, {"rows": rows})
    print("share [%] of random targets reached with at most n, and of targets made of n that are not solved with n")
    print(f"{'words of':12}{'targets':>8}  " + "".join(f"{f'n = {n}':>16}" for n in range(1, 6)))
    for row in rows:
        for what, count, shares in _shares(row):
            cells = (f"{100 * s['share']:.2f} +- {100 * s['standard_error']:.2f}" for s in shares)
            print(f"{NAMES[row['vocabulary']]:12}{count:8}  " + "".join(f"{cell:>16}" for cell in cells) + f"  {what}")
    _draw(rows).savefig(picture, dpi=150)
    return {"rows": rows}


def _with_clearance(out: Path, clearance: float, *, quick: bool) -> dict:
    """Shares with and without a clearance, to `so3_share_clear.json`."""
    record = check_writable(out / "so3_share_clear.json")
    targets, most = random_targets(32 if quick else 1000), 2 if quick else 6
    rows = []
    print(f"share [%] of {len(targets)} random targets reached with at most n manoeuvres of A and B")
    print(f"{'':14}" + "".join(f"{f'n = {n}':>9}" for n in range(1, most + 1)))
    for margin in (None, clearance):
        shares = shares_reached(targets, most, margin)
        rows.append({"clearance_m": margin, "targets": len(targets), "reached": shares})
        name = "may touch" if margin is None else f"{1e3 * margin:g} mm clear"
        print(f"{name:14}" + "".join(f"{100 * value:9.1f}" for value in shares), flush=True)
        write_json(record, {"rows": rows})
    print(f"wrote {record}")
    return {"rows": rows}


def _shares(row: dict) -> tuple[tuple[str, int, list[dict]], ...]:
    """What is counted, among how many targets, and the shares."""
    return (
        ("reached", row["targets"], row["reached"]),
        ("not solved", row["planted_targets_each"], row["planted_not_solved"]),
    )


def _draw(rows: list[dict]) -> Figure:
    """What is reached, left; how often the planner gives up wrongly, right."""
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    width = 0.8 / len(rows)
    for k, (row, colour, hatch) in enumerate(zip(rows, ("#0072b2", "#e69f00"), ("", "//"), strict=False)):
        for ax, (_, count, shares) in zip((left, right), _shares(row), strict=True):
            place = np.arange(1, len(shares) + 1) + (k - (len(rows) - 1) / 2) * width
            height = 100 * np.array([s["share"] for s in shares])
            error = 100 * np.array([s["standard_error"] for s in shares])
            style = {"color": colour, "hatch": hatch, "edgecolor": "white", "capsize": 3}
            bars = ax.bar(place, height, width, yerr=error, label=f"{NAMES[row['vocabulary']]} ({count})", **style)
            ax.bar_label(bars, [f"{h:.3g}" for h in height], fontsize=7, padding=2)
    left.set(xlabel="at most so many manoeuvres", ylabel="random targets reached [%]", title="Share of SO(3)")
    right.set(
        xlabel="made of so many random manoeuvres", ylabel="not solved with as many [%]", title="Given up wrongly"
    )
    left.set_xticks(range(1, len(rows[0]["reached"]) + 1))
    left.set_ylim(0, 112)
    right.set_xticks(range(1, len(rows[0]["planted_not_solved"]) + 1))
    right.set_ylim(0, max(1.0, 1.2 * right.get_ylim()[1]))
    for ax, corner in ((left, "upper left"), (right, "upper right")):
        ax.legend(fontsize=8, frameon=False, loc=corner, title="words of (targets)", title_fontsize=8)
    return figure


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--clearance", type=length, metavar="LENGTH", help="what the parts keep apart, such as 5mm")
    run(main, parser)

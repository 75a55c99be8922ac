"""How far does feedback between manoeuvres bring a robot whose inertias are not as planned, with a noisy sensor?

    python experiments/feedback.py            # some minutes on 2 cores
    python experiments/feedback.py --quick    # fewer runs, one correction, from the reading alone

Each run has a random target (Haar) and a prototype whose links' inertias are scaled by exp(0.1 z), z standard normal.
It runs the word planned for the nominal robot, then up to three corrections. A correction is one new word of up to 5
manoeuvres to the target, planned at the end of the word before; the last error is of the true orientation.
The orientation is read after every manoeuvre, 1 degree of noise about each axis. Three ways to plan a correction:

- reading: `replan`, nominal robot, from the last reading as it is;
- orientation: nominal robot, from the orientation estimated from all readings;
- learning: from that orientation, amplitudes corrected for the estimated robot.

Expected: one reading alone is off by 2.8 degrees (95th percentile); learning should end below 2.
"""

from pathlib import Path

import jax
import numpy as np
from _correcting import LIMITS, Words, along, angle_left, correct, legs, rotations
from _estimating import estimate
from _script import options, run
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots
from reojax._output import check_writable, write_json

SPREAD = 0.1
"""Standard deviation of the logarithm of an inertia."""
SLOTS = 5
"""Most manoeuvres of a word."""
CORRECTIONS = 3
WAYS = ("learning", "orientation", "reading")
NOMINAL = robots.prototype()


def varied(z):
    """The prototype with inertias off by `z` standard deviations, one of each link."""
    return NOMINAL.replace(inertia=NOMINAL.inertia * jax.numpy.exp(SPREAD * z)[:, None, None])


_robots = jax.jit(jax.vmap(varied))


@jax.jit
def _estimates(corners, measured, noise):
    def one(corners, measured, noise):
        found = estimate(varied, NOMINAL.mass.shape[0], corners, measured, noise=noise)
        return found.errors, found.orientation

    # one run at a time keeps memory small
    return jax.lax.map(lambda run: one(*run), (corners, measured, noise), batch_size=25)


def _padded(words: list, fill, corrections: int) -> np.ndarray:
    """Stops of all words so far, and what fills up those still to come, for one shape throughout."""
    missing = corrections - len(words)
    return np.concatenate([*words, *[np.broadcast_to(fill, words[0].shape)] * missing], axis=1)


def planned(now: np.ndarray, target: np.ndarray) -> Words:
    """Words of the nominal robot from `now` to `target`, (m, 3, 3) each."""
    limits = {"twist_limit": LIMITS[0], "bend_limit": LIMITS[1], "max_manoeuvres": SLOTS}
    plan = reojax.plan_many(NOMINAL, now.swapaxes(1, 2) @ target, **limits)
    missing = [(0, 0), (0, SLOTS - plan.twist.shape[1])]
    x = np.stack([np.pad(plan.twist, missing), np.pad(plan.bend, missing)], axis=-1)
    return Words(np.pad(np.where(plan.word == "A", -1.0, 1.0), missing, constant_values=1.0), x)


def errors_of(
    way: str, truth, first: Words, target: np.ndarray, noise: float, seed: int, corrections: int
) -> np.ndarray:
    """Angles to the target (1 + corrections, m) after the nominal word and after each correction [rad]."""
    rng = np.random.default_rng(seed)
    m = len(target)
    now, words = np.tile(np.eye(3), (m, 1, 1)), first
    corners, measured, sizes, errors = [], [], [], []
    for left in reversed(range(corrections + 1)):
        places = along(now, rotations(truth, words))[:, 1:]
        now = places[:, -1]
        errors.append(np.linalg.norm(angle_left(now, target), axis=1))
        if not left:
            break
        used = np.asarray((words.x != 0).any(axis=-1))
        tilt = Rotation.from_rotvec(noise * rng.normal(size=(m * SLOTS, 3))).as_matrix().reshape(m, SLOTS, 3, 3)
        corners.append(np.asarray(legs(*words)))
        measured.append(places @ tilt)
        sizes.append(np.where(used, noise, np.inf))
        if way == "reading":
            last = np.maximum(SLOTS - 1 - used[:, ::-1].argmax(1), 0)
            words = planned(measured[-1][np.arange(m), last], target)
            continue
        stops = len(corners) * SLOTS
        parts = [_padded(*part, corrections) for part in ((corners, 0.0), (measured, np.eye(3)), (sizes, np.inf))]
        z, seen = map(np.asarray, _estimates(*parts))
        seen = seen[:, stops - 1]
        words = planned(seen, target)
        if way == "learning":
            words = correct(_robots(z), words, seen, target, np.asarray((words.x != 0).any(axis=-1))).words
    return np.array(errors)


def main(out: Path, *, quick: bool = False) -> dict:
    """Run, print the table, write `feedback.json` and `feedback.png` to `out`, and return the numbers."""
    table, picture = check_writable(out / "feedback.json"), check_writable(out / "feedback.png")
    runs, corrections = (25, 1) if quick else (1_000, CORRECTIONS)
    rng = np.random.default_rng(0)
    target = Rotation.from_quat(rng.normal(size=(runs, 4))).as_matrix()
    truth = _robots(rng.normal(size=(runs, NOMINAL.mass.shape[0])))
    first = planned(np.tile(np.eye(3), (runs, 1, 1)), target)
    cases = {(way, 1.0): np.empty(0) for way in (WAYS[-1:] if quick else WAYS)}
    rows = []
    print("angle to the target [deg], median / 95th percentile: without feedback, after 1, 2, 3 corrections")
    for way, degrees in cases:
        errors = np.rad2deg(errors_of(way, truth, first, target, np.deg2rad(degrees), 1, corrections))
        cases[way, degrees] = errors
        middle, most = np.median(errors, axis=1), np.quantile(errors, 0.95, axis=1)
        rows.append(
            {"way": way, "noise_deg": degrees, "median_deg": middle.tolist(), "percentile_95_deg": most.tolist()}
        )
        shown = "   ".join(f"{a:6.2f} / {b:6.2f}" for a, b in zip(middle, most, strict=True))
        print(f"{way:12} {shown}", flush=True)
        write_json(table, {"runs": runs, "inertia_spread": SPREAD, "results": rows})
    _draw(cases, picture)
    return {"runs": runs, "results": rows}


def _draw(cases: dict, file: Path) -> None:
    figure = Figure(figsize=(4 * len(cases), 3.6), layout="constrained")
    axes = figure.subplots(1, len(cases), sharey=True, squeeze=False)[0]
    for ax, ((way, degrees), errors) in zip(axes, cases.items(), strict=True):
        for k, (row, style) in enumerate(zip(errors, ("-", "--", "-.", ":"), strict=False)):
            label = "no feedback" if not k else f"correction {k}"
            ax.plot(np.sort(row), (np.arange(len(row)) + 0.5) / len(row), style, label=label)
        ax.axhline(0.95, color="0.6", lw=0.8)
        ax.set(xscale="log", xlabel="angle to the target [deg]", title=f"{way}, noise {degrees:g} deg")
    axes[0].set_ylabel("share of runs below")
    axes[0].legend(fontsize="small")
    figure.savefig(file, dpi=150)


if __name__ == "__main__":
    run(main, options(__doc__))

"""How far does feedback between manoeuvres bring a robot whose inertias are not as planned, with a noisy sensor?

    python experiments/feedback.py            # some minutes on 2 cores
    python experiments/feedback.py --quick    # fewer runs, shorter words, one correction, in one way

Each run has a random target (Haar) and a prototype whose links' inertias are scaled by exp(0.1 z), z standard normal.
It runs the word planned for the nominal robot, then up to three corrections. A correction is one new word of up to 5
manoeuvres to the target, planned at the end of the word before; the last error is of the true orientation.
The orientation is read after every manoeuvre, 1 degree of noise about each axis. Five ways to correct:

- reading: `replan`, nominal robot, from the last reading as it is;
- orientation: nominal robot, from the orientation estimated from all readings;
- learning: from that orientation, amplitudes corrected for the estimated robot;
- every manoeuvre: learning, and after each manoeuvre those left of the word are corrected likewise, the first word's
  too. (A whole new word after each manoeuvre would never end: any small rotation left takes some manoeuvres again.)
- within the motion: every manoeuvre under the library's `Steering`, which reads the orientation 200 times a second,
  1 degree of noise, and estimates the inertias; 100 runs.

Expected: one reading alone is off by 2.8 degrees (95th percentile); learning should end below 2.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from common.script import options, run
from feedback_parts.correcting import LIMITS, LINKS, NOMINAL, SPREAD, Words, along, angle_left, correct, estimate, turns
from feedback_parts.in_flight import InFlight
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation
from tqdm import tqdm

import reojax
from reojax.files import check_writable, write_json

CORRECTIONS = 3
EVERY = "every manoeuvre"
WITHIN = "within the motion"
WAYS = (EVERY, "learning", "orientation", "reading", WITHIN)
WITHIN_RUNS = 100


def planned(now: np.ndarray, target: np.ndarray, slots: int) -> Words:
    """Words of up to `slots` manoeuvres on the nominal robot from `now` to `target`, (m, 3, 3) each."""
    limits = {"twist_limit": LIMITS[0], "bend_limit": LIMITS[1], "max_manoeuvres": slots}
    plan = reojax.plan_many(NOMINAL, now.swapaxes(1, 2) @ target, **limits)
    missing = [(0, 0), (0, slots - plan.twist.shape[1])]
    x = np.stack([np.pad(plan.twist, missing), np.pad(plan.bend, missing)], axis=-1)
    return Words(np.pad(np.where(plan.word == "A", -1.0, 1.0), missing, constant_values=1.0), x)


class Flight:
    """What m runs have done and what was read after each manoeuvre."""

    def __init__(self, truth: np.ndarray, noise: float):
        self.now = np.tile(np.eye(3), (len(truth), 1, 1))
        self._truth, self._noise, self._rng = truth, noise, np.random.default_rng(1)
        self._words, self._read = [], []
        self._z = np.zeros_like(truth)

    def fly(self, words: Words) -> None:
        """Run words and read the orientation after every manoeuvre."""
        m, s = words.last.shape
        places = along(self.now, turns(self._truth, words).rotation)[:, 1:]
        tilt = Rotation.from_rotvec(self._noise * self._rng.normal(size=(m * s, 3))).as_matrix().reshape(m, s, 3, 3)
        self.now = places[:, -1]
        self._words.append(words)
        self._read.append(places @ tilt)

    def last_reading(self) -> np.ndarray:
        """What was read after the last manoeuvre of the last word (m, 3, 3)."""
        used = self._words[-1].used
        last = np.maximum(used.shape[1] - 1 - used[:, ::-1].argmax(1), 0)
        return self._read[-1][np.arange(len(last)), last]

    def estimate(self) -> tuple[np.ndarray, np.ndarray]:
        """Errors of the inertias and the orientation now, from all readings."""
        so_far = Words(*(np.concatenate(part, axis=1) for part in zip(*self._words, strict=True)))
        self._z, seen = estimate(so_far, np.concatenate(self._read, axis=1), self._noise, self._z)
        return self._z, seen

    def fly_correcting(self, words: Words, target: np.ndarray) -> None:
        """Run words; after every manoeuvre, correct those that are left of the word for the estimated robot."""
        for slot in range(words.last.shape[1]):
            self.fly(Words(*(field[:, slot : slot + 1] for field in words)))
            if words.used[:, slot + 1 :].any():
                z, seen = self.estimate()
                rest = correct(z, Words(*(field[:, slot + 1 :] for field in words)), seen, target)
                words.x[:, slot + 1 :] = rest.x


def errors_of(way: str, truth, first: Words, target: np.ndarray, noise: float, corrections: int) -> np.ndarray:
    """Angles to the target (1 + corrections, m) after the first word and after each further one [rad]."""
    words, errors = Words(first.last, first.x.copy()), []
    if way == WITHIN:
        return _within(truth, words, target, noise, corrections)
    flight = Flight(truth, noise)
    slots = first.last.shape[1]
    for left in tqdm(range(corrections, -1, -1), desc=way, unit=" words", leave=False):
        if way == EVERY:
            flight.fly_correcting(words, target)
        else:
            flight.fly(words)
        errors.append(np.linalg.norm(angle_left(flight.now, target), axis=1))
        if not left:
            break
        if way == "reading":
            words = planned(flight.last_reading(), target, slots)
            continue
        z, seen = flight.estimate()
        words = planned(seen, target, slots)
        if way != "orientation":
            words = correct(z, words, seen, target)
    return np.array(errors)


def _within(truth, words: Words, target: np.ndarray, noise: float, corrections: int) -> np.ndarray:
    """`errors_of`, all of it by the library's `Steering`."""
    flight, errors, slots = InFlight(truth, noise), [], words.last.shape[1]
    for left in tqdm(range(corrections, -1, -1), desc=WITHIN, unit=" words", leave=False):
        flight.fly_word(words, target)
        errors.append(np.linalg.norm(angle_left(flight.now, target), axis=1))
        if left:
            z, seen = flight.believed()
            words = correct(z, planned(seen, target, slots), seen, target)
    return np.array(errors)


def main(out: Path, *, quick: bool = False, ways: Sequence[str] = WAYS) -> dict:
    """Run, print the table, write `feedback.json` and `feedback.png` to `out`, and return the numbers."""
    table, picture = check_writable(out / "feedback.json"), check_writable(out / "feedback.png")
    runs, corrections, slots = (12, 1, 4) if quick else (1_000, CORRECTIONS, 5)
    rng = np.random.default_rng(0)
    target = Rotation.from_quat(rng.normal(size=(runs, 4))).as_matrix()
    truth = rng.normal(size=(runs, LINKS))
    first = planned(np.tile(np.eye(3), (runs, 1, 1)), target, slots)
    cases = {(way, 1.0): np.empty(0) for way in (WAYS[:1] if quick else ways)}
    rows = []
    print("angle to the target [deg], median / 95th percentile: after the first word and 1, 2, 3 more")
    for way, degrees in cases:
        part = slice(WITHIN_RUNS if way == WITHIN else runs)
        words = Words(*(field[part] for field in first))
        errors = np.rad2deg(errors_of(way, truth[part], words, target[part], np.deg2rad(degrees), corrections))
        cases[way, degrees] = errors
        middle, most = np.median(errors, axis=1), np.quantile(errors, 0.95, axis=1)
        rows.append(
            {
                "way": way,
                "runs": errors.shape[1],
                "noise_deg": degrees,
                "median_deg": middle.tolist(),
                "percentile_95_deg": most.tolist(),
            }
        )
        shown = "   ".join(f"{a:6.2f} / {b:6.2f}" for a, b in zip(middle, most, strict=True))
        print(f"{way:15} {shown}", flush=True)
        write_json(table, {"runs": runs, "inertia_spread": SPREAD, "results": rows})
    _draw(cases, picture)
    return {"runs": runs, "results": rows}


def _draw(cases: dict, file: Path) -> None:
    figure = Figure(figsize=(4 * len(cases), 3.6), layout="constrained")
    axes = figure.subplots(1, len(cases), sharey=True, squeeze=False)[0]
    for ax, ((way, degrees), errors) in zip(axes, cases.items(), strict=True):
        for k, (row, style) in enumerate(zip(errors, ("-", "--", "-.", ":"), strict=False)):
            label = "first word" if not k else f"{k} more"
            ax.plot(np.sort(row), (np.arange(len(row)) + 0.5) / len(row), style, label=label)
        ax.axhline(0.95, color="0.6", lw=0.8)
        ax.set(xscale="log", xlabel="angle to the target [deg]", title=f"{way}, noise {degrees:g} deg")
    axes[0].set_ylabel("share of runs below")
    axes[0].legend(fontsize="small")
    figure.savefig(file, dpi=150)


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS, help="ways to correct (default: all)")
    run(main, parser)

"""How long would words of two fixed manoeuvres have to be, where a plan chooses its amplitudes?

    pip install -e ".[yardstick]"
    python experiments/solovay_kitaev.py            # a minute or two on 2 cores
    python experiments/solovay_kitaev.py --quick    # fewer targets, shorter words, less recursion

The Solovay-Kitaev algorithm (Qiskit's) writes any rotation as a word of given ones: here manoeuvres A and B of one
amplitude each, and the same backwards. The prototype, uniformly random targets (Haar). Expected: its words grow about
fivefold with each recursion while the error falls with the power 1.5 at best: about a hundred manoeuvres for a degree,
where a plan of at most 5 with amplitudes of their own is exact.
"""

import importlib.util
import warnings
from pathlib import Path

import numpy as np
from common.replay import replay
from common.script import options, run
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots
from reojax.files import check_writable, write_json

ROBOT = robots.prototype()
TWIST, BEND = np.deg2rad([200.0, 90.0])
LIMITS = {"twist_limit": np.deg2rad(270), "bend_limit": np.deg2rad(120)}
NAMES = {"s": ("A", 1), "sdg": ("A", -1), "t": ("B", 1), "tdg": ("B", -1)}
"""Qiskit knows gates by name only; it is given these with the rotations of manoeuvres and their inverses."""
TURN = np.diag([-1.0, -1.0, 1.0])
"""Qiskit's rotation of a unitary is the usual one seen from axes turned by a half turn about z."""


def turns() -> dict[str, np.ndarray]:
    """Rotations of the two manoeuvres and their inverses, by Qiskit's names."""
    paths = np.array([make(TWIST, BEND).waypoints for make in (reojax.manoeuvre_a, reojax.manoeuvre_b)])
    a, b = replay(ROBOT, paths)
    return {"s": a, "sdg": a.T, "t": b, "tdg": b.T}


def words_up_to(depth: int, gates: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """All words without a manoeuvre next to its inverse, and their rotations, the first one run rightmost."""
    level, words = {(): np.eye(3)}, {}
    for _ in range(depth):
        level = {
            (*word, name): gates[name] @ turned
            for word, turned in level.items()
            for name in gates
            if not word or NAMES[word[-1]] != (NAMES[name][0], -NAMES[name][1])
        }
        words |= {" ".join(word): turned for word, turned in level.items()}
    return words


def approximate(targets: np.ndarray, depth: int, degrees: int) -> list[dict]:
    """Lengths and errors of Qiskit's words for each recursion degree, measured by multiplying them out."""
    from qiskit.synthesis import SolovayKitaevDecomposition  # pyright: ignore[reportMissingImports]

    gates = turns()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # on its file format, which is not used
        synthesis = SolovayKitaevDecomposition(words_up_to(depth, gates))
    rows = []
    for degree in range(degrees + 1):
        length, error = [], []
        for target in targets:
            x, y, z, w = Rotation.from_matrix(TURN @ target @ TURN).as_quat()
            unitary = np.array([[w - 1j * z, -1j * x - y], [-1j * x + y, w + 1j * z]])
            turned = np.eye(3)
            word = [step.operation.name for step in synthesis.run(unitary, degree).data]
            for name in word:
                turned = gates[name] @ turned
            length.append(len(word))
            error.append((Rotation.from_matrix(turned).inv() * Rotation.from_matrix(target)).magnitude())
        rows.append({"degree": degree, "manoeuvres": length, "error_rad": error})
    return rows


def needed(rows: list[dict], error: float) -> float | None:
    """Manoeuvres until a median error, if each further recursion does what the last one did to order 1.5; or none."""
    (before, now), length = (np.median(row["error_rad"]) for row in rows[-2:]), np.median(rows[-1]["manoeuvres"])
    growth = length / np.median(rows[-2]["manoeuvres"])
    factor = now / before**1.5
    while now > error:
        if factor * now**0.5 >= 1:
            return None
        now, length = factor * now**1.5, growth * length
    return float(length)


def main(out: Path, *, quick: bool = False) -> dict:
    """Compare, print the table, write `solovay_kitaev.json` and `.png` to `out`, and return the numbers."""
    table, picture = check_writable(out / "solovay_kitaev.json"), check_writable(out / "solovay_kitaev.png")
    if importlib.util.find_spec("qiskit") is None:
        print("Qiskit is not installed (pip install 'reojax[yardstick]'): nothing is compared.")
        return {"compared": False}
    count, depth, degrees, most = (4, 6, 2, 4) if quick else (50, 8, 4, 5)
    targets = Rotation.from_quat(np.random.default_rng(0).normal(size=(count, 4))).as_matrix()
    rows = approximate(targets, depth, degrees)
    plan = reojax.plan_many(ROBOT, targets, **LIMITS, max_manoeuvres=most)
    print(f"{'recursion':>10}{'manoeuvres, median':>20}{'error, median':>16}{'largest [deg]':>15}")
    planned = {"degree": None, "manoeuvres": plan.manoeuvres.tolist(), "error_rad": plan.error.tolist()}
    for row in [*rows, planned]:
        error = np.rad2deg(row["error_rad"])
        name = "plan" if row["degree"] is None else row["degree"]
        print(f"{name:>10}{np.median(row['manoeuvres']):20.0f}{np.median(error):16.2g}{error.max():15.2g}")
    aim = float(np.max(plan.error[plan.converged], initial=1e-15))
    answer = {"compared": True, "words": rows, "plan": planned, "manoeuvres_extrapolated": needed(rows, aim)}
    extrapolated = answer["manoeuvres_extrapolated"]
    print(f"extrapolated to {aim:.1e} rad, as the plans: {extrapolated and f'{extrapolated:.2g}'} manoeuvres")
    write_json(table, answer)
    _draw(rows, planned).savefig(picture, dpi=130)
    return answer


def _draw(rows: list[dict], planned: dict) -> Figure:
    figure = Figure(figsize=(5.6, 4.0), layout="constrained")
    ax = figure.subplots()
    colours = "#0072b2", "#56b4e9", "#009e73", "#e69f00", "#d55e00"
    for row, colour in zip(rows, colours, strict=False):
        error = np.rad2deg(row["error_rad"])
        ax.loglog(row["manoeuvres"], error, ".", color=colour, label=f"recursion {row['degree']}")
    ax.loglog(planned["manoeuvres"], np.rad2deg(planned["error_rad"]), "k^", ms=4, label="plan, own amplitudes")
    ax.set(xlabel="manoeuvres", ylabel="error [deg]", title="Fixed A and B, and plans: a mark for each target")
    ax.legend(frameon=False, fontsize="small", loc="lower right")
    return figure


if __name__ == "__main__":
    run(main, options(__doc__))

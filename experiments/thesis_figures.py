"""Does the model do what the thesis says it does? Every figure of its simulations, and every claim with a verdict.

    python experiments/thesis_figures.py        # about a minute of processor time; --quick: coarser, fewer claims

Figures 1.5 and 2.7 to 2.10: the thesis's own grids, drawn as it draws them, and finer ones as contours and lines.
Figures 2.5 and 2.6: the robot along manoeuvres A and B, as rows of frames and as GIFs. Figure 1.9: ZXZ and joint
angles. Then a picture that the thesis does not have: the curvature of the local connection on the planes of A and B,
and how well its surface integral predicts the net rotation of loops of all sizes, in the base frame and in the frame in
which the connection is smallest.

Expected: all that the thesis says of figures 2.5 to 2.10 holds. Four claims do not hold for the prototype as it is:
growth of A as twist * bend^2 at small amplitudes, the sign of the bend, a third ZXZ angle that returns to zero, and the
centre joint's motor of figure 3.2. The surface integral in the best frame is within 3 degrees of A's half turn, in the
base frame it is off by 46.
"""

from pathlib import Path

import numpy as np
from common.script import options, run
from thesis import claim_table, claims, pictures as pictures
from thesis.curvature import Errors, study
from thesis.grids import FULL_BEND, FULL_TWIST, Grid, sweeps
from thesis.measure import FULL_A, FULL_B, measure

from reojax import plot, robots
from reojax.files import check_writable, replacing, write_json

PICTURES = ("1_9", "2_5", "2_6", "2_7", "2_8", "2_9", "2_10")
CURVED = ("curvature_a", "curvature_b", "curvature_loops")


def main(out: Path, *, quick: bool = False) -> dict:
    """Compute, draw, judge; write tables and pictures to `out` and return the numbers."""
    table, words = check_writable(out / "thesis_figures.json"), check_writable(out / "thesis_figures.md")
    png = {name: plot.check_picture(out / f"thesis_{name}.png") for name in (*PICTURES, *CURVED)}
    gif = {name: plot.check_animation(out / f"thesis_{name}.gif") for name in ("2_5", "2_6")}

    grids, robot = sweeps(quick=quick), robots.prototype()
    a, b = (plot.frames_along(robot, path, per_edge=pictures.SAMPLES) for path in (FULL_A, FULL_B))
    draw(grids, a, b, png)
    for name, frames in (("2_5", a), ("2_6", b)):
        pictures.animation(frames, gif[name], count=4 if quick else 36)

    sizes = np.geomspace(0.02, 1, 5 if quick else 15)
    errors = {}
    for name, last in (("A", -1.0), ("B", 1.0)):
        maps, errors[name] = study(robot, last, sizes, (FULL_BEND, FULL_TWIST), quick=quick)
        plot.save(pictures.curvature(maps, name=name), png[f"curvature_{name.lower()}"])
    plot.save(pictures.predictions(errors), png["curvature_loops"])

    numbers = measure(grids, a.rotation, quick=quick)
    judged = claims.judge(numbers)
    print(claim_table.text(judged))
    print("\n" + "\n".join(errors_table(errors)))
    with replacing(words) as file:
        file.write((claim_table.markdown(judged) + "\n" + "\n".join(errors_table(errors)) + "\n").encode())
    result = {
        "quick": quick,
        "claims": [claim._asdict() for claim in judged],
        "measured": numbers,
        "curvature": {name: e._asdict() for name, e in errors.items()},
        "grids": {key: {"axes": grid.axes, "turn": grid.own().turn._asdict()} for key, grid in grids.items()},
    }
    write_json(table, result)
    return result


def draw(grids: dict[str, Grid], a: plot.Frames, b: plot.Frames, png: dict[str, Path]) -> None:
    """Draw the thesis's figures; `a` and `b` are the poses along the full manoeuvres."""
    plot.save(pictures.history(FULL_A, a), png["1_9"])
    plot.save(pictures.progress(FULL_A, a, name="A", number="2.5"), png["2_5"])
    plot.save(pictures.progress(FULL_B, b, name="B", number="2.6"), png["2_6"])
    plot.save(pictures.amplitudes(grids["a"], name="A", figures="figures 1.5 and 2.7"), png["2_7"])
    plot.save(pictures.end_inertia(grids["inertia"]), png["2_8"])
    plot.save(pictures.motors(grids["motor"]), png["2_9"])
    plot.save(pictures.amplitudes(grids["b"], name="B", figures="figure 2.10", yaw=True), png["2_10"])


def errors_table(errors: dict[str, Errors]) -> list[str]:
    """Lines of a Markdown table: error of the curvature's integral for small, middling and large loops."""
    frames = next(iter(errors.values())).frames
    lines = [f"| loop | twist [deg] | net rotation [deg] | {' | '.join(f'{f} [deg]' for f in frames)} |"]
    lines += ["|" + " --- |" * (3 + len(frames))]
    for name, e in errors.items():
        for i in (0, len(e.size) // 2, len(e.size) - 1):
            cells = [f"{value:.2g}" for value in np.rad2deg(e.miss[:, i])]
            twist, angle = np.rad2deg(e.size[i] * FULL_TWIST), np.rad2deg(e.angle[i])
            lines.append(f"| {name} | {twist:.3g} | {angle:.3g} | {' | '.join(cells)} |")
    return lines


if __name__ == "__main__":
    run(main, options(__doc__))

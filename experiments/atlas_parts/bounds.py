"""Question 4: no loop that turns the base by an angle has less joint travel than this; how far are the answers from it?

The net rotation of a loop is the ordered product of the turns `exp(F dA)` over any surface that spans it, each carried
back to the start (non-Abelian Stokes; R. L. Hatton and H. Choset, Eur. Phys. J. Special Topics 224, 2015). Carrying
back does not change an angle, and angles of products do not exceed the sum of the angles. So a turn by `angle` needs a
spanning surface with

    angle <= integral of |F(u, v)| dA.

The box of joint limits is convex, so the surface may be the loop's cone or its surface of least area:

    the cone over the start:   angle <= K1 T^2 / 8,        K1 the largest |F_ik| of two joints,
    least area:                angle <= K2 T^2 / (4 pi),   K2 the largest |F(u, v)| of two perpendicular units,

T being the joint travel, which bounds the Euclidean length that the isoperimetric inequality asks for. In the first,
`|F(r, dr)| <= K1 |r|_1 |dr|_1` and `|r|_1` is at most the travel from the start and to the end. Repeats are one loop.

K1 and K2 are the largest values found over the box, by random postures and a local search: nothing proves that there
is no larger one. What is proven is the step from them to the travel.
"""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np
from common.markdown import table

import reojax
from atlas_parts.store import Row, Store
from atlas_parts.subjects import Subject, box_of
from atlas_parts.turns import answers

_BATCH = 512
_NEAR = 24
"""Rounds of the local search."""


class Largest(NamedTuple):
    """Largest curvature that was found over a box."""

    of_joints: float
    """K1 [rad/rad^2]."""
    of_directions: float
    """K2 [rad/rad^2]."""
    posture: np.ndarray
    """(j,) where K2 is [rad]."""


def largest_curvature(
    robot: reojax.Robot, low: np.ndarray, high: np.ndarray, *, postures: int, seed: int = 0
) -> Largest:
    """Largest curvature of the connection over the box from `low` to `high` (j,) [rad]."""
    rng = np.random.default_rng(seed)
    form = jax.jit(jax.vmap(lambda theta: reojax.curvature(robot, theta)))

    def look(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = np.asarray(form(theta))
        return np.sqrt((found**2).sum(1)).max((1, 2)), _of_directions(found)

    places, joints, directions = [], [], []
    for _ in range(max(1, postures // _BATCH)):
        theta = rng.uniform(low, high, (_BATCH, len(low)))
        corner = rng.random(theta.shape)
        theta = np.where(corner < 0.1, low, np.where(corner > 0.9, high, theta))  # faces of the box, too
        one, two = look(theta)
        keep = np.argsort(one)[-2:], np.argsort(two)[-2:]
        places += [*theta[keep[0]], *theta[keep[1]]]
        joints += [*one[keep[0]], *one[keep[1]]]
        directions += [*two[keep[0]], *two[keep[1]]]
    best = [[max(values), places[int(np.argmax(values))]] for values in (joints, directions)]
    for size in np.geomspace(0.3, 1e-3, _NEAR):
        half = _BATCH // 2
        centres = np.repeat([best[0][1], best[1][1]], half, axis=0)
        theta = np.clip(centres + size * (high - low) * rng.normal(size=centres.shape), low, high)
        for entry, values in zip(best, look(theta), strict=True):
            if values.max() > entry[0]:
                entry[:] = [values.max(), theta[int(values.argmax())]]
    return Largest(float(best[0][0]), float(best[1][0]), best[1][1])


def _of_directions(form: np.ndarray, rounds: int = 30) -> np.ndarray:
    """max |F(u, v)| (m,) over unit u, v of forms (m, 3, j, j): alternately the best n, and the best u and v for it.

    `|F(u, v)|` is the largest of `n . F(u, v)` over unit n, and for one n that is the largest singular value. Starts
    from the three axes; climbs only, so what it ends at is a value that is taken.
    """
    best = np.zeros(len(form))
    for axis in range(3):
        n = np.zeros((len(form), 3))
        n[:, axis] = 1.0
        value = np.zeros(len(form))
        for _ in range(rounds):
            u, s, v = np.linalg.svd(np.einsum("ma,maik->mik", n, form))
            turned = np.einsum("maik,mi,mk->ma", form, u[:, :, 0], v[:, 0])
            size = np.linalg.norm(turned, axis=1)
            if (size - value).max() < 1e-6 * size.max():
                break
            value, n = size, turned / np.maximum(size, 1e-300)[:, None]
        best = np.maximum(best, value)
    return best


def least_travel(angle: float, largest: Largest) -> float:
    """Joint travel that a turn by `angle` [rad] takes at the least [rad], if the curvature is nowhere larger."""
    cone = np.sqrt(8 * angle / largest.of_joints) if largest.of_joints else np.inf
    disc = np.sqrt(4 * np.pi * angle / largest.of_directions) if largest.of_directions else np.inf
    return float(max(cone, disc))


def bound_of(subject: Subject, turns: Row, *, quick: bool = False) -> Row:
    """Lower bounds for the turns of question 1, and the gaps of the travels found to them."""
    largest = largest_curvature(subject.robot, *box_of(subject), postures=2048 if quick else 16384)
    rows = {}
    for name, row in turns["turns"].items():
        least = least_travel(np.deg2rad(float(name.split()[1])), largest)
        rows[name] = {"least_deg": float(np.rad2deg(least))}
        for what, found in (("clear", row), ("free", row["free"])):
            if found["reached"] and found["travel_deg"] > 0:
                rows[name][f"{what}_over_bound"] = found["travel_deg"] / rows[name]["least_deg"]
    return {
        "of_joints": largest.of_joints,
        "of_directions": largest.of_directions,
        "posture": largest.posture.tolist(),
        "turns": rows,
    }


def jobs(subjects: list[Subject], store: Store, quick: bool) -> list[tuple[str, Callable[[], Row]]]:
    """A row for each robot of question 1."""
    turned = answers(store.under("turns"))
    return [(s.name, lambda s=s: bound_of(s, turned[s.name], quick=quick)) for s in subjects if s.name in turned]


def show(rows: dict[str, Row], out: Path) -> None:
    """Print the table: bounds, and how many times as much was found."""
    print("\nlower bounds of joint travel, and the travel found over them (without a clearance)\n")
    print(table(["robot", "K1", "K2", "90 deg: bound [deg]", "180 deg: bound [deg]", "roll", "pitch", "yaw"], [
        [name, f"{row['of_joints']:.3g}", f"{row['of_directions']:.3g}",
         *(f"{row['turns'].get(f'yaw {angle}', {}).get('least_deg', np.nan):.0f}" for angle in (90, 180)),
         *(_gap(row["turns"], axis) for axis in ("roll", "pitch", "yaw"))]
        for name, row in rows.items()
    ]))  # fmt: skip


def _gap(turns: Row, axis: str) -> str:
    """`90: clear (free); 180: ...`, times the bound."""
    cells = []
    for angle in (90, 180):
        row = turns.get(f"{axis} {angle}", {})
        if "clear_over_bound" in row:
            free = f" ({row['free_over_bound']:.1f})" if "free_over_bound" in row else ""
            cells.append(f"{row['clear_over_bound']:.1f}{free}")
    return "; ".join(cells)

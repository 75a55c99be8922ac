"""Which loop, feet and gears turn the thesis's robot by 180 degrees about roll with the least joint travel?

    python experiments/design_opt.py                # about half a minute on 2 cores, compilation included
    python experiments/design_opt.py --target 120 --quick

Manoeuvre A on the prototype. Variables, all bounded: twist (0 to 270 degrees), bend (0 to 120 degrees), inertia of
the end links about their joints (10 to 190 kg mm^2) and gear ratio (1 to 48). Least joint travel `4 twist + 2 bend`
subject to roll = target, by an augmented Lagrangian: Adam (optax) on its gradient through `net_rotation`, many
starts side by side, the multiplier updated between rounds; at the end variables at a bound are put onto it, and the
roll is put right by Newton steps along its gradient.

Expected: gears and feet that couple more need less travel, so the gear ratio ends at its bound; the end link
inertia ends near where the thesis saw its gain turn into a loss (figure 2.8).
"""

import sys
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from _script import options, run
from matplotlib.figure import Figure
from tqdm import tqdm

import reojax
from reojax import plot, so3
from reojax._output import check_writable, write_json
from reojax.robots import prototype, with_end_inertia, with_gear_ratio

NAMES = ("twist", "bend", "end inertia", "gear ratio")
UNITS = ("deg", "deg", "kg mm^2", "")
TO_SI = np.array([np.pi / 180, np.pi / 180, 1e-6, 1.0])
LOWER = np.array([0.0, 0.0, 10.0, 1.0])
UPPER = np.array([270.0, 120.0, 190.0, 48.0])
THESIS = np.array([270.0, 120.0, 70.0, 24.0])
SEED = 2019
BATCH = 64
PENALTY, ROUNDS, STEPS_PER_ROUND = 300.0, 20, 50


class Outcome(NamedTuple):
    """What a design does; of many designs when its fields have them in front."""

    roll: Any
    """Roll of the base [rad], within half a turn of the target."""
    off_axis: Any
    """Angle by which the roll axis is tipped [rad]."""
    travel: Any
    """Sum of the angles that the joints move through [rad]."""


class Evaluation(NamedTuple):
    """An outcome, with gradients by the design scaled to the unit box."""

    outcome: Outcome
    roll_slope: Any
    travel_slope: Any


def _outcome(unit: jax.Array, target: jax.Array) -> Outcome:
    """Run manoeuvre A on the prototype of a design (4,), scaled to the unit box."""
    twist, bend, inertia, ratio = (LOWER + (UPPER - LOWER) * unit) * TO_SI
    robot = with_gear_ratio(with_end_inertia(prototype(), inertia), ratio)
    path = reojax.manoeuvre_a(twist, bend)
    w, x, y, z = so3.to_quaternion(reojax.net_rotation(robot, path))
    # R = tilt Rz(roll): in the quaternion of R Rz(-target), roll - target = 2 atan2(z, w), without a jump near target
    c, s = jnp.cos(0.5 * target), jnp.sin(0.5 * target)
    cosine, sine = w * c + z * s, z * c - w * s
    side = jnp.where(cosine < 0, -1.0, 1.0)
    roll = target + 2 * jnp.arctan2(side * sine, side * cosine)
    off_axis = 2 * jnp.arctan2(jnp.hypot(x, y), jnp.hypot(w, z))
    return Outcome(roll, off_axis, reojax.joint_travel(path))


@jax.jit
@partial(jax.vmap, in_axes=(0, None))
def _evaluate(unit: jax.Array, target: jax.Array) -> Evaluation:
    """Evaluate a batch of designs. The one large program here: everything goes through it in batches of one size."""

    def roll(unit: jax.Array) -> tuple[jax.Array, Outcome]:
        result = _outcome(unit, target)
        return result.roll, result

    (_, result), roll_slope = jax.value_and_grad(roll, has_aux=True)(unit)
    return Evaluation(result, roll_slope, jax.grad(lambda unit: _outcome(unit, target).travel)(unit))


def evaluate(units: np.ndarray, target: float) -> Evaluation:
    """Evaluate designs (m, 4), scaled to the unit box, for the roll `target` [rad]."""
    padded = np.resize(units, (-(-len(units) // BATCH) * BATCH, units.shape[1]))
    parts = [jax.tree.map(np.asarray, _evaluate(batch, target)) for batch in padded.reshape(-1, BATCH, units.shape[1])]
    return jax.tree.map(lambda *fields: np.concatenate(fields)[: len(units)], *parts)


def scaled(design: np.ndarray) -> np.ndarray:
    """Scale designs (m, 4), in the units of `UNITS`, to the unit box."""
    return (design - LOWER) / (UPPER - LOWER)


class Solution(NamedTuple):
    """Where the starts ended, all fields with the starts in front."""

    design: np.ndarray
    """(m, 4) in the units of `UNITS`."""
    outcome: Outcome
    miss: np.ndarray
    """Roll minus target [rad]."""
    slope: np.ndarray
    """Gradient of the Lagrangian by the variables that are free to move, relative to the travel's own."""
    converged: np.ndarray


def search(target: float, *, starts: int, steps: int) -> Solution:
    """Search from many starts at once for the design of least travel with the roll `target` [rad]."""
    unit = np.random.default_rng(SEED).uniform(0.05, 0.95, (starts, len(NAMES)))
    optimiser = optax.adam(optax.cosine_decay_schedule(0.03, steps, alpha=0.002))

    @jax.jit
    def update(unit, memory, slope):
        change, memory = optimiser.update(slope, memory)
        return optax.projections.projection_box(unit + change, 0.0, 1.0), memory

    memory = optimiser.init(jnp.asarray(unit))
    multiplier = np.zeros(starts)
    for step in tqdm(range(steps), desc=f"{starts} starts", unit="step", file=sys.stderr, mininterval=0.5):
        now = evaluate(unit, target)
        miss = now.outcome.roll / target - 1
        if step % STEPS_PER_ROUND == STEPS_PER_ROUND - 1:
            multiplier += PENALTY * miss
        slope = now.travel_slope + (multiplier + PENALTY * miss)[:, None] * now.roll_slope / target
        unit, memory = jax.tree.map(np.asarray, update(unit, memory, slope))
    return _finish(unit, target)


def _finish(unit: np.ndarray, target: float) -> Solution:
    """Put variables that press on a bound onto it, put the roll right, and say how good the designs are."""
    near = 1e-3
    pressing, _ = _lagrangian_slope(np.clip(unit, near / 2, 1 - near / 2), target)
    at_lower, at_upper = (unit < near) & (pressing > 0), (unit > 1 - near) & (pressing < 0)
    unit = np.where(at_lower, 0.0, np.where(at_upper, 1.0, unit))
    for _ in range(8):
        now = evaluate(unit, target)
        miss = now.outcome.roll - target
        slope = np.where(at_lower | at_upper, 0.0, now.roll_slope)
        unit = np.clip(unit - miss[:, None] * slope / np.maximum((slope**2).sum(1, keepdims=True), 1e-12), 0, 1)
    gradient, now = _lagrangian_slope(unit, target)
    held = ((unit == 0) & (gradient > 0)) | ((unit == 1) & (gradient < 0))
    slope = np.linalg.norm(np.where(held, 0.0, gradient), axis=1)
    miss = now.outcome.roll - target
    design = LOWER + (UPPER - LOWER) * unit
    return Solution(design, now.outcome, miss, slope, (abs(miss) < 1e-9) & (slope < 1e-2))


def _lagrangian_slope(unit: np.ndarray, target: float) -> tuple[np.ndarray, Evaluation]:
    """Gradient of travel + multiplier * miss, the multiplier fitted to the variables off their bounds."""
    now = evaluate(unit, target)
    inside = (unit > 0) & (unit < 1)
    fit = (inside * now.roll_slope * now.travel_slope).sum(1) / np.maximum((inside * now.roll_slope**2).sum(1), 1e-12)
    gradient = now.travel_slope - fit[:, None] * now.roll_slope
    return gradient / np.linalg.norm(now.travel_slope, axis=1, keepdims=True), now


class Sensitivity(NamedTuple):
    """d(roll)/d(variable) at a design [rad per unit of `UNITS`], by gradient and by central differences."""

    gradient: np.ndarray
    difference: np.ndarray


def sensitivity(design: np.ndarray) -> Sensitivity:
    """Differentiate the roll, and check against differences over 1e-5 of each variable's range."""
    step = 1e-5
    unit = scaled(design)
    now = evaluate(np.stack([unit, *(unit + step * np.eye(4)), *(unit - step * np.eye(4))]), np.pi)
    forward, backward = now.outcome.roll[1:].reshape(2, 4)
    scale = UPPER - LOWER
    return Sensitivity(now.roll_slope[0] / scale, (forward - backward) / (2 * step) / scale)


def main(out: Path, *, quick: bool = False, target: float = 180.0) -> dict:
    """Print the two designs and the sensitivities, write `design_opt.json` and `design_opt.png`."""
    if not 0 < target < 360:
        raise ValueError(f"`--target` is {target:g}; it must be a roll between 0 and 360 degrees.")
    picture, record = plot.check_picture(out / "design_opt.png"), check_writable(out / "design_opt.json")
    found = search(np.deg2rad(target), starts=16 if quick else BATCH, steps=ROUNDS * STEPS_PER_ROUND)
    best: Solution = jax.tree.map(lambda field: field[_best(found)], found)
    thesis: Outcome = jax.tree.map(lambda field: field[0], evaluate(scaled(THESIS)[None], np.pi).outcome)
    slopes = sensitivity(THESIS)

    at_best = int((found.converged & (found.outcome.travel < best.outcome.travel * (1 + 1e-6))).sum())
    print(f"\nManoeuvre A on the prototype, target roll {target:g} deg, least joint travel\n")
    _print_table(thesis, best)
    print(f"\nof {len(found.miss)} starts {found.converged.sum()} converged, {at_best} to the best design")
    _print_sensitivity(slopes)
    answer = {
        "target_deg": target,
        "converged": bool(best.converged),
        "starts": len(found.miss),
        "starts_at_best": at_best,
        "best": _record(best.design, best.outcome) | {"miss_rad": float(best.miss), "slope": float(best.slope)},
        "thesis": _record(THESIS, thesis),
        "roll_sensitivity_at_thesis": {
            name: {"unit": f"rad/{unit}" if unit else "rad", "gradient": float(g), "difference": float(d)}
            for name, unit, g, d in zip(NAMES, UNITS, *slopes, strict=True)
        },
    }
    plot.save(_picture(thesis, best, target, grid=24 if quick else 48), picture)
    write_json(record, answer)
    print(f"\nwrote {picture} and {record}")
    return answer


def _best(found: Solution) -> int:
    """Index of the least travel that converged, else of the least miss."""
    if found.converged.any():
        return int(np.argmin(np.where(found.converged, found.outcome.travel, np.inf)))
    return int(np.argmin(np.where(np.isnan(found.miss), np.inf, np.abs(found.miss))))


def _record(design: np.ndarray, result: Outcome) -> dict[str, float]:
    values = {name.replace(" ", "_"): float(v) for name, v in zip(NAMES, design, strict=True)}
    return values | {f"{name}_deg": float(np.rad2deg(angle)) for name, angle in result._asdict().items()}


def _print_table(thesis: Outcome, best: Solution) -> None:
    rows: list[tuple[str, ...]] = [("", "thesis", "best")]
    for name, field in (("roll", "roll"), ("off-axis angle", "off_axis"), ("joint travel", "travel")):
        rows.append((f"{name} [deg]", *(f"{np.rad2deg(getattr(o, field)):.4f}" for o in (thesis, best.outcome))))
    for name, unit, *values in zip(NAMES, UNITS, THESIS, best.design, strict=True):
        rows.append((f"{name} [{unit}]" if unit else name, *(f"{v:.4f}" for v in values)))
    verdict = "yes" if best.converged else f"no: misses by {np.rad2deg(abs(best.miss)):.2g} deg, slope {best.slope:.1g}"
    rows.append(("converged", "", verdict))
    for row in rows:
        print("{:24}{:>12}{:>12}".format(*row))


def _print_sensitivity(slopes: Sensitivity) -> None:
    print("\nd(roll)/d(variable) at the thesis design")
    print(f"{'':24}{'gradient':>14}{'difference':>14}{'relative':>10}")
    for name, unit, g, d in zip(NAMES, UNITS, *slopes, strict=True):
        print(f"{f'{name} [rad/{unit}]' if unit else f'{name} [rad]':24}{g:14.8f}{d:14.8f}{abs(g / d - 1):10.1e}")


def _picture(thesis: Outcome, best: Solution, target: float, *, grid: int) -> Figure:
    """Roll over twist and bend with either robot, and over the end link inertia with either loop."""
    figure = Figure(figsize=(10.5, 4.6), layout="constrained", facecolor="white")
    left, right = figure.subplots(1, 2)
    twist, bend = np.meshgrid(np.linspace(0, 270, grid), np.linspace(0, 120, grid))
    inertias = np.linspace(LOWER[2], UPPER[2], 2 * BATCH)
    for name, design, result, colour in (
        ("thesis", THESIS, thesis, "#0072b2"),
        ("best", best.design, best.outcome, "#d55e00"),
    ):
        loops = np.stack([twist.ravel(), bend.ravel(), *np.broadcast_to(design[2:, None], (2, grid * grid))], axis=1)
        rolls = _roll(loops).reshape(grid, grid)
        left.clabel(left.contour(twist, bend, rolls, levels=range(30, 331, 30), colors=colour, alpha=0.4), fmt="%d°")
        left.contour(twist, bend, rolls, levels=[target], colors=colour, linewidths=2.2)
        label = f"{name}: {design[2]:.0f} kg mm², {design[3]:.0f}:1"
        left.plot(*design[:2], "o", color=colour, markersize=9, label=label, clip_on=False, zorder=5)
        feet = np.repeat(design[None], len(inertias), axis=0)
        feet[:, 2] = inertias
        right.plot(inertias, _roll(feet), color=colour, linewidth=2)
        label = f"{name}: {design[0]:.0f}° / {design[1]:.0f}°, {design[3]:.0f}:1"
        right.plot(design[2], np.rad2deg(result.roll), "o", color=colour, markersize=9, label=label, zorder=5)
    right.axhline(target, color="#888888", linewidth=1, linestyle=(0, (4, 3)))
    left.set(xlabel="twist [deg]", ylabel="bend [deg]", title=f"Roll of manoeuvre A; thick: {target:g}°")
    right.set(xlabel="end link inertia [kg mm²]", ylabel="roll [deg]", title="Roll against the feet's inertia")
    left.legend(loc="lower left", framealpha=0.95)
    right.legend(loc="lower right", framealpha=0.95)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _roll(design: np.ndarray) -> np.ndarray:
    """Roll [deg] of designs (m, 4), told between -90 and 270, which holds all of the box."""
    return np.rad2deg(evaluate(scaled(design), np.pi / 2).outcome.roll)


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--target", type=float, default=180.0, help="roll to reach [deg] (default: 180)")
    run(main, parser)

"""How certain a net rotation is: its derivatives by every number of the robot, and its spread under tolerances.

A small change of the net rotation R is written `dR = hat(turn) R`: `turn` is a rotation vector in the base's frame at
the start (inertial, if it starts aligned). `frame="end"` gives `R^T turn`, in the base's frame at the end.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax import so3
from reojax._internal import checks
from reojax._internal.arrays import Array, common_float
from reojax._internal.precision import in_double, warn_if_single
from reojax.design.tolerances import Sources, across, perturb, sources_of
from reojax.mechanics.holonomy import DEFAULT_STEPS, net_rotation
from reojax.mechanics.input_checks import check_path, check_robot, check_steps
from reojax.mechanics.own_units import without_names
from reojax.path import Path
from reojax.robot import Robot

Frame = Literal["start", "end"]
_FIELDS = {
    "mass": "kg",
    "com": "m",
    "inertia": "kg m^2",
    "axis": "rad",
    "anchor": "m",
    "rotor_inertia": "kg m^2",
    "gear_ratio": "",
}
_DRAWS = 4096
"""Most robots of the Monte Carlo check in one call."""
_ENTRIES = [("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2)]


class Sensitivities(NamedTuple):
    """Table of derivatives of the net rotation, the largest effect of a percent first."""

    name: tuple[str, ...]
    """Parameters: `mass[link]`, `com[link].x`, `inertia[link].xy`, `axis[joint].tilt1`, ..."""
    unit: tuple[str, ...]
    derivative: Float[np.ndarray, "k 3"]
    """Turn of the result per unit of the parameter [rad/unit]."""
    size: Float[np.ndarray, " k"]
    """What a hundred percent are, in `unit`: the parameter itself; of `com` and `anchor` the length of the vector; of
    `inertia` the largest of its diagonal; of `axis` one radian of tilt."""
    effect: Float[np.ndarray, " k"]
    """Turn of the result per percent of tolerance [rad]."""
    frame: str

    def __str__(self) -> str:
        lines = [f"turn [deg] of the result per percent, {self.frame} frame{'':8}x{'':9}y{'':9}z{'':6}size"]
        for name, unit, slope, size, effect in zip(
            self.name, self.unit, self.derivative, self.size, self.effect, strict=True
        ):
            turn = "".join(f"{np.rad2deg(0.01 * size * part):10.5f}" for part in slope)
            lines.append(f"{name:22}{np.rad2deg(effect):10.5f}   {turn}   {size:.4g} {unit}")
        return "\n".join(lines)


class Spread(NamedTuple):
    """Spread of the net rotation under independent errors, by the linear rule and by Monte Carlo."""

    covariance: Float[np.ndarray, "3 3"]
    """Of the turn [rad^2], linear rule: sum of `J_i J_i^T`, J_i the turn per standard deviation of error i."""
    deviation: Float[np.ndarray, " 3"]
    """Standard deviations of its components [rad]."""
    source: tuple[str, ...]
    share: Float[np.ndarray, " k"]
    """Part of the covariance's trace that each error makes."""
    sampled: Float[np.ndarray, "3 3"]
    """Mean of `turn turn^T` over the draws, about the nominal result [rad^2]."""
    sampled_mean: Float[np.ndarray, " 3"]
    """Mean turn of the draws [rad]: what the linear rule leaves out."""
    turns: Float[np.ndarray, "draws 3"]
    """Turns of the draws [rad]."""
    frame: str


@in_double
def sensitivities(robot: Robot, path: Path, *, frame: Frame = "start", steps: int = DEFAULT_STEPS) -> Sensitivities:
    """Differentiate the net rotation by every number of the robot that has an effect on it.

    Args:
        robot: the robot; numbers, not traced.
        path: the path in shape space.
        frame: frame of the turns, see this module.
        steps: steps per edge of `net_rotation`.

    Raises:
        ValueError: for an unknown frame, and as `net_rotation`.
    """
    _check_frame(frame)
    check_path(check_robot(robot), path)
    steps = check_steps("steps", steps)
    slopes, rotation = _slopes(without_names(robot), path, steps)
    rows = list(_rows(robot, slopes))
    derivative = np.stack([row[2] for row in rows])
    if frame == "end":
        derivative = derivative @ np.asarray(rotation)
    size = np.array([row[3] for row in rows])
    effect = 0.01 * size * np.linalg.norm(derivative, axis=1)
    order = np.argsort(-effect, kind="stable")
    return Sensitivities(
        name=tuple(rows[i][0] for i in order),
        unit=tuple(rows[i][1] for i in order),
        derivative=derivative[order],
        size=size[order],
        effect=effect[order],
        frame=frame,
    )


def spread(
    robot: Robot,
    path: Path,
    tolerances: Mapping[str, ArrayLike],
    *,
    draws: int = 1000,
    seed: int = 0,
    frame: Frame = "start",
    steps: int = DEFAULT_STEPS,
) -> Spread:
    """Spread of the net rotation for independent errors of the robot's numbers.

    Args:
        robot: the robot.
        path: the path in shape space.
        tolerances: standard deviations by field: relative for "mass" (the link's inertia goes with it), "inertia",
            "rotor_inertia" and "gear_ratio"; in m for "com" and "anchor", each component; in rad for "axis", two
            tilts. One number, or one for every link or joint.
        draws: robots drawn for the Monte Carlo check, normal errors (relative ones lognormal).
        seed: of the draw.
        frame: frame of the turns, see this module.
        steps: steps per edge of `net_rotation`.

    Raises:
        ValueError: for unknown fields, negative tolerances, an unknown frame, or too few draws.
    """
    _check_frame(frame)
    draws, seed = checks.whole("draws", draws, 2), checks.seed(seed)
    check_path(check_robot(robot), path)
    steps = check_steps("steps", steps)
    sources = sources_of(robot, tolerances)
    nominal = net_rotation(robot, path, steps=steps)
    jacobian = np.asarray(_jacobian(without_names(robot), path, sources, steps))  # (3, k)
    errors = np.random.default_rng(seed).normal(size=(draws, len(sources.name)))

    plain, rounds = without_names(robot), -(-draws // _DRAWS)
    rows = -(-draws // rounds)  # the last round is filled up: one program serves them all
    drawn = np.concatenate([errors, np.zeros((rounds * rows - draws, errors.shape[1]))]).reshape(rounds, rows, -1)
    turns = np.concatenate([np.asarray(_turns(plain, path, sources, part, nominal, steps)) for part in drawn])[:draws]
    if frame == "end":
        turns, jacobian = turns @ np.asarray(nominal), np.asarray(nominal).T @ jacobian
    covariance = jacobian @ jacobian.T
    shares = (jacobian**2).sum(0)
    return Spread(
        covariance=covariance,
        deviation=np.sqrt(np.diag(covariance)),
        source=sources.name,
        share=shares / max(shares.sum(), np.finfo(float).tiny),
        sampled=turns.T @ turns / draws,
        sampled_mean=turns.mean(0),
        turns=turns,
        frame=frame,
    )


def scatter(robot: Robot, path: Path, tolerances: Mapping[str, ArrayLike], *, steps: int = DEFAULT_STEPS) -> Array:
    """Mean square of the turn by the linear rule [rad^2], for use as an objective: traced, robot and path alike.

    The trace of `Spread.covariance`, with derivatives by the errors as central differences over a hundredth of their
    standard deviations, so that its own gradient needs first derivatives only. Right to 1e-8 relative or so in float64;
    in float32 it warns, as a tenth may be lost.

    Args:
        robot: the robot, with the numbers of the drawing.
        path: the path in shape space.
        tolerances: standard deviations by field, as for `spread`.
        steps: steps per edge, static.

    Raises:
        ValueError: as `spread`.

    Warns:
        UserWarning: in single precision.
    """
    check_path(check_robot(robot), path)
    warn_if_single("differences of a hundredth of a tolerance are not resolved", common_float(robot, path))
    sources, step = sources_of(robot, tolerances), 1e-2
    errors = step * jnp.concatenate([jnp.eye(len(sources.name)), -jnp.eye(len(sources.name))])
    turned = jax.vmap(lambda error: net_rotation(perturb(robot, sources, error), path, steps=steps))(errors)
    plus, minus = jnp.split(turned, 2)
    turns = jax.vmap(lambda a, b: so3.log(a @ b.T))(plus, minus)
    return ((turns / (2 * step)) ** 2).sum()


@partial(jax.jit, static_argnums=2)
def _slopes(robot: Robot, path: Path, steps: int) -> tuple[Robot, Array]:
    nominal = net_rotation(robot, path, steps=steps)
    turn = jax.jacrev(lambda robot: so3.log(net_rotation(robot, path, steps=steps) @ nominal.T))
    return turn(robot), nominal


@partial(jax.jit, static_argnums=(2, 5))
def _turns(
    robot: Robot, path: Path, sources: Sources, errors: Float[Array, "d k"], nominal: Float[Array, "3 3"], steps: int
) -> Float[Array, "d 3"]:
    """Turns from the nominal result of robots with errors, in standard deviations."""

    def turn(error: Array) -> Array:
        return so3.log(net_rotation(perturb(robot, sources, error), path, steps=steps) @ nominal.T)

    return jax.vmap(turn)(errors)


@partial(jax.jit, static_argnums=(2, 3))
def _jacobian(robot: Robot, path: Path, sources: Sources, steps: int) -> Array:
    nominal = net_rotation(robot, path, steps=steps)

    def turn(error: Array) -> Array:
        return so3.log(net_rotation(perturb(robot, sources, error), path, steps=steps) @ nominal.T)

    return jax.jacrev(turn)(jnp.zeros(len(sources.name), nominal.dtype))


def _rows(robot: Robot, slopes: Robot) -> Iterator[tuple[str, str, np.ndarray, float]]:
    """Name, unit, derivative (3,) and size of every parameter."""
    for field, unit in _FIELDS.items():
        value, slope = np.asarray(getattr(robot, field)), np.asarray(getattr(slopes, field))
        for i in range(len(value)):
            if field == "inertia":
                largest = np.diag(value[i]).max()
                for entry, a, b in _ENTRIES:
                    both = slope[:, i, a, b] + (slope[:, i, b, a] if a != b else 0)
                    yield f"inertia[{i}].{entry}", unit, both, float(largest)
            elif field == "axis":
                length = np.linalg.norm(value[i])
                for number, side in enumerate(np.asarray(across(value[i] / length))):
                    yield f"axis[{i}].tilt{number + 1}", unit, slope[:, i] @ side * length, 1.0
            elif value.ndim == 2:
                for entry, a in (("x", 0), ("y", 1), ("z", 2)):
                    yield f"{field}[{i}].{entry}", unit, slope[:, i, a], float(np.linalg.norm(value[i]))
            else:
                yield f"{field}[{i}]", unit, slope[:, i], float(abs(value[i]))


def _check_frame(frame: str) -> None:
    checks.one_of("frame", frame, ("start", "end"))

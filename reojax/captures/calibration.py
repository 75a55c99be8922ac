"""Fit a robot's numbers to a capture: joint angles in, orientation of the base compared, by least squares.

The measured joint angles, joined by straight edges, give the orientation by the momentum equation. Its distance from
the measured one, frame by frame, is the residual

    rho_i = log(M_i (G R_i(x))^T),

`M_i` the measured orientation, `R_i` the simulated one for the parameters x, `G` the frame of the cameras. Each edge
turns the base by `exp(phi_k)`; with `delta_k`, the effect of x on it in the base frame, the derivative of `R_i` is a
running sum, `d rho_i = -G sum_{k<i} R_{k+1} delta_k`, so all derivatives cost about one pass along the capture.

What the fit does not know has two sources: the scatter of the residuals, and the noise of the joint angles, which
pushes all later orientations the same way. The covariance has both.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from reojax._internal import checks
from reojax._internal.precision import in_double
from reojax.captures.capture import Capture
from reojax.captures.fit import FitProblem, FitState
from reojax.captures.parameters import Parameter, resolve
from reojax.optimisation.status import Status
from reojax.robot import Robot

SINGULAR = 1e-6
"""Smallest singular value of the derivatives, columns of length one, that counts as telling parameters apart."""
VAGUE = 0.5
"""Standard deviation, as a share of a parameter's scale (or of a positive one's value, if that is smaller), beyond
which the capture does not determine it."""


class Calibration(NamedTuple):
    """Fitted parameters and how well they are known."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    start: Float[np.ndarray, " p"]
    """Values before the fit."""
    values: Float[np.ndarray, " p"]
    """Fitted values."""
    std: Float[np.ndarray, " p"]
    """Standard deviations; infinite for parameters that the capture cannot tell apart."""
    covariance: Float[np.ndarray, "p p"]
    """Of the parameters; frame and clock are accounted for. NaN where the standard deviation is infinite."""
    robot: Robot
    """The robot with the fitted values."""
    frame: Float[np.ndarray, "3 3"]
    """Orientation of the first joint frame's base in the cameras' frame."""
    offset: float
    """Time by which the cameras' clock is ahead of the joints' [s]."""
    offset_std: float
    rms_before: float
    """RMS angle between measured and simulated orientation at the start values, frame and clock fitted [rad]."""
    rms: float
    """The same at the fitted values."""
    joint_noise: float
    """Standard deviation of the joint angles' noise that was reckoned with [rad]."""
    condition: float
    """Ratio of the largest to the smallest singular value of the derivatives, columns scaled to length one."""
    identifiable: tuple[bool, ...]
    """For each parameter, whether its standard deviation is below half its scale, or value."""
    warning: str
    """What the capture does not tell, in words; empty if all is well."""
    converged: bool
    """Whether the fit came to rest before it was out of steps."""
    steps: int
    """Evaluations of the residuals that it took."""

    def __str__(self) -> str:
        """Each number before and after the fit, with its standard deviation, and how it ended."""
        lines = [
            f"{name}: {before:.6g} -> {after:.6g} +- {std:.2g} {unit}".rstrip()
            for name, before, after, std, unit in zip(
                self.names, self.start, self.values, self.std, self.units, strict=True
            )
        ]
        angles = f"RMS angle {self.rms_before:.3g} -> {self.rms:.3g} rad"
        return "\n".join([*lines, f"{angles} in {self.steps} evaluations; {self.message}"])

    @property
    def value(self) -> Float[np.ndarray, " p"]:
        """The fitted values, under the name that all solvers' results have."""
        return self.values

    @property
    def cost(self) -> float:
        """The RMS angle that is left [rad]."""
        return self.rms

    @property
    def error(self) -> Float[np.ndarray, " p"]:
        """The standard deviations."""
        return self.std

    @property
    def violation(self) -> float:
        """How far a value is below 0 that must be positive: 0, as none ever is."""
        return 0.0

    @property
    def status(self) -> Status:
        """Converged, out of steps, or not finite; what the capture does not tell is in `warning`."""
        if not np.isfinite(self.rms):
            return Status.NOT_FINITE
        return Status.CONVERGED if self.converged else Status.OUT_OF_STEPS

    @property
    def message(self) -> str:
        """How it ended, and what the capture does not tell, in words."""
        return f"{self.status.text}; {self.warning}" if self.warning else self.status.text


@in_double
def calibrate(
    robot: Robot,
    capture: Capture,
    parameters: Iterable[str | Parameter] = ("end_inertia",),
    *,
    clock: bool = True,
    joint_noise: float | None = None,
    max_steps: int = 50,
) -> Calibration:
    """Fit parameters of a robot to a capture that has joint angles and orientation.

    Args:
        robot: the robot, with the values to start from.
        capture: what was measured.
        parameters: names ("end_inertia", "rotor_inertia", "gear_ratio", or entries such as "com[0,2]"), or
            `Parameter`s of your own. Scaling all masses and inertias together changes nothing that can be measured.
        clock: fit a shift between the clocks of joints and cameras too. The frame of the cameras is always fitted.
        joint_noise: standard deviation of the joint angles' noise [rad]; default from their fourth differences.
        max_steps: most evaluations of SciPy's `least_squares`.

    Raises:
        ValueError: if the capture lacks joints or orientation, or does not fit the robot, or for an unknown parameter.
    """
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    checks.whole("max_steps", max_steps)
    if not isinstance(clock, bool | np.bool_):
        raise ValueError(f"`clock` is {checks.shorten(clock)}; it must be True or False.")
    fitted = resolve(robot, parameters)
    problem = FitProblem(robot, capture, fitted, clock)
    noise = (
        _joint_noise(capture)
        if joint_noise is None
        else checks.number("joint_noise", joint_noise, unit="rad", least=0, most=np.pi)
    )

    start = np.array([p.start for p in fitted])
    begun = problem.fit_window(start)
    if problem.clock and noise:
        problem.blur = problem.blur_of(begun, noise)
    state, converged, steps = problem.fit(begun, max_steps)
    if problem.clock and noise and converged and steps < max_steps:  # the blur is that of the fitted robot now
        problem.blur = problem.blur_of(state, noise)
        state, converged, more = problem.fit(state, max_steps - steps)
        steps += more
    return _report(problem, state, noise, begun.rms, converged, steps, start)


def _report(
    problem: FitProblem, state: FitState, noise: float, before: float, converged: bool, steps: int, start: np.ndarray
) -> Calibration:
    """Covariance and verdict at the end of the fit."""
    # singular values of the Jacobian, its columns of length one: what is small was not seen
    p = len(state.x)
    jacobian = state.derivative.reshape(-1, state.derivative.shape[-1])
    lengths = np.linalg.norm(jacobian, axis=0)
    lengths = np.where(lengths > 0, lengths, 1.0)
    _, singular, directions = np.linalg.svd(jacobian / lengths, full_matrices=False)
    known = singular > SINGULAR * singular[0]
    lost = (np.abs(directions[~known]) > 0.01).any(axis=0) | (np.linalg.norm(jacobian, axis=0) == 0)
    # (J^T J)^-1 over what was seen
    inverse = (directions[known].T / singular[known] ** 2) @ directions[known] / np.outer(lengths, lengths)
    # noise of the orientations, by what is left, and of the joints, by how it pushes the normal equations
    spread = state.cost / max(1, jacobian.shape[0] - jacobian.shape[1])
    pull = noise * problem.push(state)
    unit = np.concatenate([problem.scale, np.ones(jacobian.shape[1] - p)])
    covariance = (spread * inverse + inverse @ (pull @ pull.T) @ inverse) * np.outer(unit, unit)
    std = np.where(lost, np.inf, np.sqrt(np.diag(covariance)))
    covariance[lost, :] = covariance[:, lost] = np.nan
    # the robot, and which of its numbers are worth something
    robot = problem.robot
    for parameter, value in zip(problem.fitted, state.x, strict=True):
        robot = parameter.put(robot, value)
    positive = np.array([parameter.positive for parameter in problem.fitted])
    size = np.where(positive, np.minimum(problem.scale, state.x), problem.scale)
    identifiable = tuple(bool(known) for known in std[:p] < VAGUE * size)
    names = tuple(parameter.name for parameter in problem.fitted)
    return Calibration(
        names=names,
        units=tuple(parameter.unit for parameter in problem.fitted),
        start=start,
        values=state.x,
        std=std[:p],
        covariance=covariance[:p, :p],
        robot=robot,
        frame=state.frame,
        offset=state.offset,
        offset_std=float(std[-1]) if problem.clock else 0.0,
        rms_before=before,
        rms=state.rms,
        joint_noise=noise,
        condition=float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf,
        identifiable=identifiable,
        warning=_warning(names, lost[:p], identifiable),
        converged=converged,
        steps=steps,
    )


def _warning(names: tuple[str, ...], lost: np.ndarray, identifiable: tuple[bool, ...]) -> str:
    confused = [name for name, is_lost in zip(names, lost, strict=True) if is_lost]
    vague = [name for name, good in zip(names, identifiable, strict=True) if not good and name not in confused]
    parts = []
    if confused:
        apart = "cannot be told apart" if len(confused) > 1 else "has no effect of its own"
        parts.append(f"{' and '.join(confused)} {apart} by this capture")
    if vague:
        parts.append(f"{' and '.join(vague)} {'are' if len(vague) > 1 else 'is'} hardly determined by this capture")
    return "; ".join(parts)


def _joint_noise(capture: Capture) -> float:
    """Standard deviation of white noise in the joint angles [rad], from fourth differences of even frames."""
    step = np.diff(capture.time)
    even = np.abs(step - np.median(step)) < 0.05 * np.median(step)
    runs = np.flatnonzero(even[:-3] & even[1:-2] & even[2:-1] & even[3:])
    if not runs.size:
        return 0.0
    # white noise of variance s^2 has fourth differences of variance 70 s^2 (1 + 16 + 36 + 16 + 1)
    windows = np.asarray(capture.theta)[runs[:, None] + np.arange(5)]
    differences = np.einsum("w,rwj->rj", np.array([1.0, -4, 6, -4, 1]), windows)
    differences = differences[np.isfinite(differences)]
    # the median of |x| is 1 / 1.4826 of the standard deviation, whatever a few outliers do
    return float(1.4826 * np.median(np.abs(differences)) / np.sqrt(70)) if differences.size else 0.0

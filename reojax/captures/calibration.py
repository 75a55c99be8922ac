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
from functools import lru_cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal import checks
from reojax._internal.arrays import Array
from reojax._internal.precision import in_double
from reojax.captures.alignment import align_frames, interpolate
from reojax.captures.capture import Capture
from reojax.captures.orientation import chain, edge_turn, fill_gaps, fill_up, steps_needed
from reojax.captures.parameters import Parameter, Put, resolve
from reojax.mechanics.own_units import without_names
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
    problem = _Problem(robot, capture, fitted, clock)
    noise = _joint_noise(capture) if joint_noise is None else checks.number("joint_noise", joint_noise, unit="rad")
    if not noise >= 0:
        raise ValueError(
            f"`joint_noise` is {checks.shorten(joint_noise)}; it must be a finite angle in radians, not negative."
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
    return problem.report(state, noise, begun.rms, converged, steps, start)


class _State(NamedTuple):
    """Everything at one set of parameters, frame and shift."""

    x: np.ndarray
    frame: np.ndarray
    offset: float
    cost: float
    rms: float
    residual: np.ndarray
    """(f, 3) in the cameras' frame."""
    derivative: np.ndarray
    """(f, 3, p + 3 or 4): by scaled parameters, frame, shift."""
    turned: np.ndarray
    """(m, 3, 3) simulated orientation at all frames."""
    joint_effect: np.ndarray
    """(m - 1, 3, 2 j): turn, seen from the start, by which a change of an edge's two ends moves all that follows."""


class _Problem:
    """A capture and the parameters to be fitted to it."""

    def __init__(self, robot: Robot, capture: Capture, fitted: tuple[Parameter, ...], clock: bool) -> None:
        if not isinstance(capture, Capture):
            raise ValueError(f"`capture` is a {type(capture).__name__}; it must be a Capture.")
        if capture.theta is None or not capture.seen_rotation.any():
            raise ValueError("a calibration needs joint angles and orientation; the capture lacks one of them.")
        if capture.theta.shape[1] != robot.joints:
            raise ValueError(f"the capture has {capture.theta.shape[1]} joints; {robot.name!r} has {robot.joints}.")
        theta = fill_gaps(capture)
        self.robot, self.fitted, self.clock, self.time = robot, fitted, bool(clock), capture.time
        self.seen = np.flatnonzero(capture.seen_rotation)
        self.measured = np.asarray(capture.rotation)[self.seen]
        self.edges = len(theta) - 1
        self.theta, self.steps = fill_up(theta), steps_needed(robot, theta)
        self.scale = np.array([p.scale for p in fitted])
        self.blur = np.zeros(self.edges)
        """(m - 1,) squared noise of the simulated orientation at the ends of each edge, both together [rad^2]."""
        unknowns = len(fitted) + 3 + clock
        if 3 * len(self.seen) <= unknowns:
            raise ValueError(f"{len(self.seen)} frames with an orientation cannot determine {unknowns} numbers.")

    def fit_window(self, x: np.ndarray) -> _State:
        """The state at the parameters `x`, frame and shift at their best."""
        turned, _ = self._orientation(x)
        state = self._state(x, align_frames(self.measured, turned[self.seen]), 0.0)
        return self.fit(state, 20, fixed=True)[0]

    def fit(self, begun: _State, most: int, fixed: bool = False) -> tuple[_State, bool, int]:
        """The state of least squares from `begun` on, whether it converged, and the evaluations that it took.

        The unknowns are the parameters by their scales (none if `fixed`), a rotation vector from the frame of `begun`,
        and the shift. The trust region of SciPy's method takes columns of the derivatives at length one.
        """
        from scipy.optimize import least_squares
        from scipy.spatial.transform import Rotation

        p = 0 if fixed else len(begun.x)

        @lru_cache(maxsize=2)  # residuals and derivatives are asked for at the same place
        def state_of(unknowns: tuple[float, ...]) -> _State:
            x = begun.x if fixed else np.array(unknowns[:p]) * self.scale
            frame = Rotation.from_rotvec(unknowns[p : p + 3]).as_matrix() @ begun.frame
            return self._state(x, frame, unknowns[p + 3] if self.clock else 0.0)

        def state_at(unknowns: np.ndarray) -> _State:
            return state_of(tuple(unknowns.tolist()))

        def residual(unknowns: np.ndarray) -> np.ndarray:
            state = state_at(unknowns)
            return np.append(state.residual.ravel(), self._lost_blur(state.offset)[0])

        def jacobian(unknowns: np.ndarray) -> np.ndarray:
            columns = state_at(unknowns).derivative.copy()
            parts = len(begun.x)
            turn = np.asarray(so3.left_jacobian(unknowns[p : p + 3]))  # of the frame, by its rotation vector
            columns[..., parts : parts + 3] = columns[..., parts : parts + 3] @ turn
            rows = columns[..., parts - p :].reshape(-1, columns.shape[-1] - parts + p)
            last = np.zeros((len(columns), rows.shape[1]))
            if self.clock:
                last[:, -1] = self._lost_blur(unknowns[-1])[1]
            return np.concatenate([rows, last])

        most_shift = 0.25 * float(np.ptp(self.time))
        lower = [0.0 if parameter.positive else -np.inf for parameter in self.fitted[:p]] + [-np.inf] * 3
        upper = [np.inf] * (p + 3)
        first = np.concatenate([begun.x[:p] / self.scale[:p], np.zeros(3)])
        if self.clock:
            lower, upper, first = [*lower, -most_shift], [*upper, most_shift], np.append(first, begun.offset)
        rules: dict[str, Any] = {"x_scale": "jac", "ftol": 1e-10, "xtol": 1e-10, "gtol": None, "max_nfev": most}
        # SciPy's types have no function for the derivatives
        found = least_squares(residual, first, jacobian, (lower, upper), **rules)  # pyright: ignore[reportArgumentType]
        return state_at(found.x), bool(found.status > 0), int(found.nfev)

    def blur_of(self, state: _State, noise: float) -> np.ndarray:
        """What `blur` is at a state."""
        return noise**2 * (state.joint_effect**2).sum(axis=(1, 2))

    def _lost_blur(self, offset: float) -> tuple[np.ndarray, np.ndarray]:
        """How much less blurred orientations are between two frames than at one, and the derivative by the shift.

        Noise of variance `b / 2` at both ends of an edge has `b / 2 - b s (1 - s)` at the share s of it. Least squares
        alone would shift the clocks to where orientations are read between frames, as the noise is least there; with
        `b s (1 - s)` in the sum of squares, all shifts are alike to it. The constant, which changes nothing, keeps the
        root's derivative finite.
        """
        when, edge, length = self._place(offset)
        s = (when - self.time[edge]) / length
        inside = when == self.time[self.seen] - offset
        value = np.sqrt(self.blur[edge] * (s * (1 - s) + 0.5))
        slope = np.where(inside, (2 * s - 1) / length, 0.0) * self.blur[edge]
        return value, slope / np.where(value > 0, 2 * value, 1.0)

    def _place(self, offset: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times of the joints' clock at which orientations were seen, the edges they are on, and how long these are."""
        when = np.clip(self.time[self.seen] - offset, self.time[0], self.time[-1])
        edge = np.clip(np.searchsorted(self.time, when, side="right") - 1, 0, self.edges - 1)
        return when, edge, np.diff(self.time)[edge]

    def _orientation(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Orientation at every frame, and the effect of parameters and ends of each edge on all later ones."""
        turns, effect = _edges(tuple(p.put for p in self.fitted), x, without_names(self.robot), self.theta, self.steps)
        turned = chain(np.asarray(turns)[: self.edges])
        return turned, turned[1:] @ np.asarray(effect)[: self.edges]

    def _state(self, x: np.ndarray, frame: np.ndarray, offset: float) -> _State:
        from scipy.spatial.transform import Rotation

        turned, effect = self._orientation(x)
        when, edge, length = self._place(offset)
        residual = Rotation.from_matrix(
            self.measured @ (frame @ interpolate(self.time, turned)(when)).swapaxes(1, 2)
        ).as_rotvec()
        p = len(x)
        running = np.concatenate([np.zeros((1, 3, p)), np.cumsum(effect[..., :p] * self.scale, axis=0)])
        part = ((when - self.time[edge]) / length)[:, None, None]
        columns = [-frame @ ((1 - part) * running[edge] + part * running[edge + 1])]
        columns.append(np.broadcast_to(-np.eye(3), (len(when), 3, 3)))
        if self.clock:
            turn = Rotation.from_matrix(turned[edge + 1] @ turned[edge].swapaxes(1, 2)).as_rotvec()
            columns.append((turn / length[:, None] @ frame.T)[..., None])
        cost = float((residual**2).sum())
        return _State(
            x=x,
            frame=frame,
            offset=offset,
            cost=cost if np.isfinite(cost) else np.inf,
            rms=float(np.sqrt((residual**2).sum(axis=1).mean())),
            residual=residual,
            derivative=np.concatenate(columns, axis=2),
            turned=turned,
            joint_effect=effect[..., p:],
        )

    def report(
        self, state: _State, noise: float, before: float, converged: bool, steps: int, start: np.ndarray
    ) -> Calibration:
        """Covariance and verdict at the end of the fit."""
        p = len(state.x)
        jacobian = state.derivative.reshape(-1, state.derivative.shape[-1])
        lengths = np.linalg.norm(jacobian, axis=0)
        lengths = np.where(lengths > 0, lengths, 1.0)
        _, singular, directions = np.linalg.svd(jacobian / lengths, full_matrices=False)
        known = singular > SINGULAR * singular[0]
        lost = (np.abs(directions[~known]) > 0.01).any(axis=0) | (np.linalg.norm(jacobian, axis=0) == 0)
        inverse = (directions[known].T / singular[known] ** 2) @ directions[known] / np.outer(lengths, lengths)
        spread = state.cost / max(1, jacobian.shape[0] - jacobian.shape[1])
        pull = noise * self._pull(state)
        unit = np.concatenate([self.scale, np.ones(jacobian.shape[1] - p)])
        covariance = (spread * inverse + inverse @ (pull @ pull.T) @ inverse) * np.outer(unit, unit)
        std = np.where(lost, np.inf, np.sqrt(np.diag(covariance)))
        covariance[lost, :] = covariance[:, lost] = np.nan
        robot = self.robot
        for parameter, value in zip(self.fitted, state.x, strict=True):
            robot = parameter.put(robot, value)
        positive = np.array([parameter.positive for parameter in self.fitted])
        size = np.where(positive, np.minimum(self.scale, state.x), self.scale)
        identifiable = tuple(bool(known) for known in std[:p] < VAGUE * size)
        names = tuple(parameter.name for parameter in self.fitted)
        return Calibration(
            names=names,
            units=tuple(parameter.unit for parameter in self.fitted),
            start=start,
            values=state.x,
            std=std[:p],
            covariance=covariance[:p, :p],
            robot=robot,
            frame=state.frame,
            offset=state.offset,
            offset_std=float(std[-1]) if self.clock else 0.0,
            rms_before=before,
            rms=state.rms,
            joint_noise=noise,
            condition=float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf,
            identifiable=identifiable,
            warning=_warning(names, lost[:p], identifiable),
            converged=converged,
            steps=steps,
        )

    def _pull(self, state: _State) -> np.ndarray:
        """(unknowns, m j): how the noise of each joint angle pushes the fit's normal equations."""
        weight = np.zeros((len(self.time), 3, state.derivative.shape[-1]))
        weight[self.seen] = -state.frame.T @ state.derivative
        later = np.cumsum(weight[:0:-1], axis=0)[::-1]
        ends = np.einsum("kxu,kxe->uke", later, state.joint_effect)
        joints = ends.shape[2] // 2
        pull = np.zeros((ends.shape[0], len(self.time), joints))
        pull[:, :-1] += ends[..., :joints]
        pull[:, 1:] += ends[..., joints:]
        return pull.reshape(ends.shape[0], -1)


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
    windows = np.asarray(capture.theta)[runs[:, None] + np.arange(5)]
    differences = np.einsum("w,rwj->rj", np.array([1.0, -4, 6, -4, 1]), windows)
    differences = differences[np.isfinite(differences)]
    return float(1.4826 * np.median(np.abs(differences)) / np.sqrt(70)) if differences.size else 0.0


@partial(jax.jit, static_argnums=(0, 4))
def _edges(puts: tuple[Put, ...], x: Array, robot: Robot, theta: Array, steps: int) -> tuple[Array, Array]:
    """Turn of the base along every edge (e, 3, 3), and its derivative (e, 3, p + 2 j) in the frame at its end."""
    joints = theta.shape[1]

    def turn(numbers: Array) -> Array:
        changed: Any = robot
        for k, put in enumerate(puts):
            changed = put(changed, numbers[k])
        start, end = jnp.split(numbers[len(puts) :], [joints])
        return edge_turn(changed, start, end, steps)

    def edge(start: Array, end: Array) -> tuple[Array, Array]:
        numbers = jnp.concatenate([jnp.asarray(x), start, end])
        turned = turn(numbers)
        change = jnp.einsum("ba,bcn->acn", turned, jax.jacfwd(turn)(numbers))  # R^T dR = hat(delta)
        return turned, jnp.stack([change[2, 1], change[0, 2], change[1, 0]])

    return jax.vmap(edge)(jnp.asarray(theta[:-1]), jnp.asarray(theta[1:]))

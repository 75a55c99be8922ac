"""The least-squares problem of a calibration: unknowns, residuals and their derivatives along a capture.

See `calibration` for the equations. The unknowns are the parameters by their scales, a rotation vector of the cameras'
frame, and the shift of their clock.
"""

from __future__ import annotations

import warnings
from functools import lru_cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from reojax import so3
from reojax._internal.arrays import Array
from reojax.captures.alignment import align_frames, interpolate
from reojax.captures.capture import Capture
from reojax.captures.orientation import chain, edge_turn, fill_gaps, fill_up, steps_needed
from reojax.captures.parameters import Parameter, Put
from reojax.mechanics.own_units import without_names
from reojax.robot import Robot


class FitState(NamedTuple):
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


class FitProblem:
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

    def fit_window(self, x: np.ndarray) -> FitState:
        """The state at the parameters `x`, frame and shift at their best."""
        moved = self._orientation(x)
        state = self._state(x, align_frames(self.measured, moved[0][self.seen]), 0.0, moved)
        return self.fit(state, 20, fixed=True)[0]

    def fit(self, begun: FitState, most: int, fixed: bool = False) -> tuple[FitState, bool, int]:
        """The state of least squares from `begun` on, whether it converged, and the evaluations that it took.

        The unknowns are the parameters by their scales (none if `fixed`), a rotation vector from the frame of `begun`,
        and the shift. The trust region of SciPy's method takes columns of the derivatives at length one.
        """
        from scipy.optimize import least_squares
        from scipy.spatial.transform import Rotation

        p = 0 if fixed else len(begun.x)
        moved = self._orientation(begun.x) if fixed else None

        @lru_cache(maxsize=2)  # residuals and derivatives are asked for at the same place
        def state_of(unknowns: tuple[float, ...]) -> FitState:
            x = begun.x if fixed else np.array(unknowns[:p]) * self.scale
            frame = Rotation.from_rotvec(unknowns[p : p + 3]).as_matrix() @ begun.frame
            return self._state(x, frame, unknowns[p + 3] if self.clock else 0.0, moved)

        def state_at(unknowns: np.ndarray) -> FitState:
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
        # a slope of exactly 0, where nothing moves, is an end: from there SciPy's steps are no numbers
        rules: dict[str, Any] = {"x_scale": "jac", "ftol": 1e-10, "xtol": 1e-10, "gtol": 1e-300, "max_nfev": most}
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Setting `gtol`", UserWarning)
            # SciPy's types have no function for the derivatives
            found = least_squares(residual, first, jacobian, (lower, upper), **rules)  # pyright: ignore[reportArgumentType]
        return state_at(found.x), bool(found.status > 0), int(found.nfev)

    def blur_of(self, state: FitState, noise: float) -> np.ndarray:
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

    def _state(
        self, x: np.ndarray, frame: np.ndarray, offset: float, moved: tuple[np.ndarray, np.ndarray] | None = None
    ) -> FitState:
        """Everything at `x`; `moved` is what `_orientation` gives there, where it is known."""
        from scipy.spatial.transform import Rotation

        turned, effect = self._orientation(x) if moved is None else moved
        # rotation vectors from where the robot should be seen, G R(t), to where it was
        when, edge, length = self._place(offset)
        residual = Rotation.from_matrix(
            self.measured @ (frame @ interpolate(self.time, turned)(when)).swapaxes(1, 2)
        ).as_rotvec()
        # by the parameters: what all edges before have turned, and a share of the present one
        p = len(x)
        running = np.concatenate([np.zeros((1, 3, p)), np.cumsum(effect[..., :p] * self.scale, axis=0)])
        part = ((when - self.time[edge]) / length)[:, None, None]
        columns = [-frame @ ((1 - part) * running[edge] + part * running[edge + 1])]
        # by the cameras' frame: a turn of it turns the residual back
        columns.append(np.broadcast_to(-np.eye(3), (len(when), 3, 3)))
        # by the clock: the angular velocity on the present edge
        if self.clock:
            turn = Rotation.from_matrix(turned[edge + 1] @ turned[edge].swapaxes(1, 2)).as_rotvec()
            columns.append((turn / length[:, None] @ frame.T)[..., None])
        cost = float((residual**2).sum())
        return FitState(
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

    def push(self, state: FitState) -> np.ndarray:
        """(unknowns, m j): how the noise of each joint angle pushes the fit's normal equations."""
        # normal equations by the residuals: J^T, in the base's frame, at the frames that were seen
        weight = np.zeros((len(self.time), 3, state.derivative.shape[-1]))
        weight[self.seen] = -state.frame.T @ state.derivative
        # an edge turns all that follows, and moves with the joints at both of its ends
        later = np.cumsum(weight[:0:-1], axis=0)[::-1]
        ends = np.einsum("kxu,kxe->uke", later, state.joint_effect)
        joints = ends.shape[2] // 2
        pull = np.zeros((ends.shape[0], len(self.time), joints))
        pull[:, :-1] += ends[..., :joints]
        pull[:, 1:] += ends[..., joints:]
        return pull.reshape(ends.shape[0], -1)


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

"""The law of `correction_gains` as a robot runs it: NumPy alone, nothing of JAX. Numbers from `write_gains`.

The change of the joints is `p = -direction c` with a steering vector `c` (3,). A reading of the orientation, with the
motion's own orientation `R` at that time and the connection `Gamma`, is off by

    e = log(measured (R exp(Gamma p))^T),

and the changes that are under way already take back `gramian c` of it, less what the filter holds back. What is left
of `e` after that adds `(gramian + rest)^-1 left` to `c`, the share of it that a reading is worth. `c` goes through a
filter of second order, so that what the joints are told starts smoothly. Old readings do no harm, as only what is left
acts.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np


class OnboardState(NamedTuple):
    """What the law remembers."""

    time: float
    """Of the last tick [s]."""
    steer: np.ndarray
    """(3,) `c`."""
    filtered: np.ndarray
    """(3,) `c` behind the filter."""
    rate: np.ndarray
    """(3,) its rate."""
    read: float
    """When the last reading was taken [s]."""
    past: np.ndarray
    """(n, 4) times of the last ticks and `filtered` at each, the newest last."""


class OnboardLaw:
    """The law for one motion.

    Args:
        table: what `read` or `gain_table` gives.
        tau: time constant of the filter [s].
        settle: time over which readings are averaged: one that comes `h` after the last counts `1 - exp(-h / settle)`.
        largest: largest change of a joint [rad].
        memory: ticks that are remembered; readings must not be older.
    """

    def __init__(
        self,
        table: Mapping[str, np.ndarray],
        *,
        tau: float = 5e-3,
        settle: float = 5e-3,
        largest: float = 0.3,
        memory: int = 32,
    ):
        self.table, self.tau, self.settle, self.largest, self.memory = table, tau, settle, largest, memory

    def start(self) -> OnboardState:
        """No change yet."""
        return OnboardState(0.0, np.zeros(3), np.zeros(3), np.zeros(3), 0.0, np.zeros((self.memory, 4)))

    def step(
        self, state: OnboardState, time: float, seen: tuple[np.ndarray, float] | None = None
    ) -> tuple[OnboardState, np.ndarray]:
        """One tick: the new state, and joint angles (j,) to go to [rad].

        `seen` is an orientation of the base (3, 3) and the time when it was read, if there is one.
        """
        now, (_, steer, filtered, rate, read) = at(self.table, time), state[:5]
        if seen is not None:
            then = at(self.table, seen[1])
            before = np.array([np.interp(seen[1], state.past[:, 0], column) for column in state.past[:, 1:].T])
            own = then["rotation"] @ exp(then["connection"] @ (-then["direction"] @ before))
            since = (then["gramian"] - now["gramian"]) @ (before + filtered) / 2
            error, worth = then["to_end"] @ log(seen[0] @ own.T) - since, 1 - np.exp(-(seen[1] - read) / self.settle)
            later, read = self.table["direction"][self.table["at"] >= time], seen[1]
            steer = corrected(now, later, steer, filtered, rate, error, worth, self.tau, self.largest)
        filtered, rate = smooth(steer, filtered, rate, time - state.time, self.tau)
        past = np.vstack([state.past[1:], [time, *filtered]])
        return OnboardState(time, steer, filtered, rate, read, past), now["theta"] - now["direction"] @ filtered


def corrected(now, later, steer, filtered, rate, error, worth, tau, largest):
    """Steering vector with what is left of `error`, now, that the changes under way do not take back."""
    held_back = now["density"] @ (2 * tau * (filtered - steer) + tau**2 * rate)
    left = error - now["gramian"] @ steer - held_back
    can = now["gramian"] - 2 * tau * now["density"] + now["rest"] * np.eye(3)
    steer = steer + worth * np.linalg.solve(positive(can, now["rest"]), left)
    return steer * min(1.0, largest / max(np.abs(later @ steer).max(initial=0.0), 1e-12))


def smooth(steer, filtered, rate, step, tau):
    """The filter of second order, `step` later, exactly."""
    gap, decay = filtered - steer, np.exp(-step / tau)
    slope = rate + gap / tau
    return steer + (gap + step * slope) * decay, (rate - step / tau * slope) * decay


def at(table: Mapping[str, np.ndarray], time: float) -> dict[str, np.ndarray]:
    """Everything at one time: joints and orientation by cubics, the rest by straight lines."""
    times = table["at"]
    k = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 2))
    h = times[k + 1] - times[k]
    u = np.clip((time - times[k]) / h, 0.0, 1.0)
    a, b = u * u * (3 - 2 * u), u * (1 - u)

    def cubic(value, rate):
        return (1 - a) * value[k] + a * value[k + 1] + h * b * ((1 - u) * rate[k] - u * rate[k + 1])

    q = table["quaternion"]
    spin = [0.5 * times_quaternion(q[i], table["omega"][i]) for i in (k, k + 1)]
    pair = np.stack([q[k], q[k + 1]]) * [[1.0], [1.0 if q[k] @ q[k + 1] >= 0 else -1.0]]
    spin[1] = spin[1] * (1.0 if q[k] @ q[k + 1] >= 0 else -1.0)
    turned = (1 - a) * pair[0] + a * pair[1] + h * b * ((1 - u) * spin[0] - u * spin[1])
    lines = ("connection", "direction", "gramian", "rest", *(["to_end"] if "to_end" in table else []))
    found = {"to_end": np.eye(3)} | {name: (1 - u) * table[name][k] + u * table[name][k + 1] for name in lines}
    found["density"] = (table["gramian"][k] - table["gramian"][k + 1]) / h
    return found | {"theta": cubic(table["theta"], table["theta_dot"]), "rotation": matrix(turned)}


def read(path: str | Path) -> dict[str, np.ndarray]:
    """Read the table of a CSV file that `write_gains` wrote."""
    if not Path(path).is_file():
        raise ValueError(f"{str(path)!r} is not a regular file.")
    with open(path, encoding="utf-8") as file:
        names = file.readline().strip().split(",")
        rows = np.loadtxt(file, delimiter=",", ndmin=2)
    joints = sum(name.startswith("theta_dot") for name in names)
    shapes = {"at": (), "theta": (joints,), "theta_dot": (joints,), "quaternion": (4,), "omega": (3,)}
    shapes |= {"connection": (3, joints), "direction": (joints, 3), "gramian": (3, 3), "rest": ()}
    shapes |= {"momentum": (3,)} | ({"to_end": (3, 3)} if "to_end_0_0" in names else {})
    table, column = {}, 0
    for name, shape in shapes.items():
        width = int(np.prod(shape, dtype=int))
        table[name] = rows[:, column : column + width].reshape(len(rows), *shape)
        column += width
    return table


def positive(matrix: np.ndarray, least: float) -> np.ndarray:
    """The symmetric matrix with its eigenvalues raised to `least`."""
    values, vectors = np.linalg.eigh(matrix)
    return vectors * np.maximum(values, least) @ vectors.T


def exp(vector: np.ndarray) -> np.ndarray:
    """Rotation by a rotation vector."""
    half = 0.5 * np.linalg.norm(vector)
    return matrix(np.append(np.cos(half), 0.5 * np.sinc(half / np.pi) * vector))


def log(rotation: np.ndarray) -> np.ndarray:
    """Rotation vector, for rotations below half a turn."""
    twice = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine = 0.5 * np.linalg.norm(twice)
    angle = np.arctan2(sine, 0.5 * (np.trace(rotation) - 1))
    return twice * (0.5 * angle / sine if sine > 1e-9 else 0.5)


def matrix(q: np.ndarray) -> np.ndarray:
    """Rotation of a quaternion (w, x, y, z) of any length."""
    w, x, y, z = q / np.linalg.norm(q)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * (w * cross + cross @ cross)


def times_quaternion(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Quaternion `q (0, v)`."""
    return np.append(-q[1:] @ v, q[0] * v + np.cross(q[1:], v))

"""The law of `correction_gains` as a robot runs it: NumPy alone, nothing of JAX. Numbers from `write_gains`.

At each tick, with the motion's own joints `theta` and orientation `R` at that time, the connection `Gamma` and the gain:

    e = log(measured (R exp(Gamma p))^T),      wanted = -gain e,      p follows wanted,      joints = theta + p,

the second-order filter `p'' = (wanted - p) / tau^2 - 2 p' / tau` so that what the joints are told starts smoothly.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np


class State(NamedTuple):
    """What the law remembers; `start(joints)` before the motion."""

    time: float
    """Of the last tick [s]."""
    change: np.ndarray
    """(j,) `p` [rad]."""
    rate: np.ndarray
    """(j,) [rad/s]."""
    wanted: np.ndarray
    """(j,) what the last reading asked for [rad]."""


def start(joints: int) -> State:
    """No change yet."""
    return State(0.0, np.zeros(joints), np.zeros(joints), np.zeros(joints))


def step(table: Mapping[str, np.ndarray], tau: float, state: State, time: float, measured=None, taken=None):
    """Run the law for one tick: the new state, and what the joints are told (j,).

    `measured` (3, 3) is the base's orientation, read at time `taken` (default now); None where there is no reading.
    """
    wanted = state.wanted
    if measured is not None:
        taken = time if taken is None else taken
        row = at(table, taken)
        change = state.change + (taken - state.time) * state.rate
        error = log(measured @ (row["rotation"] @ exp(row["connection"] @ change)).T)
        wanted = -row["gain"] @ error
    h = time - state.time
    gap, decay = state.change - wanted, np.exp(-h / tau)
    slope = state.rate + gap / tau
    change = wanted + (gap + h * slope) * decay
    rate = (state.rate - h / tau * slope) * decay
    return State(time, change, rate, wanted), at(table, time)["theta"] + change


def at(table: Mapping[str, np.ndarray], time: float) -> dict[str, np.ndarray]:
    """Everything at one time: joints and orientation by cubics, connection and gain by straight lines."""
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
    found = {name: (1 - u) * table[name][k] + u * table[name][k + 1] for name in ("connection", "gain")}
    return found | {"theta": cubic(table["theta"], table["theta_dot"]), "rotation": matrix(turned)}


def read(path: str | Path) -> dict[str, np.ndarray]:
    """Read the table of a CSV file that `write_gains` wrote."""
    with open(path, encoding="utf-8") as file:
        names = file.readline().strip().split(",")
        rows = np.loadtxt(file, delimiter=",", ndmin=2)
    joints = sum(name.startswith("theta_dot") for name in names)
    shapes = {"at": (), "theta": (joints,), "theta_dot": (joints,), "quaternion": (4,), "omega": (3,)}
    shapes |= {"connection": (3, joints), "gain": (joints, 3)}
    table, column = {}, 0
    for name, shape in shapes.items():
        width = int(np.prod(shape, dtype=int))
        table[name] = rows[:, column : column + width].reshape(len(rows), *shape)
        column += width
    return table


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

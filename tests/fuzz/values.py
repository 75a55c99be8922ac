"""What is put in the place of an argument, and a robot, a path and so on that are right."""

import datetime
import math
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import reojax

ROBOT = reojax.robots.prototype()
PATH = reojax.manoeuvre_a(1.0, 0.5)
TRAJECTORY = reojax.along(PATH, "quintic", 0.2)
TIME = np.linspace(0, 1, 12)
CAPTURE = reojax.make_capture(TIME, np.zeros((12, 3)), np.broadcast_to(np.eye(3), (12, 3, 3)))
MOTION = reojax.simulate(ROBOT, PATH, durations=0.2, samples=16)
TURN = np.asarray(reojax.net_rotation(ROBOT, PATH))
NO_JOINTS = reojax.make_robot(
    mass=[1.0], com=np.zeros((1, 3)), inertia=[np.eye(3)], axis=np.zeros((0, 3)), anchor=np.zeros((0, 3))
)
STACKED = jax.tree.map(lambda x: np.stack([x, x]), ROBOT)

VALUES: list[Any] = [
    None, True, False, 0, 1, -1, 3, 2**70, -(2**70), 0.0, -0.0, 0.5, -0.5, 1e-300, 1e308, -1e308, 90.0, math.nan,
    math.inf, -math.inf, 1j, "", "x", "0.5", "x" * 10**5, b"x", [], [0.1], [0.1, 0.2, 0.3], [0.1, math.nan, 0.3],
    [0.1, True, 0.3], ["a", "b", "c"], [[1, 2], [3]], {}, {"a": 1}, (), set(), object(), print, np.float16(0.5),
    np.longdouble(0.5), np.timedelta64(5, "ms"), np.datetime64("2020-01-01"), datetime.timedelta(seconds=1),
    np.zeros((2, 3)), np.zeros((2, 0)), np.zeros(0), np.full((2, 3), np.nan), np.eye(3), 2 * np.eye(3), -np.eye(3),
    np.diag([1.0, 1, -1]), np.eye(3, dtype=bool), np.eye(3, dtype=int), np.zeros((5, 3, 3)), np.zeros((0, 3, 3)),
    np.ma.masked_array([1.0, 2.0, 3.0], [1, 0, 0]), np.zeros(3, "float16"), jnp.ones(3, jnp.bfloat16), np.array(["1"]),
    np.ones((2, 3), np.float32), np.ones(10**5), ROBOT, NO_JOINTS, STACKED, PATH, reojax.polygon(np.zeros((1, 3))),
    reojax.polygon(np.zeros((3, 2))), TRAJECTORY, CAPTURE, MOTION, reojax.RE_MAX_17, reojax.Release(),
    reojax.FOUR_BODY, reojax.SIX_BODY, Path("/nowhere/x.csv"), "/dev/null", "/dev/full",
]  # fmt: skip

LIMITS = {"twist_limit": 2.0, "bend_limit": 1.5, "max_manoeuvres": 2}

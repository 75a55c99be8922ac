"""A motion replayed by MuJoCo's full dynamics: floating base, no gravity, Runge-Kutta of fourth order.

The joints have the accelerations of the motion, by whatever torques that takes (an ideal servo). The base's six
accelerations follow from MuJoCo's mass matrix and bias forces, `M_bb a = -M_bj theta'' - bias_b`; nothing of reojax's
momentum matrices or integrators is used, and momentum is conserved only as well as the integration is good.
"""

# pyright: reportAttributeAccessIssue=false

import mujoco
import numpy as np

import reojax
from reojax import interop


def replay(robot: reojax.Robot, found: reojax.Righting, steps: int = 400) -> np.ndarray:
    """Orientation (3, 3) of the base at the end."""
    foreign = interop.mujoco_model(robot)
    model = foreign.model
    data = mujoco.MjData(model)
    unit, mass, pushed = np.eye(6, model.nv), np.zeros((6, model.nv)), np.zeros(model.nv)
    trajectory, end = found.trajectory, float(found.duration)
    breaks, coefficients = np.asarray(trajectory.breaks), np.asarray(trajectory.coefficients)

    def joints(t: float) -> list[np.ndarray]:
        piece = int(np.clip(np.searchsorted(breaks, t, side="right") - 1, 0, len(coefficients) - 1))
        powers = np.polynomial.polynomial
        own = coefficients[piece]
        return [powers.polyval(t - breaks[piece], own if k == 0 else powers.polyder(own, k)) for k in range(3)]

    def accelerations(t: float, base: np.ndarray, speed: np.ndarray) -> np.ndarray:
        theta, rate, acceleration = joints(t)
        data.qpos[:7], data.qpos[7:] = base, foreign.angles @ theta
        data.qvel[:6], data.qvel[6:] = speed, foreign.angles @ rate
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        for k in range(6):  # columns of the mass matrix; `mj_fullM` is called differently in each version
            mujoco.mj_mulM(model, data, mass[k], unit[k])
        asked = np.concatenate([np.zeros(6), foreign.angles @ acceleration])
        mujoco.mj_mulM(model, data, pushed, asked)
        return -np.linalg.solve(mass[:, :6], pushed[:6] + data.qfrc_bias[:6])

    def moved(base: np.ndarray, speed: np.ndarray, h: float) -> np.ndarray:
        """The base after `h` at constant speed: linear in the inertial frame, angular in the base frame."""
        after = base.copy()
        after[:3] += h * speed[:3]
        mujoco.mju_quatIntegrate(after[3:], np.ascontiguousarray(speed[3:]), h)
        return after

    base = np.array([0.0, 0, 0, 1, 0, 0, 0])
    inertia = np.asarray(reojax.momentum_matrices(robot, joints(0.0)[0]).A)
    speed = np.concatenate([np.zeros(3), np.linalg.solve(inertia, found.momentum)])
    h = end / steps
    for k in range(steps):
        t = k * h
        v1, a1 = speed, accelerations(t, base, speed)
        v2 = speed + h / 2 * a1
        a2 = accelerations(t + h / 2, moved(base, v1, h / 2), v2)
        v3 = speed + h / 2 * a2
        a3 = accelerations(t + h / 2, moved(base, v2, h / 2), v3)
        v4 = speed + h * a3
        a4 = accelerations(t + h, moved(base, v3, h), v4)
        base = moved(base, (v1 + 2 * v2 + 2 * v3 + v4) / 6, h)
        speed = speed + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, base[3:])
    return matrix.reshape(3, 3)

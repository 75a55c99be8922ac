"""Pinocchio and MuJoCo from Python: the momentum matrix node by node, the rest in NumPy.

Every loop has a model of its own, made beforehand.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from reojax import interop

from . import _magnus
from ._foreign import omega_of
from ._measure import measure
from ._rows import Row, optional, row
from ._task import Loops, Task, robot_of


def pinocchio(task: Task) -> Iterator[Row]:
    """Rows of `pin.computeCentroidalMap`."""
    pin = optional("pinocchio", "pin")

    def momentum(loop: Loops) -> Callable[[np.ndarray], np.ndarray]:
        foreign = interop.pinocchio_model(robot_of(loop))
        model, data, q = foreign.model, foreign.model.createData(), pin.neutral(foreign.model)

        def at(theta: np.ndarray) -> np.ndarray:
            matrices = np.empty((len(theta), 3, model.nv))
            for matrix, hinges in zip(matrices, theta @ foreign.angles.T, strict=True):
                q[7:] = hinges
                matrix[:] = pin.computeCentroidalMap(model, data, q)[3:]
            return matrices @ foreign.drive

        return at

    yield from _rows(task, "Pinocchio from Python", momentum)


def mujoco(task: Task) -> Iterator[Row]:
    """Rows of `mj_angmomMat`."""
    mj = optional("mujoco", "mujoco")

    def momentum(loop: Loops) -> Callable[[np.ndarray], np.ndarray]:
        foreign = interop.mujoco_model(robot_of(loop))
        model, data = foreign.model, mj.MjData(foreign.model)

        def at(theta: np.ndarray) -> np.ndarray:
            matrices = np.empty((len(theta), 3, model.nv))
            for matrix, hinges in zip(matrices, theta @ foreign.angles.T, strict=True):
                data.qpos[7:] = hinges
                mj.mj_kinematics(model, data)
                mj.mj_comPos(model, data)
                mj.mj_angmomMat(model, data, matrix, 1)
            return matrices @ foreign.drive

        return at

    yield from _rows(task, "MuJoCo from Python", momentum)


def _rows(task: Task, system: str, momentum: Callable[[Loops], Callable[[np.ndarray], Any]]) -> Iterator[Row]:
    loops = list(task.loops.first(10 if task.quick else 40).each())
    matrices = [momentum(loop) for loop in loops]

    def run() -> np.ndarray:
        rotations = []
        for loop, matrix in zip(loops, matrices, strict=True):
            theta, rate = _magnus.nodes(loop, task.magnus_steps)
            rotations.append(_magnus.product(omega_of(matrix(theta), rate)))
        return np.stack(rotations)

    yield row(
        system,
        "value",
        measure([run], task.seconds)[0],
        loops=len(loops),
        threads=1,
        steps=task.magnus_steps,
        evaluations=_magnus.evaluations(task.magnus_steps),
        error=task.error(run()),
    )

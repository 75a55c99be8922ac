"""MuJoCo simulating the loop: servos move every hinge through it, and what the base does comes out of the dynamics.

Every edge takes a quarter of a second, from rest to rest (the quintic of least jerk). A servo of 200 rad/s, critically
damped, turns each joint, and one each rotor; commands lead by the servo's lag. With no momentum at the start there is
none at any time, so the momentum found is the integrator's error.
"""

from collections.abc import Iterator
from typing import Any

import jax
import numpy as np

from reojax import interop, so3

from ._measure import CORES, measure
from ._rows import Row, optional, row
from ._task import Loops, Task, edges, robot_of

TIME_STEP, EDGE, SETTLE = 1e-3, 0.25, 0.05  # s
SERVO = 200.0  # rad/s
INTEGRATORS = {"implicitfast": "mjINT_IMPLICITFAST", "RK4": "mjINT_RK4"}


def rows(task: Task) -> Iterator[Row]:
    """Rows of `mujoco.rollout` with two integrators, on all cores."""
    mj = optional("mujoco", "mujoco")
    rollout = optional("mujoco.rollout", "mujoco")
    loops = task.loops.first(8 if task.quick else 64)
    foreign = [interop.mujoco_model(robot_of(loop)) for loop in loops.each()]
    commands = np.stack([_commands(loop) @ f.angles.T for loop, f in zip(loops.each(), foreign, strict=True)])
    for name, integrator in INTEGRATORS.items():
        models = [_with_servos(mj, f.model, integrator) for f in foreign]
        start = np.stack([_state(mj, model, mj.MjData(model)) for model in models])
        data = [mj.MjData(models[0]) for _ in range(CORES)]

        def run(models=models, start=start, data=data) -> np.ndarray:
            return rollout.rollout(models, data, start, commands)[0][:, -1]

        [samples] = measure([run], task.seconds)
        end = run()
        error = task.error(np.asarray(jax.vmap(so3.from_quaternion)(end[:, 4:8])))
        yield row(
            f"MuJoCo simulation, {name}",
            "value",
            samples,
            loops=len(models),
            threads=CORES,
            steps=f"{TIME_STEP * 1e3:g} ms",
            error=error,
            note=f"a loop takes {4 * EDGE:g} s; {_drift(mj, models, end)}",
        )


def _commands(loop: Loops) -> np.ndarray:
    """Joint angles to ask for (time, 3), the servos' lag taken into account."""
    x = np.arange(round(EDGE / TIME_STEP))[:, None] * TIME_STEP / EDGE
    along, speed = x**3 * (10 - 15 * x + 6 * x**2), 30 * x**2 * (1 - x) ** 2 / EDGE
    moving = [start + (along + speed * 2 / SERVO) * change for start, change in edges(loop)]
    return np.concatenate([*moving, np.zeros((round(SETTLE / TIME_STEP), 3))])


def _with_servos(mj: Any, model: Any, integrator: str) -> Any:
    """Return a copy of a model with a servo on each hinge."""
    data, mass = mj.MjData(model), np.zeros((model.nv, model.nv))
    mj.mj_forward(model, data)
    mj.mj_fullM(model, data, mass)
    seen = 1 / np.diag(np.linalg.inv(mass))  # the inertia that a torque at each hinge meets
    spec = mj.MjSpec()
    spec.option.gravity, spec.option.timestep = np.zeros(3), TIME_STEP
    spec.option.integrator = getattr(mj.mjtIntegrator, integrator)
    bodies = [spec.worldbody]
    for i in range(1, model.nbody):
        body = bodies[model.body_parentid[i]].add_body(name=model.body(i).name, pos=model.body_pos[i])
        body.explicitinertial, body.mass, body.ipos = True, model.body_mass[i], model.body_ipos[i]
        body.inertia, body.iquat = model.body_inertia[i], model.body_iquat[i]
        bodies.append(body)
        joint = model.joint(int(model.body_jntadr[i]))
        if joint.type == mj.mjtJoint.mjJNT_FREE:
            body.add_freejoint()
            continue
        body.add_joint(name=joint.name, type=mj.mjtJoint.mjJNT_HINGE, axis=joint.axis, pos=joint.pos)
        servo = spec.add_actuator(target=joint.name, trntype=mj.mjtTrn.mjTRN_JOINT)
        servo.gaintype, servo.biastype = mj.mjtGain.mjGAIN_FIXED, mj.mjtBias.mjBIAS_AFFINE
        stiffness = seen[joint.dofadr[0]] * SERVO**2
        servo.gainprm[0], servo.biasprm[1], servo.biasprm[2] = stiffness, -stiffness, -2 * stiffness / SERVO
    return spec.compile()


def _state(mj: Any, model: Any, data: Any) -> np.ndarray:
    """Time, positions and velocities."""
    everything = mj.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mj.mj_stateSize(model, everything))
    mj.mj_getState(model, data, state, everything)
    return state


def _drift(mj: Any, models: list, end: np.ndarray) -> str:
    """Say how much momentum there is at the end, and how fast the robot then goes on turning, in the median."""
    momenta, rates = [], []
    for model, state in zip(models, end, strict=True):
        data, matrix = mj.MjData(model), np.empty((3, model.nv))
        mj.mj_setState(model, data, state, mj.mjtState.mjSTATE_FULLPHYSICS)
        mj.mj_forward(model, data)
        mj.mj_angmomMat(model, data, matrix, 1)
        momenta.append(np.linalg.norm(matrix @ data.qvel))
        rates.append(np.rad2deg(np.linalg.norm(np.linalg.solve(matrix[:, 3:6], matrix @ data.qvel))))
    momentum, rate = np.median(momenta), np.median(rates)
    return f"momentum drifts from 0 to {momentum:.1e} kg m^2/s: the robot goes on turning at {rate:.2g} deg/s"

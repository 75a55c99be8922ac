"""Robots in MuJoCo, with a free-flying base, without gravity or contacts (extra `oracle`)."""

# pyright: reportAttributeAccessIssue=false

from typing import Any

import numpy as np

from reojax.interop.foreign import Foreign, configuration, rotors, tie_hinges
from reojax.robot import Robot


def mujoco_model(robot: Robot) -> Foreign:
    """The robot in MuJoCo, without gravity or contacts.

    MuJoCo wants positive masses that obey the triangle rule, so each rotor is a small flat disc near its
    link's centre of mass: a thousandth of the link's mass, transverse inertia 0.6 of the axial. The
    link loses exactly what the disc has.

    Raises:
        ImportError: without MuJoCo.
    """
    import mujoco

    mass, com, inertia = (np.array(field) for field in (robot.mass, robot.com, robot.inertia))
    discs = []
    for rotor in rotors(robot):
        i, axial = rotor.link, np.outer(rotor.axis, rotor.axis)
        place = np.asarray(robot.com[i]) + 0.03 * rotor.axis + [0.0, 0.01, -0.02]
        disc = (1e-3 * float(robot.mass[i]), place, rotor.inertia * (0.4 * axial + 0.6 * np.eye(3)))
        discs.append(disc)
        mass[i], com[i], inertia[i] = _subtract((mass[i], com[i], inertia[i]), disc)

    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity = np.zeros(3)
    bodies = [spec.worldbody.add_body(name=robot.link_names[0])]
    bodies[0].add_freejoint()
    for k, parent in enumerate(robot.parent):
        bodies.append(bodies[parent].add_body(name=robot.link_names[k + 1], pos=robot.anchor[k]))
        hinge = mujoco.mjtJoint.mjJNT_HINGE
        bodies[-1].add_joint(name=robot.joint_names[k], type=hinge, axis=np.array(robot.axis[k]))
    for body, *link in zip(bodies, mass, com, inertia, strict=True):
        _weigh(body, *link)
    for rotor, disc in zip(rotors(robot), discs, strict=True):
        body = bodies[rotor.link].add_body(name=f"rotor{rotor.joint}")
        body.add_joint(name=f"rotor{rotor.joint}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=rotor.axis, pos=disc[1])
        _weigh(body, *disc)
    model = spec.compile()
    first = {k: int(model.joint(name).dofadr[0]) for k, name in enumerate(robot.joint_names)}
    geared = [(int(model.joint(f"rotor{rotor.joint}").dofadr[0]), rotor) for rotor in rotors(robot)]
    return tie_hinges(robot, model, first, geared)


def mujoco_momentum(foreign: Foreign, theta: np.ndarray, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Angular momentum matrix by MuJoCo: (3, 6 + j), see `split`.

    Args:
        foreign: what `mujoco_model` gives.
        theta: (j,) joint angles [rad].
        position: (3,) of the base, inertial frame [m].
        rotation: (3, 3) of the base, base components to inertial ones.
    """
    import mujoco

    data = mujoco.MjData(foreign.model)
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, rotation.ravel())
    data.qpos[:] = configuration(foreign, [position, quaternion], theta, data.qpos)
    mujoco.mj_kinematics(foreign.model, data)
    mujoco.mj_comPos(foreign.model, data)
    matrix = np.zeros((3, foreign.model.nv))
    mujoco.mj_angmomMat(foreign.model, data, matrix, 1)
    return matrix @ foreign.drive


def _weigh(body: Any, mass: float, com: np.ndarray, inertia: np.ndarray) -> None:
    """Give a MuJoCo body its mass; principal axes from NumPy, whose eigenvalues are good to rounding."""
    import mujoco

    moments, frame = np.linalg.eigh(inertia)
    frame = frame * np.linalg.det(frame)
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, frame.ravel())
    body.explicitinertial, body.mass, body.ipos = True, mass, com
    body.inertia, body.iquat = moments, quaternion


def _subtract(whole: tuple, part: tuple) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre of mass and inertia of `whole` without its `part`, by the parallel axis theorem."""
    mass = whole[0] - part[0]
    com = (whole[0] * whole[1] - part[0] * part[1]) / mass
    inertia = whole[2] - part[2] - part[0] * _spread(part[1] - whole[1]) - mass * _spread(com - whole[1])
    return mass, com, inertia


def _spread(arm: np.ndarray) -> np.ndarray:
    return arm @ arm * np.eye(3) - np.outer(arm, arm)

"""The same robots in other people's code: `Robot` to Pinocchio and to MuJoCo, with a free-flying base.

Rotors are bodies of their own there, on hinges of their own, so that nothing of reojax's rotor
formula is repeated: the part of the link that is the rotor is taken out of the link and put back as a
body that turns. A matrix `drive` ties the hinges together: all velocities of the foreign model are
`drive @ [v, omega, theta_dot]` with the base's linear velocity (in the foreign model's frame), the
base's angular velocity in the base frame, and the joint rates.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from reojax import Robot


class Rotor(NamedTuple):
    """The rotor of joint `joint`, a part of link `link`, turning `spin` times as fast as the joint."""

    joint: int
    link: int
    axis: np.ndarray
    inertia: float
    spin: float


class Foreign(NamedTuple):
    """A robot in a foreign model, and how its velocities follow from the robot's."""

    model: Any
    drive: np.ndarray
    """(nv, 6 + j); see the module's first lines."""
    angles: np.ndarray
    """(nv - 6, j): all hinge angles, in the order of the model, per joint angle."""


def rotors(robot: Robot) -> Iterator[Rotor]:
    """The rotors that have any inertia."""
    for k, (parent, side) in enumerate(zip(robot.parent, robot.rotor_on, strict=True)):
        if robot.rotor_inertia[k] > 0:
            on_parent = side == "parent"
            ratio = float(robot.gear_ratio[k])
            yield Rotor(
                joint=k,
                link=parent if on_parent else k + 1,
                axis=np.asarray(robot.axis[k]),
                inertia=float(robot.rotor_inertia[k]),
                spin=ratio if on_parent else -ratio,
            )


def _foreign(robot: Robot, model: Any, first: dict[int, int], geared: list[tuple[int, Rotor]]) -> Foreign:
    """`first[k]`: velocity index of joint k; `geared`: velocity index of each rotor."""
    drive = np.zeros((model.nv, 6 + robot.joints))
    drive[:6, :6] = np.eye(6)
    for k, index in first.items():
        drive[index, 6 + k] = 1.0
    for index, rotor in geared:
        drive[index, 6 + rotor.joint] = rotor.spin
    return Foreign(model, drive, drive[6:, 6:])


def pinocchio_model(robot: Robot) -> Foreign:
    """The robot in Pinocchio; rotors are bodies without mass, with inertia about their axes only."""
    import pinocchio as pin

    model = pin.Model()
    model.gravity = pin.Motion.Zero()
    inertia = np.array(robot.inertia)
    for rotor in rotors(robot):
        inertia[rotor.link] -= rotor.inertia * np.outer(rotor.axis, rotor.axis)
    body = [model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "base")]
    for k, parent in enumerate(robot.parent):
        joint = pin.JointModelRevoluteUnaligned(np.array(robot.axis[k]))
        place = pin.SE3(np.eye(3), np.array(robot.anchor[k]))
        body.append(model.addJoint(body[parent], joint, place, f"joint{k}"))
    for i, joint in enumerate(body):
        link = pin.Inertia(float(robot.mass[i]), np.array(robot.com[i]), inertia[i])
        model.appendBodyToJoint(joint, link, pin.SE3.Identity())
    geared = []
    for rotor in rotors(robot):
        joint = pin.JointModelRevoluteUnaligned(rotor.axis)
        spinner = model.addJoint(body[rotor.link], joint, pin.SE3.Identity(), f"rotor{rotor.joint}")
        wheel = pin.Inertia(0.0, np.zeros(3), rotor.inertia * np.outer(rotor.axis, rotor.axis))
        model.appendBodyToJoint(spinner, wheel, pin.SE3.Identity())
        geared.append((model.idx_vs[spinner], rotor))
    return _foreign(robot, model, {k: model.idx_vs[body[k + 1]] for k in range(robot.joints)}, geared)


def mujoco_model(robot: Robot) -> Foreign:
    """The robot in MuJoCo, without gravity or contacts.

    MuJoCo wants positive masses that obey the triangle rule, so each rotor is a small flat disc near its
    link's centre of mass: a thousandth of the link's mass, transverse inertia 0.6 of the axial. The
    link loses exactly what the disc has.
    """
    import mujoco

    mass, com, inertia = (np.array(field) for field in (robot.mass, robot.com, robot.inertia))
    discs = []
    for rotor in rotors(robot):
        i, axial = rotor.link, np.outer(rotor.axis, rotor.axis)
        place = robot.com[i] + 0.03 * rotor.axis + [0.0, 0.01, -0.02]
        disc = (1e-3 * float(robot.mass[i]), place, rotor.inertia * (0.4 * axial + 0.6 * np.eye(3)))
        discs.append(disc)
        mass[i], com[i], inertia[i] = _without((mass[i], com[i], inertia[i]), disc)

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
    return _foreign(robot, model, first, geared)


def _weigh(body: Any, mass: float, com: np.ndarray, inertia: np.ndarray) -> None:
    """Give a MuJoCo body its mass; principal axes from NumPy, whose eigenvalues are good to rounding."""
    import mujoco

    moments, frame = np.linalg.eigh(inertia)
    frame = frame * np.linalg.det(frame)
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, frame.ravel())
    body.explicitinertial, body.mass, body.ipos = True, mass, com
    body.inertia, body.iquat = moments, quaternion


def _without(whole: tuple, part: tuple) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre of mass and inertia of `whole` without its `part`, by the parallel axis theorem."""
    mass = whole[0] - part[0]
    com = (whole[0] * whole[1] - part[0] * part[1]) / mass
    inertia = whole[2] - part[2] - part[0] * _spread(part[1] - whole[1]) - mass * _spread(com - whole[1])
    return mass, com, inertia


def _spread(arm: np.ndarray) -> np.ndarray:
    return arm @ arm * np.eye(3) - np.outer(arm, arm)


def pinocchio_momentum(foreign: Foreign, theta: np.ndarray, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Momentum matrix by Pinocchio: (6, 6 + j), see `split`."""
    import pinocchio as pin

    data = foreign.model.createData()
    quaternion = pin.Quaternion(rotation).coeffs()
    q = _configuration(foreign, [position, quaternion], theta, pin.neutral(foreign.model))
    return pin.computeCentroidalMap(foreign.model, data, q) @ foreign.drive


def _configuration(foreign: Foreign, base: list, theta: np.ndarray, neutral: np.ndarray) -> np.ndarray:
    q = np.concatenate([*base, foreign.angles @ theta])
    assert q.shape == neutral.shape
    return q


def mujoco_momentum(foreign: Foreign, theta: np.ndarray, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Angular momentum matrix by MuJoCo: (3, 6 + j), see `split`."""
    import mujoco

    data = mujoco.MjData(foreign.model)
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, rotation.ravel())
    data.qpos[:] = _configuration(foreign, [position, quaternion], theta, data.qpos)
    mujoco.mj_kinematics(foreign.model, data)
    mujoco.mj_comPos(foreign.model, data)
    matrix = np.zeros((3, foreign.model.nv))
    mujoco.mj_angmomMat(foreign.model, data, matrix, 1)
    return matrix @ foreign.drive


def split(momentum: np.ndarray, rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`A`, `B` and the effect of the base's linear velocity (all in the base frame) of a momentum matrix."""
    momentum = rotation.T @ momentum[-3:]
    return momentum[:, 3:6], -momentum[:, 6:], momentum[:, :3]

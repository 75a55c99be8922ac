"""Robots in Pinocchio, with a free-flying base (extra `oracle`)."""

# pyright: reportAttributeAccessIssue=false

import numpy as np

from reojax.interop.foreign import Foreign, configuration, rotors, tie_hinges
from reojax.robot import Robot


def pinocchio_model(robot: Robot) -> Foreign:
    """The robot in Pinocchio; rotors are bodies without mass, with inertia about their axes only.

    Raises:
        ImportError: without Pinocchio.
    """
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
    return tie_hinges(robot, model, {k: model.idx_vs[body[k + 1]] for k in range(robot.joints)}, geared)


def pinocchio_momentum(foreign: Foreign, theta: np.ndarray, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Momentum matrix by Pinocchio: (6, 6 + j), see `split`.

    Args:
        foreign: what `pinocchio_model` gives.
        theta: (j,) joint angles [rad].
        position: (3,) of the base, inertial frame [m].
        rotation: (3, 3) of the base, base components to inertial ones.
    """
    import pinocchio as pin

    data = foreign.model.createData()
    quaternion = pin.Quaternion(rotation).coeffs()
    q = configuration(foreign, [position, quaternion], theta, pin.neutral(foreign.model))
    return pin.computeCentroidalMap(foreign.model, data, q) @ foreign.drive

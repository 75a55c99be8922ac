"""Which public robot files load, and whether their A and B are those of Pinocchio and MuJoCo."""

# pyright: reportAttributeAccessIssue=false

import re
import warnings
from pathlib import Path
from typing import Any

import jax
import numpy as np

import reojax
from any_robot_parts.files import PACKAGES, robot_files

_HELD = re.compile(
    r"^(?:locked: (?:prismatic )?joint '(.+?)' at (\S+?)(?: m)?(?:, which.*)?|held at (\S+?): joint '(.+?)'.*)$"
)


def loading(quick: bool) -> dict[str, Any]:
    """A row for each package, the refused files, and the largest disagreement with each oracle."""
    rows, refused, apart = [], [], {"Pinocchio": [], "MuJoCo": []}
    for package, (ending, _, _) in PACKAGES.items():
        count = {"files": 0, "load": 0, "with repair": 0, "with lock": 0, "parts": 0}
        for file in robot_files(package)[:: 10 if quick else 1]:
            robot, how = _try(file)
            if how.startswith("it has no bodies"):
                count["parts"] += 1
                continue
            count["files"] += 1
            if robot is None:
                refused.append({"package": package, "file": file.name, "reason": how})
                continue
            count[how] += 1
            if how != "load":
                refused.append({"package": package, "file": file.name, "reason": f"loads {how}"})
            elif robot.joints and not any("dropped at the root" in note for note in robot.notes if ending == "urdf"):
                oracle = "Pinocchio" if ending == "urdf" else "MuJoCo"
                difference = (_pinocchio if ending == "urdf" else _mujoco)(file, robot)
                if difference is not None:
                    apart[oracle].append(difference)
        rows.append({"package": package, **count})
    agreement = {
        oracle: {"files": len(values), "largest": max(values, default=0.0)} for oracle, values in apart.items()
    }
    return {"rows": rows, "refused": refused, "agreement": agreement}


def _try(file: Path) -> tuple[reojax.Robot | None, str]:
    """The robot and how it loads; without shapes, which the momentum does not need."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return reojax.load_robot(file, shapes=False), "load"
        except ValueError as error:
            reason = str(error).partition(": ")[2]
        try:
            return reojax.load_robot(file, shapes=False, repair=True), "with repair"
        except ValueError:
            pass
        return _locked(file, reason)


def _locked(file: Path, reason: str) -> tuple[reojax.Robot | None, str]:
    """What the refusal says to lock, at zero, until none is left."""
    lock: dict[str, float] = {}
    while tied := re.search(r"equality constraint .* ties '(.+?)'|lock=\{'(.+?)': 0\} holds it", reason):
        new = {joint: 0.0 for joint in (tied[1] or tied[2]).split(", ")}
        if new.keys() <= lock.keys():
            break
        lock |= new
        try:
            return reojax.load_robot(file, shapes=False, lock=lock), "with lock"
        except ValueError as error:
            reason = str(error).partition(": ")[2]
    return None, reason


@jax.jit
def _matrices(robot: reojax.Robot, theta: Any) -> Any:
    return reojax.momentum_matrices(robot, theta)


def _own(robot: reojax.Robot, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A and B without rotors, which neither oracle has."""
    plain = robot.replace(rotor_inertia=np.zeros(robot.joints), notes=(), name="robot")
    A, B = _matrices(plain, theta)
    return np.asarray(A), np.asarray(B)


def _difference(robot: reojax.Robot, theta: np.ndarray, A: np.ndarray, B: np.ndarray) -> float:
    own = _own(robot, theta)
    return float(max(np.abs(own[0] - A).max(), np.abs(own[1] - B).max()) / np.abs(A).max())


def _positions(robot: reojax.Robot, theta: np.ndarray) -> dict[str, float]:
    """Positions of all joints, those that the notes say are held included."""
    positions = dict(zip(robot.joint_names, map(float, theta), strict=True))
    for note in robot.notes:
        if found := _HELD.match(note):
            name, value = (found[1], found[2]) if found[1] else (found[4], found[3])
            positions[name] = float(value)
    return positions


def _pinocchio(file: Path, robot: reojax.Robot) -> float | None:
    import pinocchio as pin

    try:
        model = pin.buildModelFromUrdf(str(file), pin.JointModelFreeFlyer())
    except ValueError:
        return None
    theta = np.random.default_rng(0).uniform(-1.5, 1.5, robot.joints)
    q = pin.neutral(model)
    for name, value in _positions(robot, theta).items():
        if not model.existJointName(name):
            return None
        joint = model.joints[model.getJointId(name)]
        q[joint.idx_q : joint.idx_q + joint.nq] = (np.cos(value), np.sin(value)) if joint.nq == 2 else value
    centroidal = pin.computeCentroidalMap(model, model.createData(), q)[3:]
    columns = [model.joints[model.getJointId(name)].idx_v for name in robot.joint_names]
    return _difference(robot, theta, centroidal[:, 3:6], -centroidal[:, columns])


def _mujoco(file: Path, robot: reojax.Robot) -> float | None:
    import mujoco

    try:
        spec = mujoco.MjSpec.from_file(str(file))
        spec.compiler.fusestatic = False
        model = spec.compile()
    except (ValueError, RuntimeError):
        return None
    data = mujoco.MjData(model)
    theta = np.random.default_rng(0).uniform(-1, 1, robot.joints)
    for name, value in _positions(robot, theta).items():
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
        if joint < 0:  # a joint without a name, or one hinge of a ball
            return None
        data.qpos[model.jnt_qposadr[joint]] = value
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    base = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, robot.link_names[0])
    if base < 0:
        return None
    matrix = np.zeros((3, model.nv))
    mujoco.mj_angmomMat(model, data, matrix, base)
    frame = data.xmat[base].reshape(3, 3)
    tree = np.flatnonzero(model.body_rootid == model.body_rootid[base])
    arm = data.xipos[tree] - model.body_mass[tree] @ data.xipos[tree] / model.body_mass[tree].sum()
    turn = data.ximat[tree].reshape(-1, 3, 3)
    locked = np.einsum("iab,ib,icb->ac", turn, model.body_inertia[tree], turn)
    locked += np.einsum(
        "i,iab->ab", model.body_mass[tree], (arm**2).sum(1)[:, None, None] * np.eye(3) - arm[:, :, None] * arm[:, None]
    )
    columns = [model.jnt_dofadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, n)] for n in robot.joint_names]
    return _difference(robot, theta, frame.T @ locked @ frame, -(frame.T @ matrix)[:, columns])

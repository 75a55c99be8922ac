"""A quadruped of 2.5 kg with twelve joints: Solo12 (Grimminger et al., IEEE RA-L 5(2), 2020).

**Published**: masses, centres of mass, inertias and joint places, as in the URDF of the Open Dynamic Robot Initiative
(`solo12.urdf`, in example-robot-data; feet merged into the lower legs; that file notes of some shoulder inertias that
they are to be updated, and they are taken as they are); gears of 9:1.

**Chosen**: joint limits (the file has none to speak of: 10 rad); `ROTOR_INERTIA`; motors of hips on the parent's side;
capsules round the body, the hips, the legs and the feet.

At `theta = 0` it stands on straight legs: x forwards, y to the left, z up. Base frame: centre of mass of the body.
"""

from collections.abc import Iterator

import numpy as np

from reojax.capsules import Capsule
from reojax.robot import Robot, make_robot

ROTOR_INERTIA = 4e-6
"""Inertia of a motor's rotor [kg m^2] (chosen)."""
GEAR_RATIO = 9.0
"""Rotor turns per joint turn (Grimminger et al. 2020)."""
LIMITS = (1.2, 2.4, 2.6)
"""Largest angle of hip abduction, hip flexion and knee, either way [rad] (chosen)."""

_BODY_MASS, _BODY_INERTIA = 1.16115091, (0.00578574, 0.01938108, 0.02476124)
_LINK_MASS = 0.14853845
"""Mass of a shoulder, and of an upper leg [kg]."""
_LOWER_MASS = 0.03763607
"""Mass of a lower leg with its foot [kg]."""
_THIGH = 0.16
"""Hip to knee, and knee to foot [m]."""


def quadruped() -> Robot:
    """Build Solo12: a body and four legs of three joints each.

    Frames, published and chosen numbers are in this module's docstring. It has no `Layout`: `free_path` turns it.
    """
    mass, com, inertia = [_BODY_MASS], [np.zeros(3)], [np.diag(_BODY_INERTIA)]
    anchor, parent, links, joints = [], [], ["body"], []
    for name, front, left in (("FL", 1, 1), ("FR", 1, -1), ("HL", -1, 1), ("HR", -1, -1)):
        hip = len(mass)
        mass += [_LINK_MASS, _LINK_MASS, _LOWER_MASS]
        com += [
            np.array([-0.078707 * front, 0.01 * left, 0]),
            np.array([1.377e-05 * left, 0.01935853 * left, -0.078707]),
            np.array([0, 0.007899211229132053 * left, -0.10224903071020168]),
        ]
        inertia += [
            _symmetric(3.024e-05, 4.671e-05 * left * front * front, 0.00041193, 0, 0.00041107),
            _symmetric(0.00041107, 0, 0.00041193, 4.671e-05 * left, 3.024e-05),
            _symmetric(
                0.0001488193037682854, 0, 0.00014913921739033597, 3.0991871808848403e-06 * left, 2.690086377949433e-06
            ),
        ]
        anchor += [(0.1946 * front, 0.0875 * left, 0), (0, 0.014 * left, 0), (0, 0.03745 * left, -_THIGH)]
        parent += [0, hip, hip + 1]
        links += [f"{name}_shoulder", f"{name}_upper_leg", f"{name}_lower_leg"]
        joints += [f"{name}_HAA", f"{name}_HFE", f"{name}_KFE"]
    limits = np.tile(LIMITS, 4)
    return make_robot(
        mass=mass,
        com=com,
        inertia=inertia,
        axis=[(1, 0, 0), (0, 1, 0), (0, 1, 0)] * 4,
        anchor=anchor,
        parent=parent,
        rotor_inertia=[ROTOR_INERTIA] * 12,
        gear_ratio=[GEAR_RATIO] * 12,
        lower=-limits,
        upper=limits,
        link_names=links,
        joint_names=joints,
        name="quadruped",
        capsules=list(_capsules()),
        notes=(
            "Solo12 (Grimminger et al. 2020), numbers of its public URDF",
            "joint limits, rotors and capsules are chosen",
        ),
    )


def _capsules() -> Iterator[Capsule]:
    yield Capsule("body", (-0.16, 0.035, 0), (0.16, 0.035, 0), 0.045)
    yield Capsule("body", (-0.16, -0.035, 0), (0.16, -0.035, 0), 0.045)
    for name, front, left in (("FL", 1, 1), ("FR", 1, -1), ("HL", -1, 1), ("HR", -1, -1)):
        yield Capsule(f"{name}_shoulder", (-0.10 * front, 0.01 * left, 0), (0, 0.01 * left, 0), 0.026)
        yield Capsule(f"{name}_upper_leg", (0, 0.0255 * left, 0), (0, 0.0255 * left, -_THIGH), 0.021)
        yield Capsule(f"{name}_lower_leg", (0, 0.008 * left, 0), (0, 0.008 * left, -_THIGH), 0.014)


def _symmetric(xx: float, xy: float, yy: float, yz: float, zz: float) -> np.ndarray:
    return np.array([[xx, xy, 0], [xy, yy, yz], [0, yz, zz]])

"""An astronaut in shirt sleeves: trunk with head, two arms, two legs, fourteen joints (after Kane and Scher 1970).

**Published** (de Leva, J. Biomechanics 29(9), 1996, table 4, male): mass, length, centre of mass and radii of gyration
of each segment, in shares of a body of 73 kg and of the segment's length; mean lengths. Typed from memory and then
compared with what other programs have from that table (BioBuddy 0.3.2 and two others): limbs, trunk and head agree
digit by digit, the hand's radii once scaled by a length of the hand that is inferred. Hands stay in
line with the forearms, feet at right angles to the shanks, the head in line with the trunk.

**Chosen**: breadths between the joint centres of shoulders and hips, the height of the ankle, the limits (rounded below
usual ranges of motion), no rotors (muscles have none), and the capsules, a little thinner than people are, so that
arms hang clear.

At `theta = 0` the body is straight, arms down: x forwards, y to the left, **z along the body, up**. Base frame: midway
between the hip joints. Positive angles flex (arms, forearms and thighs forwards, shanks backwards), abduct, and turn
the upper arms inwards.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from reojax.capsules import Capsule
from reojax.robot import Robot, make_robot
from reojax.robots.parts import Solid, join

TOTAL_MASS = 73.0
"""Mass of the body [kg] (de Leva 1996, the mean of his male subjects)."""
SHOULDER, HIP, ANKLE = 0.21, 0.09, 0.045
"""Half the distance of the shoulder joints and of the hip joints, height of the heel under the ankle [m] (chosen)."""


class Segment(NamedTuple):
    """One row of de Leva's table 4."""

    share: float
    """Of the body's mass [%]."""
    length: float
    """Length [m]."""
    centre: float
    """Centre of mass from the first end [% of the length]."""
    radii: tuple[float, float, float]
    """Radii of gyration about the sagittal, transverse and longitudinal axes [% of the length]."""

    def solid(self, start: Sequence[float], along: Sequence[float], frame: np.ndarray | None = None) -> Solid:
        """As a body with its first end at `start`, pointing to `along`; the columns of `frame` are its three axes."""
        mass = TOTAL_MASS * self.share / 100
        moments = mass * (np.array(self.radii) / 100 * self.length) ** 2
        axes = np.eye(3) if frame is None else frame
        centre = np.asarray(start, float) + self.centre / 100 * self.length * np.asarray(along, float)
        return Solid(mass, centre, axes @ np.diag(moments) @ axes.T)


HEAD = Segment(6.94, 0.2033, 59.76, (36.2, 37.6, 31.2))
TRUNK = Segment(43.46, 0.5319, 44.86, (37.2, 34.7, 19.1))
UPPER_ARM = Segment(2.71, 0.2817, 57.72, (28.5, 26.9, 15.8))
FOREARM = Segment(1.62, 0.2689, 45.74, (27.6, 26.5, 12.1))
HAND = Segment(0.61, 0.0862, 79.00, (62.8, 51.3, 40.1))
THIGH = Segment(14.16, 0.4222, 40.95, (32.9, 32.9, 14.9))
SHANK = Segment(4.33, 0.4340, 44.59, (25.5, 24.9, 10.3))
FOOT = Segment(1.37, 0.2581, 44.15, (25.7, 24.5, 12.4))
SHOULDER_HEIGHT, VERTEX = 0.5155, 0.8462
"""Of the shoulder joints and of the top of the head, over the hip joints [m] (de Leva: 515.5, 242.9 + 603.3 mm)."""

_DOWN, _UP = (0, 0, -1), (0, 0, 1)
_FLEX, _KNEE = (0, -1, 0), (0, 1, 0)
_LIMITS = {  # degrees, chosen
    "shoulder_flexion": (-50, 170),
    "shoulder_abduction": (-5, 120),
    "shoulder_rotation": (-60, 80),
    "elbow": (0, 140),
    "hip_flexion": (-20, 110),
    "hip_abduction": (-10, 45),
    "knee": (0, 125),
}


def astronaut() -> Robot:
    """Build a straight human body of 73 kg with four joints in each arm and three in each leg.

    The shoulder's three joints and the hip's two meet in one point each; the links between them have no mass. Frames,
    published and chosen numbers are in this module's docstring. It has no `Layout`: `free_path` turns it.
    """
    nothing = Solid(0.0, np.zeros(3), np.zeros((3, 3)))
    trunk = join(
        TRUNK.solid((0, 0, TRUNK.length), _DOWN),
        HEAD.solid((0, 0, VERTEX), _DOWN),
    )
    upper_arm, thigh = UPPER_ARM.solid((0, 0, 0), _DOWN), THIGH.solid((0, 0, 0), _DOWN)
    forearm = join(FOREARM.solid((0, 0, 0), _DOWN), HAND.solid((0, 0, -FOREARM.length), _DOWN))
    forwards = np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]])  # the foot's longitudinal axis is x
    foot = FOOT.solid((-0.25 * FOOT.length, 0, -SHANK.length - ANKLE), (1, 0, 0), forwards)
    shank = join(SHANK.solid((0, 0, 0), _DOWN), foot)

    links, names, joints, axes, anchors, parents = [trunk], ["trunk"], [], [], [], []
    for side, left in (("left", 1), ("right", -1)):
        first = len(links)
        links += [nothing, nothing, upper_arm, forearm]
        names += [f"{side}_{part}" for part in ("shoulder_1", "shoulder_2", "upper_arm", "forearm")]
        joints += [f"{side}_{j}" for j in ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow")]
        axes += [_FLEX, (left, 0, 0), (0, 0, -left), _FLEX]
        anchors += [(0, SHOULDER * left, SHOULDER_HEIGHT), (0, 0, 0), (0, 0, 0), (0, 0, -UPPER_ARM.length)]
        parents += [0, first, first + 1, first + 2]
    for side, left in (("left", 1), ("right", -1)):
        first = len(links)
        links += [nothing, thigh, shank]
        names += [f"{side}_{part}" for part in ("hip", "thigh", "shank")]
        joints += [f"{side}_{j}" for j in ("hip_flexion", "hip_abduction", "knee")]
        axes += [_FLEX, (left, 0, 0), _KNEE]
        anchors += [(0, HIP * left, 0), (0, 0, 0), (0, 0, -THIGH.length)]
        parents += [0, first, first + 1]
    limits = np.deg2rad([_LIMITS[joint.partition("_")[2]] for joint in joints])
    return make_robot(
        mass=[link.mass for link in links],
        com=[link.com for link in links],
        inertia=[link.inertia for link in links],
        axis=axes,
        anchor=anchors,
        parent=parents,
        lower=limits[:, 0],
        upper=limits[:, 1],
        link_names=names,
        joint_names=joints,
        name="astronaut",
        capsules=list(_capsules()),
        notes=(
            "segments: de Leva 1996, table 4, male, 73 kg",
            "joint breadths, limits and capsules are chosen; no rotors",
        ),
    )


def _capsules() -> Iterator[Capsule]:
    for y in (-0.05, 0.05):
        yield Capsule("trunk", (0, y, 0.02), (0, y, 0.44), 0.1)
    yield Capsule("trunk", (0, 0, 0.66), (0, 0, VERTEX - 0.09), 0.09)
    for side in ("left", "right"):
        yield Capsule(f"{side}_upper_arm", (0, 0, -0.02), (0, 0, -UPPER_ARM.length), 0.045)
        wrist = -FOREARM.length
        yield Capsule(f"{side}_forearm", (0, 0, -0.02), (0, 0, wrist - HAND.length), 0.038)
        yield Capsule(f"{side}_thigh", (0, 0, -0.09), (0, 0, -THIGH.length), 0.07)
        ankle = -SHANK.length
        yield Capsule(f"{side}_shank", (0, 0, -0.02), (0, 0, ankle), 0.05)
        heel, toes = -0.25 * FOOT.length, 0.75 * FOOT.length
        yield Capsule(f"{side}_shank", (heel + 0.035, 0, ankle - 0.01), (toes - 0.035, 0, ankle - 0.01), 0.035)

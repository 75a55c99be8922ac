"""The four-link robot of the thesis (chapter 2.6).

At `theta = 0` the robot is straight and its long axis is z:

    z ^    link 0: end link, an L: shank along z, foot near +y       <- base, the thesis's link 1
      |    ---- joint 0, twist, about -z
      |    link 1: middle link
      |    ---- joint 1, bend, about +x
      |    link 2: middle link
      |    ---- joint 2, twist, about -z
           link 3: end link, a second copy of link 0 turned by half a turn about y

Base frame: origin on joint 0. **Roll is about z, yaw about y, pitch about x** (the bend axis). In ZXZ angles roll is
the first one; where the second one is zero, only the sum of first and third means anything, and that is the roll.

The twist axes point from the base outwards along the chain. So the roll of manoeuvre A has the sign of its twist,
whichever way the centre bends: `manoeuvre_a(+270 deg, .)` rolls by a positive angle, as the measured +3.35 rad.
Positive bend folds the robot over its feet, as a cat folds over its paws; the fit is for this bend. Negative bend folds
it the other way, and A then rolls less (130 degrees) and tips more (6).

**Published** (thesis 2.6, and the grids of figures 2.8 and 2.9): total mass, end link inertia, rotor inertia, gear
ratio, steel in the ends of the end links, the motors of joints 0 and 2 inside links 1 and 2, and one motor for the
centre joint. That motor is chosen to sit in link 1; its rotor is all that tells the two halves apart.

**Chosen** is everything in `Chosen`, because the thesis keeps it in a CAD model: sizes, split of the mass, shape of
the end links. Both end links are the same part, so but for the centre rotor the robot is symmetric under a half turn
about y. The foot leaves the bending plane (y-z) by `foot_angle`. Ends that mirror each other would make A a pure roll,
however they are built; this way it has an off-axis part, and the feet pass each other in A. (They meet in some of the
others: `manoeuvre_b(-270 deg, 120 deg)` is one.) Its capsules contain the parts: of a middle link the whole cylinder,
rounded over its ends, of an end link shank, foot and the ball about the insert's corners.

**Fitted.** `experiments/fit_prototype.py` finds length and radius of the middle links and the foot angle from three
aims: A at 270/120 degrees rolls by 185 degrees and tips the roll axis by 2, and the roll peaks at an end link inertia
of 100 kg mm^2 (figure 2.8). The values here are the fitted ones, rounded. Mass split and shape of the L were picked
by hand so that A grows smoothly with its amplitudes (figure 2.7) and B is strong enough to be of use.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from reojax.capsules import Capsule
from reojax.manoeuvres import FOUR_BODY
from reojax.robot import Robot, make_robot
from reojax.robots.parts import Solid, cube, cylinder, half_turn_y, join

TOTAL_MASS = 0.3
"""Mass of the robot [kg] (thesis 2.6)."""
END_INERTIA = 70e-6
"""Inertia of an end link about its distal joint's axis [kg m^2] (thesis figures 2.8 and 2.9)."""
ROTOR_INERTIA = 0.1e-6
"""Inertia of a motor's rotor [kg m^2] (thesis 2.6, maxon RE-max 17)."""
GEAR_RATIO = 24.0
"""Rotor turns per joint turn (thesis 2.6)."""
TWIST_LIMIT = np.deg2rad(270)
"""Largest angle of the distal joints, either way [rad] (the range of thesis figures 1.9 and 2.7)."""
BEND_LIMIT = np.deg2rad(120)
"""Largest angle of the centre joint, either way [rad] (the range of thesis figures 1.9 and 2.7)."""


class Chosen(NamedTuple):
    """What the thesis does not publish; every number here is chosen."""

    middle_length: float = 0.064
    """Length of a middle link, distal joint to centre joint [m]; fitted."""
    middle_radius: float = 0.0256
    """Radius of a middle link, taken as a uniform cylinder [m]; fitted. It has to house a 17 mm motor."""
    foot_angle: float = 0.287
    """Angle by which the first foot leaves the bending plane, from +y towards -x [rad]; fitted."""
    middle_mass: float = 0.08
    """Mass of a middle link, motors included [kg]."""
    shank_mass: float = 0.058
    """Mass of the shank of an end link [kg]."""
    foot_mass: float = 0.005
    """Mass of the foot of an end link, without the steel insert, which has the rest of the total mass [kg]."""
    shank_length: float = 0.05
    """Length of the shank, from the distal joint to the foot [m]."""
    rod_radius: float = 0.006
    """Radius of shank and foot [m]."""
    insert_side: float = 0.01
    """Side of the steel insert, a cube at the far end of the foot [m]."""

    @property
    def insert_mass(self) -> float:
        """Mass of a steel insert [kg]: what the other parts leave of the published total."""
        return TOTAL_MASS / 2 - self.middle_mass - self.shank_mass - self.foot_mass

    @property
    def foot_length(self) -> float:
        """Distance from the distal joint's axis to the insert [m], set by the published end link inertia."""
        thick = self.shank_mass * self.rod_radius**2 / 2 + self.foot_mass * self.rod_radius**2 / 4
        thick += self.insert_mass * self.insert_side**2 / 6
        return float(np.sqrt((END_INERTIA - thick) / (self.foot_mass / 3 + self.insert_mass)))

    @property
    def foot_direction(self) -> np.ndarray:
        """(3,) where the first foot points, unit length."""
        return np.array([-np.sin(self.foot_angle), np.cos(self.foot_angle), 0.0])


def prototype(chosen: Chosen | None = None) -> Robot:
    """Build the thesis's prototype: four links, three joints, L-shaped end links (thesis 2.6).

    Frames, signs and sources are in this module's docstring. Manoeuvre A at 270/120 degrees rolls it by
    185 degrees (unwrapped: R itself shows -175) and tips its roll axis by 2; B yaws it by 45, the other way about y.

    Args:
        chosen: the unpublished numbers; default the fitted ones.

    Raises:
        ValueError: if they leave nothing of the total mass for the inserts, or make a link that no body can be.
    """
    chosen = Chosen() if chosen is None else chosen
    if not chosen.insert_mass > 0:
        raise ValueError(
            f"the chosen parts leave {chosen.insert_mass:.6g} kg for each steel insert; it must be positive, so that "
            f"the robot weighs {TOTAL_MASS} kg in all."
        )
    middle = middle_link(chosen)
    first = _end_link(chosen)
    links = (first, middle, middle, half_turn_y(first))
    to_next = (0.0, 0.0, -chosen.middle_length)
    return make_robot(
        mass=[link.mass for link in links],
        com=[link.com for link in links],
        inertia=[link.inertia for link in links],
        axis=[(0, 0, -1), (1, 0, 0), (0, 0, -1)],
        anchor=[(0, 0, 0), to_next, to_next],
        rotor_inertia=[ROTOR_INERTIA] * 3,
        gear_ratio=[GEAR_RATIO] * 3,
        rotor_on=["child", "parent", "parent"],  # links 1, 1, 2: thesis 2.6, the middle one chosen
        lower=[-TWIST_LIMIT, -BEND_LIMIT, -TWIST_LIMIT],
        upper=[TWIST_LIMIT, BEND_LIMIT, TWIST_LIMIT],
        joint_names=["twist1", "bend", "twist2"],
        layout=FOUR_BODY,
        capsules=[
            *_end_capsules(0, chosen, 1.0),
            middle_capsule(1, chosen),
            middle_capsule(2, chosen),
            *_end_capsules(3, chosen, -1.0),
        ],
        name="prototype",
    )


def middle_link(chosen: Chosen) -> Solid:
    """Middle link, hanging along -z from its inboard joint at the origin."""
    length = chosen.middle_length
    return cylinder(chosen.middle_mass, chosen.middle_radius, length, centre=(0, 0, -length / 2), along=(0, 0, 1))


def shank(chosen: Chosen, *, start: float) -> Solid:
    """Shank of an end link, along z, its lower end at height `start` [m]."""
    centre = (0, 0, start + chosen.shank_length / 2)
    return cylinder(chosen.shank_mass, chosen.rod_radius, chosen.shank_length, centre=centre, along=(0, 0, 1))


def foot(chosen: Chosen, *, heel: ArrayLike, along: ArrayLike) -> Solid:
    """Foot with its steel insert, from `heel` [m] in direction `along` (unit length)."""
    heel, along = np.asarray(heel, float), np.asarray(along, float)
    length = chosen.foot_length
    rod = cylinder(
        chosen.foot_mass, chosen.rod_radius, length, centre=tuple(heel + along * length / 2), along=tuple(along)
    )
    return join(rod, cube(chosen.insert_mass, chosen.insert_side, centre=tuple(heel + along * length)))


def _end_link(chosen: Chosen) -> Solid:
    """First end link, standing along +z on joint 0 at the origin."""
    top = np.array([0.0, 0.0, chosen.shank_length])
    return join(shank(chosen, start=0.0), foot(chosen, heel=top, along=chosen.foot_direction))


def middle_capsule(link: int, chosen: Chosen) -> Capsule:
    """Shape of a middle link: its cylinder, with a round end at either joint."""
    return Capsule(link, np.zeros(3), np.array([0.0, 0.0, -chosen.middle_length]), chosen.middle_radius)


def foot_capsules(link: int, chosen: Chosen, *, heel: ArrayLike, along: ArrayLike) -> list[Capsule]:
    """Shape of a foot: its rod, and the ball through the corners of the insert."""
    heel, along = np.asarray(heel, float), np.asarray(along, float)
    tip = heel + chosen.foot_length * along
    return [
        Capsule(link, heel, tip, chosen.rod_radius),
        Capsule(link, tip, tip, np.sqrt(0.75) * chosen.insert_side),
    ]


def _end_capsules(link: int, chosen: Chosen, side: float) -> list[Capsule]:
    """Shape of an end link; `side` -1 turns it by half a turn about y, as the last link."""
    turn = np.array([side, 1.0, side])
    heel = turn * (0.0, 0.0, chosen.shank_length)
    shin = Capsule(link, np.zeros(3), heel, chosen.rod_radius)
    return [shin, *foot_capsules(link, chosen, heel=heel, along=turn * chosen.foot_direction)]

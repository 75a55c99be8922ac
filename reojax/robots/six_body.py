"""The thesis's cat in full: six links, five joints, with feet that fold (thesis 1.4)."""

import numpy as np

from reojax.capsules import Capsule
from reojax.manoeuvres import SIX_BODY
from reojax.robot import Robot, make_robot
from reojax.robots.parts import half_turn_y
from reojax.robots.prototype import (
    BEND_LIMIT,
    GEAR_RATIO,
    ROTOR_INERTIA,
    TWIST_LIMIT,
    Chosen,
    foot,
    foot_capsules,
    middle_capsule,
    middle_link,
    shank,
)


def six_body() -> Robot:
    """Build the six-link cat: the prototype with its feet on joints of their own (thesis 1.4).

    At `theta = 0` all six links lie along z, the base (first foot) on top. Axes as on the prototype: roll about z,
    yaw about y, pitch about x. Joints 1 and 3 twist about -z, joint 2 bends about +x. Joints 0 and 4 fold the feet
    about axes near +x and -x; at the angles (pi/2, -pi/2) of `SIX_BODY` each foot stands on its shank exactly as on
    the prototype, and the robot is then the same mechanism, seen from the first foot. Base frame: origin on joint 0.

    Sources: the numbers of `prototype()`, parts and masses included. Chosen: folding joints with the prototype's motor
    and gears, in the shanks, their mass within the shanks'; folding angles from -90 to +90 degrees.
    """
    chosen = Chosen()
    middle = middle_link(chosen)
    shin = shank(chosen, start=-chosen.shank_length)
    first = foot(chosen, heel=(0, 0, 0), along=(0, 0, 1))
    links = (first, shin, middle, middle, shin, half_turn_y(first))
    fold = np.cross(chosen.foot_direction, (0, 0, 1))  # a quarter turn takes the foot from z to its direction
    down_shank, down_middle = (0, 0, -chosen.shank_length), (0, 0, -chosen.middle_length)
    upper = np.array([np.pi / 2, TWIST_LIMIT, BEND_LIMIT, TWIST_LIMIT, np.pi / 2])
    return make_robot(
        mass=[link.mass for link in links],
        com=[link.com for link in links],
        inertia=[link.inertia for link in links],
        axis=np.array([fold, (0, 0, -1), (1, 0, 0), (0, 0, -1), fold * (-1, 1, -1)]),
        anchor=[(0, 0, 0), down_shank, down_middle, down_middle, down_shank],
        rotor_inertia=[ROTOR_INERTIA] * 5,
        gear_ratio=[GEAR_RATIO] * 5,
        rotor_on=["child", "child", "parent", "parent", "parent"],
        lower=-upper,
        upper=upper,
        link_names=["foot1", "shank1", "middle1", "middle2", "shank2", "foot2"],
        joint_names=["fold1", "twist1", "bend", "twist2", "fold2"],
        capsules=[
            *foot_capsules(0, chosen, heel=(0, 0, 0), along=(0, 0, 1)),
            Capsule(1, np.zeros(3), down_shank, chosen.rod_radius),
            middle_capsule(2, chosen),
            middle_capsule(3, chosen),
            Capsule(4, np.zeros(3), down_shank, chosen.rod_radius),
            *foot_capsules(5, chosen, heel=(0, 0, 0), along=(0, 0, -1)),
        ],
        layout=SIX_BODY,
        name="six_body",
    )

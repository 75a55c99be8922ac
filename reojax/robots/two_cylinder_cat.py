"""The falling cat of Kane and Scher (1969): two equal cylinders that bend at the waist and roll without twist."""

import numpy as np

from reojax._internal.checks import number
from reojax.capsules import Capsule
from reojax.robot import Robot, make_robot
from reojax.robots.parts import Solid, cylinder

_MASS = 1.5
"""Mass of each half [kg] (chosen; it plays no part)."""
_RADIUS = 0.05
"""Radius of each half [m] (chosen; it plays no part)."""
_WAIST = 0.1
"""Share of a half's mass in its waist link (chosen; it plays no part)."""


def two_cylinder_cat(axial_to_transverse: float) -> Robot:
    """Build the two-cylinder cat: front half, waist, waist, rear half, straight along z at `theta = 0`.

    T. R. Kane and M. P. Scher, "A dynamical explanation of the falling cat phenomenon", Int. J. Solids Structures 5
    (1969). Bent by the angle g, with both halves rolled once about their own axes, the cat turns about z by

        2 pi j cos(g/2) / (sin^2(g/2) + j cos^2(g/2)),    j = `axial_to_transverse`.

    `manoeuvre_a(-2 pi, g)` is that loop, and `manoeuvre_a(2 pi, g)` the opposite turn: bend, a full turn of both spin
    joints, unbend; the last edge turns the spin joints back in the straight pose, where the halves stay at rest. Along
    the way the base makes a full turn the other way with its own spin, which leaves its net rotation as it is.

    Axes as on the prototype: roll about z, yaw about y, pitch about x; joints 0 and 2 spin the halves about -z, joint
    1 bends about x. Base: front half, frame on joint 0. No joint limits. Each half has two capsules, its part next to
    the waist and the one beyond it: the two at the waist always touch, the others must stay clear.

    *Why it is exact.* A hinge that both bends and rolls needs a waist link between bend and spin, which must have some
    mass. Each half is one uniform cylinder, shared out: the waist link has a tenth of its mass and inertia, and a
    rotor with ratio 1 on the spin joint, which turns with the half and has all of the waist's axial inertia. So all of
    the cylinder's axial inertia spins, none stays with the waist, and the transverse part does not care.

    Args:
        axial_to_transverse: axial inertia over transverse inertia of a half about its centre of mass; above 0, below 2
            (a disc). It sets the length of the halves; their mass and radius are chosen.

    Raises:
        ValueError: if the ratio is outside these bounds.
    """
    ratio = number("axial_to_transverse", axial_to_transverse)
    if not 0 < ratio < 2:
        raise ValueError(f"`axial_to_transverse` is {axial_to_transverse}; a cylinder has it above 0 and below 2.")
    length = _RADIUS * np.sqrt(6 / ratio - 3)  # axial m r^2 / 2, transverse m (3 r^2 + l^2) / 12

    def half(share: float, centre: float) -> Solid:
        return cylinder(share * _MASS, _RADIUS, length, centre=(0, 0, centre), along=(0, 0, 1))

    front, rear = length / 2, -length / 2
    links = (half(1 - _WAIST, front), half(_WAIST, front), half(_WAIST, rear), half(1 - _WAIST, rear))
    spin = links[1].inertia[2, 2]
    return make_robot(
        mass=[link.mass for link in links],
        com=[link.com for link in links],
        inertia=[link.inertia for link in links],
        axis=[(0, 0, -1), (1, 0, 0), (0, 0, -1)],
        anchor=np.zeros((3, 3)),
        rotor_inertia=[spin, 0.0, spin],
        gear_ratio=[1.0, 1.0, 1.0],
        rotor_on=["child", "parent", "parent"],
        link_names=["front", "waist1", "waist2", "rear"],
        joint_names=["spin1", "bend", "spin2"],
        capsules=[
            Capsule(link, (0, 0, side * share * length), (0, 0, side * (share + 0.5) * length), _RADIUS)
            for link, side in ((0, 1), (3, -1))
            for share in (0.0, 0.5)
        ],
        name="two_cylinder_cat",
    )

"""A free-flying satellite with a seven-joint shoulder-elbow-wrist arm (thesis 1.9: space robots with time to spare).

The arm is Kinova's Gen3 with seven joints, **published** by its maker in `ros_kortex`, `gen3_macro.xacro`, 7dof,
without the vision module: masses, centres of mass, inertias, joint places, axes and the limits of joints 2, 4 and 6.

**Chosen**: the bus, a uniform cube of 100 kg and 0.6 m, so that the arm has 8 % of the bus's mass, as Orbital Express's
arm had of its satellite; the arm stands on the middle of the cube's face towards +z; one turn either way for joints 1,
3, 5 and 7, which the maker leaves continuous (a cable of the bus would not be); rotors of `ROTOR_INERTIA` behind
strain wave gears of 100:1, on the parent's side; the capsules: round arm links, and four that contain the cube.

At `theta = 0` the arm is stretched along z. Base frame: at the centre of the cube, parallel to its edges.
"""

from collections.abc import Iterator

import numpy as np

from reojax.capsules import Capsule
from reojax.robot import Robot, make_robot
from reojax.robots.parts import Solid, cube, join

BUS_MASS, BUS_SIDE = 100.0, 0.6
"""Mass [kg] and side [m] of the bus (chosen)."""
ROTOR_INERTIA = 5e-6
"""Inertia of a motor's rotor [kg m^2] (chosen)."""
GEAR_RATIO = 100.0
"""Rotor turns per joint turn (chosen, usual for strain wave gears)."""

_QUARTER = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
"""A quarter turn about x, by which the file's frames differ from one link to the next."""
_FRAMES = [np.linalg.matrix_power(_QUARTER, k) for k in (2, 3, 2, 3, 2, 3, 2)]
"""Orientation of each arm link's frame in the file, seen from the arm's foot, at the joint angles zero."""
_FOOT = (1.697, (-0.000648, -0.000166, 0.084487), (0.004622, 9e-06, 6e-05, 0.004495, 9e-06, 0.002079))
"""Mass, centre of mass and inertia (xx, xy, xz, yy, yz, zz) of the arm's foot, fixed to the bus."""
_LINKS = (
    (1.3773, (-2.3e-05, -0.010364, -0.07336), (0.00457, 1e-06, 2e-06, 0.004831, 0.000448, 0.001409)),
    (1.1636, (-4.4e-05, -0.09958, -0.013278), (0.011088, 5e-06, 0.0, 0.001072, -0.000691, 0.011255)),
    (1.1636, (-4.4e-05, -0.006641, -0.117892), (0.010932, 0.0, -7e-06, 0.011127, 0.000606, 0.001043)),
    (0.9302, (-1.8e-05, -0.075478, -0.015006), (0.008147, -1e-06, 0.0, 0.000631, -0.0005, 0.008316)),
    (0.6781, (1e-06, -0.009432, -0.063883), (0.001596, 0.0, 0.0, 0.001607, 0.000256, 0.000399)),
    (0.6781, (1e-06, -0.045483, -0.00965), (0.001641, 0.0, 0.0, 0.00041, -0.000278, 0.001641)),
    (0.364, (-9.3e-05, 0.000132, -0.022905), (0.000214, 0.0, 1e-06, 0.000223, -2e-06, 0.00024)),
)
"""The same of the arm's links, in the file's frames."""
_PLACES = (
    (0, 0, 0.15643),
    (0, 0.005375, -0.12838),
    (0, -0.21038, -0.006375),
    (0, 0.006375, -0.21038),
    (0, -0.20843, -0.006375),
    (0, 0.00017505, -0.10593),
    (0, -0.10593, -0.00017505),
)
"""Where each joint sits in its parent's frame in the file."""
_FLANGE = (0, 0, -0.061525)
"""End of the arm in the last link's frame in the file."""
_LIMITS = (2 * np.pi, 2.41, 2 * np.pi, 2.66, 2 * np.pi, 2.23, 2 * np.pi)
_RADII = (0.047, 0.047, 0.046, 0.046, 0.040, 0.039, 0.039)
_LINK_NAMES = ("shoulder", "half_arm_1", "half_arm_2", "forearm", "wrist_1", "wrist_2", "bracelet")


def satellite_arm() -> Robot:
    """Build a satellite of 108 kg with the seven-joint Kinova Gen3 arm.

    Frames, published and chosen numbers are in this module's docstring. It has no `Layout`: `free_path` turns it.
    """
    foot = _body(*_FOOT, np.eye(3), np.array([0, 0, BUS_SIDE / 2]))
    links = [join(cube(BUS_MASS, BUS_SIDE, centre=(0, 0, 0)), foot)]
    links += [_body(*link, frame, np.zeros(3)) for link, frame in zip(_LINKS, _FRAMES, strict=True)]
    anchor = [frame @ place for frame, place in zip([np.eye(3), *_FRAMES], np.array(_PLACES), strict=False)]
    anchor[0] += (0, 0, BUS_SIDE / 2)
    limits = np.array(_LIMITS)
    return make_robot(
        mass=[link.mass for link in links],
        com=[link.com for link in links],
        inertia=[link.inertia for link in links],
        axis=[frame[:, 2] for frame in _FRAMES],
        anchor=anchor,
        rotor_inertia=[ROTOR_INERTIA] * 7,
        gear_ratio=[GEAR_RATIO] * 7,
        lower=-limits,
        upper=limits,
        link_names=["bus", *_LINK_NAMES],
        joint_names=[f"joint_{k}" for k in range(1, 8)],
        name="satellite_arm",
        capsules=list(_capsules(np.array(anchor))),
        notes=(
            "arm: Kinova Gen3, 7 joints, as its maker publishes it (ros_kortex)",
            "bus, motors, capsules and the limits of joints 1, 3, 5 and 7 are chosen",
        ),
    )


def _body(mass: float, com: tuple, inertia: tuple, frame: np.ndarray, origin: np.ndarray) -> Solid:
    """A link of the file, its numbers turned into the frame that it has at `theta = 0`."""
    xx, xy, xz, yy, yz, zz = inertia
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Solid(mass, origin + frame @ com, frame @ matrix @ frame.T)


def _capsules(anchor: np.ndarray) -> Iterator[Capsule]:
    # Four capsules along x contain the cube: each has a quarter of its section, and spheres that hold the corners.
    quarter, radius = BUS_SIDE / 4, 0.4 * BUS_SIDE
    end = BUS_SIDE / 2 - np.sqrt(radius**2 - 2 * quarter**2)
    for y in (-quarter, quarter):
        for z in (-quarter, quarter):
            yield Capsule("bus", (-end, y, z), (end, y, z), radius)
    top = np.array([0, 0, BUS_SIDE / 2])
    yield Capsule("bus", top, anchor[0], 0.050)
    ends = [*anchor[1:], _FRAMES[-1] @ _FLANGE]
    for name, radius, end in zip(_LINK_NAMES, _RADII, ends, strict=True):
        yield Capsule(name, (0, 0, 0), end, radius)

"""What planning asks of a robot and its layout, or a `ValueError`."""

from collections.abc import Hashable
from typing import Any

import jax
import numpy as np

from reojax._internal.checks import on_host
from reojax.manoeuvres import Layout, check_layout
from reojax.mechanics.input_checks import check_robot
from reojax.robot import Robot, layout_of

OBJECTIVES = ("count", "travel")


def key_of(robot: Robot) -> Hashable:
    """Return what a robot is, down to the last bit, as a key to keep things under; names do not count."""
    leaves = (np.asarray(leaf) for leaf in jax.tree.leaves(robot))
    numbers = ((leaf.dtype.str, leaf.shape, leaf.tobytes()) for leaf in leaves)
    structure = robot.parent, robot.rotor_on, robot.capsule_link, robot.collision_pairs, robot.couplings, robot.layout
    return structure, *numbers


def a_robot(robot: Any) -> None:
    """Refuse what is no robot of concrete numbers."""
    check_robot(robot)
    on_host("robot", robot, "planning")


def robot_and_layout(robot: Any, layout: Layout | None) -> Layout:
    """Return the layout, by default the robot's own."""
    a_robot(robot)
    if layout is None:
        layout = layout_of(robot)
    check_layout(layout)
    if layout.joints != robot.joints:
        raise ValueError(f"`layout` is for {layout.joints} joints; {robot.name!r} has {robot.joints}.")
    return layout

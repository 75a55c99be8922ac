"""reojax: how a robot in free fall turns itself with its own joints, differentiably, in JAX."""

from reojax import robots as robots, so3 as so3
from reojax.certificate import Certificate as Certificate, certify as certify
from reojax.curvature import curvature as curvature
from reojax.holonomy import net_rotation as net_rotation, rotation_history as rotation_history
from reojax.manoeuvres import (
    FOUR_BODY as FOUR_BODY,
    SIX_BODY as SIX_BODY,
    Layout as Layout,
    manoeuvre_a as manoeuvre_a,
    manoeuvre_b as manoeuvre_b,
)
from reojax.momentum import (
    angular_momentum as angular_momentum,
    connection as connection,
    momentum_matrices as momentum_matrices,
)
from reojax.path import Path as Path, joint_travel as joint_travel, polygon as polygon
from reojax.robot import Robot as Robot, make_robot as make_robot
from reojax.sweep import Sweep as Sweep, sweep as sweep, zipped as zipped

"""A robot in units of its own mass and size, and a robot without what the mechanics does not read.

A net rotation depends on ratios of masses and of lengths alone. In units of the robot's own no square or determinant
leaves the range of the floating point numbers, whatever the units of the data.
"""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from reojax.robot import Robot

_NO_VECTORS, _NO_NUMBERS = np.zeros((0, 3)), np.zeros(0)


def in_own_units(robot: Robot) -> Robot:
    """The robot, of arrays of one dtype, measured by its own mass and by its longest lever arm or radius of gyration.

    The units count as constants in derivatives: what the result is used for must not depend on them, and then all
    derivatives by the robot are right.
    """
    largest = [jnp.abs(array).max(initial=0.0) for array in (robot.com, robot.anchor)]
    mass = jax.lax.stop_gradient(robot.mass.sum())
    gyration = jnp.sqrt(jnp.abs(jax.lax.stop_gradient(robot.inertia)).max() / mass)
    length = jnp.maximum(gyration, jax.lax.stop_gradient(jnp.maximum(*largest)))

    def moment_of_inertia(value):
        return value / mass / length / length  # one by one: their product may be out of range

    return dataclasses.replace(
        robot,
        mass=robot.mass / mass,
        com=robot.com / length,
        inertia=moment_of_inertia(robot.inertia),
        anchor=robot.anchor / length,
        rotor_inertia=moment_of_inertia(robot.rotor_inertia),
    )


_SHAPES = {
    "capsule_start": _NO_VECTORS,
    "capsule_end": _NO_VECTORS,
    "capsule_radius": _NO_NUMBERS,
    "capsule_link": (),
    "collision_pairs": (),
}
_COUPLINGS = {"coupling_ratio": _NO_NUMBERS, "coupling_offset": _NO_NUMBERS, "couplings": ()}


def without_names(robot: Robot, *, shapes: bool = False, couplings: bool = False) -> Robot:
    """The robot without names, notes and layout; and without shapes and couplings, which the mechanics does not read.

    What is static in a robot is part of the key of every compiled program that takes it; a program that takes this one
    serves all robots of one tree.

    Args:
        robot: the robot.
        shapes: keep its capsules and pairs, for what asks for clearances.
        couplings: keep which joints follow others, for what chooses how they move.
    """
    gone = ({} if shapes else _SHAPES) | ({} if couplings else _COUPLINGS)
    names = {"link_names": ("",) * robot.links, "joint_names": ("",) * robot.joints, "name": ""}
    return dataclasses.replace(robot, layout=None, notes=(), **names, **gone)

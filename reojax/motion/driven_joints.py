"""Joints under torques of their motors: what a motor can give, and how the joints and the base then move."""

from __future__ import annotations

import jax.numpy as jnp

from reojax._internal.arrays import Array
from reojax._internal.linalg import solve_positive, solve_without_exchange
from reojax.mechanics.dynamics import joint_inertia_of_pose, joint_load, rotor_inertia_of_pose
from reojax.mechanics.kinematics import kinematics
from reojax.motion.motor import Motor
from reojax.robot import Robot

_CREEP = 1.0
"""Speed of a rotor over which friction changes its sign smoothly [rad/s]."""


def saturate(motors: Motor, command: Array, speed: Array) -> Array:
    """Torque that the motors can give of what is asked for."""
    k = motors.torque_constant
    least, most = (jnp.asarray((sign * motors.supply - k * speed) * k / motors.resistance) for sign in (-1, 1))
    return jnp.clip(command, least, most)


def joint_acceleration(
    robot: Robot, motors: Motor, command: Array, theta: Array, rate: Array, momentum: Array
) -> tuple[Array, Array]:
    """Joint accelerations and the base's angular velocity under motor torques, gears' losses included.

    With `P` the motor's torque at the joint after friction and `S(theta_ddot)` what spins up its rotor (`Load.rotor`),
    the joint gets `k (P - S) + S`, k the efficiency, or one over it while the joint drives the motor: what `drive` asks
    of the motor for this acceleration is what it gives. Whether a joint drives is decided without losses first, and
    again with those.
    """
    ratio = robot.gear_ratio
    # power P at the joint: torque within the supply, less drag and friction
    speed = ratio * rate
    friction = motors.drag * speed + motors.friction * jnp.tanh(speed / _CREEP)
    power = ratio * (saturate(motors, command, speed) - friction)
    # torque that the joints need without accelerating
    still = joint_load(robot, theta, rate, jnp.zeros_like(theta), momentum=momentum)
    pose = kinematics(robot, theta)
    inertia, rotor = joint_inertia_of_pose(robot, pose), rotor_inertia_of_pose(robot, pose)

    def respond(before: Array) -> Array:
        # which way the gear's loss goes, by the acceleration before
        driving = (power - still.rotor - rotor @ before) * rate >= 0
        k = jnp.where(driving, motors.efficiency, 1 / jnp.asarray(motors.efficiency_back))
        # k (P - S) + S = D theta_ddot + torque at rest
        lossy = inertia - (1 - k)[:, None] * rotor
        return solve_without_exchange(lossy, k * power - still.torque + (1 - k) * still.rotor)

    ideal = solve_positive(inertia, power - still.torque)
    return respond(respond(ideal)), still.omega

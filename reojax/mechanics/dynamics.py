"""Joint torques of a robot in free fall: the momentum equation and its rate, motors' rotors included.

About the centre of mass, in the base frame, the kinetic energy is a quadratic form in the base's angular
velocity and the joint rates,

    T = 1/2 omega.A omega - omega.B theta_dot + 1/2 theta_dot.D theta_dot,

with `A`, `B` of thesis eq. 2.14; `h = A omega - B theta_dot` is the total angular momentum. It stays put in
inertial space, so `omega = A^-1 (B theta_dot + h)` and `h' = -omega x h`: the joints alone are left, with the
inertia `D - B^T A^-1 B`. There is no gravity in free fall. A motor's rotor, spinning at `s theta_dot` about
its joint's axis `e` relative to the link that carries it (`s` is plus or minus the gear ratio), adds

    J s theta_dot e.w + 1/2 J (s theta_dot)^2

to the energy, `w` being the stator link's angular velocity: its inertia as a part of that link is the link's.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal.arrays import Array
from reojax._internal.linalg import solve_positive, solve_symmetric3
from reojax.mechanics.input_checks import check_motion
from reojax.mechanics.kinematics import Kinematics, kinematics, support_mask
from reojax.mechanics.momentum import inertia_in_base_frame, momentum_matrices_of_pose, rotor_spin
from reojax.robot import Robot


class Load(NamedTuple):
    """What the joints carry, and the motion of the base that goes with it."""

    torque: Float[Array, " j"]
    """Joint torques at the output side, rotors included [N m]: `inverse_dynamics`."""
    rotor: Float[Array, " j"]
    """The part of `torque` that accelerates the motor's own rotor about its axis; no gear stands before it [N m]."""
    omega: Float[Array, "3"]
    """Angular velocity of the base, base frame [rad/s]."""
    omega_dot: Float[Array, "3"]
    """Its rate, base frame [rad/s^2]."""


def inverse_dynamics(
    robot: Robot,
    theta: Float[Array, " j"],
    theta_dot: Float[Array, " j"],
    theta_ddot: Float[Array, " j"],
    *,
    momentum: Float[Array, "3"] | None = None,
) -> Float[Array, " j"]:
    """Joint torques that a motion of the joints takes in free fall [N m].

    At the output side of the gears, before friction, rotors included:
    `d/dt dT/dtheta_dot - dT/dtheta` with the base moving as the angular momentum says.

    Args:
        robot: the robot.
        theta: (j,) joint angles [rad].
        theta_dot: (j,) joint rates [rad/s].
        theta_ddot: (j,) joint accelerations [rad/s^2].
        momentum: (3,) total angular momentum about the centre of mass at this instant, in the base
            frame [kg m^2/s]; default zero.

    Raises:
        ValueError: if an argument has the wrong shape or is not finite.
    """
    robot, theta, theta_dot, theta_ddot, h = check_motion(
        robot, theta=theta, theta_dot=theta_dot, theta_ddot=theta_ddot, momentum=_or_zero(momentum)
    )
    return joint_load(robot, theta, theta_dot, theta_ddot, momentum=h).torque


def joint_load(
    robot: Robot,
    theta: Float[Array, " j"],
    theta_dot: Float[Array, " j"],
    theta_ddot: Float[Array, " j"],
    *,
    momentum: Float[Array, "3"] | None = None,
) -> Load:
    """`inverse_dynamics` with what it finds on the way: the rotors' own part, and the base's motion.

    Nothing is checked: arrays are finite and of one dtype.
    """
    h = jnp.zeros(3, theta.dtype) if momentum is None else momentum
    pose = kinematics(robot, theta)
    A, B = momentum_matrices_of_pose(robot, pose)
    # angular velocity of the base from the momentum equation, A omega = B theta_dot + h
    omega = solve_symmetric3(A, (B @ theta_dot + h)[:, None])[:, 0]
    # d'Alembert with the base's angular acceleration left out at first: it enters through A and B alone
    turn_rate, turn_acceleration, acceleration = _accelerations(robot, pose, theta_dot, theta_ddot, omega)
    spin, stator = rotor_spin(robot), _stator(robot)
    inertia = inertia_in_base_frame(robot, pose)
    # moment on each link about its centre of mass: I w' + w x I w ...
    twisting = jnp.einsum("iab,ib->ia", inertia, turn_acceleration)
    twisting = twisting + jnp.cross(turn_rate, jnp.einsum("iab,ib->ia", inertia, turn_rate))
    # ... and on its stators what changes their rotors' spin momentum J s theta_dot e
    wheel = (robot.rotor_inertia * spin)[:, None] * pose.axis
    turning = theta_ddot[:, None] * wheel + theta_dot[:, None] * jnp.cross(turn_rate[stator], wheel)
    twisting = twisting.at[stator].add(turning)
    # force on each link: m a
    pushing = robot.mass[:, None] * acceleration
    # what the joints give of both, by the Jacobians' transposes
    torque = jnp.einsum("iak,ia->k", pose.angular_jacobian, twisting)
    torque = torque + jnp.einsum("iak,ia->k", pose.linear_jacobian, pushing)
    # what spins the rotors up about their axes: J (s^2 theta_ddot + s e . w')
    rotor = robot.rotor_inertia * spin * spin * theta_ddot + (wheel * turn_acceleration[stator]).sum(1)
    # nothing turns the robot as a whole: A omega' takes back the moment that is left
    whole = (twisting + jnp.cross(pose.com, pushing)).sum(0)
    omega_dot = -solve_symmetric3(A, whole[:, None])[:, 0]
    return Load(torque + rotor - B.T @ omega_dot, rotor + wheel @ omega_dot, omega, omega_dot)


def forward_dynamics(
    robot: Robot,
    theta: Float[Array, " j"],
    theta_dot: Float[Array, " j"],
    torque: Float[Array, " j"],
    *,
    momentum: Float[Array, "3"] | None = None,
) -> Float[Array, " j"]:
    """Joint accelerations that joint torques give in free fall [rad/s^2]; undoes `inverse_dynamics`.

    Args:
        robot: the robot.
        theta: (j,) joint angles [rad].
        theta_dot: (j,) joint rates [rad/s].
        torque: (j,) joint torques at the output side of the gears, after friction [N m].
        momentum: as for `inverse_dynamics`.

    Raises:
        ValueError: if an argument has the wrong shape or is not finite.
    """
    robot, theta, theta_dot, torque, h = check_motion(
        robot, theta=theta, theta_dot=theta_dot, torque=torque, momentum=_or_zero(momentum)
    )
    if not robot.joints:
        return torque
    still = joint_load(robot, theta, theta_dot, jnp.zeros_like(theta), momentum=h).torque
    return solve_positive(joint_inertia_of_pose(robot, kinematics(robot, theta)), torque - still)


def joint_inertia(robot: Robot, theta: Float[Array, " j"]) -> Float[Array, "j j"]:
    """Inertia that the joints feel while the base floats, `D - B^T A^-1 B`, rotors included [kg m^2].

    Symmetric, positive definite; `1/2 theta_dot . M theta_dot` is the kinetic energy at zero momentum.

    Args:
        robot: the robot.
        theta: (j,) joint angles [rad].

    Raises:
        ValueError: if `theta` has the wrong shape or is not finite.
    """
    robot, theta = check_motion(robot, theta=theta)
    return joint_inertia_of_pose(robot, kinematics(robot, theta))


def joint_inertia_of_pose(robot: Robot, pose: Kinematics) -> Float[Array, "j j"]:
    """`joint_inertia` where the poses and Jacobians are known already."""
    A, B = momentum_matrices_of_pose(robot, pose)
    return _fixed_base_inertia(robot, pose) - B.T @ solve_symmetric3(A, B)


def rotor_inertia_of_pose(robot: Robot, pose: Kinematics) -> Float[Array, "j j"]:
    """How joint accelerations spin the rotors up: `Load.rotor` is this times `theta_ddot`, and its rest at 0.

    Row k is `J s e . w'` of the stator's link, whose angular acceleration `w'` has the base's in it, and `J s^2`.
    """
    A, B = momentum_matrices_of_pose(robot, pose)
    spin = rotor_spin(robot)
    turned = pose.angular_jacobian[_stator(robot)] + solve_symmetric3(A, B)[None]
    carried = jnp.einsum("k,ka,kal->kl", robot.rotor_inertia * spin, pose.axis, turned)
    return carried + jnp.diag(robot.rotor_inertia * spin * spin)


def base_velocity(
    robot: Robot,
    theta: Float[Array, " j"],
    theta_dot: Float[Array, " j"],
    *,
    momentum: Float[Array, "3"] | None = None,
) -> Float[Array, "3"]:
    """Angular velocity of the base, `A^-1 (B theta_dot + h)`, in the base frame [rad/s].

    Arguments and errors as for `inverse_dynamics`.
    """
    return _base(robot, theta, theta_dot, momentum)[-1]


def kinetic_energy(
    robot: Robot,
    theta: Float[Array, " j"],
    theta_dot: Float[Array, " j"],
    *,
    momentum: Float[Array, "3"] | None = None,
) -> Float[Array, ""]:
    """Kinetic energy about the centre of mass, rotors included [J]. Its rate is `torque . theta_dot`.

    Arguments and errors as for `inverse_dynamics`.
    """
    robot, theta_dot, pose, A, B, omega = _base(robot, theta, theta_dot, momentum)
    joints = theta_dot @ _fixed_base_inertia(robot, pose) @ theta_dot
    return 0.5 * (omega @ (A @ omega) + joints) - omega @ (B @ theta_dot)


def _base(
    robot: Robot, theta: Any, theta_dot: Any, momentum: Any
) -> tuple[Robot, Array, Kinematics, Array, Array, Array]:
    """The checked robot and joint rates, the pose, `A`, `B`, and the base's angular velocity."""
    robot, theta, theta_dot, h = check_motion(robot, theta=theta, theta_dot=theta_dot, momentum=_or_zero(momentum))
    pose = kinematics(robot, theta)
    A, B = momentum_matrices_of_pose(robot, pose)
    return robot, theta_dot, pose, A, B, solve_symmetric3(A, (B @ theta_dot + h)[:, None])[:, 0]


def _or_zero(momentum: Any) -> Any:
    return np.zeros(3) if momentum is None else momentum


def _stator(robot: Robot) -> np.ndarray:
    """(j,) link that carries each motor's stator."""
    pairs = zip(robot.parent, robot.rotor_on, strict=True)
    return np.array([p if side == "parent" else k + 1 for k, (p, side) in enumerate(pairs)], int)


def _fixed_base_inertia(robot: Robot, pose: Kinematics) -> Array:
    """`D`: inertia that the joints feel while the base does not turn."""
    spin, stator, jacobian = rotor_spin(robot), _stator(robot), pose.angular_jacobian
    # links: Ja^T I Ja + m Jl^T Jl
    links = jnp.einsum("iak,iab,ibl->kl", jacobian, inertia_in_base_frame(robot, pose), jacobian)
    links = links + jnp.einsum("i,iak,ial->kl", robot.mass, pose.linear_jacobian, pose.linear_jacobian)
    # rotors: J s e . w of the stator's link, and J s^2
    carried = jnp.einsum("k,ka,kal->kl", robot.rotor_inertia * spin, pose.axis, jacobian[stator])
    return links + carried + carried.T + jnp.diag(robot.rotor_inertia * spin * spin)


def _accelerations(
    robot: Robot, pose: Kinematics, theta_dot: Array, theta_ddot: Array, omega: Array
) -> tuple[Array, Array, Array]:
    """Of all links, base frame: angular velocity, its rate, acceleration of the centre of mass, each (n, 3).

    With the angular velocity `omega` of the base constant; the centre of mass of the robot does not accelerate.
    """
    parent, moved = np.array(robot.parent, int), support_mask(robot).astype(omega.dtype)
    w = omega[None] + pose.angular_jacobian @ theta_dot
    # each joint between adds its acceleration and, carried round by the link before, theta_dot w x e
    w_dot = moved @ (theta_ddot[:, None] * pose.axis + theta_dot[:, None] * jnp.cross(w[parent], pose.axis))
    # from joint to joint, and on to the centre of mass
    arm = pose.origin[1:] - pose.origin[parent]
    lever = jnp.einsum("iab,ib->ia", pose.rotation, robot.com)
    centre = moved @ _lever_acceleration(w[parent], w_dot[parent], arm) + _lever_acceleration(w, w_dot, lever)
    share = robot.mass / robot.mass.sum()
    return w, w_dot, centre - (share @ centre)[None]


def _lever_acceleration(rate: Array, rate_dot: Array, arm: Array) -> Array:
    """Acceleration of the end of `arm`, relative to its start, on a body that turns; all (m, 3)."""
    return jnp.cross(rate_dot, arm) + jnp.cross(rate, jnp.cross(rate, arm))

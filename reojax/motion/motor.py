"""Motors: direct current, behind a gear; what a motion asks of them, and whether they can (thesis 1.8).

A joint's load splits in two. What accelerates the motor's own rotor acts on it directly; the rest goes through
the gear, which loses a share of the power, whichever way it flows. With the motor's speed `w = N theta_dot`
and the torque `M` that its current makes,

    M = (through the gear) / (N eta) + (rotor) / N + drag w + friction sign(w)      while driving the joint,
    M = (through the gear) eta_back / N + ...                                        while driven back,
    current = M / k,      voltage = resistance current + k w,      |voltage| <= supply.

While motoring the last line is the torque-speed line `|M| <= M_stall (1 - w / w_0)`; while braking it allows
more, up to `M_stall (1 + w / w_0)`, which current limits of the electronics, not modelled, may cut.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from reojax._internal import checks
from reojax._internal.arrays import Array, as_numbers, cast, is_concrete
from reojax.mechanics.dynamics import Load
from reojax.robot import Robot


class Motor(NamedTuple):
    """Motors of a robot's joints; each field one number, or one for each joint (j,).

    The robot's own `rotor_inertia` and `gear_ratio` hold in all that follows, as in all of its mechanics:
    `with_motors` gives a robot those of its motors.
    """

    supply: float | Array
    """Supply voltage [V]."""
    resistance: float | Array
    """Terminal resistance [ohm]."""
    torque_constant: float | Array
    """Torque per current [N m/A], and voltage per speed [V s/rad]."""
    rotor_inertia: float | Array
    """Inertia of the rotor about its axis [kg m^2]."""
    gear_ratio: float | Array
    """Rotor turns per joint turn."""
    efficiency: float | Array = 1.0
    """Share of the power that reaches the joint through the gear while the motor drives it."""
    efficiency_back: float | Array = 1.0
    """Share of the power that reaches the motor through the gear while the joint drives it."""
    drag: float | Array = 0.0
    """Viscous drag on the rotor [N m s/rad]."""
    friction: float | Array = 0.0
    """Friction on the rotor that does not depend on its speed [N m]."""
    continuous_torque: float | Array = np.inf
    """Torque of the motor that it stands for ever, by its heat [N m]; compare with the root mean square."""


RE_MAX_17 = Motor(
    supply=12.0,  # the thesis's figure 3.2
    resistance=8.3,
    torque_constant=10.7e-3,
    rotor_inertia=0.868e-7,
    gear_ratio=1539 / 65,
    efficiency=0.81,
    efficiency_back=0.81,
    drag=8.87e-8,
)
"""The maxon RE-max 17 behind a GP 16 A gear of 24:1, as the thesis's prototype has at its joints (thesis 2.6).

Sources: resistance, torque constant, rotor inertia (0.868 g cm^2) and viscous drag of part 214897 as given in
public course material; whether that is the 4.5 W version of the thesis is unconfirmed. The exact gear ratio,
1539/65, is inferred from the gear's stages; its efficiency is the maker's figure for two stages, taken both
ways. The supply is that of the thesis's figure 3.2. Friction and a limit for continuous torque are not known,
and left out. The thesis itself gives 24:1 and 0.1 kg mm^2, which is what `robots.prototype()` has.
"""


class Drive(NamedTuple):
    """What a motion asks of the motors, at one instant."""

    speed: Float[Array, " j"]
    """Speed of each rotor relative to its stator, positive with the joint's rate if the gear ratio is [rad/s]."""
    torque: Float[Array, " j"]
    """Torque that each motor's current makes [N m]."""
    current: Float[Array, " j"]
    """Current [A]."""
    voltage: Float[Array, " j"]
    """Voltage at the terminals [V]."""
    margin: Float[Array, " j"]
    """`1 - |voltage| / supply`: distance to the torque-speed line in stall torques; negative beyond it."""


def stall_torque(motor: Motor) -> float | Array:
    """Torque at standstill under the full supply, `k supply / resistance` [N m].

    Args:
        motor: one motor, or many in fields of one shape, which the result has.

    Raises:
        ValueError: if `motor` is none, or has a number that no motor has.
    """
    motor = _motor(motor)
    return motor.torque_constant * motor.supply / motor.resistance


def no_load_speed(motor: Motor) -> float | Array:
    """Speed without a load under the full supply, own drag and friction included [rad/s].

    Arguments and errors as for `stall_torque`.
    """
    motor = _motor(motor)
    # supply = resistance (drag w + friction) / k + k w
    k, resistance = motor.torque_constant, motor.resistance
    return (motor.supply - resistance * motor.friction / k) / (k + resistance * motor.drag / k)


def with_motors(robot: Robot, motors: Motor | Sequence[Motor]) -> Robot:
    """Return the robot with the rotor inertias [kg m^2] and gear ratios of `motors`; for its mechanics.

    Args:
        robot: the robot, of j joints.
        motors: motors of the joints, one for all or one for each.

    Raises:
        ValueError: if the motors do not fit the robot, or hold a number that no motor has.
    """
    motors = check_motors(motors, robot, compare=False)
    return robot.replace(rotor_inertia=motors.rotor_inertia, gear_ratio=motors.gear_ratio)


def drive(robot: Robot, motors: Motor, theta_dot: Float[Array, " j"], load: Load) -> Drive:
    """What a load of the joints asks of the motors; see this module's first lines.

    Args:
        robot: the robot, whose rotor inertias and gear ratios hold.
        motors: its motors.
        theta_dot: (j,) joint rates [rad/s].
        load: what `dynamics.joint_load` gives for the motion.
    """
    # current = M / k, and the voltage that the turning rotor induces beside it
    squared, linear, constant = demand(robot, motors, theta_dot, load)
    current = (squared + linear[0] + constant) / motors.resistance
    voltage = squared + linear.sum(0) + constant
    return Drive(
        speed=robot.gear_ratio * theta_dot,
        torque=current * motors.torque_constant,
        current=current,
        voltage=voltage,
        margin=1 - jnp.abs(voltage) / motors.supply,
    )


def demand(
    robot: Robot, motors: Motor, theta_dot: Float[Array, " j"], load: Load, *, soft: Any = None
) -> tuple[Float[Array, " j"], Float[Array, "2 j"], Float[Array, " j"]]:
    """Voltage that a load takes, by how it grows with the speed of the motion at zero momentum [V].

    Args:
        robot: as for `drive`.
        motors: as for `drive`.
        theta_dot: as for `drive`.
        load: as for `drive`.
        soft: power over which driving turns into being driven back [W], so that an optimiser finds the demand
            smooth; may be traced. It jumps by default.

    Returns:
        (j,) what grows with the square of the speed: inertia, through the gear and of the rotor;
        (2, j) what grows with the speed: drag, and the voltage that the turning rotor induces;
        (j,) what does not depend on it: friction.
    """
    ratio = robot.gear_ratio
    speed = ratio * theta_dot
    # what the gear takes of the load's power, whichever way it flows
    geared = load.torque - load.rotor
    power = geared * theta_dot
    driving = jnp.where(power >= 0, 1, 0) if soft is None else 0.5 * (1 + jnp.tanh(power / soft))
    through = geared * (driving / motors.efficiency + (1 - driving) * motors.efficiency_back)
    # resistance / k times the torque: (through the gear) / N and (rotor) / N, drag w, friction sign(w); and k w
    per_torque = motors.resistance / motors.torque_constant
    inertial = per_torque * (through + load.rotor) / ratio
    linear = jnp.stack([per_torque * motors.drag * speed, motors.torque_constant * speed])
    return inertial, linear, per_torque * motors.friction * jnp.sign(speed)


def check_motors(motors: Motor | Sequence[Motor], robot: Robot, *, compare: bool = True) -> Motor:
    """Return the motors of a robot's joints as one `Motor` of (j,) arrays.

    Raises:
        ValueError: naming the entry, its value and the rule: numbers of a wrong shape, not positive, or with
            `compare` a rotor inertia or gear ratio more than a fifth away from the robot's.
    """
    checks.instance("robot", robot, Robot, "`make_robot` makes")
    if not isinstance(motors, Motor):
        if not isinstance(motors, Sequence) or not all(isinstance(m, Motor) for m in motors):
            raise ValueError(f"`motors` is {checks.shorten(motors)}; it must be a Motor, or one Motor for each joint.")
        if len(motors) != robot.joints:
            raise ValueError(f"`motors` has {len(motors)} motors; {robot.name!r} has {robot.joints} joints.")
        columns: dict[str, Any] = {field: [getattr(m, field) for m in motors] for field in Motor._fields}
    else:
        columns = motors._asdict()
    columns = {field: _column(field, value, robot) for field, value in columns.items()}
    if compare:
        for field in ("rotor_inertia", "gear_ratio"):
            _compare(field, columns[field], getattr(robot, field))
    return Motor(**columns)


def _motor(motor: Any) -> Motor:
    """Return one motor, or many of one shape, its numbers those that a motor can have."""
    checks.instance("motor", motor, Motor, "`RE_MAX_17`")
    return Motor(*(_possible(field, as_numbers(f"motor.{field}", value)) for field, value in motor._asdict().items()))


def _column(field: str, value: Any, robot: Robot) -> Array:
    array = as_numbers(f"motors.{field}", value)
    if array.shape not in ((), (robot.joints,)):
        raise ValueError(f"motors.{field} has shape {array.shape}; it must be one number or ({robot.joints},).")
    array = _possible(field, array)
    xp = np if isinstance(array, np.ndarray | np.floating) else jnp
    return xp.broadcast_to(array, (robot.joints,))


def _possible(field: str, array: Array) -> Array:
    """Return the numbers if a motor can have them, or they are traced."""
    if is_concrete(array):
        rule, kept = "positive", array > 0
        if field in ("drag", "friction", "rotor_inertia"):
            rule, kept = "zero or positive", array >= 0
        if field in ("efficiency", "efficiency_back"):
            rule, kept = "above 0 and at most 1", (array > 0) & (array <= 1)
        if field == "gear_ratio":
            rule, kept = "other than zero", array != 0
        if not np.all(kept & (np.isfinite(array) | (field == "continuous_torque"))):
            shown = checks.shorten(np.asarray(array).tolist())
            raise ValueError(f"motors.{field} is {shown}; it must be {rule}, and a finite number.")
    return array


def _compare(field: str, motors: Array, robot: Array) -> None:
    if not is_concrete((motors, robot)):
        return
    mine, theirs = np.abs(np.asarray(robot)), np.abs(np.asarray(motors))
    apart = np.abs(mine - theirs) > 0.2 * np.maximum(mine, theirs)
    if apart.any():
        k = int(np.argmax(apart))
        raise ValueError(
            f"motors.{field} is {theirs[k]:g} at joint {k}, where the robot has {mine[k]:g}; "
            "`with_motors(robot, motors)` gives the robot those of its motors."
        )


def per_joint(motors: Motor, dtype: np.dtype) -> Motor:
    """Return the motors' numbers as JAX arrays of one dtype."""
    return cast(motors, dtype)

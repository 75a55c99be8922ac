"""How the end of a motion turns with what is not known: momentum, drag, parameters."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp

from reojax._internal.arrays import Array
from reojax.captures.parameters import Parameter
from reojax.robot import Robot
from reojax.steering.estimator import omega_and_slopes
from reojax.steering.gains import CorrectionGains


@partial(jax.jit, static_argnums=1)
def drift_of(robot: Robot, chosen: tuple[Parameter, ...], gains: CorrectionGains, momentum: Array) -> Array:
    """(m, 3, 4 + q) turn of the end from each sample on per momentum, drag and parameters, by the trapezoid rule.

    Inertial frame; columns in rad per kg m^2/s (3), per N m s/rad (1), and per unit of each parameter. By momentum it
    is `integral of Phi R A^-1 R^T`, with `Phi` what an error becomes at the end; drag takes `drag R omega` of the
    momentum in each unit of time; by a parameter p it is `integral of Phi R d omega / d p`.

    Args:
        robot: the robot as planned.
        chosen: the parameters.
        gains: of the motion, whose samples (m,) it takes.
        momentum: (3,) that the motion was planned for, inertial frame [kg m^2/s].
    """
    values = jnp.asarray([p.start for p in chosen], momentum.dtype)

    def rates(theta: Array, rate: Array, rotation: Array, to_end: Array) -> tuple[Array, Array, Array]:
        omega, by = omega_and_slopes(robot, chosen, values, theta, rate, rotation, momentum)
        return to_end @ rotation @ by[:, :3], to_end @ rotation @ by[:, 4:], rotation @ omega

    by_momentum, by_values, spin = jax.vmap(rates)(gains.theta, gains.theta_dot, gains.rotation, gains.to_end)
    length = jnp.diff(gains.at)

    def onward(values: Array) -> Array:
        step = length.reshape(-1, *(1,) * (values.ndim - 1))
        total = jnp.cumsum(step * (values[1:] + values[:-1]) / 2, axis=0)
        return jnp.concatenate([jnp.zeros_like(total[:1]), total])

    turned = onward(spin)
    first = onward(by_momentum)
    braked = onward((by_momentum @ turned[..., None])[..., 0])
    first, braked, rest = ((x[-1:] - x) for x in (first, braked, onward(by_values)))
    drag = -(braked - (first @ turned[..., None])[..., 0])
    return jnp.concatenate([first, drag[..., None], rest], axis=2)

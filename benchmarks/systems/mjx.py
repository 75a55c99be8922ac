"""MJX, MuJoCo in JAX: the mass matrix at every node, under vmap, fourth-order Magnus method.

MuJoCo keeps inertias by their principal axes. The end links' inertia is a variable, so these are found by `eigh`, once
for each loop.
"""

from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from reojax import interop, so3
from reojax.robots import prototype

from . import _jax_rows, _magnus
from ._foreign import omega_from_base_rows
from ._rows import Row, optional
from ._task import Loops, Task, robot_of

END_LINKS = np.array([0, 3])


def rows(task: Task) -> Iterator[Row]:
    """Rows of `mjx.kinematics`, `com_pos`, `crb`."""
    optional("mujoco", "mujoco")
    mjx = optional("mujoco.mjx", "mujoco-mjx")
    foreign = interop.mujoco_model(prototype())
    model, data = mjx.put_model(foreign.model), mjx.make_data(foreign.model)
    still = jnp.asarray(data.qpos[:7])

    def rotation(loop: Loops) -> jax.Array:
        design = _of_loop(model, foreign.model, loop)
        drive = _drive(foreign, loop)

        def omega(theta: jax.Array, rate: jax.Array) -> jax.Array:
            placed = mjx.kinematics(design, data.replace(qpos=jnp.concatenate([still, drive @ theta])))
            mass = mjx.full_m(design, mjx.crb(design, mjx.com_pos(design, placed)))
            return omega_from_base_rows(mass[:6, :6], mass[:6, 6:] @ (drive @ rate))

        return _magnus.rotation(omega, loop, task.magnus_steps)

    yield from _jax_rows.rows(
        task,
        "MJX",
        *_jax_rows.under_vmap(rotation, forward=True),
        loops=8 if task.quick else 64,
        steps=task.magnus_steps,
        evaluations=_magnus.evaluations(task.magnus_steps),
    )


def _of_loop(model: Any, named: Any, loop: Loops) -> Any:
    """Return the MJX model with the end links of a loop."""
    robot = robot_of(loop)
    bodies = np.array([named.body(prototype().link_names[link]).id for link in END_LINKS])
    moments, frames = jnp.linalg.eigh(jnp.asarray(robot.inertia)[END_LINKS])
    frames = frames.at[:, :, 0].multiply(jnp.sign(jnp.linalg.det(frames))[:, None])
    return model.replace(
        body_ipos=jnp.asarray(model.body_ipos).at[bodies].set(jnp.asarray(robot.com)[END_LINKS]),
        body_inertia=jnp.asarray(model.body_inertia).at[bodies].set(moments),
        body_iquat=jnp.asarray(model.body_iquat).at[bodies].set(jax.vmap(so3.to_quaternion)(frames)),
    )


def _drive(foreign: Any, loop: Loops) -> jax.Array:
    """Hinge angles of the model per joint angle, with the gear ratio of a loop."""
    geared = np.abs(foreign.angles) > 1
    return jnp.where(geared, np.sign(foreign.angles) * loop.ratio, foreign.angles)

"""What `reojax sweep` computes: how a manoeuvre turns a robot, over amplitudes and the thesis's design parameters."""

from collections.abc import Callable, Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np

from reojax import so3
from reojax._internal.arrays import Array
from reojax.cli._robot import layout_of
from reojax.manoeuvres import BY_NAME
from reojax.mechanics.attitude import roll_along
from reojax.mechanics.holonomy import DEFAULT_STEPS, refinement, rotation_history
from reojax.path import joint_travel
from reojax.robot import Robot
from reojax.robots import with_end_inertia, with_gear_ratio, with_rotor_inertia


def turn_function(
    robot: Robot, manoeuvre: str, outputs: Sequence[str], amplitudes: Mapping[str, Array]
) -> Callable[..., dict[str, jax.Array]]:
    """Make the function of a sweep of manoeuvre `a` or `b` on `robot`.

    It takes `twist` and `bend` [rad], `end_inertia` and `rotor_inertia` [kg m^2] and `gear` by name, all or some,
    and returns the angles [rad] that `outputs` names:

    - `roll`: about z, counted on along the path, so that 200 degrees are not -160. The path is sampled at every
      67.5 degrees or less of a joint angle for that. It jumps where z is turned upside down on the way.
    - `off_axis`: the angle between the z axis before and after.
    - `angle`: the angle of the net rotation, at most half a turn.
    - `travel`: the sum of the angles that the joints move through.

    Args:
        robot: the robot, before the design changes it.
        manoeuvre: `a` or `b`.
        outputs: names of results.
        amplitudes: all values that `twist` and `bend` take, for the number of samples. The first one holds for a
            design that does not say.

    Raises:
        ValueError: if the robot has no layout for the manoeuvres.
    """
    layout = layout_of(robot)
    longest = max(float(np.abs(values).max()) for values in amplitudes.values())
    samples = DEFAULT_STEPS * refinement(longest)
    fixed = {name: values[0] for name, values in amplitudes.items()}
    path_of = BY_NAME[manoeuvre]
    changes = {"end_inertia": with_end_inertia, "gear": with_gear_ratio, "rotor_inertia": with_rotor_inertia}

    def function(**design: jax.Array) -> dict[str, jax.Array]:
        changed = robot
        for name, change in changes.items():
            if name in design:
                changed = change(changed, design[name])
        design = fixed | design
        path = path_of(design["twist"], design["bend"], layout)
        history = rotation_history(changed, path, samples=samples)
        end = history[-1]
        found = {
            "roll": roll_along(history)[-1],
            "off_axis": jnp.arctan2(jnp.hypot(end[0, 2], end[1, 2]), end[2, 2]),
            "angle": so3.angle(end),
            "travel": jnp.asarray(joint_travel(path)),
        }
        return {name: found[name] for name in outputs}

    return function

"""Free closed paths: one closed polygon within the joint limits that ends on the target, with little joint travel."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from reojax import so3
from reojax._arrays import Array
from reojax.design.loops import polygons
from reojax.design.solver import optimise
from reojax.holonomy import net_rotation
from reojax.manoeuvres import Layout
from reojax.path import Path
from reojax.plan import checks
from reojax.robot import Robot

_STEPS = 4
"""Steps an edge while searching; the answer is judged with four times as many."""


class FreePaths(NamedTuple):
    """Closed polygons, one for each target."""

    waypoints: Float[np.ndarray, "m v j"]
    """Corners of the joint paths [rad], both ends at zero, for `polygon`."""
    rotation: Float[np.ndarray, "m 3 3"]
    """Net rotation of the base after each."""
    error: Float[np.ndarray, " m"]
    """Angle left to the target [rad]."""
    travel: Float[np.ndarray, " m"]
    """Sum over all joints of the angle each one moves through [rad]."""
    converged: Bool[np.ndarray, " m"]
    """Whether `error` is within the tolerance; the travel is then the least found, not proven to be the least."""


def free_paths(
    robot: Robot,
    targets: Float[Array, "m 3 3"] | ArrayLike,
    *,
    twist_limit: float,
    bend_limit: float,
    corners: int = 6,
    starts: int = 8,
    layout: Layout | None = None,
    tolerance: float = 1e-8,
    max_steps: int = 100,
    seed: int = 0,
    progress: bool = False,
) -> FreePaths:
    """Find closed polygons of little joint travel after which the base has turned by the targets.

    Sequential quadratic programming from random polygons, for all targets side by side (`design.optimise`). Local:
    more `starts` find less travel, and with few some targets are not reached.

    Args:
        robot: the robot. Joints that neither twist nor bend keep to the robot's own limits.
        targets: (m, 3, 3) rotations of the base, final base components to initial ones.
        twist_limit: largest angle of the distal joints, either way [rad]. The robot's own joint limits hold too.
        bend_limit: largest angle of the centre joint, either way [rad].
        corners: number of free corners, at least 2.
        starts: random polygons for each target.
        layout: which joints twist and bend; default by the robot's number of joints.
        tolerance: angle to the target that counts as reached [rad].
        max_steps: most steps of the solver.
        seed: of the random polygons.
        progress: whether to show a bar on stderr.

    Returns:
        The paths. Where a target is not reached, the closest path found, with `converged` False.

    Raises:
        ValueError: naming the entry, if a target is no rotation or an option makes no sense.
    """
    layout = checks.robot_and_layout(robot, layout)
    wanted = checks.rotations("targets", targets, (-1, 3, 3))
    tolerance, starts = checks.positive("tolerance", tolerance), checks.whole("starts", starts)
    low, high = np.array(robot.lower, float), np.array(robot.upper, float)
    for joints, limit in (
        ([*layout.twist], checks.positive("twist_limit", twist_limit)),
        ([layout.bend], checks.positive("bend_limit", bend_limit)),
    ):
        low[joints], high[joints] = np.maximum(low[joints], -limit), np.minimum(high[joints], limit)
    loop = polygons(robot.replace(lower=low, upper=high), corners)
    m, v = len(wanted), corners + 2
    if not m:
        empty = np.zeros(0)
        return FreePaths(np.zeros((0, v, robot.joints)), wanted, empty, empty, empty.astype(bool))

    def miss(x: Array, target: Any) -> Array:
        turned = net_rotation(robot, loop.path(x), steps=_STEPS)
        return jnp.concatenate([loop.equality(x), so3.log(target.T @ turned)])

    found = optimise(
        lambda x, _: loop.travel(x),
        loop.random(np.random.default_rng(seed), m * starts),
        lower=np.asarray(loop.variable.lower),
        upper=np.asarray(loop.variable.upper),
        equality=miss,
        inequality=lambda x, _: loop.inequality(x),
        data=np.repeat(wanted, starts, axis=0),
        tolerance=min(1e-10, 0.1 * tolerance),
        max_steps=max_steps,
        progress="free paths" if progress else None,
    )

    @jax.jit
    @jax.vmap
    def judged(x: Array, target: Array) -> tuple[Array, Array, Array, Array]:
        path = Path(jnp.clip(loop.path(x).waypoints, jnp.asarray(low)[None], jnp.asarray(high)[None]))
        turned = net_rotation(robot, path, steps=4 * _STEPS)
        travel = jnp.abs(jnp.diff(path.waypoints, axis=0)).sum()
        return path.waypoints, turned, so3.angle(target.T @ turned), travel

    paths, turned, error, travel = map(np.asarray, judged(found.value, np.repeat(wanted, starts, axis=0)))
    reached = (error <= tolerance).reshape(m, starts)
    rank = np.where(reached, travel.reshape(m, starts), 1e9 * (1 + np.nan_to_num(error, nan=4.0)).reshape(m, starts))
    best = np.arange(m) * starts + rank.argmin(1)
    return FreePaths(paths[best], turned[best], error[best], travel[best], error[best] <= tolerance)

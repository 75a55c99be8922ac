"""The thesis's sweeps (figures 1.5 and 2.7 to 2.10) on its own grids and on finer ones that hold them."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from common.types import Array
from jax.typing import ArrayLike
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots
from reojax.manoeuvres import rectangle
from reojax.robots.prototype import END_INERTIA, GEAR_RATIO, ROTOR_INERTIA

TWISTS = np.deg2rad([0, 67.5, 135, 202.5, 270])  # rad, thesis figures 2.7 and 2.10
BENDS = np.deg2rad([0.0, 30, 60, 90, 120])  # rad
INERTIAS = np.array([10.0, 40, 70, 100, 130, 160, 190]) * 1e-6  # kg m^2, thesis figure 2.8
RATIOS = np.array([1.0, 12, 24, 36, 48])  # thesis figure 2.9
ROTORS = END_INERTIA / np.array([1400, 700, 350, 175, 87.5])  # kg m^2
LINE = np.deg2rad(np.linspace(0.0, 270, 181))  # rad, twists at full bend
ONCE = {"xla_backend_optimization_level": 0}
"""For programs that run too briefly to be worth a long compilation."""
FULL_TWIST, FULL_BEND = TWISTS[-1], BENDS[-1]
FINE = {False: {"a": 12, "b": 12, "inertia": 15, "motor": 6}, True: {"a": 2, "b": 2, "inertia": 3, "motor": 2}}
"""Steps of the fine grids in one of the thesis's, by `quick`."""


class Turn(NamedTuple):
    """What a manoeuvre does to the base; [rad]."""

    roll: ArrayLike
    """About z, unwrapped along the path."""
    tip: ArrayLike
    """Angle between the z axis before and after: what is left when the roll is taken away."""
    yaw: ArrayLike
    """About y, as the roll is about z; not unwrapped."""
    tip_yaw: ArrayLike
    """Angle between the y axis before and after."""
    rotation: ArrayLike
    """(3, 3), base frame at the end to base frame at the start."""


class Grid(NamedTuple):
    """A sweep over one or two variables, first to last."""

    axes: tuple[np.ndarray, ...]
    """Values of the variables [SI]."""
    step: int
    """Every how many points the thesis has one."""
    turn: Turn
    """Results with the grid's shape in front."""

    def own(self) -> "Grid":
        """Return the thesis's own grid."""
        every = (slice(None, None, self.step),) * len(self.axes)
        axes = tuple(values[:: self.step] for values in self.axes)
        return Grid(axes, 1, jax.tree.map(lambda field: field[every], self.turn))


def outcome(twist, bend, last, inertia, ratio, rotor) -> Turn:
    """Run a rectangle on the prototype with the given motors and end links; `last` is -1 for A and 1 for B."""
    robot = robots.with_rotor_inertia(robots.with_gear_ratio(robots.prototype(), ratio), rotor)
    robot = robots.with_end_inertia(robot, inertia)
    history = reojax.rotation_history(robot, rectangle(twist, bend, last * twist), samples=8)
    about_z = jnp.arctan2(history[:, 1, 0] - history[:, 0, 1], history[:, 0, 0] + history[:, 1, 1])
    end = history[-1]
    return Turn(
        roll=jnp.unwrap(about_z)[-1],
        tip=_between(end[:, 2], 2),
        yaw=jnp.arctan2(end[0, 2] - end[2, 0], end[2, 2] + end[0, 0]),
        tip_yaw=_between(end[:, 1], 1),
        rotation=end,
    )


def _between(axis: jax.Array, k: int) -> jax.Array:
    """Angle between a unit vector and the k-th axis."""
    across = jnp.delete(axis, k)
    return jnp.arctan2(jnp.sqrt(across @ across + 1e-300), axis[k])


def finer(values: np.ndarray, step: int, *, ratio: bool = False) -> np.ndarray:
    """Put `step - 1` values between each two of `values`, in equal steps or in equal ratios."""
    at = np.linspace(0, len(values) - 1, step * (len(values) - 1) + 1)
    known = np.log(values) if ratio else values
    between = np.interp(at, np.arange(len(values)), known)
    return np.exp(between) if ratio else between


def sweeps(*, quick: bool) -> dict[str, Grid]:
    """Run all sweeps, as one: their designs make one list, so that one program serves them all."""
    step = FINE[quick]
    axes = {
        "a": (finer(TWISTS, step["a"]), finer(BENDS, step["a"])),
        "b": (finer(TWISTS, step["b"]), finer(BENDS, step["b"])),
        "inertia": (finer(INERTIAS, step["inertia"]),),
        "motor": (finer(RATIOS, step["motor"]), finer(ROTORS, step["motor"], ratio=True)),
    }
    axes |= {"line_a": (LINE,), "line_b": (LINE,)}
    names = {"a": ("twist", "bend"), "b": ("twist", "bend"), "inertia": ("inertia",), "motor": ("ratio", "rotor")}
    names |= {"line_a": ("twist",), "line_b": ("twist",)}
    columns: dict[str, list[np.ndarray]] = {key: [] for key in ("twist", "bend", "last", "inertia", "ratio", "rotor")}
    usual = {
        "twist": FULL_TWIST,
        "bend": FULL_BEND,
        "inertia": END_INERTIA,
        "ratio": GEAR_RATIO,
        "rotor": ROTOR_INERTIA,
    }
    shapes = {}
    for key, values in axes.items():
        mesh = dict(zip(names[key], np.meshgrid(*values, indexing="ij"), strict=True))
        shapes[key] = tuple(map(len, values))
        for column, chosen in ({**usual, "last": 1.0 if key in ("b", "line_b") else -1.0} | mesh).items():
            columns[column].append(np.broadcast_to(chosen, shapes[key]).ravel())
    turns = run({column: np.concatenate(parts) for column, parts in columns.items()})
    grids, start = {}, 0
    for key, shape in shapes.items():
        part = slice(start, start + int(np.prod(shape)))
        own = jax.tree.map(lambda field, part=part, shape=shape: field[part].reshape(*shape, *field.shape[1:]), turns)
        grids[key] = Grid(axes[key], step.get(key, 1), own)
        start = part.stop
    return grids


def run(designs: dict[str, np.ndarray]) -> Turn:
    """Run a list of designs, columns by the names of `outcome`'s arguments."""
    done = reojax.sweep(outcome, reojax.zipped(designs))
    if done.bad:
        raise ValueError(f"{len(done.bad)} designs failed, the first is {done.bad[0]}.")
    return done.results


@partial(jax.jit, compiler_options=ONCE)
def _net(robot: reojax.Robot, corners: jax.Array) -> Array:
    return reojax.net_rotation(robot, reojax.Path(corners))  # the robot is data, so that many share one program


def net(robot: reojax.Robot, path: reojax.Path) -> Rotation:
    """Net rotation of a robot after a path."""
    return Rotation.from_matrix(np.asarray(_net(robot, np.asarray(path.waypoints, float))))

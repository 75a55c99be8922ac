"""Rotation of the base after a polygon, with its derivative.

The derivative of the end rotation is a sum over the path: a change `d omega(s)` of the angular velocity turns
the end by `R(s) d omega(s)` seen from the start, so `dR R^T = hat(integral of R d omega)`. And since
`L(theta, theta_dot, omega) = 0` along the path, `d omega = -A^-1 dL` with `dL` the change of the angular momentum
at a fixed motion of the base: nothing of the inverse has to be differentiated. The linear momentum of that fixed
motion being zero, its reference point and velocity may stay fixed too (their first-order effects cancel).
The sum uses the nodes and values of the solution itself. Forward mode (`_push`) takes `dL` from `momentum_jvp`.
Reverse mode (`_pull`) is the transpose: one constant vector `l` turned into each node's frame, `mu = -A^-1 R^T l`, and
the derivative of `mu . L` in closed form (`momentum_vjp`). Both compute the values at the nodes again, block by block
(`blocking`): keeping them from the first pass would take as long, and memory for all designs. What they are by are the
`Parameters` of `parameters`; from there to the arrays of a robot JAX differentiates as usual.
"""

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero

from reojax._internal.quaternions import inverse, product
from reojax.mechanics._fast import rolled
from reojax.mechanics._fast.blocking import Call, in_blocks
from reojax.mechanics._fast.magnus import Step, mean_over_step, step_rotations
from reojax.mechanics._fast.materialize import materialize
from reojax.mechanics._fast.momentum_jvp import angular_momentum
from reojax.mechanics._fast.momentum_vjp import fusion_groups, slopes
from reojax.mechanics._fast.nodes import NODES, path_nodes, sum_over_nodes, to_nodes, to_points
from reojax.mechanics._fast.parameters import (
    Known,
    Parameters,
    Pattern,
    RobotScalars,
    components,
    flatten,
    known_parameters,
    parameters,
    split,
)
from reojax.mechanics._fast.quaternions import (
    Quaternion,
    Triple,
    ordered_product,
    products_up_to,
    rotate,
    shift,
    to_matrix,
)
from reojax.mechanics._fast.recursion import AT_ONCE, Base, inward, solve
from reojax.mechanics._fast.scalar import Symmetric, Vector, cross, plus, scale
from reojax.mechanics._fast.sincos import sincos
from reojax.robot import Robot

ROLLED_ALONE, ROLLED_IN_BATCHES = 9, 12
"""Joints beyond which the passes over the tree are loops over joints (`rolled`), for one design and for few designs.

Such a program is compiled in a few seconds whatever the number of joints, and runs as fast for one design; for many it
takes four to eight times as long as one in which every joint has code of its own.
"""
_FEW = 64
"""Designs that are few."""


class RotationProblem(NamedTuple):
    """What is known while tracing."""

    steps: int
    parent: tuple[int, ...]
    known: Known
    varied: tuple[bool, ...] = ()
    """Which of the flattened parameters a derivative is by; the known ones among them do not change."""
    moved: bool = False
    """Whether it is by the path too."""
    rolled: bool = False
    """Whether the passes over the tree are loops over joints."""

    def short(self) -> tuple["RotationProblem", int] | None:
        """The problem for a short program, and the designs up to which it is used."""
        joints = len(self.parent)
        most = _FEW if joints > ROLLED_IN_BATCHES else 1 if joints > ROLLED_ALONE else 0
        return (self._replace(rolled=True), most) if most else None

    def robot(self, data: Sequence[jax.Array]) -> RobotScalars:
        """Put the known numbers in the place of the data."""
        return components([x if k is None else k for x, k in zip(data, self.known, strict=True)], self.parent)


def steps_of_path(robot: Robot, pattern: Pattern, points: jax.Array, steps: int) -> Step:
    """Rotation over each of the `steps` steps of each edge, in order."""
    rolled = robot.joints > ROLLED_IN_BATCHES
    problem = RotationProblem(steps, robot.parent, known_parameters(pattern), rolled=rolled)
    return _steps_of_path(problem, flatten(parameters(robot)), points)


def net_rotation(robot: Robot, pattern: Pattern, points: jax.Array, steps: int) -> jax.Array:
    """Rotation (3, 3) after the polygon `points` (v, j), v >= 2; all arrays of one dtype."""
    problem = RotationProblem(steps, robot.parent, known_parameters(pattern))
    return _end_rotation(problem, parameters(robot), points)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _end_rotation(problem: RotationProblem, numbers: Parameters, points: jax.Array) -> jax.Array:
    alive = 1 if points.shape[1] <= AT_ONCE else 4
    call = Call(_rotation, problem, ((3, 3),), alive * _nodes(problem, points), short=problem.short())
    return in_blocks(call, flatten(numbers), points)[0]


@partial(_end_rotation.defjvp, symbolic_zeros=True)
def _end_rotation_jvp(problem, primals, tangents):
    rotation = _end_rotation(problem, *primals)
    numbers, points = primals
    by_numbers, by_points = tangents
    varied = [change for change in by_numbers if not isinstance(change, SymbolicZero)]
    problem = problem._replace(
        varied=tuple(not isinstance(c, SymbolicZero) for c in by_numbers for _ in range(c.size)),
        moved=not isinstance(by_points, SymbolicZero),
    )
    changes = ([flatten(varied)] if varied else []) + [by_points] * problem.moved
    if not changes:
        return rotation, jnp.zeros_like(rotation)
    alive = max(4, points.shape[1])
    size = alive * _nodes(problem, points)
    call = Call(_push, problem, ((3,),), size, short=problem.short(), transpose=_pull, linear=len(changes))
    turn = in_blocks(call, flatten(numbers), points, *changes)[0]
    return rotation, jnp.cross(turn[:, None], rotation, axis=0)


def _nodes(problem: RotationProblem, points: jax.Array) -> int:
    """Size of a value at all nodes. (Blocks are smaller the more of them are `alive` at once, as measured.)"""
    return (points.shape[0] - 1) * problem.steps * len(NODES)


def _rotation(problem: RotationProblem, numbers: jax.Array, points: jax.Array) -> list[jax.Array]:
    return [to_matrix(ordered_product(_steps_of_path(problem, numbers, points).rotation))]


def _steps_of_path(problem: RotationProblem, numbers: jax.Array, points: jax.Array) -> Step:
    if problem.rolled:
        motion = rolled.motion_at_nodes(points, problem.steps)
        base = rolled.inward(rolled.unflatten(numbers, len(problem.parent)), problem.parent, motion)
        like = motion.rate[0]
    else:
        theta, rate = path_nodes(points, problem.steps)
        base = inward(problem.robot(split(numbers)), [sincos(a) for a in theta], rate)
        like = theta[0]
    return step_rotations(materialize(_at_nodes(solve(base.inertia, scale(-1, base.momentum)), like)))


class NodeSolution(NamedTuple):
    """What derivatives read of the solution, kept."""

    inertia: Symmetric
    """`A`."""
    centre: Vector
    omega: Triple
    velocity: Any
    """Of the base's origin, the centre of mass being at rest."""
    step: Step
    to_step: Quaternion
    """Attitude in which `step.inside` begins, from the start of the path, four arrays (steps,)."""

    def change_of_omega(self, change: Vector) -> Triple:
        """What a change of the momentum at a fixed motion of the base does to omega: `-A^-1 dL`."""
        return materialize(_at_nodes(solve(self.inertia, scale(-1, change)), self.omega[0]))


def _solution(base: Base, like: jax.Array) -> NodeSolution:
    moving = materialize((*base.momentum, *base.drift))
    centre, drift = materialize(base.centre), moving[3:]
    inertia = materialize(base.inertia)
    # A omega = -L, thesis eq. 2.14; the base's origin moves so that the centre of mass rests
    omega = materialize(_at_nodes(solve(inertia, scale(-1, moving[:3])), like))
    velocity = materialize(scale(-1, plus(drift, cross(omega, centre))))
    # attitude at the middle frame of each step: the product of the steps before, and half of its mean turn
    step = step_rotations(omega)
    to_step = materialize(product(shift(products_up_to(step.rotation), 1), step.half))
    return NodeSolution(inertia, centre, omega, velocity, step, to_step)


def _unrolled_solution(
    problem: RotationProblem, data: list[jax.Array], points: jax.Array
) -> tuple[NodeSolution, list[jax.Array], list[Any]]:
    """With the joints' rates and the sines and cosines of their angles."""
    theta, rate = path_nodes(points, problem.steps)
    sine_cosine = [materialize(sincos(angle)) for angle in theta]
    robot = problem.robot(data)
    base = inward(robot, sine_cosine, rate, by_joint=not robot.axes_known)
    return _solution(base, theta[0]), rate, sine_cosine


def _push(problem: RotationProblem, numbers: jax.Array, points: jax.Array, *changes: jax.Array) -> list[jax.Array]:
    """How the end turns, seen from the start, with changes of the data and of the path."""
    given = iter(changes)
    by_data = next(given) if any(problem.varied) else None
    by_points = next(given) if problem.moved else jnp.zeros_like(points)
    push = _push_rolled if problem.rolled else _push_unrolled
    known, change = push(problem, numbers, points, by_data, by_points)
    # the integral of R d omega: within each step, then over all steps
    in_step = materialize(mean_over_step(known.step.inside(known.change_of_omega(change))))
    x, y, z = (c.sum() for c in rotate(known.to_step, in_step))
    return [jnp.stack([x, y, z])]


def _push_unrolled(
    problem: RotationProblem, numbers: jax.Array, points: jax.Array, by_data: Any, by_points: jax.Array
) -> tuple[NodeSolution, Vector]:
    """Solution, and the change of the momentum at a fixed motion of the base."""
    data = split(numbers)
    known, *_ = _unrolled_solution(problem, data, points)
    like = known.omega[0]
    places = [i for i, varied in enumerate(problem.varied) if varied]

    def momentum(varied, points):
        now = [to_nodes(value, like) for value in data]
        for i, value in zip(places, varied, strict=True):
            now[i] = to_nodes(value, like)
        theta, rate = path_nodes(points, problem.steps)
        fixed = (known.omega, known.velocity, known.centre)
        return _at_nodes(angular_momentum(problem.robot(now), [sincos(a) for a in theta], rate, *fixed), like)

    changes = split(by_data) if places else []
    return known, jax.jvp(momentum, ([data[i] for i in places], points), (changes, by_points))[1]


def _push_rolled(
    problem: RotationProblem, numbers: jax.Array, points: jax.Array, by_data: Any, by_points: jax.Array
) -> tuple[NodeSolution, Vector]:
    """The same, in loops over joints."""
    parent, joints = problem.parent, len(problem.parent)
    motion = rolled.motion_at_nodes(points, problem.steps)
    known = _solution(rolled.inward(rolled.unflatten(numbers, joints), parent, motion), motion.rate[0])

    def momentum(numbers, points):
        robot, motion = rolled.unflatten(numbers, joints), rolled.motion_at_nodes(points, problem.steps)
        return rolled.angular_momentum(robot, parent, motion, known.omega, known.velocity, known.centre)

    change = jnp.zeros_like(numbers)
    if by_data is not None:
        change = change.at[np.flatnonzero(problem.varied)].set(by_data)
    return known, jax.jvp(momentum, (numbers, points), (change, by_points))[1]


def _pull(problem: RotationProblem, numbers: jax.Array, points: jax.Array, by_turn: jax.Array) -> list[jax.Array]:
    """Transpose of `_push`: what the scalar product of `by_turn` with the end's turn changes by."""
    pull = _pull_rolled if problem.rolled else _pull_unrolled
    return pull(problem, numbers, points, by_turn)


def _virtual_turn(known: NodeSolution, by_turn: jax.Array) -> Triple:
    """`mu = -A^-1 R^T l` at all nodes."""
    in_step = materialize(rotate(inverse(known.to_step), tuple(split(by_turn))))  # R^T l, step by step
    return known.change_of_omega(known.step.back(in_step))


def _pull_unrolled(
    problem: RotationProblem, numbers: jax.Array, points: jax.Array, by_turn: jax.Array
) -> list[jax.Array]:
    data = split(numbers)
    robot = problem.robot(data)
    known, rate, sine_cosine = _unrolled_solution(problem, data, points)
    like = known.omega[0]
    mu = _virtual_turn(known, by_turn)
    of = slopes(robot, sine_cosine, rate, known.omega, known.velocity, known.centre, mu)
    found = []
    # by the robot's parameters: sums over nodes, those that read the same values in one loop
    if any(problem.varied):
        by_entry, loops = jax.tree.leaves(of.robot), jax.tree.leaves(fusion_groups(robot))
        unknown = [i for i, varied in enumerate(problem.varied) if varied and problem.known[i] is None]
        sums: dict[int, jax.Array] = {}
        for loop in dict.fromkeys(loops[i] for i in unknown):
            places = [i for i in unknown if loops[i] == loop]
            values = _at_nodes([by_entry[i] for i in places], like)
            sums |= zip(places, sum_over_nodes(values), strict=True)
        zero = jnp.zeros((), like.dtype)
        found.append(jnp.stack([sums.get(i, zero) for i, varied in enumerate(problem.varied) if varied]))
    # by the path: from the nodes back to its corners
    if problem.moved:
        by_nodes = [materialize(_at_nodes(of_joint, like)) for of_joint in zip(of.theta, of.rate, strict=True)]
        by_theta, by_rate = ([pair[i] for pair in by_nodes] for i in (0, 1))
        found.append(to_points(by_theta, by_rate, problem.steps))
    return found


def _pull_rolled(
    problem: RotationProblem, numbers: jax.Array, points: jax.Array, by_turn: jax.Array
) -> list[jax.Array]:
    parent = problem.parent
    robot, motion = rolled.unflatten(numbers, len(parent)), rolled.motion_at_nodes(points, problem.steps)
    known = _solution(rolled.inward(robot, parent, motion), motion.rate[0])
    mu = _virtual_turn(known, by_turn)
    of = rolled.slopes(robot, parent, motion, known.omega, known.velocity, known.centre, mu)
    found = [flatten(of.robot)[np.flatnonzero(problem.varied)]] if any(problem.varied) else []
    return found + ([rolled.to_points(of.theta, of.rate, problem.steps)] if problem.moved else [])


def _at_nodes(vector, like: jax.Array) -> Triple:
    return tuple(jnp.broadcast_to(jnp.asarray(c, like.dtype), like.shape) for c in vector)

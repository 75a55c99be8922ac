"""The robot's angular momentum with everything moving, for its derivative at fixed motion of the base (forward mode).

`momentum_vjp` has the same derivative for reverse mode.
"""

from collections.abc import Sequence

from reojax.mechanics._fast.materialize import materialize
from reojax.mechanics._fast.parameters import RobotScalars
from reojax.mechanics._fast.recursion import apply_symmetric, joint_rotation
from reojax.mechanics._fast.scalar import Matrix, Scalar, Symmetric, Vector, apply, cross, mul, plus, scale, transpose

Pair = tuple[Vector, Vector]
"""Angular velocity and velocity of the origin; or linear and angular momentum about the origin."""


def angular_momentum(
    robot: RobotScalars,
    sine_cosine: Sequence[tuple[Scalar, Scalar]],
    rate: Sequence[Scalar],
    omega: Vector,
    velocity: Vector,
    centre: Vector,
) -> Vector:
    """Angular momentum about the point `centre` (base frame) when the base moves with `omega` and `velocity`.

    Outward, each link's angular velocity `w` and its origin's velocity `v`, in its own frame:
    `w' = E^T w + rate e`, `v' = E^T (v + w x a)`. There, momentum `p = m v + w x f`, `h = J w + f x v`. Inward,
    `p + E p'`, `h + E h' + a x E p'`, and the rotors. Values are kept link by link (`materialize`).
    """
    joints = range(len(robot.parent))
    E = [joint_rotation(e, *sc) for e, sc in zip(robot.axis, sine_cosine, strict=True)]
    # outward: w' = E^T w + rate e, v' = E^T (v + w x a)
    motion: list[Pair] = [(omega, velocity)]
    for k in joints:
        w, v = outward(E[k], robot.anchor[k], motion[robot.parent[k]])
        motion.append(keep_pair((plus(w, scale(rate[k], robot.axis[k])), v)))
    # of each link: p = m v + w x f, h = J w + f x v
    bodies = zip(robot.mass, robot.moment, robot.inertia, motion, strict=True)
    momentum = [body_momentum(m, f, J, *of_link) for m, f, J, of_link in bodies]
    # inward: p + E p', h + E h' + a x E p', and the rotors
    for k in reversed(joints):
        parent = robot.parent[k]
        rotor = scale(mul(rate[k], robot.rotor_momentum[k]), robot.axis[k])
        momentum[parent] = onto_parent(E[k], robot.anchor[k], momentum[parent], keep_pair(momentum[k + 1]), rotor)
    # from the base's origin to the centre
    p, h = momentum[0]
    return plus(h, scale(-1, cross(centre, p)))


def keep_pair(pair: Pair) -> Pair:
    """Keep both vectors together."""
    six = materialize((*pair[0], *pair[1]))
    return six[:3], six[3:]


def outward(E: Matrix, anchor: Vector, motion: Pair) -> Pair:
    """Return the motion of a link that is at rest against its parent, in its own frame."""
    w, v = motion
    back = transpose(E)
    return apply(back, w), apply(back, plus(v, cross(w, anchor)))


def body_momentum(m: Scalar, f: Vector, J: Symmetric, w: Vector, v: Vector) -> Pair:
    """Return the momentum of one link alone."""
    return plus(scale(m, v), cross(w, f)), plus(apply_symmetric(J, w), cross(f, v))


def onto_parent(E: Matrix, anchor: Vector, own: Pair, beyond: Pair, rotor: Vector) -> Pair:
    """Return a link's momentum with that of the links beyond a joint, and of the joint's rotor."""
    push = apply(E, beyond[0])
    return plus(own[0], push), plus(own[1], plus(plus(apply(E, beyond[1]), rotor), cross(anchor, push)))

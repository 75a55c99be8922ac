"""The derivative of `mu . L`, `L` the robot's angular momentum at a fixed motion of the base, by virtual motion.

`mu . L` pairs the momentum of every link with the motion that it has when the whole robot, its joints locked, turns
with `mu` about the centre of mass. The pairing is symmetric: with `w, v` the angular velocity of a link and the
velocity of its origin, `~` the virtual ones, all in the link's frame,

    mu . L = sum over links  <(w~, v~), (w, v)>  +  sum over joints  rate * spin * e . w~
    <(w~, v~), (w, v)> = w~ . J w + w~ . (f x v) + v~ . (w x f) + m v~ . v

So what a link's `m`, `f`, `J` do can be read off. What a joint does follows from the momenta `p, h` and `p~, h~` of all
links beyond it, about its place, in both motions: if these links are turned by a small `d` (link frame), their motions,
seen from them, change by `-d x (.)`, except that the joint's own rate turns with them (`u = w - rate e`):

    d . (h~ x u + p~ x v + h x w~ + p x v~)

A rate moves them by `e`, and meets `e . h~`; an anchor's shift `da` meets `E (p~ x u + p x w~)` in the parent's frame;
a change `de` of a unit axis turns them by `d = sin(theta) de - (1 - cos(theta)) e x de`, the right Jacobian of the
exponential map at `theta e`. One pass outward for both motions and one inward for both momenta give it all.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

from reojax.mechanics._fast.materialize import materialize
from reojax.mechanics._fast.momentum_jvp import Pair, body_momentum, keep_pair, onto_parent, outward
from reojax.mechanics._fast.parameters import RobotScalars
from reojax.mechanics._fast.recursion import joint_rotation
from reojax.mechanics._fast.scalar import (
    Matrix,
    Scalar,
    Symmetric,
    Vector,
    add,
    apply,
    cross,
    dot,
    mul,
    plus,
    scale,
    sub,
)


class Slopes(NamedTuple):
    """Derivatives of `mu . L` at all nodes."""

    robot: RobotScalars
    """By each entry of the robot; by axes as far as they stay of unit length."""
    theta: list[Scalar]
    rate: list[Scalar]


def slopes(
    robot: RobotScalars,
    sine_cosine: Sequence[tuple[Scalar, Scalar]],
    rate: Sequence[Scalar],
    omega: Vector,
    velocity: Vector,
    centre: Vector,
    mu: Vector,
) -> Slopes:
    """Differentiate `mu . angular_momentum(...)` (`momentum_jvp`) at fixed `mu`, `omega`, `velocity` and `centre`."""
    joints = range(len(robot.parent))
    E = [joint_rotation(e, *sc) for e, sc in zip(robot.axis, sine_cosine, strict=True)]
    # outward: both motions of every link, w, v and w~, v~
    actual: list[Pair] = [(omega, velocity)]
    virtual: list[Pair] = [(mu, cross(centre, mu))]
    for k in joints:
        parent, anchor = robot.parent[k], robot.anchor[k]
        w, v = outward(E[k], anchor, actual[parent])
        actual.append(keep_pair((plus(w, scale(rate[k], robot.axis[k])), v)))
        virtual.append(keep_pair(outward(E[k], anchor, virtual[parent])))
    # momenta of each link alone, in both motions
    bodies = list(zip(robot.mass, robot.moment, robot.inertia, strict=True))
    momentum = [body_momentum(*body, *motion) for body, motion in zip(bodies, actual, strict=True)]
    likewise = [body_momentum(*body, *motion) for body, motion in zip(bodies, virtual, strict=True)]
    # inward: momenta p, h and p~, h~ of all beyond each joint, and what the joint does
    of_joints: list[Any] = [None] * len(joints)
    for k in reversed(joints):
        link, parent, e = k + 1, robot.parent[k], robot.axis[k]
        momentum[link], likewise[link] = keep_pair(momentum[link]), keep_pair(likewise[link])
        of_joints[k] = joint_slopes(
            E[k], e, sine_cosine[k], rate[k], robot.rotor_momentum[k],
            momentum[link], likewise[link], actual[link], virtual[link], virtual[parent][0],
        )  # fmt: skip
        rotor = scale(mul(rate[k], robot.rotor_momentum[k]), e)
        momentum[parent] = onto_parent(E[k], robot.anchor[k], momentum[parent], momentum[link], rotor)
        likewise[parent] = onto_parent(E[k], robot.anchor[k], likewise[parent], likewise[link], (0, 0, 0))
    of_links = [body_slopes(*motions) for motions in zip(actual, virtual, strict=True)]
    return Slopes(
        robot=RobotScalars(
            mass=[of.mass for of in of_links],
            moment=[of.moment for of in of_links],
            inertia=[of.inertia for of in of_links],
            axis=[of.axis for of in of_joints],
            anchor=[of.anchor for of in of_joints],
            rotor_momentum=[of.rotor_momentum for of in of_joints],
            parent=robot.parent,
        ),
        theta=[of.theta for of in of_joints],
        rate=[of.rate for of in of_joints],
    )


class BodySlopes(NamedTuple):
    """Derivatives of `mu . L` by what one link is."""

    mass: Scalar
    moment: Vector
    inertia: Symmetric


def body_slopes(motion: Pair, virtual: Pair) -> BodySlopes:
    """Read off the pairing of the two motions of a link."""
    (w, v), (w_, v_) = motion, virtual
    mixed = tuple(add(mul(w[i], w_[j]), mul(w[j], w_[i])) for i, j in ((0, 1), (0, 2), (1, 2)))
    return BodySlopes(
        mass=dot(v, v_),  # m v~ . v
        moment=plus(cross(v, w_), cross(v_, w)),  # w~ . (f x v) + v~ . (w x f)
        # w~ . J w, products counted twice
        inertia=(*(mul(x, y) for x, y in zip(w, w_, strict=True)), *mixed),
    )


class JointSlopes(NamedTuple):
    """Derivatives of `mu . L` by what one joint is and does."""

    theta: Scalar
    rate: Scalar
    axis: Vector
    anchor: Vector
    rotor_momentum: Scalar


def joint_slopes(
    E: Matrix,
    e: Vector,
    sine_cosine: tuple[Scalar, Scalar],
    rate: Scalar,
    rotor: Scalar,
    momentum: Pair,
    momentum_: Pair,
    motion: Pair,
    virtual: Pair,
    virtual_before: Vector,
) -> JointSlopes:
    """Of one joint, from both momenta of all beyond it and both motions of its link, in the link's frame.

    `virtual_before` is the virtual angular velocity of the link before, which carries the joint's rotor.
    """
    (p, h), (p_, h_), (w, v), (w_, v_), (s, c) = momentum, momentum_, motion, virtual, sine_cosine
    u = plus(w, scale(mul(-1, rate), e))  # the joint's own rate turns with its axis
    # a turn of all beyond the joint, about any axis: h~ x u + p~ x v + h x w~ + p x v~
    turning = plus(plus(cross(h_, u), cross(p_, v)), plus(cross(h, w_), cross(p, v_)))
    if not all(isinstance(x, int) for x in e):  # or else only one of the three is needed
        turning = materialize(turning)
    # a change of the unit axis: the turn that it makes at this angle, and the rate's and the rotor's direction
    turned = plus(scale(s, turning), scale(sub(c, 1), cross(turning, e)))
    moved = plus(h_, scale(rotor, virtual_before))
    along = dot(e, w_)
    return JointSlopes(
        theta=dot(e, turning),
        rate=add(dot(e, h_), mul(rotor, along)),
        axis=plus(turned, scale(rate, moved)),
        anchor=apply(E, plus(cross(p_, u), cross(p, w_))),  # E (p~ x u + p x w~)
        rotor_momentum=mul(rate, along),
    )


def fusion_groups(robot: RobotScalars) -> Any:
    """Name for each entry what is best computed in one loop with it, as it reads the same values."""
    links, joints = range(len(robot.mass)), range(len(robot.parent))
    names: dict[str, Any] = dict(
        mass=[f"body {i}" for i in links],
        moment=[(f"body {i}",) * 3 for i in links],
        inertia=[(f"inertia {i}",) * 6 for i in links],
        axis=[(f"axis {k}",) * 3 for k in joints],
        anchor=[(f"anchor {k}",) * 3 for k in joints],
        rotor_momentum=[f"axis {k}" for k in joints],
        parent=robot.parent,
    )
    return RobotScalars(**names)

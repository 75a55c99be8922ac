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
from reojax.mechanics._fast.momentum_jvp import Pair, body_momentum, kept, onto_parent, outward
from reojax.mechanics._fast.parameters import RobotScalars
from reojax.mechanics._fast.recursion import joint_rotation
from reojax.mechanics._fast.scalar import (
    Scalar,
    Symmetric,
    Vector,
    add,
    apply,
    cross,
    dot,
    mul,
    plus,
    sub,
    times,
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
    """Differentiate `mu . angular_momentum(...)` (`momentum`) at fixed `mu`, `omega`, `velocity` and `centre`."""
    joints = range(len(robot.parent))
    E = [joint_rotation(e, *sc) for e, sc in zip(robot.axis, sine_cosine, strict=True)]
    actual: list[Pair] = [(omega, velocity)]
    virtual: list[Pair] = [(mu, cross(centre, mu))]
    for k in joints:
        parent, anchor = robot.parent[k], robot.anchor[k]
        w, v = outward(E[k], anchor, actual[parent])
        actual.append(kept((plus(w, times(rate[k], robot.axis[k])), v)))
        virtual.append(kept(outward(E[k], anchor, virtual[parent])))
    bodies = list(zip(robot.mass, robot.moment, robot.inertia, strict=True))
    momentum = [body_momentum(*body, *motion) for body, motion in zip(bodies, actual, strict=True)]
    likewise = [body_momentum(*body, *motion) for body, motion in zip(bodies, virtual, strict=True)]
    turning: list[Vector] = [()] * len(joints)
    pull: list[Vector] = [()] * len(joints)
    for k in reversed(joints):
        link, parent, e = k + 1, robot.parent[k], robot.axis[k]
        (p, h), (p_, h_) = momentum[link], likewise[link] = kept(momentum[link]), kept(likewise[link])
        (w, v), (w_, v_) = actual[link], virtual[link]
        u = plus(w, times(mul(-1, rate[k]), e))
        turning[k] = plus(plus(cross(h_, u), cross(p_, v)), plus(cross(h, w_), cross(p, v_)))
        if not all(isinstance(c, int) for c in e):  # or else only one of the three is needed
            turning[k] = materialize(turning[k])
        pull[k] = plus(cross(p_, u), cross(p, w_))
        rotor = times(mul(rate[k], robot.rotor_momentum[k]), e)
        momentum[parent] = onto_parent(E[k], robot.anchor[k], momentum[parent], momentum[link], rotor)
        likewise[parent] = onto_parent(E[k], robot.anchor[k], likewise[parent], likewise[link], (0, 0, 0))

    along = [dot(e, virtual[k + 1][0]) for k, e in zip(joints, robot.axis, strict=True)]
    beyond = [likewise[k + 1][1] for k in joints]
    by_axis = []
    for k in joints:
        (s, c), e, g = sine_cosine[k], robot.axis[k], turning[k]
        turned = plus(times(s, g), times(sub(c, 1), cross(g, e)))
        moved = plus(beyond[k], times(robot.rotor_momentum[k], virtual[robot.parent[k]][0]))
        by_axis.append(plus(turned, times(rate[k], moved)))
    motions = list(zip(actual, virtual, strict=True))
    return Slopes(
        robot=RobotScalars(
            mass=[dot(v, v_) for (_, v), (_, v_) in motions],
            moment=[plus(cross(v, w_), cross(v_, w)) for (w, v), (w_, v_) in motions],
            inertia=[_products(w, w_) for (w, _), (w_, _) in motions],
            axis=by_axis,
            anchor=[apply(E[k], pull[k]) for k in joints],
            rotor_momentum=[mul(rate[k], along[k]) for k in joints],
            parent=robot.parent,
        ),
        theta=[dot(e, g) for e, g in zip(robot.axis, turning, strict=True)],
        rate=[
            add(dot(e, h), mul(spin, a))
            for e, h, spin, a in zip(robot.axis, beyond, robot.rotor_momentum, along, strict=True)
        ],
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


def _products(a: Vector, b: Vector) -> Symmetric:
    mixed = tuple(add(mul(a[i], b[j]), mul(a[j], b[i])) for i, j in ((0, 1), (0, 2), (1, 2)))
    return (*(mul(x, y) for x, y in zip(a, b, strict=True)), *mixed)

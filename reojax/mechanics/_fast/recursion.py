"""Angular velocity of the base at zero momentum, `omega = A^-1 B theta_dot` (thesis eq. 2.14), fast.

One inward pass over the tree. Each link carries, in its own frame and about its own origin, what hangs
on it: mass `m`, first moment `f`, inertia `J`, and the momentum (linear `p`, angular `h`) that the joint
rates give while the base rests. Turning a joint by `E` and moving by its anchor `a`:

    p' = E (p + rate e x f)        h' = E (h + rate J e) + rotor + a x p'
    f' = E f + m a                 J' = E J E^T + 2 (a . g) - (a g^T + g a^T),   g = E f + m a / 2

At the base, about the centre of mass, `A = J - m (|c|^2 - c c^T)` with `c = f / m`, `L = h - c x p`, and
`A omega + L = 0`.
"""

from collections.abc import Sequence
from typing import NamedTuple

from reojax.mechanics._fast.materialize import materialize
from reojax.mechanics._fast.parameters import RobotScalars
from reojax.mechanics._fast.scalar import (
    ZERO,
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
    point_inertia,
    scale,
    sub,
    turned_inertia,
)

AT_ONCE = 4
"""So many joints are computed in one loop; more values than they read would not be vectorised."""


class Base(NamedTuple):
    """What the inward pass finds at the base, for the whole robot."""

    inertia: Symmetric
    """`A` of the thesis's eq. 2.14, about the centre of mass."""
    momentum: Vector
    """`L = -B theta_dot`, angular momentum about the centre of mass while the base rests."""
    centre: Vector
    """Centre of mass, from the base frame's origin."""
    drift: Vector
    """Velocity of the centre of mass while the base rests."""


class Subtree(NamedTuple):
    """A link and all that hangs on it, in its frame, about its origin."""

    mass: Scalar
    moment: Vector
    inertia: Symmetric
    push: Vector
    """Linear momentum that the joint rates give while the base rests."""
    spin: Vector
    """Angular momentum likewise."""


def inward(
    robot: RobotScalars, sine_cosine: Sequence[tuple[Scalar, Scalar]], rate: Sequence[Scalar], *, by_joint: bool = False
) -> Base:
    """Gather inertia and momentum from the tips to the base.

    In long robots, what every fourth joint hands on is kept (`materialize`), or every joint where axes are data, or if
    `by_joint`: without, XLA computes long chains again for every value they end in, and compile time grows with their
    square or worse.
    """
    long = len(robot.parent) > AT_ONCE
    every = 1 if by_joint or (long and not robot.axes_known) else AT_ONCE
    subtree = [
        Subtree(m, f, J, ZERO, ZERO) for m, f, J in zip(robot.mass, robot.moment, robot.inertia, strict=True)
    ]  # so far the link alone
    for k in reversed(range(len(robot.parent))):
        parent, e = robot.parent[k], robot.axis[k]
        E = joint_rotation(e, *sine_cosine[k])
        handed = hand_on(subtree[k + 1], E, e, robot.anchor[k], rate[k], robot.rotor_momentum[k])
        total = together(subtree[parent], handed)
        subtree[parent] = keep(total) if k and k % every == 0 else total
    return about_centre(subtree[0])


def hand_on(link: Subtree, E: Matrix, e: Vector, anchor: Vector, rate: Scalar, rotor: Scalar) -> Subtree:
    """What a joint hands on to the link that it hangs from: the equations of the module's first lines."""
    # the joint's rate turns all beyond it about e
    turned_push = plus(link.push, scale(rate, cross(e, link.moment)))
    turned_spin = plus(link.spin, scale(rate, apply_symmetric(link.inertia, e)))
    # into the frame of the link before, and to its origin
    push, spin, moment = (apply(E, vector) for vector in (turned_push, turned_spin, link.moment))
    own_rotor = scale(mul(rate, rotor), e)
    return Subtree(
        mass=link.mass,
        moment=plus(moment, scale(link.mass, anchor)),  # E f + m a
        inertia=plus(turned_inertia(E, link.inertia), _shift(link.mass, moment, anchor)),  # E J E^T, moved by a
        push=push,  # E (p + rate e x f)
        spin=plus(plus(spin, own_rotor), cross(anchor, push)),  # E (h + rate J e) + rotor + a x p'
    )


def together(a: Subtree, b: Subtree) -> Subtree:
    """Sum of what hangs on one link."""
    return Subtree(add(a.mass, b.mass), *(plus(x, y) for x, y in zip(a[1:], b[1:], strict=True)))


def keep(link: Subtree) -> Subtree:
    """Compute it once, for all that read it (`materialize`)."""
    moving = materialize((*link.push, *link.spin))
    return Subtree(link.mass, materialize(link.moment), materialize(link.inertia), moving[:3], moving[3:])


def about_centre(whole: Subtree) -> Base:
    """Inertia and momentum of the whole robot about its centre of mass, of what hangs on its base."""
    # c = f / m, and what it moves at
    centre, drift = (scale(1 / whole.mass, vector) for vector in (whole.moment, whole.push))
    return Base(
        inertia=plus(whole.inertia, scale(-1, point_inertia(whole.mass, centre))),  # J - m (|c|^2 - c c^T)
        momentum=plus(whole.spin, scale(-1, cross(centre, whole.push))),  # h - c x p
        centre=centre,
        drift=drift,
    )


def apply_symmetric(s: Symmetric, a: Vector) -> Vector:
    """Return `s @ a` for a symmetric matrix."""
    xx, yy, zz, xy, xz, yz = s
    return (dot((xx, xy, xz), a), dot((xy, yy, yz), a), dot((xz, yz, zz), a))


def joint_rotation(e: Vector, s: Scalar, c: Scalar) -> Matrix:
    """Rotation by the angle of sine `s` and cosine `c` about the unit vector `e` (Rodrigues)."""
    x, y, z = e
    versine = sub(1, c)

    def diagonal(a: Scalar) -> Scalar:
        known_unit = isinstance(a, int) and abs(a) == 1
        return 1 if known_unit else add(c, mul(versine, mul(a, a)))

    def pair(a: Scalar, b: Scalar, other: Scalar) -> tuple[Scalar, Scalar]:
        even, odd = mul(versine, mul(a, b)), mul(s, other)
        return sub(even, odd), add(even, odd)

    # c + (1 - c) e e^T + s hat(e)
    (xy, yx), (zx, xz), (yz, zy) = pair(x, y, z), pair(z, x, y), pair(y, z, x)
    return ((diagonal(x), xy, xz), (yx, diagonal(y), yz), (zx, zy, diagonal(z)))


def _shift(mass: Scalar, moment: Vector, a: Vector) -> Symmetric:
    """What moving by `a` adds to the inertia of a body of `mass` and first `moment`."""
    # 2 (a . g) - (a g^T + g a^T) with g = E f + m a / 2
    g = plus(moment, scale(mul(0.5, mass), a))
    x, y, z = (mul(p, q) for p, q in zip(a, g, strict=True))
    products = tuple(add(mul(a[i], g[j]), mul(a[j], g[i])) for i, j in ((0, 1), (0, 2), (1, 2)))
    return (*scale(2, (add(y, z), add(x, z), add(x, y))), *scale(-1, products))


def solve(A: Symmetric, right: Vector) -> Vector:
    """Solve `A x = right`, `A` symmetric positive definite."""
    adjugate, determinant = _adjugate(A)
    return scale(1 / determinant, apply_symmetric(adjugate, right))


def _adjugate(A: Symmetric) -> tuple[Symmetric, Scalar]:
    xx, yy, zz, xy, xz, yz = A
    adjugate = (
        sub(mul(yy, zz), mul(yz, yz)),
        sub(mul(xx, zz), mul(xz, xz)),
        sub(mul(xx, yy), mul(xy, xy)),
        sub(mul(xz, yz), mul(xy, zz)),
        sub(mul(xy, yz), mul(xz, yy)),
        sub(mul(xy, xz), mul(xx, yz)),
    )
    # the determinant, by the first row
    return adjugate, dot((xx, xy, xz), (adjugate[0], adjugate[3], adjugate[4]))

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

import jax

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
    conjugate,
    cross,
    dot,
    mul,
    plus,
    point_inertia,
    sub,
    times,
)
from reojax.mechanics._fast.sincos import sincos

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


def omega(robot: RobotScalars, theta: Sequence[jax.Array], rate: Sequence[jax.Array]) -> Vector:
    """Angular velocity of the base, base frame, at joint angles `theta` and `rate`, arrays of one shape."""
    base = inward(robot, [sincos(angle) for angle in theta], rate)
    return solve(base.inertia, times(-1, base.momentum))


def inward(
    robot: RobotScalars, sine_cosine: Sequence[tuple[Scalar, Scalar]], rate: Sequence[Scalar], *, by_joint: bool = False
) -> Base:
    """Gather inertia and momentum from the tips to the base.

    In long robots, what every fourth joint hands on is kept (`store`), or every joint where axes are data, or if
    `by_joint`: without, XLA computes long chains again for every value they end in, and compile time grows with their
    square or worse.
    """
    long = len(robot.parent) > AT_ONCE
    every = 1 if by_joint or (long and not robot.axes_known) else AT_ONCE
    m = list(robot.mass)
    f, J = list(robot.moment), list(robot.inertia)
    p, h = [ZERO] * len(m), [ZERO] * len(m)
    for k in reversed(range(len(robot.parent))):
        link, parent, e, a = k + 1, robot.parent[k], robot.axis[k], robot.anchor[k]
        E = joint_rotation(e, *sine_cosine[k])
        push = apply(E, plus(p[link], times(rate[k], cross(e, f[link]))))
        spin = apply(E, plus(h[link], times(rate[k], apply_symmetric(J[link], e))))
        rotor = times(mul(rate[k], robot.rotor_momentum[k]), e)
        moment = apply(E, f[link])
        p[parent] = plus(p[parent], push)
        h[parent] = plus(h[parent], plus(plus(spin, rotor), cross(a, push)))
        J[parent] = plus(J[parent], plus(conjugate(E, J[link]), _shift(m[link], moment, a)))
        f[parent] = plus(f[parent], plus(moment, times(m[link], a)))
        m[parent] = add(m[parent], m[link])
        if k and k % every == 0:
            moving = materialize((*p[parent], *h[parent]))
            p[parent], h[parent], J[parent], f[parent] = (
                moving[:3],
                moving[3:],
                materialize(J[parent]),
                materialize(f[parent]),
            )
    centre, drift = times(1 / m[0], f[0]), times(1 / m[0], p[0])
    return Base(
        inertia=plus(J[0], times(-1, point_inertia(m[0], centre))),
        momentum=plus(h[0], times(-1, cross(centre, p[0]))),
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

    (xy, yx), (zx, xz), (yz, zy) = pair(x, y, z), pair(z, x, y), pair(y, z, x)
    return ((diagonal(x), xy, xz), (yx, diagonal(y), yz), (zx, zy, diagonal(z)))


def _shift(mass: Scalar, moment: Vector, a: Vector) -> Symmetric:
    """What moving by `a` adds to the inertia of a body of `mass` and first `moment`."""
    g = plus(moment, times(mul(0.5, mass), a))
    x, y, z = (mul(p, q) for p, q in zip(a, g, strict=True))
    products = tuple(add(mul(a[i], g[j]), mul(a[j], g[i])) for i, j in ((0, 1), (0, 2), (1, 2)))
    return (*times(2, (add(y, z), add(x, z), add(x, y))), *times(-1, products))


def solve(A: Symmetric, right: Vector) -> Vector:
    """Solve `A x = right`, `A` symmetric positive definite."""
    adjugate, determinant = _adjugate(A)
    return times(1 / determinant, apply_symmetric(adjugate, right))


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
    return adjugate, dot((xx, xy, xz), (adjugate[0], adjugate[3], adjugate[4]))

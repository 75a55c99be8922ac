"""The robot's angular momentum with everything moving, for its derivative at fixed motion of the base (forward mode).

`virtual` has the same derivative for reverse mode.
"""

from collections.abc import Sequence

from reojax._fast.components import Components
from reojax._fast.omega import apply_symmetric, joint_rotation
from reojax._fast.scalar import Scalar, Vector, apply, cross, mul, plus, times, transpose
from reojax._fast.store import keep


def angular_momentum(
    robot: Components,
    sine_cosine: Sequence[tuple[Scalar, Scalar]],
    rate: Sequence[Scalar],
    omega: Vector,
    velocity: Vector,
    centre: Vector,
) -> Vector:
    """Angular momentum about the point `centre` (base frame) when the base moves with `omega` and `velocity`.

    Outward, each link's angular velocity `w` and its origin's velocity `v`, in its own frame:
    `w' = E^T w + rate e`, `v' = E^T (v + w x a)`. There, momentum `p = m v + w x f`, `h = J w + f x v`. Inward,
    `p + E p'`, `h + E h' + a x E p'`, and the rotors. Values are kept link by link (`store`).
    """
    joints = range(len(robot.parent))
    E = [joint_rotation(e, *sc) for e, sc in zip(robot.axis, sine_cosine, strict=True)]
    w, v = [omega], [velocity]
    for k in joints:
        outward, parent = transpose(E[k]), robot.parent[k]
        spin = plus(apply(outward, w[parent]), times(rate[k], robot.axis[k]))
        moving = keep((*spin, *apply(outward, plus(v[parent], cross(w[parent], robot.anchor[k])))))
        w.append(moving[:3])
        v.append(moving[3:])
    p = [plus(times(m, v_), cross(w_, f)) for m, f, v_, w_ in zip(robot.mass, robot.moment, v, w, strict=True)]
    h = [
        plus(apply_symmetric(J, w_), cross(f, v_))
        for J, f, v_, w_ in zip(robot.inertia, robot.moment, v, w, strict=True)
    ]
    for k in reversed(joints):
        link, parent = k + 1, robot.parent[k]
        carried = keep((*p[link], *h[link]))
        push = apply(E[k], carried[:3])
        rotor = times(mul(rate[k], robot.rotor_spin[k]), robot.axis[k])
        p[parent] = plus(p[parent], push)
        h[parent] = plus(h[parent], plus(plus(apply(E[k], carried[3:]), rotor), cross(robot.anchor[k], push)))
    return plus(h[0], times(-1, cross(centre, p[0])))

"""Integrators of `R' = R hat(omega)` on the rotation group, for steps of any kind; all keep R a rotation to rounding.

    magnus       omega known beforehand: fourth and sixth order, all steps at once
    runge_kutta  omega that depends on R and on a further state: fourth and sixth order, step by step

Net rotations of polygons have a faster one of their own, `reojax.mechanics._fast.magnus`.
"""

from reojax.mechanics.integrators.magnus import (
    GAUSS as GAUSS,
    GAUSS_4 as GAUSS_4,
    end_rotation as end_rotation,
    magnus4 as magnus4,
    magnus6 as magnus6,
)
from reojax.mechanics.integrators.runge_kutta import (
    RK4 as RK4,
    RK6 as RK6,
    Tableau as Tableau,
    orientations as orientations,
    runge_kutta_step as runge_kutta_step,
    step_nodes as step_nodes,
)

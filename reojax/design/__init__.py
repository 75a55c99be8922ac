"""Design by gradients: pose a problem over a robot and its loop, solve it, and say how certain the answer is."""

from reojax.design.authority import authority as authority, authority_above as authority_above
from reojax.design.link_edits import (
    with_com_offset as with_com_offset,
    with_joint_inertia as with_joint_inertia,
    with_length as with_length,
    with_mass as with_mass,
)
from reojax.design.loops import Loops as Loops, polygons as polygons, rectangles as rectangles
from reojax.design.measures import (
    bend_within as bend_within,
    clear_by as clear_by,
    loop_area as loop_area,
    off_axis_within as off_axis_within,
    travel as travel,
    turned_about as turned_about,
    turned_to as turned_to,
    value_of as value_of,
    weighted as weighted,
)
from reojax.design.outcome import Outcome as Outcome
from reojax.design.problem import Problem as Problem
from reojax.design.smooth import fourier_loops as fourier_loops, spline_loops as spline_loops
from reojax.design.solutions import Solutions as Solutions
from reojax.design.uncertainty import (
    Sensitivities as Sensitivities,
    Spread as Spread,
    scatter as scatter,
    sensitivities as sensitivities,
    spread as spread,
)
from reojax.design.variables import Space as Space, Variable as Variable
from reojax.optimisation.adam import descend as descend
from reojax.optimisation.optimise import Solution as Solution, optimise as optimise

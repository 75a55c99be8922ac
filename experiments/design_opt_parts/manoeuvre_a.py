"""Manoeuvre A of the prototype with its amplitudes, end link inertia and gear ratio to be chosen together."""

from collections.abc import Sequence
from typing import Any

import reojax
from reojax import design
from reojax.design import Outcome, Problem, Variable
from reojax.robots import prototype, with_end_inertia, with_gear_ratio

INERTIA, RATIO = (10.0, 190.0), (1.0, 48.0)
"""Range of the end link inertia [kg mm^2], and of the gear ratio, as in the thesis."""


def manoeuvre_problem(
    roll: float, objective: Any, conditions: Sequence[Any] = (), more: Sequence[Variable] = ()
) -> Problem:
    """Least `objective` with the roll [rad] given, its off-axis part left free; `more` variables for the conditions."""
    return Problem(
        lambda values: (
            with_gear_ratio(with_end_inertia(prototype(), values["inertia"]), values["ratio"]),
            reojax.manoeuvre_a(values["twist"], values["bend"]),
        ),
        [
            Variable("twist", 0, 270, "deg"),
            Variable("bend", 0, 120, "deg"),
            Variable("inertia", *INERTIA, "kg mm^2"),
            Variable("ratio", *RATIO),
            *more,
        ],
        objective=objective,
        equality=[design.turned_about([0, 0, 1], roll)],
        inequality=conditions,
    )


def joint_travel(outcome: Outcome) -> Any:
    """Travel of A: both distal joints twist and untwist, the centre joint bends and unbends [rad]."""
    return 4 * outcome.values["twist"] + 2 * outcome.values["bend"]

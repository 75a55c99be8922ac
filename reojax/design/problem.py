"""A design problem: named variables, what they make of robot and loop, what is wanted, and what must hold."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array
from reojax.collision.path_clearance import PathClearance, path_clearance
from reojax.design.loops import Loops
from reojax.design.variables import Space, Variable
from reojax.mechanics.holonomy import DEFAULT_STEPS, net_rotation
from reojax.optimisation.optimise import Solution, optimise
from reojax.path import Path
from reojax.robot import Robot

Build = Callable[[dict[str, Array]], tuple[Robot, Path]]


class Outcome:
    """What a design does; its quantities are computed when they are asked for."""

    def __init__(self, values: dict[str, Array], robot: Robot, path: Path, steps: int) -> None:
        """Keep the parts; `Problem.outcome` calls this."""
        self.values, self.robot, self.path, self.steps = values, robot, path, steps

    @cached_property
    def rotation(self) -> Float[Array, "3 3"]:
        """Net rotation of the base after the loop."""
        return net_rotation(self.robot, self.path, steps=self.steps)

    @cached_property
    def clearance(self) -> PathClearance:
        """Least clearance along the whole loop, proven."""
        return path_clearance(self.robot, self.path)


Measure = Callable[[Outcome], Any]
"""A quantity of a design: a scalar, or a vector (k,), traced by JAX."""


class Problem:
    """Least `objective` over the box of `variables`, with every `equality` 0 and every `inequality` at most 0.

    Everything is compiled once per problem and number of starts; change numbers, not functions, by variables whose
    bounds are equal (`hold`).
    """

    def __init__(
        self,
        build: Build,
        variables: Sequence[Variable | Loops],
        *,
        objective: Measure,
        equality: Sequence[Measure] = (),
        inequality: Sequence[Measure] = (),
        steps: int = DEFAULT_STEPS,
    ) -> None:
        """Pose the problem.

        Args:
            build: makes (robot, path) of the values by name, in SI; loops' coefficients are vectors. Traced by JAX.
            variables: what may be chosen. A family of loops brings its coefficients, conditions and random starts.
            objective: scalar measure of an outcome to make small.
            equality: measures that must be 0.
            inequality: measures that must not be positive.
            steps: steps per edge of `net_rotation`; 1 serves sampled curves.

        Raises:
            ValueError: for bad variables, see `Space`.
        """
        self.loops = tuple(v for v in variables if isinstance(v, Loops))
        self.space = Space([v.variable if isinstance(v, Loops) else v for v in variables])
        self._build, self._steps = build, steps

        def cost(x: Array) -> Array:
            return objective(self.outcome(x))

        def gather(measures: Sequence[Measure], conditions: str) -> Callable[[Array], Array]:
            def function(x: Array) -> Array:
                outcome = self.outcome(x)
                parts = [measure(outcome) for measure in measures]
                parts += [getattr(loop, conditions)(outcome.values[loop.variable.name]) for loop in self.loops]
                return jnp.concatenate([jnp.zeros(0, x.dtype), *(jnp.reshape(part, -1) for part in parts)])

            return function

        self.cost = cost
        self.equality, self.inequality = gather(equality, "equality"), gather(inequality, "inequality")

    def outcome(self, x: Array) -> Outcome:
        """Outcome of a design as a vector (n,) in SI."""
        values = self.space.named(x)
        robot, path = self._build(values)
        return Outcome(values, robot, path, self._steps)

    def starts(self, count: int, *, seed: int = 0) -> Float[np.ndarray, "m n"]:
        """Random designs within the bounds, loops within the joint limits."""
        rng = np.random.default_rng(seed)
        x = rng.uniform(self.space.lower, self.space.upper, (count, len(self.space.lower)))
        for loop in self.loops:
            x[:, self.space.place(loop.variable.name)] = loop.random(rng, count)
        return np.clip(x, self.space.lower, self.space.upper)

    def solve(
        self,
        starts: int | ArrayLike = 64,
        *,
        seed: int = 0,
        hold: Mapping[str, ArrayLike] | None = None,
        **options: Any,
    ) -> Solution:
        """Solve from many starts by `optimise`.

        Variables with a catalogue are relaxed first. Then, of each, the entries next to the best answer's value are
        held in turn (all combinations), and the best answer from there is returned.

        Args:
            starts: number of random starts, or (m, n) designs in SI.
            seed: of the random starts.
            hold: variables to keep at a value, in SI, by name.
            options: of `optimise`.

        Raises:
            ValueError: for an unknown name or a value outside of its bounds; and as `optimise`.
        """
        x = self.starts(int(starts), seed=seed) if isinstance(starts, int | np.integer) else np.array(starts, float)
        held = dict(hold or {})
        answer = self._solve_held(x, held, options)
        catalogues = {name: entries for name, entries in self.space.catalogues().items() if name not in held}
        if not catalogues:
            return answer
        best = self.space.named(answer.value[answer.best])
        choices = [_neighbours(entries, float(best[name])) for name, entries in catalogues.items()]
        answers = [
            self._solve_held(answer.value, held | dict(zip(catalogues, choice, strict=True)), options)
            for choice in itertools.product(*choices)
        ]
        return min(answers, key=lambda a: (not a.converged[a.best], a.cost[a.best]))

    def _solve_held(self, x: np.ndarray, held: Mapping[str, ArrayLike], options: Mapping[str, Any]) -> Solution:
        lower, upper, x = self.space.lower.copy(), self.space.upper.copy(), x.copy()
        for name, value in held.items():
            place = self.space.place(name)
            if not (np.all(lower[place] <= value) and np.all(value <= upper[place])):
                raise ValueError(f"{name!r} is held at {value}, which is outside of its bounds (SI).")
            lower[place] = upper[place] = value
            if x.ndim == 2:
                x[:, place] = value
        size = np.where(self.space.upper > self.space.lower, self.space.upper - self.space.lower, 1.0)
        return optimise(
            self.cost,
            x,
            lower=lower,
            upper=upper,
            equality=self.equality,
            inequality=self.inequality,
            scale=size,
            **options,
        )


def _neighbours(entries: np.ndarray, value: float) -> list[float]:
    """Catalogue entries on either side of a value, or the one that it is, or the end that it is beyond."""
    near = np.isclose(entries, value, rtol=1e-9, atol=0)
    if near.any():
        return [float(entries[near][0])]
    above = int(np.searchsorted(entries, value))
    return [float(entry) for entry in entries[max(above - 1, 0) : above + 1]]

"""A design problem: named variables, what they make of robot and loop, what is wanted, and what must hold."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from reojax._internal import checks
from reojax._internal.arrays import Array, as_numbers
from reojax.collision.path_clearance import least_clearance, look_for
from reojax.design.loops import Loops
from reojax.design.outcome import Measure, Outcome
from reojax.design.self_clearance import ClearBy, solve_proven
from reojax.design.solutions import Solutions
from reojax.design.variables import Space, Variable, neighbours
from reojax.mechanics.holonomy import DEFAULT_STEPS
from reojax.optimisation.functions import Function, Functions
from reojax.optimisation.optimise import Limits, Solution, choose_best, optimise
from reojax.path import Path
from reojax.robot import Robot

Build = Callable[[dict[str, Array]], tuple[Robot, Path]]
Vector = Callable[[Array], Array]


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
        momentum: ArrayLike | None = None,
    ) -> None:
        """Pose the problem.

        Args:
            build: makes (robot, path) of the values by name, in SI; loops' coefficients are vectors. Traced by JAX.
            variables: what may be chosen. A family of loops brings its coefficients, conditions and random starts.
            objective: scalar measure of an outcome to make small.
            equality: measures that must be 0.
            inequality: measures that must not be positive.
            steps: steps per edge of `net_rotation`; 1 serves sampled curves.
            momentum: none, or zero: any other is refused, and `reojax.righting` named.

        Raises:
            ValueError: for bad variables, see `Space`.
        """
        checks.no_momentum(momentum, "design.Problem")
        for entry, function in (("build", build), ("objective", objective)):
            if not callable(function):
                raise ValueError(f"`{entry}` is {checks.shorten(function)}; it must be a function.")
        families = isinstance(variables, Sequence) and all(isinstance(item, Variable | Loops) for item in variables)
        if not families:
            raise ValueError(
                f"`variables` is {checks.shorten(variables)}; it must list Variables and families of loops."
            )
        for entry, listed in (("equality", equality), ("inequality", inequality)):
            if not isinstance(listed, Sequence) or not all(callable(item) for item in listed):
                raise ValueError(f"`{entry}` is {checks.shorten(listed)}; it must list measures, which are functions.")
        checks.whole("steps", steps)
        self.loops = tuple(v for v in variables if isinstance(v, Loops))
        self.space = Space([v.variable if isinstance(v, Loops) else v for v in variables])
        self._build, self._steps = build, steps

        def cost(x: Array) -> Array:
            return objective(self.outcome(x))

        self.cost = cost
        # measures and the loops' own conditions apart: the latter are cheap, and need no derivative of the rotation
        self._equality = self._in_a_row(equality), self._conditions("equality")
        self._inequality = self._in_a_row(inequality), self._conditions("inequality")
        self._clear = tuple(measure for measure in inequality if isinstance(measure, ClearBy))
        self._tightened = self._of_share(inequality)
        self._proven = jax.jit(self._proof)

    def _in_a_row(self, measures: Sequence[Measure]) -> Vector:
        def function(x: Array) -> Array:
            outcome = self.outcome(x)
            return _concatenate(x, [measure(outcome) for measure in measures])

        return function

    def _of_share(self, inequality: Sequence[Measure]) -> tuple[Function, tuple[Function, ...], tuple[Function, ...]]:
        """The problem as functions of x and how much more clearance is asked for: one program for all that is."""

        def tightened(x: Array, share: Array) -> Array:
            outcome = self.outcome(x)
            measures = [m.tighter(share) if isinstance(m, ClearBy) else m for m in inequality]
            return _concatenate(x, [measure(outcome) for measure in measures])

        alike = lambda function: lambda x, share: function(x)
        equality = tuple(alike(function) for function in self._equality)
        return alike(self.cost), equality, (tightened, alike(self._inequality[1]))

    def _conditions(self, kind: str) -> Vector:
        def function(x: Array) -> Array:
            values = self.space.named(x)
            return _concatenate(x, [getattr(loop, kind)(values[loop.variable.name]) for loop in self.loops])

        return function

    @property
    def functions(self) -> Functions:
        """Cost and constraints as `optimise` takes them: by parts that are differentiated apart."""
        return Functions(self.cost, self._equality, self._inequality, False)

    def equality(self, x: Array) -> Float[Array, " p"]:
        """What must be 0 at a design `x` (n,) in SI: the measures, then the conditions of the loops."""
        return jnp.concatenate([function(x) for function in self._equality])

    def inequality(self, x: Array) -> Float[Array, " q"]:
        """What must not be positive at a design `x` (n,) in SI, in the same order."""
        return jnp.concatenate([function(x) for function in self._inequality])

    def outcome(self, x: Array) -> Outcome:
        """Outcome of a design `x`, a vector (n,) in SI, in the order of `space.names`; may be traced."""
        values = self.space.named(x)
        robot, path = self._build(values)
        return Outcome(values, robot, path, self._steps)

    def starts(self, count: int, *, seed: int = 0) -> Float[np.ndarray, "m n"]:
        """Random designs (m, n) in SI, within the bounds, loops within the joint limits.

        Args:
            count: how many.
            seed: of the random numbers.

        Raises:
            ValueError: if `count` is no positive integer, or `seed` no whole number.
        """
        count, rng = checks.whole("count", count), np.random.default_rng(checks.seed(seed))
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
        tolerance: float = 1e-8,
        slope_tolerance: float = 1e-6,
        max_steps: int = 200,
        progress: bool | str = False,
    ) -> Solution:
        """Solve from many starts by `optimise`.

        Variables with a catalogue are relaxed first. Then, of each, the entries next to the best answer's value are
        held in turn (all combinations), and the best answer from there is returned.

        Args:
            starts: number of random starts, or (m, n) designs in SI.
            seed: of the random starts.
            hold: variables to keep at a value, in SI, by name.
            tolerance: of `optimise`, and so are `slope_tolerance`, `max_steps` and `progress`.
            slope_tolerance: largest slope.
            max_steps: most steps of a start.
            progress: whether to show a bar on stderr, or what to write before it.

        Raises:
            ValueError: for an unknown name or a value outside of its bounds; and as `optimise`.
        """
        limits = Limits(tolerance, slope_tolerance, max_steps, progress)
        x, held = self._starts(starts, seed), dict(hold or {})
        answer = self._solve_held(x, {name: np.asarray(value)[None] for name, value in held.items()}, limits)
        catalogues = {name: entries for name, entries in self.space.catalogues().items() if name not in held}
        if not catalogues:
            return answer
        best = self.space.named(answer.value[answer.best])
        choices = list(itertools.product(*(neighbours(e, float(best[name])) for name, e in catalogues.items())))
        # every combination of entries from every start, side by side
        each = {name: np.repeat([choice[i] for choice in choices], len(x)) for i, name in enumerate(catalogues)}
        each |= {name: np.asarray(value)[None] for name, value in held.items()}
        many = self._solve_held(np.tile(answer.value, (len(choices), 1)), each, limits)
        first = many.best - many.best % len(x)  # of the combination with the best answer
        fields = {name: value[first : first + len(x)] for name, value in many._asdict().items() if name != "best"}
        return Solution(**fields, best=many.best - first)

    def solve_each(
        self,
        holds: Mapping[str, ArrayLike],
        starts: int | ArrayLike = 8,
        *,
        seed: int = 0,
        tolerance: float = 1e-8,
        slope_tolerance: float = 1e-6,
        max_steps: int = 200,
        progress: bool | str = False,
    ) -> Solutions:
        """Solve many problems that differ by the values of some variables, side by side, each from every start.

        A trade-off over targets, weights, limits or parameters, all of them variables that are held, is one call:

            problem.solve_each({"target": targets, "gear ratio": np.linspace(1, 48, 13)})

        Catalogues are not looked at.

        Args:
            holds: by name, the values (k, ...) in SI that a variable is kept at in each of the k problems; NaN in those
                problems where it is free.
            starts: number of random starts, or (m, n) designs in SI, the same for every problem.
            seed: of the random starts.
            tolerance: of `optimise`, and so are `slope_tolerance`, `max_steps` and `progress`.
            slope_tolerance: largest slope.
            max_steps: most steps of a start.
            progress: whether to show a bar on stderr, or what to write before it.

        Raises:
            ValueError: for no values, different numbers of them, an unknown name or a value outside of its bounds; and
                as `optimise`.
        """
        counts = {name: np.shape(value)[0] if np.ndim(value) else 0 for name, value in holds.items()}
        if len(set(counts.values())) != 1 or not all(counts.values()):
            raise ValueError(f"`holds` has {counts or 'nothing'}; every variable needs one value for each problem.")
        x, many = self._starts(starts, seed), next(iter(counts.values()))
        each = {name: np.repeat(np.asarray(value, float), len(x), axis=0) for name, value in holds.items()}
        limits = Limits(tolerance, slope_tolerance, max_steps, progress)
        found = self._solve_held(np.tile(x, (many, 1)), each, limits)
        fields = {
            name: value.reshape(many, len(x), *value.shape[1:])
            for name, value in found._asdict().items()
            if name != "best"
        }
        best = choose_best(*(fields[name] for name in ("cost", "residual", "converged")))
        return Solutions(**fields, best=best)

    def _starts(self, starts: int | ArrayLike, seed: int) -> Float[np.ndarray, "m n"]:
        if isinstance(starts, int | np.integer) and not isinstance(starts, bool):
            return self.starts(checks.whole("starts", starts), seed=seed)
        x = np.array(as_numbers("starts", starts), float)
        x = x[None] if x.ndim == 1 else x
        if x.shape[1:] != self.space.lower.shape or not len(x):
            raise ValueError(f"`starts` has shape {x.shape}; it must be (m, {self.space.lower.size}).")
        return x

    def _solve_held(self, x: np.ndarray, held: Mapping[str, np.ndarray], limits: Limits) -> Solution:
        """Solve with variables held at values (1 or m, ...), free where they are NaN."""
        x, lower, upper = self.space.hold(x, held)
        size = np.where(self.space.upper > self.space.lower, self.space.upper - self.space.lower, 1.0)

        def run(functions: Sequence[Any], x: np.ndarray, rows: np.ndarray, data: Any) -> Solution:
            cost, equality, inequality = functions
            return optimise(
                cost,
                x,
                lower=lower[rows],
                upper=upper[rows],
                equality=equality,
                inequality=inequality,
                data=data,
                scale=size,
                **limits._asdict(),
            )

        if not self._clear:
            return run((self.cost, self._equality, self._inequality), x, np.arange(len(x)), None)
        return solve_proven(x, partial(run, self._tightened), self._kept)

    def _kept(self, x: Float[np.ndarray, "m n"]) -> Bool[np.ndarray, " m"]:
        """Which designs are proven to keep their clearance along their whole loops."""
        return np.array([bool(self._proven(row)) for row in x], bool)

    def _proof(self, x: Array) -> Array:
        """Whether one is, looked at no closer than that takes."""
        outcome, margin = self.outcome(x), max(measure.margin for measure in self._clear)
        return least_clearance(outcome.robot, outcome.path.waypoints, *look_for(margin)).distance >= margin


def _concatenate(x: Array, parts: Sequence[Any]) -> Array:
    return jnp.concatenate([jnp.zeros(0, x.dtype), *(jnp.reshape(part, -1) for part in parts)])

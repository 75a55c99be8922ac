"""Design problems by other people's optimisers, start by start, with the same compiled values and derivatives."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from reojax.design import Problem

TOLERANCE = 1e-8
"""Violation that counts as converged, of every system."""


class Ended(NamedTuple):
    """Where the starts of one system ended."""

    cost: np.ndarray
    violation: np.ndarray
    converged: np.ndarray
    """Of reojax: stationary and feasible; of the others: feasible, whatever they say."""
    gradients: int
    seconds: float


class Functions:
    """Cost and constraints in the free, scaled variables, each point evaluated once."""

    def __init__(self, problem: Problem, held: dict[str, np.ndarray]) -> None:
        lower, upper = problem.space.lower.copy(), problem.space.upper.copy()
        for name, value in held.items():
            lower[problem.space.place(name)] = upper[problem.space.place(name)] = value
        self.free = upper > lower
        self.scale = (upper - lower)[self.free]
        self.lower, self.upper = (end[self.free] / self.scale for end in (lower, upper))
        place, fixed = np.flatnonzero(self.free), jnp.asarray(lower)

        def whole(u: jax.Array) -> jax.Array:
            return fixed.at[place].set(u * self.scale)

        kinds = ((problem.functions.cost,), problem.functions.equality, problem.functions.inequality)

        def values(u: jax.Array) -> tuple[jax.Array, ...]:
            x = whole(u)
            cost, *rows = ([jnp.atleast_1d(f(x)) for f in kind] for kind in kinds)
            return cost[0][0], *(jnp.concatenate(part) for part in rows)

        def derivatives(u: jax.Array) -> tuple[jax.Array, ...]:
            # each function apart, so that linear rows cost nothing
            slope = lambda f: jnp.atleast_2d(jax.jacrev(lambda u: f(whole(u)))(u))
            cost, *rows = ([slope(f) for f in kind] for kind in kinds)
            return cost[0][0], *(jnp.concatenate(part) for part in rows)

        self._values, self._derivatives = jax.jit(values), jax.jit(derivatives)
        self._value_at = self._derivative_at = b""
        self.gradients = 0
        middle = 0.5 * (self.lower + self.upper)
        jax.block_until_ready((self._values(middle), self._derivatives(middle)))

    def values(self, u: np.ndarray) -> tuple[np.ndarray, ...]:
        """Cost, equalities and inequalities."""
        if u.tobytes() != self._value_at:
            self._value_at, self._value = u.tobytes(), tuple(map(np.asarray, self._values(u)))
        return self._value

    def derivatives(self, u: np.ndarray) -> tuple[np.ndarray, ...]:
        """Their first derivatives."""
        if u.tobytes() != self._derivative_at:
            self._derivative_at, self._derivative = u.tobytes(), tuple(map(np.asarray, self._derivatives(u)))
            self.gradients += 1
        return self._derivative

    def ended(self, points: list[np.ndarray], seconds: float) -> Ended:
        """What was found at points, all within the bounds."""
        found = [self.values(np.clip(u, self.lower, self.upper)) for u in points]
        violation = np.array([max(np.abs(e).max(initial=0.0), i.max(initial=0.0)) for _, e, i in found])
        cost = np.array([float(c) for c, _, _ in found])
        return Ended(cost, violation, violation <= TOLERANCE, self.gradients, seconds)


def slsqp(functions: Functions, starts: np.ndarray) -> Ended:
    """SciPy's SLSQP."""
    from scipy.optimize import minimize

    f = functions
    constraints: list[dict[str, Any]] = []
    for k, kind, sign in ((1, "eq", 1.0), (2, "ineq", -1.0)):
        if f.values(starts[0])[k].size:
            constraints.append(
                {
                    "type": kind,
                    "fun": lambda u, k=k, sign=sign: sign * f.values(u)[k],
                    "jac": lambda u, k=k, sign=sign: sign * f.derivatives(u)[k],
                }
            )
    f.gradients, begin, points = 0, time.perf_counter(), []
    for start in starts:
        found = minimize(
            lambda u: float(f.values(u)[0]),
            start,
            jac=lambda u: f.derivatives(u)[0],
            bounds=list(zip(f.lower, f.upper, strict=True)),
            constraints=constraints,
            method="SLSQP",
            options={"ftol": 1e-10, "maxiter": 300},
        )
        points.append(found.x)
    return f.ended(points, time.perf_counter() - begin)


class _Ipopt:
    """What IPOPT calls."""

    def __init__(self, functions: Functions) -> None:
        self.f = functions

    def objective(self, u: np.ndarray) -> float:
        return float(self.f.values(u)[0])

    def gradient(self, u: np.ndarray) -> np.ndarray:
        return self.f.derivatives(u)[0]

    def constraints(self, u: np.ndarray) -> np.ndarray:
        return np.concatenate(self.f.values(u)[1:])

    def jacobian(self, u: np.ndarray) -> np.ndarray:
        return np.concatenate(self.f.derivatives(u)[1:]).ravel()


def ipopt(functions: Functions, starts: np.ndarray) -> Ended:
    """IPOPT with its limited-memory Hessian."""
    import cyipopt

    f = functions
    _, equality, inequality = f.values(starts[0])
    f.gradients, begin, points = 0, time.perf_counter(), []
    for start in starts:
        solver = cyipopt.Problem(
            n=len(start),
            m=equality.size + inequality.size,
            problem_obj=_Ipopt(f),
            lb=f.lower,
            ub=f.upper,
            cl=np.concatenate([np.zeros(equality.size), np.full(inequality.size, -1e20)]),
            cu=np.zeros(equality.size + inequality.size),
        )
        for name, value in (
            ("hessian_approximation", "limited-memory"),
            ("print_level", 0),
            ("sb", "yes"),
            ("tol", 1e-8),
            ("constr_viol_tol", TOLERANCE),
            ("bound_relax_factor", 0.0),
            ("max_iter", 300),
        ):
            solver.add_option(name, value)
        points.append(solver.solve(start)[0])
    return f.ended(points, time.perf_counter() - begin)


PEERS: dict[str, Callable[[Functions, np.ndarray], Ended]] = {"SLSQP": slsqp}
"""Those that are installed; IPOPT needs `cyipopt`."""
if importlib.util.find_spec("cyipopt"):
    PEERS["IPOPT"] = ipopt

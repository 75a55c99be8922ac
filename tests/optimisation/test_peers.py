"""The solver beside SciPy's SLSQP and IPOPT: as many starts converged, no worse a best cost; known minima reached."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize

from reojax.design import optimise

CONFIG = {"ftol": 1e-12, "maxiter": 300}


def rosenbrock(x):
    return (100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2).sum()


def in_a_ball(x):
    return jnp.array([x @ x - 1.5])


def robot_arm_cost(x):
    """Joint travel of a planar arm of unit links, smoothed."""
    return jnp.sqrt(x**2 + 1e-4).sum()


def arm_reaches(x):
    turned = jnp.cumsum(x)
    return jnp.array([jnp.cos(turned).sum() - 1.2, jnp.sin(turned).sum() - 0.9])


def hand_turn(x):
    return jnp.array([jnp.abs(x.sum()) ** 2 - 4.0])


def hs100(x):
    """Hock and Schittkowski's problem 100, whose least cost is 680.6300573."""
    return (
        (x[0] - 10) ** 2
        + 5 * (x[1] - 12) ** 2
        + x[2] ** 4
        + 3 * (x[3] - 11) ** 2
        + 10 * x[4] ** 6
        + 7 * x[5] ** 2
        + x[6] ** 4
        - 4 * x[5] * x[6]
        - 10 * x[5]
        - 8 * x[6]
    )


def hs100_rows(x):
    return jnp.array(
        [
            2 * x[0] ** 2 + 3 * x[1] ** 4 + x[2] + 4 * x[3] ** 2 + 5 * x[4] - 127,
            7 * x[0] + 3 * x[1] + 10 * x[2] ** 2 + x[3] - x[4] - 282,
            23 * x[0] + x[1] ** 2 + 6 * x[5] ** 2 - 8 * x[6] - 196,
            4 * x[0] ** 2 + x[1] ** 2 - 3 * x[0] * x[1] + 2 * x[2] ** 2 + 5 * x[5] - 11 * x[6],
        ]
    )


def no_rows(x):
    return jnp.zeros(0)


PROBLEMS = {
    "Rosenbrock in a ball": (rosenbrock, no_rows, in_a_ball, 4, -2.0, 2.0),
    "an arm that reaches": (robot_arm_cost, arm_reaches, hand_turn, 5, -3.0, 3.0),
    "Hock-Schittkowski 100": (hs100, no_rows, hs100_rows, 7, -10.0, 10.0),
}


def slsqp(functions, starts, lower, upper):
    """Costs of starts that end feasible, infinite of the others."""
    cost, equality, inequality = functions
    values = [jax.jit(f) for f in functions]
    slopes = [jax.jit(jax.jacrev(f)) for f in functions]
    number = lambda f: lambda x: np.asarray(f(x), float)
    constraints = [
        {
            "type": kind,
            "fun": lambda x, k=k, s=s: s * number(values[k])(x),
            "jac": lambda x, k=k, s=s: s * number(slopes[k])(x),
        }
        for k, kind, s in ((1, "eq", 1.0), (2, "ineq", -1.0))
        if np.size(functions[k](starts[0]))
    ]
    found = [
        minimize(
            lambda x: float(values[0](x)), start, jac=number(slopes[0]), method="SLSQP",
            bounds=[(lower, upper)] * len(start), constraints=constraints, options=CONFIG,
        ).x
        for start in starts
    ]  # fmt: skip
    return np.array([_worth(functions, np.clip(x, lower, upper)) for x in found])


def ipopt(functions, starts, lower, upper):
    cyipopt = pytest.importorskip("cyipopt")
    values, slopes = [jax.jit(f) for f in functions], [jax.jit(jax.jacrev(f)) for f in functions]

    class Callbacks:
        objective = staticmethod(lambda x: float(values[0](x)))
        gradient = staticmethod(lambda x: np.asarray(slopes[0](x)))
        constraints = staticmethod(lambda x: np.concatenate([values[1](x), values[2](x)]))
        jacobian = staticmethod(lambda x: np.concatenate([slopes[1](x), slopes[2](x)]).ravel())

    p, q = (np.size(f(starts[0])) for f in functions[1:])
    found, n = [], starts.shape[1]
    for start in starts:
        box = {"lb": np.full(n, lower), "ub": np.full(n, upper)}
        rows = {"cl": np.append(np.zeros(p), np.full(q, -1e20)), "cu": np.zeros(p + q)}
        solver = cyipopt.Problem(n=n, m=p + q, problem_obj=Callbacks(), **box, **rows)
        settings = {"hessian_approximation": "limited-memory", "print_level": 0, "sb": "yes", "bound_relax_factor": 0.0}
        for name, value in settings.items():
            solver.add_option(name, value)
        found.append(solver.solve(start)[0])
    return np.array([_worth(functions, np.clip(x, lower, upper)) for x in found])


def _worth(functions, x):
    cost, equality, inequality = (np.asarray(f(x)) for f in functions)
    off = max(np.abs(equality).max(initial=0.0), inequality.max(initial=0.0))
    return float(cost) if off <= 1e-7 else np.inf


@pytest.mark.parametrize("peer", [slsqp, ipopt])
@pytest.mark.parametrize("name", PROBLEMS)
def test_as_many_converge_to_no_worse_a_cost(name, peer):
    *functions, n, lower, upper = PROBLEMS[name]
    starts = np.random.default_rng(7).uniform(0.5 * lower, 0.5 * upper, (8, n))
    theirs = peer(functions, starts, lower, upper)
    ours = optimise(functions[0], starts, lower=lower, upper=upper, equality=functions[1], inequality=functions[2])
    assert ours.converged.sum() >= np.isfinite(theirs).sum()
    assert ours.cost[ours.best] <= theirs.min() + 1e-6 * abs(theirs.min())
    np.testing.assert_allclose(
        [_worth(functions, x) for x in ours.value[ours.converged]], ours.cost[ours.converged], rtol=1e-10
    )


def test_a_published_minimum_with_four_inequalities():
    starts = np.random.default_rng(1).uniform(-3, 3, (6, 7))
    found = optimise(hs100, starts, lower=-10, upper=10, inequality=hs100_rows)
    assert found.converged.all()
    np.testing.assert_allclose(found.cost, 680.6300573, rtol=1e-9)

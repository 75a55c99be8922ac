"""The constrained solver against problems with known answers, and what it says where there is none."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from reojax.design import descend, optimise
from reojax.optimisation.status import Status

STARTS = np.random.default_rng(0).uniform(1, 5, (8, 4))


def product_cost(x):
    """Hock and Schittkowski's problem 71, whose answer is 17.0140172..."""
    return x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]


def forty(x):
    return jnp.array([x @ x - 40])


def at_least_25(x):
    return jnp.array([25 - x[0] * x[1] * x[2] * x[3]])


HS71 = dict(lower=1.0, upper=5.0, equality=forty, inequality=at_least_25)


def test_known_answer_with_all_kinds_of_constraints():
    found = optimise(product_cost, STARTS, **HS71)
    best = found.value[found.best]
    np.testing.assert_allclose(best, [1, 4.74299963, 3.82114998, 1.37940829], atol=1e-6)
    np.testing.assert_allclose(found.cost[found.best], 17.0140172, atol=1e-6)
    assert found.converged.all()
    assert (found.residual <= 1e-8).all()
    assert (found.slope <= 1e-6).all()
    assert (found.steps < 40).all()
    np.testing.assert_allclose(found.cost, jax.vmap(product_cost)(found.value), rtol=1e-12)
    gap = np.maximum(np.abs(jax.vmap(forty)(found.value)).max(1), jax.vmap(at_least_25)(found.value).max(1))
    np.testing.assert_allclose(found.residual, np.maximum(gap, 0), atol=1e-12)


def test_agrees_with_scipy():
    from scipy.optimize import minimize

    constraints = [
        {"type": "eq", "fun": lambda x: np.asarray(forty(x))},
        {"type": "ineq", "fun": lambda x: -np.asarray(at_least_25(x))},
    ]
    theirs = minimize(
        product_cost, STARTS[0], bounds=[(1, 5)] * 4, constraints=constraints, method="SLSQP", options={"ftol": 1e-12}
    )
    ours = optimise(product_cost, STARTS[0], **HS71)
    assert ours.value.shape == (1, 4)
    np.testing.assert_allclose(ours.value[0], theirs.x, atol=1e-5)


def distance(x, data):
    return ((x - data["point"]) ** 2).sum()


def on_circle(x, data):
    return jnp.array([x @ x - data["radius"] ** 2])


def test_a_problem_per_start():
    """Nearest point of a circle: towards the point, at the radius."""
    points = np.random.default_rng(1).normal(size=(6, 2))
    radii = np.linspace(0.5, 2, 6)
    found = optimise(
        distance, np.full((6, 2), 0.1), lower=-3, upper=3, equality=on_circle, data={"point": points, "radius": radii}
    )
    expected = points / np.linalg.norm(points, axis=1, keepdims=True) * radii[:, None]
    assert found.converged.all()
    np.testing.assert_allclose(found.value, expected, atol=1e-5)


def test_unreachable_target_gives_the_closest_found():
    found = optimise(jnp.sum, np.full((2, 3), 0.5), lower=0, upper=1, equality=lambda x: jnp.array([x.sum() - 4]))
    assert not found.converged.any()
    np.testing.assert_allclose(found.value, 1, atol=1e-6)
    np.testing.assert_allclose(found.residual, 1, atol=1e-6)
    assert (found.steps < 60).all()


def test_not_finite_somewhere():
    """The start that begins where the cost is not finite is reported; the others get past such points."""

    def cost(x):
        return jnp.where(x[0] < -0.5, jnp.nan, (x[0] + 1) ** 2 - jnp.log(x[0] + 0.6)) + x[1] ** 2

    found = optimise(cost, [[-0.9, 0.3], [0.9, 0.3], [0.0, -0.5]], lower=-1, upper=1)
    np.testing.assert_array_equal(found.converged, [False, True, True])
    assert np.isinf([found.cost[0], found.residual[0], found.slope[0]]).all()
    root = (-1.6 + np.sqrt(1.6**2 - 4 * 0.1)) / 2  # of 2 (x + 1) (x + 0.6) = 1
    np.testing.assert_allclose(found.value[1:], [[root, 0]] * 2, atol=1e-5)
    assert found.best in (1, 2)


def test_a_held_variable_and_one_without_bounds():
    found = optimise(
        lambda x: (x[0] - 7) ** 2 + x[1] + 2 * (x[2] - x[1]) ** 2 + jnp.cos(3 * x[1] * x[2]),
        [0.0, 0.25, 0.0],
        lower=[-np.inf, 0.25, -1],
        upper=[np.inf, 0.25, 1],
    )
    slope = lambda z: 4 * (z - 0.25) - 0.75 * np.sin(0.75 * z)
    assert found.converged.all()
    assert (found.steps <= 12).all()
    np.testing.assert_allclose(found.value[0, :2], [7, 0.25], atol=1e-5)
    np.testing.assert_allclose(slope(found.value[0, 2]), 0, atol=1e-5)


def test_what_is_held_has_no_influence():
    """Whatever the held variable's derivatives and bounds are, the answers of the others stay the same."""

    def cost(x, steep):
        return (x[0] - 0.3) ** 2 + x[0] * x[1] + steep * x[2]

    def line(x, steep):
        return jnp.array([x[0] + 2 * x[1] - 1 + steep * (x[2] - 0.5)])

    starts = np.array([[0.1, 0.9, 0.5], [0.8, 0.2, 0.5]])
    lower, upper = [0, 0, 0.5], [1, 1, 0.5]
    answers = [
        optimise(cost, starts, lower=lower, upper=upper, equality=line, data=np.full(2, steep), scale=scale)
        for steep, scale in ((0.0, 1.0), (1e6, 1.0), (1e6, [1.0, 1.0, 6.4]))
    ]
    for other in answers[1:]:
        assert other.converged.all()
        np.testing.assert_allclose(other.value, answers[0].value, atol=1e-9)
        np.testing.assert_allclose(other.slope, answers[0].slope, atol=1e-9)
        np.testing.assert_array_equal(other.steps, answers[0].steps)


def test_bounds_for_every_start():
    found = optimise(
        lambda x: (x**2).sum(), [[0.5, 0.5], [0.5, 3.0]], lower=[[0.1, 0.2], [0.4, 3.0]], upper=[[1.0, 1.0], [1.0, 3.0]]
    )
    assert found.converged.all()
    np.testing.assert_allclose(found.value, [[0.1, 0.2], [0.4, 3.0]], atol=1e-9)


def test_several_constraint_functions_are_one_after_the_other():
    one = optimise(product_cost, STARTS, **HS71)
    apart = HS71 | {"equality": (forty, lambda x: jnp.zeros(0)), "inequality": (lambda x: jnp.zeros(0), at_least_25)}
    np.testing.assert_allclose(optimise(product_cost, STARTS, **apart).value, one.value, atol=1e-9)


def test_statuses_say_why():
    short = optimise(product_cost, STARTS, **HS71, max_steps=1)
    assert (short.status == Status.OUT_OF_STEPS).all()
    assert (short.steps == 1).all()
    assert short.message[0].startswith("out of steps")
    far = optimise(jnp.sum, [0.5], lower=0, upper=1, equality=lambda x: x - 4)
    assert far.status[0] == Status.INFEASIBLE
    np.testing.assert_array_equal(far.violation, far.residual)
    lost = optimise(lambda x: jnp.log(x[0]), [-1.0], lower=-2, upper=2)
    assert lost.status[0] == Status.NOT_FINITE


def test_a_start_is_moved_out_of_a_local_least_of_the_violations():
    """x^4 - x^2 = 2 has a local least of its violation at 0, where the gradient vanishes, and two roots."""
    found = optimise(lambda x: x[0], [0.0], lower=-3, upper=3, equality=lambda x: x**4 - x**2 - 2)
    assert found.converged.all()
    np.testing.assert_allclose(abs(found.value), np.sqrt(2), atol=1e-7)


def test_no_start_depends_on_the_others():
    together = optimise(product_cost, STARTS, **HS71)
    np.testing.assert_allclose(optimise(product_cost, STARTS[3:5], **HS71).value, together.value[3:5], atol=1e-9)


def test_redundant_constraints_and_a_corner():
    """More active constraints than variables, twice the same equality, and a linear cost."""
    found = optimise(
        lambda x: -x.sum(),
        [[0.1, 0.2], [0.9, 0.0]],
        lower=0,
        upper=1,
        equality=lambda x: jnp.array([x[0] - x[1], 2 * (x[0] - x[1])]),
        inequality=lambda x: jnp.array([x[0] + x[1] - 1, x[0] - 0.5, x[1] - 0.5]),
    )
    assert found.converged.all()
    np.testing.assert_allclose(found.value, 0.5, atol=1e-7)


def test_single_precision():
    with pytest.warns(UserWarning, match="jax_enable_x64"):
        optimise(product_cost, STARTS[:1].astype(np.float32), **HS71, max_steps=1)
    found = optimise(product_cost, STARTS.astype(np.float32), **HS71, tolerance=1e-4, slope_tolerance=1e-3)
    assert found.value.dtype == np.float32
    assert found.converged.any()
    np.testing.assert_allclose(found.cost[found.best], 17.0140172, rtol=1e-4)


def test_nothing_is_compiled_or_traced_twice():
    """The functions are not called again for other starts, fewer, or other data of the same types."""
    calls = []

    def counted(x, data):
        calls.append(1)
        return ((x - data) ** 2).sum()

    centres = np.linspace(0.2, 0.8, 27).reshape(9, 3)
    optimise(counted, centres, lower=0, upper=1, data=centres + 0.1)
    assert calls
    before = len(calls)
    for count in (9, 8):
        found = optimise(counted, centres[:count], lower=-1, upper=1, data=centres[:count])
        assert found.converged.all()
    assert len(calls) == before


def test_descent_in_a_box_with_a_kink():
    """Least of |x - 1/3| + (y - 2)^2 in the unit box; a start where the cost is not finite is reported."""
    kinked = lambda x, a: jnp.abs(x[0] - 1 / 3) + (x[1] - 2) ** 2 + jnp.log(a)
    found = descend(kinked, [[0.9, 0.1], [0.1, 0.1]], lower=0, upper=1, data=np.array([1.0, -1.0]))
    np.testing.assert_allclose(found.value[0], [1 / 3, 1], atol=1e-3)
    np.testing.assert_allclose(found.cost[0], 1, atol=1e-3)
    assert found.best == 0
    assert np.isinf(found.cost[1])
    with pytest.raises(ValueError, match=r"starts\[0, 0\] is 2"):
        descend(jnp.sum, [2.0], lower=0, upper=1)
    with pytest.raises(ValueError, match="`rate` is -1"):
        descend(jnp.sum, [0.5], lower=0, upper=1, rate=-1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lower": 6.0}, r"lower\[0\] is 6 and upper\[0\] is 5"),
        ({"lower": [1, 1, np.nan, 1]}, r"lower\[2\] is nan"),
        ({"starts": STARTS * [1, 1, 9, 1]}, r"starts\[0, 2\] is .*from 1 to 5"),
        ({"starts": np.ones((2, 2, 2))}, r"`starts` has shape \(2, 2, 2\)"),
        ({"starts": np.zeros((0, 4))}, r"`starts` has shape \(0, 4\)"),
        ({"starts": "abc"}, "`starts`"),
        ({"upper": [5, 5]}, r"`upper` has shape \(2,\)"),
        ({"scale": 0.0}, r"scale\[0\] is 0"),
        ({"cost": lambda x: x}, r"`cost` returns an array of shape \(4,\)"),
        ({"equality": lambda x: x[0]}, r"`equality` returns an array of shape \(\)"),
        ({"tolerance": 0.0}, "`tolerance` is 0.0"),
        ({"max_steps": 0}, "`max_steps` is 0"),
        ({"cost": lambda x: x[0] > 1}, "`cost` returns bool"),
        ({"cost": lambda x: jnp.int32(3)}, "`cost` returns int32"),
        ({"inequality": lambda x: x > 1}, "`inequality` returns bool"),
        ({"lower": np.ones((3, 4))}, r"`lower` has shape \(3, 4\)"),
        ({"max_steps": True}, "`max_steps` is True"),
        ({"data": np.zeros(3), "cost": lambda x, d: x[0]}, r"`data` has an array of shape \(3,\)"),
    ],
)
def test_bad_input_is_named(change, message):
    arguments = dict(cost=product_cost, starts=STARTS) | HS71 | change
    with pytest.raises(ValueError, match=message):
        optimise(arguments.pop("cost"), arguments.pop("starts"), **arguments)

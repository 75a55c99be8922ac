"""How far one loop turns a robot: against areas, against what is asked of a path, and refusals."""

import jax
import numpy as np
import pytest

import reojax
from reojax import farthest_turn, robots, so3

RODS = robots.planar(3)
LOW, HIGH = 0.3, 1.1
"""A box of both angles in which the curvature has one sign."""


def _curvature() -> tuple[np.ndarray, np.ndarray]:
    """The curvature at the nodes of Gauss and Legendre in the box, and their weights."""
    nodes, weights = np.polynomial.legendre.leggauss(16)
    half = (HIGH - LOW) / 2
    x, y = np.meshgrid(LOW + half * (1 + nodes), LOW + half * (1 + nodes))
    form = jax.jit(jax.vmap(lambda theta: reojax.curvature(RODS, theta)[2, 0, 1]))
    return np.asarray(form(np.stack([x.ravel(), y.ravel()], axis=1))), half**2 * np.outer(weights, weights).ravel()


def test_two_joints_go_round_their_whole_box():
    """Nothing turns farther than the boundary of a box in which the curvature has one sign: its integral, by Stokes."""
    values, weights = _curvature()
    assert (np.sign(values) == np.sign(values[0])).all()
    area = abs(float(values @ weights))
    ways = [
        farthest_turn(RODS, [0, 0, side], start=[LOW, LOW], lower=LOW, upper=HIGH, corners=4, starts=4, max_steps=60)
        for side in (1.0, -2.0)
    ]
    for found, side in zip(ways, (1, -1), strict=True):
        assert found.converged
        turn = side * so3.log(found.rotation)[2]
        assert turn == pytest.approx(area, rel=2e-3)
        assert turn <= area * (1 + 1e-6)
        assert found.error < 1e-9
        assert (found.waypoints >= LOW - 1e-12).all()
        assert (found.waypoints <= HIGH + 1e-12).all()
        np.testing.assert_allclose(
            reojax.net_rotation(RODS, reojax.polygon(found.waypoints), steps=24), found.rotation, atol=1e-9
        )


@pytest.mark.slow
def test_a_clearance_is_kept_and_costs_turn():
    """Rods folded onto each other: with a clearance the loop turns less, and keeps it, as proven from outside."""
    options = {"corners": 4, "starts": 4, "max_steps": 60, "lower": -3.0, "upper": 3.0}
    free = farthest_turn(RODS, [0, 0, 1], **options)
    clear = farthest_turn(RODS, [0, 0, 1], clearance=0.05, **options)
    assert free.converged
    assert clear.converged
    assert free.clearance is None
    apart = float(reojax.path_clearance(RODS, reojax.polygon(clear.waypoints)).distance)
    assert clear.clearance == pytest.approx(apart, abs=2e-4)
    assert apart >= 0.05
    assert float(reojax.path_clearance(RODS, reojax.polygon(free.waypoints)).distance) < 0.05
    assert 0.1 < so3.angle(clear.rotation) < so3.angle(free.rotation)


def test_what_cannot_be_is_said():
    """Rods in a plane turn about no other axis; a single joint turns nothing; a path that stays put is handed on."""
    found = farthest_turn(RODS, [1, 0, 0], corners=4)
    assert not found.converged
    assert "unreachable" in found.status
    np.testing.assert_array_equal(found.waypoints, np.zeros((6, 2)))
    alone = farthest_turn(RODS, [0, 0, 1], joints=[0], corners=4)
    assert "no loop" in alone.status


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"axis": [0, 0, 0]}, "`axis`"),
        ({"axis": [0, 1]}, "`axis`"),
        ({"axis": [0, 0, np.nan]}, "axis"),
        ({"joints": ["elbow"]}, "elbow"),
        ({"start": [0, 9.0], "upper": 1.0}, "start"),
        ({"clearance": -1.0}, "`clearance`"),
        ({"clearance": 5.0}, "`clearance`"),
        ({"corners": 1}, "`corners`"),
        ({"starts": 0}, "`starts`"),
        ({"tolerance": 0.0}, "`tolerance`"),
    ],
)
def test_bad_input_is_named(options, said):
    with pytest.raises(ValueError, match=said):
        farthest_turn(RODS, **({"axis": [0, 0, 1]} | options))

"""Free closed paths: on the target, inside the box; and refusals."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots
from reojax.plan import free_paths

LIMITS = {"twist_limit": float(np.deg2rad(270)), "bend_limit": float(np.deg2rad(120))}
ROBOT = robots.prototype()


def test_a_random_target_is_reached_inside_the_box():
    targets = Rotation.random(3, random_state=0).as_matrix()[:1]
    found = free_paths(ROBOT, targets, **LIMITS, starts=6, max_steps=60)
    assert found.converged.all()
    turn = jax.jit(jax.vmap(lambda corners: reojax.net_rotation(ROBOT, reojax.polygon(corners), steps=24)))
    turned = np.asarray(turn(jnp.asarray(found.waypoints)))
    assert (Rotation.from_matrix(turned).inv() * Rotation.from_matrix(targets)).magnitude().max() < 1e-8
    assert (np.abs(found.waypoints) <= [LIMITS["twist_limit"], LIMITS["bend_limit"], LIMITS["twist_limit"]]).all()
    np.testing.assert_array_equal(found.waypoints[:, [0, -1]], 0)
    np.testing.assert_allclose(found.travel, np.abs(np.diff(found.waypoints, axis=1)).sum((1, 2)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"targets": np.eye(3)}, r"`targets` has shape \(3, 3\); it must be \(m, 3, 3\)"),
        ({"targets": 1.1 * np.eye(3)[None]}, r"targets\[0\] is no rotation"),
        ({"twist_limit": 0.0}, "`twist_limit` is 0.0; it must be one positive number"),
        ({"bend_limit": np.nan}, "`bend_limit` is nan; it must be one positive number"),
        ({"corners": 1}, "`corners` is 1"),
        ({"starts": 0}, "`starts` is 0; it must be a positive integer"),
        ({"max_steps": 0}, "`max_steps` is 0; it must be a positive integer"),
    ],
)
def test_bad_input_is_named(change, message):
    with pytest.raises(ValueError, match=message):
        free_paths(ROBOT, **({"targets": np.eye(3)[None], **LIMITS} | change))

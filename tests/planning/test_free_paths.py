"""Free closed paths: on the target, inside the box, shorter than a manoeuvre that does the same; and refusals."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import reojax
from reojax import FreePaths, free_path, free_paths, robots
from reojax.cli import main

LIMITS = {"twist_limit": float(np.deg2rad(270)), "bend_limit": float(np.deg2rad(120))}
FEW = {"corners": 5, "starts": 2, "max_steps": 60}
"""Eight polygons at once in every call below, so that one program serves them all."""
ROBOT = robots.prototype()
A = float(np.deg2rad(150)), float(np.deg2rad(80))
TARGETS = np.stack(
    [
        np.asarray(reojax.net_rotation(ROBOT, reojax.manoeuvre_a(*A))),
        Rotation.from_rotvec([0, 1e-4, 0]).as_matrix(),
        Rotation.from_rotvec([0, 0, np.pi]).as_matrix(),
        np.eye(3),
    ]
)


def replayed(found: FreePaths) -> np.ndarray:
    """Net rotations of the paths by finer steps than the planner's."""
    turn = jax.jit(jax.vmap(lambda corners: reojax.net_rotation(ROBOT, reojax.polygon(corners), steps=24)))
    return np.asarray(turn(jnp.asarray(found.waypoints)))


def apart(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Angles between rotations [rad]."""
    return (Rotation.from_matrix(p).inv() * Rotation.from_matrix(q)).magnitude()


@pytest.fixture(scope="module")
def found() -> FreePaths:
    return free_paths(ROBOT, TARGETS, **LIMITS, **FEW)


def test_targets_are_reached_inside_the_box(found):
    assert found.converged.all()
    assert (found.error <= 1e-9).all()
    turned = replayed(found)
    assert apart(turned, TARGETS).max() < 1.5e-9
    assert apart(turned, found.rotation).max() < 1e-9
    assert (np.abs(found.waypoints) <= [LIMITS["twist_limit"], LIMITS["bend_limit"], LIMITS["twist_limit"]]).all()
    np.testing.assert_array_equal(found.waypoints[:, [0, -1]], 0)
    np.testing.assert_allclose(found.travel, np.abs(np.diff(found.waypoints, axis=1)).sum((1, 2)))


def test_travel_is_little(found):
    """A manoeuvre's own turn takes a third less than the manoeuvre, a small turn a small loop, the identity nothing."""
    assert found.travel[0] < 0.67 * (4 * A[0] + 2 * A[1])
    assert found.travel[1] < 0.3
    np.testing.assert_array_equal(found.waypoints[3], 0)
    assert found.travel[3] == 0


def test_the_command_line(capsys, monkeypatch, tmp_path):
    """A small turn, which takes a small loop: corners in the table, path in the file, a picture."""
    monkeypatch.setenv("REOJAX_CACHE", "0")
    picture, table = tmp_path / "a.svg", tmp_path / "a.csv"
    options = ["--corners", "5", "--out", str(picture), "--csv", str(table)]
    assert main(["plan", "--vocabulary", "free", "--target", "rotvec 0 0 2", *options]) == 0
    out = capsys.readouterr().out
    assert out.startswith("Closed path for rotvec 0 0 2 on prototype\n")
    assert "reached, to" in out
    assert picture.read_text().lstrip().startswith("<?xml")
    corners = np.loadtxt(table, delimiter=",", skiprows=1)
    assert len(corners) == 7
    np.testing.assert_array_equal(corners[[0, -1]], 0)
    turned = reojax.net_rotation(ROBOT, reojax.polygon(np.deg2rad(corners)))
    np.testing.assert_allclose(turned, Rotation.from_rotvec([0, 0, np.deg2rad(2)]).as_matrix(), atol=1e-8)


def test_what_cannot_be_reached_ends_closest_and_says_so():
    """Within 5 degrees no polygon of a few corners makes a half turn, but it can turn towards it."""
    narrow = np.deg2rad(5)
    one = free_path(ROBOT, TARGETS[2], twist_limit=narrow, bend_limit=narrow, corners=5, starts=8, max_steps=20)
    assert not one.converged
    assert np.pi - 0.1 < one.error < np.pi
    assert one.waypoints.shape == (7, 3)
    assert np.abs(one.waypoints).max() <= narrow
    np.testing.assert_allclose(one.error, apart(replayed(FreePaths(*(f[None] for f in one)))[0], TARGETS[2]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"targets": np.zeros((0, 3, 3))}, "at least one rotation"),
        ({"targets": np.eye(3)}, r"`targets` has shape \(3, 3\); it must be \(m, 3, 3\)"),
        ({"targets": 1.1 * np.eye(3)[None]}, r"targets\[0\] is no rotation"),
        ({"targets": np.full((1, 3, 3), np.nan)}, r"targets\[0\] has an entry nan"),
        ({"twist_limit": 0.0}, "`twist_limit` is 0.0; it must be one positive number"),
        ({"bend_limit": np.nan}, "`bend_limit` is nan; it must be one positive number"),
        ({"corners": 1}, "`corners` is 1; it must be an integer of at least 2"),
        ({"starts": 0}, "`starts` is 0; it must be a positive integer"),
        ({"max_steps": 2.5}, "`max_steps` is 2.5; it must be a positive integer"),
        ({"tolerance": 0.0}, "`tolerance` is 0.0; it must be one positive number"),
        ({"seed": -1}, "`seed` is -1; it must be an integer of at least 0"),
    ],
)
def test_bad_input_is_named(change, message):
    with pytest.raises(ValueError, match=message):
        free_paths(ROBOT, **({"targets": np.eye(3)[None], **LIMITS} | change))

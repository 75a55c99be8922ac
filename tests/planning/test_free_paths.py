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


@pytest.mark.slow
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


@pytest.mark.slow
def test_the_command_line(capsys, monkeypatch, tmp_path):
    """A small turn, which takes a small loop: corners in the table, path in the file, a picture."""
    monkeypatch.setenv("REOJAX_CACHE", "0")
    picture, table = tmp_path / "a.svg", tmp_path / "a.csv"
    options = ["--corners", "5", "--out", str(picture), "--csv", str(table)]
    assert main(["plan", "--vocabulary", "free", "--target", "rotvec 0 0 2", *options]) == 0
    out = capsys.readouterr().out
    assert out.startswith("Path for rotvec 0 0 2 on prototype\n")
    assert "reached, to" in out
    assert picture.read_text().lstrip().startswith("<?xml")
    corners = np.loadtxt(table, delimiter=",", skiprows=1)
    assert len(corners) == 7
    np.testing.assert_array_equal(corners[[0, -1]], 0)
    turned = reojax.net_rotation(ROBOT, reojax.polygon(np.deg2rad(corners)))
    np.testing.assert_allclose(turned, Rotation.from_rotvec([0, 0, np.deg2rad(2)]).as_matrix(), atol=1e-8)


@pytest.mark.slow
def test_what_cannot_be_reached_ends_closest_and_says_so():
    """Within 5 degrees no polygon of a few corners makes a half turn, but it can turn towards it."""
    narrow = np.deg2rad(5)
    one = free_path(ROBOT, TARGETS[2], twist_limit=narrow, bend_limit=narrow, corners=5, starts=8, max_steps=20)
    assert not one.converged
    assert np.pi - 0.1 < one.error < np.pi
    assert one.waypoints.shape == (7, 3)
    assert np.abs(one.waypoints).max() <= narrow
    np.testing.assert_allclose(one.error, apart(replayed(one._replace(waypoints=one.waypoints[None]))[0], TARGETS[2]))


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


def chain(joints: int, axes: list | None = None, **fields: object) -> reojax.Robot:
    """A robot without a layout: a heavy base and a chain of links, joints turning about x, y, z in turn."""
    n = joints + 1
    return reojax.make_robot(
        mass=[3.0] + [1.0] * joints,
        com=[[0.0, 0.0, 0.0]] + [[0.1, 0.02, 0.0]] * joints,
        inertia=[np.diag([0.05, 0.06, 0.07])] + [np.diag([0.002, 0.006, 0.007])] * joints,
        axis=np.eye(3)[np.arange(joints) % 3] if axes is None else axes,
        anchor=[[0.2, 0.0, 0.0]] * joints,
        **{"lower": np.full(joints, -1.5), "upper": np.full(joints, 1.5)} | fields,
    ).replace(name=f"chain{n}")


QUICK = {"corners": 4, "starts": 2, "max_steps": 40}
"""One program for the chain of four joints; eight rows at once."""
CHAIN = chain(4)
TENTH = Rotation.from_rotvec([0.05, -0.07, 0.05]).as_matrix()


@pytest.mark.slow
def test_any_robot_from_any_posture_to_another():
    """No layout; every corner within limits; both ends where they should be."""
    start, end = np.array([0.5, -1.0, 0.2, 1.5]), np.array([0.4, -0.8, 0.1, 1.2])
    found = free_path(CHAIN, TENTH, start=start, end=end, **QUICK)
    assert found.converged
    assert found.status == "converged"
    assert found.clearance is None
    np.testing.assert_array_equal(found.waypoints[[0, -1]], [start, end])
    assert np.abs(found.waypoints).max() <= 1.5
    turn = reojax.net_rotation(CHAIN, reojax.polygon(found.waypoints), steps=16)
    assert apart(np.asarray(turn), TENTH) < 1.5e-9


@pytest.mark.slow
def test_joints_by_name_and_narrower_limits():
    """The others stay where they are, and the limits given hold beside the robot's own."""
    start = np.array([0.1, 0.2, 0.3, -1.4])
    found = free_path(
        CHAIN, TENTH, start=start, joints=[CHAIN.joint_names[2], 0, 1], lower=-0.9, upper=[9, 9, 0.8, 9], **QUICK
    )
    assert found.converged
    np.testing.assert_array_equal(found.waypoints[:, 3], -1.4)
    assert found.waypoints[:, :3].min() >= -0.9
    assert found.waypoints[:, 2].max() <= 0.8


@pytest.mark.slow
def test_coupled_joints_follow_exactly():
    """In the path, its travel and its limits: the driver may go to 0.5 rad only, where its follower is at 1.5."""
    robot = chain(5, couplings={"joint4": ("joint1", -2.0, 0.5)})
    found = free_path(robot, TENTH, **QUICK)
    assert found.converged
    np.testing.assert_array_equal(found.waypoints[:, 4], -2 * found.waypoints[:, 1] + 0.5)
    assert np.abs(found.waypoints).max() <= 1.5 + 1e-12
    np.testing.assert_allclose(found.travel, np.abs(np.diff(found.waypoints, axis=0)).sum())


@pytest.mark.slow
def test_one_loop_many_times():
    """Within 12 degrees one loop does not do it; the least number does, exactly, and one less does not."""
    narrow = {"lower": -0.2, "upper": 0.2}
    target = Rotation.from_rotvec([0.0, 0.25, 0.25]).as_matrix()
    once = free_path(CHAIN, target, **narrow, **QUICK)
    assert once.status.startswith("not found")
    least = free_path(CHAIN, target, repeats="least", **narrow, **QUICK)
    assert least.converged
    assert least.repeats > 1
    turn = np.asarray(reojax.net_rotation(CHAIN, reojax.polygon(least.waypoints), steps=16))
    assert apart(np.linalg.matrix_power(turn, least.repeats), target) < 1.5e-9
    one_run = np.abs(np.diff(least.waypoints, axis=0)).sum()
    np.testing.assert_allclose(least.travel, least.repeats * one_run)
    fewer = free_path(CHAIN, target, repeats=max(1, int(0.7 * least.repeats)), **narrow, **QUICK)
    assert not fewer.converged
    twice = free_path(CHAIN, target, repeats=2 * int(least.repeats), **narrow, **QUICK)
    assert twice.converged


@pytest.mark.slow
def test_what_is_unreachable_in_principle_is_told():
    out_of_plane = Rotation.from_rotvec([0.5, 0, 0.3]).as_matrix()
    planar = chain(3, [[0, 0, 1]] * 3)
    found = free_path(planar, out_of_plane, **QUICK)
    assert "about the axis (0, 0, " in found.status
    q = Rotation.from_matrix(out_of_plane).as_quat()
    left = 2 * np.arctan2(np.hypot(q[0], q[1]), np.hypot(q[2], q[3]))
    assert f"{np.rad2deg(left):.6g} deg are left" in found.status
    np.testing.assert_allclose(found.error, left, atol=1e-9)
    alone = free_path(CHAIN, TENTH, joints=[1], **QUICK)
    assert alone.status.startswith("unreachable: no loop of the joints that move turns the base")
    assert not alone.converged
    assert not alone.travel
    nothing = free_path(CHAIN, TENTH, joints=[], **QUICK)
    assert nothing.status.startswith("unreachable")


def test_float64_whatever_jax_says():
    with jax.enable_x64(False):
        found = free_path(CHAIN, TENTH, start=[0.1, 0.2, 0.3, -1.4], **QUICK)
    assert found.converged
    assert found.waypoints.dtype == np.float64


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"robot": chain(4, lower=[0.2, -1, -1, -1])}, r"joint 'joint0' cannot be at zero: .* Pass `start=`"),
        ({"start": [0, 0, 0, 1.6]}, "`start` has joint 'joint3' at 1.6 rad; its limits are -1.5 to 1.5 rad"),
        ({"start": [0, 0, 0]}, r"`start` has shape \(3,\)"),
        ({"end": [0, np.nan, 0, 0]}, "must be a finite number"),
        ({"end": [0.1, 0, 0, 0], "joints": [1, 2]}, "joint 'joint0' goes from 0 to 0.1 rad"),
        ({"end": [0.1, 0, 0, 0], "repeats": 2}, "only a closed path can be run again"),
        ({"joints": ["elbow"]}, r"`joints\[0\]` is 'elbow'"),
        ({"repeats": 0}, "`repeats` is 0; it must be a positive integer"),
        ({"repeats": 10**7}, "at most 1000000"),
        ({"repeats": "most"}, "`repeats` is 'most'"),
        ({"lower": 1.0}, "Pass `start=`"),
        ({"lower": 2.0}, "joint 'joint0' is left nothing"),
        ({"twist_limit": 1.0}, "`bend_limit` is missing"),
        ({"twist_limit": 1.0, "bend_limit": 1.0}, "has no layout of its own"),
        ({"twist_limit": 1.0, "bend_limit": 1.0, "start": np.zeros(4)}, "give one or the other"),
        ({"robot": chain(4, couplings={"joint3": ("joint0", 1, 0)}), "joints": [3]}, "follows 'joint0'"),
    ],
)
def test_bad_input_of_any_robot_is_named(change, message):
    with pytest.raises(ValueError, match=message):
        free_path(**({"robot": CHAIN, "target": TENTH} | change))

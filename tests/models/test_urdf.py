"""URDF: each quirk of public files in a small one of its own, and what is refused in one line."""

import numpy as np
import pytest

from reojax import load_robot
from reojax._internal.inertias import nearest_possible

BLOCK = '<mass value="{m}"/><inertia ixx="{a}" ixy="0" ixz="0" iyy="{b}" iyz="0" izz="{c}"/>'


def link(name: str, mass: float = 1.0, moments=(0.1, 0.2, 0.25), origin: str = "", more: str = "") -> str:
    inertial = f"<inertial>{origin}{BLOCK.format(m=mass, a=moments[0], b=moments[1], c=moments[2])}</inertial>"
    return f'<link name="{name}">{inertial if mass or any(moments) else ""}{more}</link>'


def joint(
    name, parent, child, kind="revolute", xyz="0 0 0", rpy="0 0 0", axis="0 0 1", more='<limit lower="-1" upper="2"/>'
):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>{more}</joint>'
    )


def load(tmp_path, *elements: str, **options):
    (tmp_path / "robot.urdf").write_text(f'<robot name="toy">{"".join(elements)}</robot>')
    return load_robot(tmp_path / "robot.urdf", **options)


def refusal(tmp_path, *elements: str, **options) -> str:
    with pytest.raises(ValueError, match="cannot load") as caught:
        load(tmp_path, *elements, **options)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 700
    return str(caught.value)


PAIR = (link("a"), link("b"), joint("turn", "a", "b", xyz="1 2 3"))


# --- what becomes what -----------------------------------------------------------------------------------


def test_two_links_and_a_joint(tmp_path):
    robot = load(tmp_path, *PAIR)
    assert (robot.name, robot.link_names, robot.joint_names) == ("toy", ("a", "b"), ("turn",))
    np.testing.assert_array_equal(robot.anchor, [[1, 2, 3]])
    np.testing.assert_array_equal((robot.lower[0], robot.upper[0]), (-1, 2))
    np.testing.assert_array_equal(robot.inertia[1], np.diag([0.1, 0.2, 0.25]))


def test_frames_that_are_turned_become_parallel(tmp_path):
    """Roll, pitch and yaw of joint and inertial, by hand: a quarter turn about z takes x to y."""
    turned = '<origin xyz="0.5 0 0" rpy="1.5707963267948966 0 0"/>'  # inertial axes: y to z
    robot = load(
        tmp_path, link("a"), link("b", origin=turned), joint("t", "a", "b", rpy="0 0 1.5707963267948966", axis="1 0 0")
    )
    np.testing.assert_allclose(robot.axis, [[0, 1, 0]], atol=1e-15)
    np.testing.assert_allclose(robot.com[1], [0, 0.5, 0], atol=1e-15)
    np.testing.assert_allclose(robot.inertia[1], np.diag([0.25, 0.1, 0.2]), atol=1e-15)


def test_fixed_joints_are_merged_with_the_inertia_of_both(tmp_path):
    """Two unit masses half a metre either side of their centre; a frame without mass comes along."""
    robot = load(
        tmp_path,
        *PAIR,
        link("tool"),
        link("frame", 0, (0, 0, 0)),
        joint("weld", "b", "tool", "fixed", xyz="1 0 0"),
        joint("to_frame", "tool", "frame", "fixed", xyz="9 9 9"),
    )
    assert robot.link_names == ("a", "b")
    assert robot.mass[1] == 2.0
    np.testing.assert_allclose(robot.com[1], [0.5, 0, 0])
    np.testing.assert_allclose(robot.inertia[1], np.diag([0.2, 0.4 + 0.5, 0.5 + 0.5]))
    assert any("merged into link 'b': tool, frame" in note for note in robot.notes)


def test_prismatic_joints_are_held_at_rest_or_where_lock_says(tmp_path):
    slide = joint("slide", "b", "c", "prismatic", axis="1 0 0", more='<limit lower="0.5" upper="2"/>')
    robot = load(tmp_path, *PAIR, link("c"), slide)
    np.testing.assert_allclose(robot.com[1], [0.25, 0, 0])  # half of the lower limit: zero is out of reach
    robot = load(tmp_path, *PAIR, link("c"), slide, lock={"slide": 2.0})
    np.testing.assert_allclose(robot.com[1], [1.0, 0, 0])
    assert any("locked: joint 'slide' at 2" in note for note in robot.notes)
    assert "limits are 0.5 to 2" in refusal(tmp_path, *PAIR, link("c"), slide, lock={"slide": 3.0})


def test_a_locked_hinge_is_turned_and_merged(tmp_path):
    """A quarter turn about z at (1, 2, 3): what was along x is along y."""
    out = '<origin xyz="1 0 0"/>'
    robot = load(
        tmp_path,
        link("a"),
        link("b", origin=out),
        link("c"),
        joint("turn", "a", "b", xyz="1 2 3"),
        joint("next", "b", "c", xyz="2 0 0", axis="1 0 0"),
        lock={"turn": np.pi / 2},
    )
    assert robot.joint_names == ("next",)
    np.testing.assert_allclose(robot.anchor, [[1, 4, 3]], atol=1e-15)
    np.testing.assert_allclose(robot.axis, [[0, 1, 0]], atol=1e-15)
    np.testing.assert_allclose(robot.com[0], [0.5, 1.5, 1.5], atol=1e-15)


def test_continuous_joints_and_missing_limits_are_unlimited(tmp_path):
    """Missing, empty, inverted and absurd ones; the last three are told."""
    for more, told in (
        ("", True),
        ('<limit lower="0" upper="0"/>', True),
        ('<limit lower="2" upper="-1"/>', True),
        ('<limit lower="-1e16" upper="1e16"/>', True),
    ):
        robot = load(tmp_path, link("a"), link("b"), joint("t", "a", "b", more=more))
        assert np.isinf(robot.lower[0])
        assert np.isinf(robot.upper[0])
        assert any("unlimited" in note for note in robot.notes) == told
    assert np.isinf(load(tmp_path, link("a"), link("b"), joint("t", "a", "b", "continuous")).upper[0])


def test_zero_outside_of_the_limits_is_legal_and_told(tmp_path):
    robot = load(tmp_path, link("a"), link("b"), joint("t", "a", "b", more='<limit lower="-3" upper="-0.1"/>'))
    assert robot.upper[0] == -0.1
    assert "theta = 0 is outside of the limits of t" in robot.notes


@pytest.mark.parametrize("kind", ["fixed", "floating", "planar", "revolute"])
def test_a_world_at_the_root_is_dropped(tmp_path, kind):
    robot = load(tmp_path, link("world", 0, (0, 0, 0)), *PAIR, joint("to_world", "world", "a", kind))
    assert robot.joint_names == ("turn",)
    assert robot.link_names[0] in ("a", "world")  # a fixed one is merged
    assert robot.mass[0] == 1.0


def test_mimic_joints_become_couplings_chains_composed(tmp_path):
    """c = -2 b + 0.1, b = 0.5 a - 1: c = -a + 2.1."""
    names = "abcd"
    follow = {
        "c": '<mimic joint="b_joint" multiplier="-2" offset="0.1"/>',
        "b": '<mimic joint="a_joint" multiplier="0.5" offset="-1"/>',
    }
    robot = load(
        tmp_path,
        link("base"),
        *(link(n) for n in names),
        *(joint(f"{n}_joint", "base", n, xyz=f"{i} 0 0", more=follow.get(n, "")) for i, n in enumerate(names)),
    )
    assert robot.couplings == ((1, 0), (2, 0))
    np.testing.assert_allclose(robot.coupling_ratio, [0.5, -1.0])
    np.testing.assert_allclose(robot.coupling_offset, [-1.0, 2.1])
    held = load_robot(tmp_path / "robot.urdf", lock={"a_joint": 0.4})
    assert held.joint_names == ("d_joint",)
    assert any("joint 'c_joint' at 1.7" in note for note in held.notes)


def test_a_mimic_that_follows_itself_or_nothing(tmp_path):
    def tied(*drivers):
        rows = [joint(f"j{i}", "base", f"l{i}", more=f'<mimic joint="{d}"/>') for i, d in enumerate(drivers)]
        return [link("base"), *(link(f"l{i}") for i in range(len(drivers))), *rows]

    assert "mimics itself" in refusal(tmp_path, *tied("j0"))
    assert "mimics itself" in refusal(tmp_path, *tied("j1", "j0"))
    assert "'nobody', which is not there" in refusal(tmp_path, *tied("nobody"))
    assert load(tmp_path, *tied("nobody"), lock={"j0": 0.0}).joints == 0


def test_order_is_the_file_s_as_far_as_parents_come_first(tmp_path):
    robot = load(
        tmp_path,
        *(link(n) for n in "abcd"),
        joint("third", "c", "d", xyz="0 1 0"),
        joint("first", "a", "b", xyz="1 0 0"),
        joint("second", "a", "c", xyz="0 0 1"),
    )
    assert robot.joint_names == ("first", "second", "third")
    assert robot.parent == (0, 0, 2)


def test_another_base_turns_the_tree_round(tmp_path):
    """Same momentum seen from the hand: A about the centre of mass keeps its moments, rates count the same."""
    import reojax

    elements = (
        link("a", origin='<origin xyz="0 0 0.2" rpy="0.3 0.2 0.1"/>'),
        link("b", 2.0, origin='<origin xyz="0.1 0 0"/>'),
        link("c", 0.7),
        joint("first", "a", "b", xyz="0.5 0 0.1", rpy="0.4 -0.2 0.9", axis="0 1 0"),
        joint("second", "b", "c", xyz="0 0.5 0", rpy="0.1 0.2 0.3", axis="0.6 0 0.8"),
    )
    theta = np.array([0.7, -0.4])
    from_a, from_c = load(tmp_path, *elements), load(tmp_path, *elements, base="c")
    assert from_c.link_names == ("c", "b", "a")
    assert from_c.joint_names == ("second", "first")
    first, second = reojax.momentum_matrices(from_a, theta), reojax.momentum_matrices(from_c, theta[::-1])
    np.testing.assert_allclose(np.linalg.eigvalsh(first.A), np.linalg.eigvalsh(second.A), rtol=1e-12)
    # A closed loop turns both bases by conjugate rotations: equal angles.
    corners = np.array([[0, 0], [1, 0], [1, 1.2], [0, 1.2], [0, 0.0]])
    turned = [
        reojax.so3.angle(reojax.net_rotation(r, reojax.polygon(c)))
        for r, c in ((from_a, corners), (from_c, corners[:, ::-1]))
    ]
    assert float(turned[0]) == pytest.approx(float(turned[1]), rel=1e-9)
    assert float(turned[0]) > 1e-3


def test_rotors_keep_their_meaning_when_the_tree_is_turned_round(tmp_path):
    """The stator stays on its own link, so that the turn of a loop is the same."""
    import reojax

    elements = (
        link("a"),
        link("b", 2.0),
        link("c", 0.7),
        joint("first", "a", "b", xyz="0.5 0 0.1", axis="0 1 0"),
        joint("second", "b", "c", xyz="0 0.5 0", axis="1 0 0"),
    )
    options = {"gear_ratio": {"first": 20.0, "second": -7.0}, "rotor_inertia": {"first": 1e-3, "second": 1e-3}}
    robots = load(tmp_path, *elements, **options), load(tmp_path, *elements, base="c", **options)
    assert robots[0].rotor_on == ("parent", "parent")
    assert robots[1].rotor_on == ("child", "child")
    corners = np.array([[0, 0], [1, 0], [1, 1.2], [0, 1.2], [0, 0.0]])
    turned = [
        float(reojax.so3.angle(reojax.net_rotation(r, reojax.polygon(c))))
        for r, c in zip(robots, (corners, corners[:, ::-1]), strict=True)
    ]
    assert turned[0] == pytest.approx(turned[1], rel=1e-9)


def test_reductions_come_from_transmissions_and_arguments(tmp_path):
    actuator = '<actuator name="m"><mechanicalReduction>{}</mechanicalReduction></actuator>'
    transmission = f'<transmission name="t"><joint name="turn"/>{actuator}</transmission>'
    assert load(tmp_path, *PAIR, transmission.format(50)).gear_ratio[0] == 50
    robot = load(tmp_path, *PAIR, transmission.format(50), gear_ratio={"turn": 9.0}, rotor_inertia={"turn": 1e-5})
    assert (robot.gear_ratio[0], robot.rotor_inertia[0]) == (9.0, 1e-5)
    assert any("taken as 1" in note for note in load(tmp_path, *PAIR, transmission.format("much")).notes)


def test_a_joint_that_moves_no_mass_is_held(tmp_path):
    robot = load(tmp_path, *PAIR, link("pad", 0, (0, 0, 0)), joint("grip", "b", "pad"))
    assert robot.joint_names == ("turn",)
    assert any("'grip', which carries no mass" in note for note in robot.notes)


def test_a_massless_link_between_is_legal(tmp_path):
    robot = load(
        tmp_path,
        link("a"),
        link("cross", 0, (0, 0, 0)),
        link("b"),
        joint("x", "a", "cross", axis="1 0 0"),
        joint("y", "cross", "b", axis="0 1 0"),
    )
    assert robot.joint_names == ("x", "y")


def test_a_spherical_joint_becomes_three_hinges(tmp_path):
    robot = load(tmp_path, *PAIR, link("c"), joint("neck", "b", "c", "spherical", xyz="0 0 1"))
    assert robot.joint_names == ("turn", "neck_x", "neck_y", "neck_z")
    np.testing.assert_array_equal(robot.axis[1:], np.eye(3))
    assert load(tmp_path, *PAIR, link("c"), joint("neck", "b", "c", "spherical"), lock={"neck": 0}).joints == 1


# --- inertias that no body has ---------------------------------------------------------------------------

HEAVY = (link("a"), link("b", moments=(0.1, 0.1, 0.5)), joint("turn", "a", "b"))


def test_the_triangle_rule_is_named_and_mended_by_the_least_change(tmp_path):
    message = refusal(tmp_path, *HEAVY)
    assert "'b': 0.1, 0.1, 0.5" in message
    assert "repair=True" in message
    robot = load(tmp_path, *HEAVY, repair=True)
    np.testing.assert_allclose(robot.inertia[1], np.diag([0.2, 0.2, 0.4]), atol=1e-15)  # v/3 = 0.1 each
    assert any(
        "repaired: inertia of link 'b'" in note and "0.1, 0.1, 0.5 to 0.2, 0.2, 0.4" in note for note in robot.notes
    )


def test_what_is_possible_only_when_merged_is_accepted(tmp_path):
    """Checked after merging, not before."""
    robot = load(tmp_path, *HEAVY, link("c", moments=(0.5, 0.5, 0.1)), joint("weld", "b", "c", "fixed"))
    np.testing.assert_allclose(np.diag(robot.inertia[1]), [0.6, 0.6, 0.6])


def test_the_nearest_inertia_is_the_nearest(tmp_path):
    """Against a search over possible ones, whose second moments are squares."""
    from scipy.optimize import minimize

    rng = np.random.default_rng(1)
    for _ in range(6):
        wild = rng.normal(size=(3, 3))
        wild = wild + wild.T
        best = nearest_possible(wild)

        def change(entries, wild=wild):
            root = entries.reshape(3, 3)
            spread = root @ root.T
            return ((np.trace(spread) * np.eye(3) - spread - wild) ** 2).sum()

        found = min(minimize(change, rng.normal(size=9)).fun for _ in range(3))
        assert ((best - wild) ** 2).sum() == pytest.approx(found, rel=1e-4, abs=1e-8)


# --- what is refused ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("elements", "words"),
    [
        ((), "no links"),
        ((link("a"), link("a")), "two links are named 'a'"),
        ((*PAIR, joint("turn", "a", "b")), "two joints are named 'turn'"),
        ((link("a"), link("b")), "2 links that hang from none"),
        ((link("a"), link("b"), joint("t", "a", "b"), joint("u", "b", "a")), "loop"),
        ((link("r"), link("a"), link("b"), joint("t", "a", "b"), joint("u", "b", "a")), "loop"),
        ((*PAIR, joint("twice", "a", "b")), "'b' hangs from two joints, 'turn' and 'twice'"),
        ((link("a"), joint("t", "a", "ghost")), "child 'ghost'"),
        ((link("a"), link("b"), joint("t", "a", "b", "rubber")), "type 'rubber'"),
        (
            (link("a"), link("b"), link("c"), joint("t", "a", "b"), joint("f", "b", "c", "floating")),
            "'f' is floating.*lock=",
        ),
        ((link("a", float("nan")),), "mass is 'nan'"),
        ((link("a", -1.0),), "mass is -1.0"),
        ((link("a"), link("b"), joint("t", "a", "b", xyz="0 0")), "xyz is '0 0'; it must be 3 numbers"),
        ((link("a"), link("b"), joint("t", "a", "b", axis="0 0 0")), "axis"),
        ((link("a"), link("b"), joint("t", "a", "b", xyz="0 0 inf")), "finite"),
        ((link("a", moments=("x", 0, 0)),), "ixx is 'x'"),
        ((link("a", 0, (0, 0, 0)), link("b", 0, (0, 0, 0)), joint("t", "a", "b")), "mass"),
        (('<xacro:macro xmlns:xacro="http://ros.org/wiki/xacro"/>',), "xacro"),
    ],
)
def test_what_cannot_be_read_is_named(tmp_path, elements, words):
    import re

    assert re.search(words, refusal(tmp_path, *elements))


@pytest.mark.parametrize("entry", ["lock", "gear_ratio", "rotor_inertia"])
def test_unknown_joints_of_arguments(tmp_path, entry):
    assert f"`{entry}` names 'nobody'; the joints are 'turn'" in refusal(tmp_path, *PAIR, **{entry: {"nobody": 1.0}})
    assert "finite number" in refusal(tmp_path, *PAIR, **{entry: {"turn": float("nan")}})
    with pytest.raises(ValueError, match=f"`{entry}` is 3"):
        load(tmp_path, *PAIR, **{entry: 3})


def test_an_unknown_base(tmp_path):
    assert "`base` is 'c'; the links are 'a, b'" in refusal(tmp_path, *PAIR, base="c")


BOMB = '<!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]><robot name="&b;"><link name="x"/></robot>'
OUTSIDE = '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/hostname">]><robot name="&x;"><link name="x"/></robot>'


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
@pytest.mark.parametrize("text", [BOMB, OUTSIDE])
def test_no_entities_and_no_files_through_xml(tmp_path, text, encoding):
    (tmp_path / "robot.urdf").write_bytes(text.encode(encoding))
    with pytest.raises(ValueError, match="DTD"):
        load_robot(tmp_path / "robot.urdf")


@pytest.mark.parametrize(
    "data",
    [b"", b"no xml", b"<robot>", b"\x00\xff\x00", b"<sdf/>", b"<html/>", b'<?xml version="1.0" encoding="x"?><robot/>'],
)
def test_what_is_no_robot_file(tmp_path, data):
    (tmp_path / "robot.urdf").write_bytes(data)
    with pytest.raises(ValueError, match="cannot load") as caught:
        load_robot(tmp_path / "robot.urdf")
    assert "\n" not in str(caught.value)

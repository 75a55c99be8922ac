"""MJCF: each quirk of public files in a small one of its own, momentum against MuJoCo's, and what is refused."""

import dataclasses

import numpy as np
import pytest

from reojax import load_robot, momentum_matrices

mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.oracle

BOX = '<geom type="box" size="0.1 0.2 0.3" pos="0.05 0 0.1" density="{}"/>'


def load(tmp_path, body: str, rest: str = "", compiler: str = 'angle="radian"', **options):
    text = f'<mujoco model="toy"><compiler {compiler}/>{rest}<worldbody>{body}</worldbody></mujoco>'
    (tmp_path / "robot.xml").write_text(text)
    return load_robot(tmp_path / "robot.xml", **options)


def refusal(tmp_path, *parts: str, **options) -> str:
    with pytest.raises(ValueError, match="cannot load") as caught:
        load(tmp_path, *parts, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def compare(path, robot, positions: dict[str, float]) -> None:
    """A and B are MuJoCo's at the joint positions given, the base's own joints left at rest."""
    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.fusestatic = False
    model = spec.compile()
    data = mujoco.MjData(model)
    for name, value in positions.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    base = model.body(robot.link_names[0]).id
    matrix = np.zeros((3, model.nv))
    mujoco.mj_angmomMat(model, data, matrix, base)
    frame = data.xmat[base].reshape(3, 3)
    columns = [int(model.joint(name).dofadr[0]) for name in robot.joint_names]
    A, B = momentum_matrices(
        robot.replace(rotor_inertia=np.zeros(robot.joints)), [positions[n] for n in robot.joint_names]
    )
    np.testing.assert_allclose(B, -(frame.T @ matrix)[:, columns], atol=1e-12 * np.abs(A).max())
    tree = [i for i in range(1, model.nbody) if model.body_rootid[i] == model.body_rootid[base]]
    mass = model.body_mass[tree]
    centre = mass @ data.xipos[tree] / mass.sum()
    locked = np.zeros((3, 3))
    for i in tree:
        turn, arm = data.ximat[i].reshape(3, 3), data.xipos[i] - centre
        locked += turn @ np.diag(model.body_inertia[i]) @ turn.T
        locked += model.body_mass[i] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    np.testing.assert_allclose(A, frame.T @ locked @ frame, atol=1e-12 * np.abs(locked).max())


ARM = f"""
<body name="base" pos="0 0 1" euler="0.1 0.2 0.3"><freejoint/>{BOX.format(900)}
  <body name="upper" pos="0.3 0 0.1" euler="0.5 -0.2 0.1">
    <joint name="pan" axis="0 0 1" pos="0 0.05 0" range="-1 2"/>
    <joint name="tilt" axis="0 2 0" pos="0.02 0 0"/>
    {BOX.format(500)}
    <body name="fixed" pos="0 0.4 0" euler="0 0 1">{BOX.format(100)}
      <body name="lower" pos="0 0.3 0">
        <joint name="elbow" axis="1 1 0" ref="0.4" pos="0 0.1 0" armature="0.02"/>{BOX.format(300)}
      </body>
    </body>
  </body>
</body>"""


def test_momentum_is_mujoco_s(tmp_path):
    """A free joint, several joints in a body off its origin, a fixed body, `ref`, inertias from geoms."""
    robot = load(tmp_path, ARM)
    assert robot.joint_names == ("pan", "tilt", "elbow")
    assert robot.link_names == ("base", "upper_pan", "upper", "lower")
    np.testing.assert_allclose([robot.lower[0], robot.upper[0]], [-1, 2])
    assert np.isinf(robot.upper[1])
    compare(tmp_path / "robot.xml", robot, {"pan": 0.7, "tilt": -0.5, "elbow": 0.9})
    notes = " | ".join(robot.notes)
    assert "merged into link 'upper': fixed" in notes
    assert "joints between the world and 'base'" in notes
    assert "armature left out" in notes


def test_locked_joints_and_slides(tmp_path):
    """A slide rests at its `ref`, a locked hinge stands where it is told, in the file's coordinate."""
    rail = '<joint name="slide" type="slide" axis="0 0 1" ref="0.3"/>'
    slide = f'<body name="cart" pos="0.2 0 0">{rail}{BOX.format(200)}</body>'
    head, tail = ARM.rsplit("</body>\n  </body>\n</body>", 1)
    body = f"{head}{slide}</body></body></body>{tail}"
    robot = load(tmp_path, body, lock={"elbow": 0.9})
    assert robot.joint_names == ("pan", "tilt")
    compare(tmp_path / "robot.xml", robot, {"pan": 0.7, "tilt": -0.5, "elbow": 0.9})
    robot = load(tmp_path, body, lock={"slide": -0.2})
    compare(tmp_path / "robot.xml", robot, {"pan": 0.7, "tilt": -0.5, "elbow": 0.9, "slide": -0.2})


def test_defaults_includes_and_degrees(tmp_path):
    (tmp_path / "arm.xml").write_text(
        '<mujocoinclude><body name="arm" pos="1 0 0"><joint class="big" name="turn"/>'
        f"{BOX.format(500)}</body></mujocoinclude>"
    )
    rest = '<default><default class="big"><joint axis="0 1 0" range="-90 45"/></default></default>'
    robot = load(
        tmp_path,
        f'<body name="base"><freejoint/>{BOX.format(900)}<include file="arm.xml"/></body>',
        rest,
        'angle="degree"',
    )
    np.testing.assert_allclose([robot.lower[0], robot.upper[0]], np.deg2rad([-90, 45]))
    np.testing.assert_array_equal(robot.axis, [[0, 1, 0]])


def test_a_ball_joint_becomes_three_hinges(tmp_path):
    joint = '<joint name="b" type="ball" range="0 1"/>'
    body = f'<body name="base">{BOX.format(900)}<body name="ball">{joint}{BOX.format(100)}</body></body>'
    robot = load(tmp_path, body)
    assert robot.joint_names == ("b_x", "b_y", "b_z")
    np.testing.assert_array_equal(robot.upper, [1, 1, 1])
    assert any("three hinges" in note for note in robot.notes)


def test_joints_to_the_world_are_dropped_and_the_tree_is_chosen(tmp_path):
    """Slides and a hinge of a planar hopper; a loose ball beside it is told; `base` takes the other tree."""
    root = '<joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide"/><joint name="y" axis="0 1 0"/>'
    leg = f'<body name="leg" pos="0 0 -1"><joint name="hip" axis="0 1 0"/>{BOX.format(300)}</body>'
    hopper = f'<body name="torso">{root}{BOX.format(900)}{leg}</body>'
    ball = f'<body name="ball"><freejoint/>{BOX.format(9000)}</body>'
    robot = load(tmp_path, ball + hopper)
    assert (robot.link_names, robot.joint_names) == (("torso", "leg"), ("hip",))
    notes = " | ".join(robot.notes)
    assert "dropped: bodies of the world beside 'torso': ball" in notes
    assert "joints between the world and 'torso': x, z, y" in notes
    assert load(tmp_path, ball + hopper, base="ball").link_names == ("ball",)


MOTOR = '<actuator><motor joint="turn" gear="{}"/></actuator>'
WHEEL = f"""<body name="base"><freejoint/>{BOX.format(900)}
  <body name="wheel"><joint name="turn" armature="0.02"/>{BOX.format(100)}</body>
</body>"""


def test_armature_is_split_by_the_gear(tmp_path):
    """N^2 J = 0.02 with N = 10 is a rotor of 2e-4; without a gear its split is unknown and it is left out."""
    robot = load(tmp_path, WHEEL + "</worldbody>" + MOTOR.format(10) + "<worldbody>")
    assert (robot.gear_ratio[0], robot.rotor_inertia[0]) == (10, pytest.approx(2e-4))
    robot = load(tmp_path, WHEEL)
    assert (robot.gear_ratio[0], robot.rotor_inertia[0]) == (1, 0)
    assert any("give gear_ratio=" in note for note in robot.notes)
    robot = load(tmp_path, WHEEL, gear_ratio={"turn": 20.0})
    assert (robot.gear_ratio[0], robot.rotor_inertia[0]) == (20, pytest.approx(5e-5))
    robot = load(tmp_path, WHEEL, gear_ratio={"turn": 20.0}, rotor_inertia={"turn": 1e-6})
    assert robot.rotor_inertia[0] == 1e-6


EQUAL = {
    "joint": '<joint name="tie" joint1="pan" joint2="elbow"/>',
    "connect": '<connect name="tie" body1="lower" body2="base" anchor="0 0 0"/>',
    "weld": '<weld name="tie" body1="lower" body2="base"/>',
}


@pytest.mark.parametrize("kind", EQUAL)
def test_equality_constraints_are_refused_by_name_unless_locked(tmp_path, kind):
    tie = f"<equality>{EQUAL[kind]}</equality>"
    message = refusal(tmp_path, ARM, tie)
    assert f"equality constraint 'tie' ({kind}) ties" in message
    robot = load(tmp_path, ARM, tie, lock={"pan": 0.0, "tilt": 0.0, "elbow": 0.4})
    assert robot.joints == 0
    assert any("met by locking: equality constraint 'tie'" in note for note in robot.notes)
    passive = tie.replace("/>", ' active="false"/>')
    assert load(tmp_path, ARM, passive).joints == 3


def test_missing_textures_and_meshes_of_pictures_do_not_matter(tmp_path):
    pictures = '<texture name="t" type="2d" file="none.png"/><material name="m" texture="t"/>'
    assets = f'<asset>{pictures}<mesh name="mesh" file="none.stl"/></asset>'
    shown = '<geom type="mesh" mesh="mesh" material="m"/>'
    weighed = '<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>'
    robot = load(tmp_path, f'<body name="a"><freejoint/>{weighed}{shown}</body>', assets)
    assert robot.mass[0] == 1.0
    assert any("whose file is missing" in note for note in robot.notes)
    assert "inertia from mesh 'mesh'" in refusal(tmp_path, f'<body name="a"><freejoint/>{shown}</body>', assets)


def test_names_of_pictures_and_shapes_that_come_twice_do_not_matter(tmp_path):
    """As in dm_control's dog: a scene and the robot that it includes both define the floor and its texture."""
    asset = '<asset><texture name="grid" type="2d" builtin="flat" width="9" height="9"/>'
    asset += '<material name="grid" texture="grid"/>{}</asset>'
    body = f'<body name="a">{BOX.format(900)}<body name="b" pos="0 0 1"><joint name="j" axis="0 1 0"/>'
    body += f'{BOX.format(500)}<geom type="mesh" mesh="m" material="grid" mass="0"/></body></body>'
    mesh, floor = '<mesh name="m" file="m.obj"/>', '<geom name="floor" type="plane" size="1 1 1"/>'
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "m.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    part = f'<mujoco><compiler meshdir="meshes"/>{asset.format(mesh)}<worldbody>{floor}{body}</worldbody></mujoco>'
    (tmp_path / "part.xml").write_text(part)
    robot = load(tmp_path, floor, asset.format("") + '<include file="part.xml"/>')
    assert (robot.link_names, robot.joint_names) == (("a", "b"), ("j",))
    assert len(robot.capsules) == 3
    assert any(note.startswith("textures, materials and names of shapes left out") for note in robot.notes)
    plain = load(
        tmp_path, body.replace(' material="grid"', ""), f"<asset>{mesh.replace('m.obj', 'meshes/m.obj')}</asset>"
    )
    np.testing.assert_array_equal(robot.inertia, plain.inertia)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("", "no bodies"),
        ('<body name="a"><joint/></body>', "mass and inertia of moving bodies"),
        ('<body name="a"/><body name="a"/>', "repeated name"),
        ("<robot/>", "MuJoCo does not take it"),
        ('<include file="nothing.xml"/>', "nothing.xml"),
    ],
)
def test_what_mujoco_does_not_take_is_told_in_one_line(tmp_path, body, words):
    assert words in refusal(tmp_path, body)


def test_an_unknown_base(tmp_path):
    assert "`base` is 'ghost'; the links are 'base, upper" in refusal(tmp_path, ARM, base="ghost")


def test_no_entities(tmp_path):
    (tmp_path / "bomb.xml").write_text('<!DOCTYPE m [<!ENTITY a "ha">]><mujoco model="&a;"><worldbody/></mujoco>')
    with pytest.raises(ValueError, match="DTD"):
        load_robot(tmp_path / "bomb.xml")


def test_without_mujoco_the_error_says_what_to_install(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ImportError, match=r'pip install "reojax\[models\]"'):
        load(tmp_path, ARM)


def test_every_field_is_finite_but_the_limits(tmp_path):
    robot = load(tmp_path, ARM)
    for field in dataclasses.fields(robot):
        value = getattr(robot, field.name)
        if isinstance(value, np.ndarray) and field.name not in ("lower", "upper"):
            assert np.isfinite(value).all()

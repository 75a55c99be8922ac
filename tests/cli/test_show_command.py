"""`reojax show`, and `--robot FILE`: what a file holds is told, and the same robot comes out of what is saved."""

import json

import pytest

from reojax import load_robot
from reojax.cli import main

LINK = '<link name="{}"><inertial><origin xyz="{} 0 0"/><mass value="{}"/>{}</inertial></link>'
INERTIA = '<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.25"/>'
JOINT = """<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><origin xyz="0.5 0 0"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="2"/></joint>"""


def link(name, mass=1.0, inertia=INERTIA):
    return LINK.format(name, 0.1, mass, inertia)


@pytest.fixture
def urdf(tmp_path):
    parts = [link("body", 3.0), link("arm"), link("tool"), link("slide"), link("hand")]
    parts += [JOINT.format("shoulder", "revolute", "body", "arm"), JOINT.format("weld", "fixed", "arm", "tool")]
    parts += [JOINT.format("rail", "prismatic", "arm", "slide"), JOINT.format("wrist", "revolute", "slide", "hand")]
    file = tmp_path / "toy.urdf"
    file.write_text(f'<robot name="toy">{"".join(parts)}</robot>')
    return file


def run(capsys, *args):
    status = main([str(arg) for arg in args])
    out = capsys.readouterr()
    return status, out.out, out.err


def test_show_tells_what_a_file_holds(capsys, urdf):
    status, text, _ = run(capsys, "show", urdf)
    assert status == 0
    assert text.startswith("toy: 3 links, 2 joints, 7 kg")
    assert "shoulder  body    -57.3 .. 114.6" in text
    assert "note: merged into link 'arm': tool, slide" in text
    assert "note: locked: prismatic joint 'rail' at 0.0 m" in text
    assert "momentum self-check: passed" in text


def test_show_prints_json_and_saves_what_it_shows(capsys, urdf, tmp_path):
    """Degrees for hinges, metres for slides; the saved robot is the loaded one."""
    saved = tmp_path / "saved.json"
    options = ("--lock", "wrist=90", "--lock", "rail=0.5", "--gear", "shoulder=20", "--rotor", "shoulder=1e-5")
    status, text, _ = run(capsys, "show", urdf, *options, "--save", saved, "--json")
    assert status == 0
    report = json.loads(text)
    assert report["robot"]["joints"][0]["gear_ratio"] == 20
    assert report["self_check"]["passed"]
    assert report["total_mass_kg"] == 7
    import numpy as np

    lock = {"wrist": np.deg2rad(90), "rail": 0.5}
    same = load_robot(urdf, lock=lock, gear_ratio={"shoulder": 20}, rotor_inertia={"shoulder": 1e-5})
    assert load_robot(saved) == same
    assert run(capsys, "show", saved)[0] == 0


def test_show_knows_the_named_robots(capsys):
    status, text, _ = run(capsys, "show", "prototype")
    assert status == 0
    assert "layout: twist1 and twist2 twist, bend bends" in text


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("nothing",), "no robot named 'nothing'"),
        (("nothing.urdf",), "No such file"),
        (("prototype", "--lock", "bend=0"), "are for files"),
        (("{}", "--lock", "rail"), "must be a joint's name"),
        (("{}", "--lock", "ghost=1"), "`lock` names 'ghost'; the joints are"),
        (("{}", "--base", "ghost"), "`base` is 'ghost'"),
        (("{}", "--save", "robot.txt"), "ends in one of .json"),
    ],
)
def test_bad_input_is_one_line(capsys, urdf, args, words):
    status, text, error = run(capsys, "show", *(arg.format(urdf) for arg in args))
    assert (status, text) == (2, "")
    assert words in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    "command",
    [
        ("simulate",),
        ("time",),
        ("export", "out.csv", "--duration", "1"),
        ("sweep", "twist=1,2"),
    ],
)
def test_commands_take_files_and_say_that_it_has_no_layout(capsys, urdf, command):
    status, _, error = run(capsys, *command, "--robot", urdf)
    assert status == 2
    assert "layout" in error
    assert error.count("\n") == 1


def test_a_file_that_is_no_robot_is_one_line_for_every_command(capsys, tmp_path):
    (tmp_path / "bad.urdf").write_text("<robot>")
    for command in ("simulate", "time", "view"):
        status, _, error = run(capsys, command, "--robot", tmp_path / "bad.urdf")
        assert status == 2
        assert "no XML" in error
        assert error.count("\n") == 1

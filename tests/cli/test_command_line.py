"""The command line: numbers that agree with the library, pictures whole or absent, one line for bad input."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import reojax
from reojax import plot, robots, session, so3
from reojax._internal import files
from reojax.cli import COMMANDS, main, simulate
from reojax.mechanics.attitude import tilt_and_roll

SHIPPED = Path(__file__).parents[2] / "docs" / "synthetic_capture.csv"


@pytest.fixture(autouse=True)
def _no_cache(monkeypatch):
    monkeypatch.setenv("REOJAX_CACHE", "0")


@pytest.mark.slow
def test_simulate_prints_what_the_library_computes(capsys, tmp_path):
    """The default is manoeuvre A on the prototype at 270/120; every form of the rotation is the same one."""
    out = tmp_path / "a.png"
    assert main(["simulate", "--json", "--out", str(out)]) == 0
    printed, complaint = capsys.readouterr()
    report = json.loads(printed)
    assert complaint == ""
    assert report["config"]["robot"] == "prototype"
    path = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
    rotation = reojax.net_rotation(robots.prototype(), path)
    for same in (
        report["rotation_matrix"],
        so3.exp(report["rotation_vector_rad"]),
        so3.from_euler_zxz(report["euler_zxz_rad"]),
        so3.from_quaternion(report["quaternion_wxyz"]),
    ):
        np.testing.assert_allclose(same, rotation, atol=1e-12)
    for key in ("rotation_vector", "euler_zxz", "angle", "roll_along_path"):
        np.testing.assert_allclose(report[f"{key}_deg"], np.rad2deg(report[f"{key}_rad"]), rtol=1e-14)
    assert report["roll_along_path_deg"] - 360 == pytest.approx(report["rotation_vector_deg"][2], abs=2)
    assert report["certificate"]["momentum_relative"] < 3e-11
    assert report["certificate"]["orthogonality"] < 3e-14
    assert report["certificate"]["halving_rad"] < 1e-9
    assert report["joints_beyond_limits"] == []
    assert report["picture"] == str(out)
    assert os.listdir(tmp_path) == ["a.png"]
    assert out.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_python_m_reojax_prints_a_table_and_keeps_its_program(tmp_path):
    """In a process of its own: text on stdout, nothing on stderr, the compiled program in the cache."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path), "JAX_COMPILATION_CACHE_DIR": ""}
    del environment["REOJAX_CACHE"]
    command = [sys.executable, "-W", "error", "-m", "reojax", "simulate"]
    options = ["--robot", "six_body", "--manoeuvre", "b", "--bend", "-1.5e2"]
    done = subprocess.run(command + options, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert lines[0] == "Manoeuvre B on six_body: twist 270 deg, bend -150 deg"
    for label in ("rotation vector", "ZXZ angles", "momentum", "orthogonality", "halving the step"):
        assert any(line.startswith(f"  {label}") for line in lines)
    momentum = next(line.split()[1] for line in lines if line.startswith("  momentum"))
    assert float(momentum) < 1e-10
    assert "beyond the joint limits of six_body: bend" in lines
    assert list((tmp_path / "reojax" / "jax").iterdir())


def test_version():
    done = subprocess.run([sys.executable, "-m", "reojax", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("reojax ")


def test_help_lists_every_command_with_what_it_does(capsys):
    assert main(["--help"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for name, module in COMMANDS.items():
        assert f"{name} {' '.join(module.__doc__.splitlines()[0].split())}" in text


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_every_command_has_help_of_its_own(capsys, command):
    assert main([command, "--help"]) == 0
    assert f"usage: reojax {command} " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "reojax: the following arguments are required: COMMAND"),
        (["turn"], "reojax: argument COMMAND: invalid choice: 'turn'"),
        (["simulte"], "reojax: argument COMMAND: invalid choice: 'simulte'"),
        (["x" * 10**6], "reojax: argument COMMAND: invalid choice: 'xxx"),
        (["simulate", "--manoeuvre", "c"], "reojax simulate: argument --manoeuvre: invalid choice: 'c'"),
        (["simulate", "--twist", "far"], "reojax simulate: argument --twist: 'far' is not a number"),
        (["simulate", "--bend", ""], "reojax simulate: argument --bend: '' is not a number"),
        (["simulate", "--bend", "nan"], "reojax simulate: argument --bend: 'nan' is not a finite number"),
        (["simulate", "--bend", "-inf"], "reojax simulate: argument --bend: '-inf' is not a finite number"),
        (["simulate", "--bend=-1e9"], "reojax simulate: argument --bend: '-1e9' is beyond 36000 degrees"),
        (["simulate", "--bend"], "reojax simulate: argument --bend: expected one argument"),
        (["simulate", "--ben", "3"], "reojax: unrecognized arguments: --ben 3"),
        (
            ["simulate", "--robot", "cat"],
            "reojax simulate: there is no robot named 'cat'; the names",
        ),
        (["simulate", "--robot", "planar3"], "reojax simulate: 'planar3' has no layout of its own"),
        (
            ["simulate", "--out", "/nowhere/a.png"],
            "reojax simulate: cannot write '/nowhere/a.png': ",
        ),
        (
            ["simulate", "--out", "a.bmp"],
            "reojax simulate: cannot write 'a.bmp': the name of",
        ),
        (["simulate", "--out", ""], "reojax simulate: cannot write '': the name of"),
    ],
)
def test_bad_input_is_one_line_and_status_2(capsys, monkeypatch, tmp_path, arguments, message):
    """Said before anything is computed, and nothing is written."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(simulate, "_report", lambda *_: pytest.fail("computed"))
    assert main(arguments) == 2
    out, complaint = capsys.readouterr()
    assert out == ""
    assert complaint.startswith(message)
    assert complaint.count("\n") == 1
    assert os.listdir(tmp_path) == []


def test_ctrl_c_is_status_130(monkeypatch):
    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(simulate, "run", interrupt)
    assert main(["simulate"]) == 130


def test_a_reader_that_has_enough_is_no_error():
    """`reojax ... | head -1` ends quietly."""
    code = """
import sys
from reojax.cli import main, simulate
simulate.run = lambda args: print("line " * 100_000)
sys.exit(main(["simulate"]))
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert child.stdout is not None
    child.stdout.close()
    assert child.stderr is not None
    assert child.stderr.read() == b""
    child.stderr.close()
    assert child.wait() == 0


def shell(command: str, **environment: str) -> subprocess.CompletedProcess:
    """Run a command of the shell in which `reojax` is this one."""
    script = f'reojax() {{ exec "{sys.executable}" -m reojax "$@"; }}; {command}'
    return subprocess.run(
        ["sh", "-c", script], capture_output=True, text=True, check=False, env={**os.environ, **environment}
    )


@pytest.mark.parametrize("buffered", ["", "1"])
def test_a_full_or_closed_stdout_is_one_line(buffered):
    for command, status, complaint in (
        ("reojax --help >/dev/full", 1, "reojax: cannot print the result: No space left on device.\n"),
        ("reojax --version >/dev/full", 1, "reojax: cannot print the result: No space left on device.\n"),
        ("reojax --help >&-", 2, "reojax: stdout is closed, so that no result can be printed.\n"),
        ("reojax turn 2>&-", 2, ""),
        ("reojax turn 2>/dev/full", 2, ""),
    ):
        done = shell(command, PYTHONUNBUFFERED=buffered)
        assert (done.returncode, done.stdout, done.stderr) == (status, "", complaint)


def test_a_terminal_without_degrees_and_other_letters():
    done = shell("reojax simulate --robot 'Kätzchen °'", PYTHONIOENCODING="ascii", PYTHONUTF8="0", LC_ALL="C")
    assert done.returncode == 2
    assert done.stderr.startswith("reojax simulate: there is no robot named")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("moment", [0.02, 0.06, 0.15, 0.3, 0.5, 0.8, 1.2, 2.0])
def test_ctrl_c_at_any_moment_is_one_line_and_status_130(moment):
    """Also while modules are imported and programs compiled; before Python reads the command it is Python's own."""
    code = "import sys, reojax.__main__ as entry; print('here', flush=True); sys.argv[0] = 'reojax'; entry.main()"
    command = [sys.executable, "-c", code, "compare", str(SHIPPED), "--calibrate", "end_inertia"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(moment)
    process.send_signal(signal.SIGINT)
    printed, complaint = process.communicate()
    assert (process.returncode, complaint, printed) == (130, "reojax: interrupted\n", "")


def test_files_are_whole_or_absent(tmp_path):
    """A failure half way leaves the old file and nothing else; a link stays a link."""
    old, link = tmp_path / "old.json", tmp_path / "link.json"
    files.write_json(old, {"array": np.arange(2), "number": jnp.float64(0.5)})
    assert json.loads(old.read_text()) == {"array": [0, 1], "number": 0.5}
    link.symlink_to(old)
    with pytest.raises(ValueError, match="not JSON compliant"):
        files.write_json(old, {"number": float("nan")})
    with pytest.raises(TypeError, match="bytes-like"), files.replacing(link) as file:
        file.writelines([b"half", None])  # pyright: ignore[reportArgumentType]
    assert json.loads(old.read_text())["number"] == 0.5
    files.write_json(link, [])
    assert link.is_symlink()
    assert old.read_text() == "[]\n"
    assert sorted(os.listdir(tmp_path)) == ["link.json", "old.json"]


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (".", "it is a folder"),
        ("missing/a", "there is no folder"),
        ("file/a", "there is no folder"),
        ("/dev/null", "not a regular file"),
        ("x" * 300, "File name too long"),
        ("x" * 10**6, "File name too long"),
        ("loop", "Too many levels of symbolic links"),
        ("loop/a", "Too many levels of symbolic links"),
        (1, "it is a int, not the path of a file"),
        ("a\0", "no path has a zero byte"),
    ],
    ids=str,
)
def test_paths_that_cannot_be_written_are_refused(monkeypatch, tmp_path, path, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    (tmp_path / "loop").symlink_to("pool")
    (tmp_path / "pool").symlink_to("loop")
    with pytest.raises(ValueError, match=f"cannot write .*{message}"):
        files.write_json(path, [])
    assert sorted(os.listdir(tmp_path)) == ["file", "loop", "pool"]


def test_permissions_stay(tmp_path):
    for mode in (0o600, 0o640, 0o755):
        (tmp_path / "a").touch()
        (tmp_path / "a").chmod(mode)
        files.write_json(tmp_path / "a", [])
        assert (tmp_path / "a").stat().st_mode & 0o777 == mode
    before = os.umask(0o027)
    files.write_json(tmp_path / "new", [])
    os.umask(before)
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o640


def test_a_picture_that_fails_leaves_nothing(monkeypatch, tmp_path):
    figure = Figure()
    monkeypatch.setattr(figure, "savefig", lambda file, **_: file.writelines([b"half", None]))
    with pytest.raises(TypeError, match="bytes-like"):
        plot.save(figure, tmp_path / "a.svg")
    assert os.listdir(tmp_path) == []


def test_the_picture_shows_the_joints_and_the_tilt_and_roll():
    """Curves end where the path and its rotations end; every edge has its name."""
    robot = robots.prototype()
    path = reojax.manoeuvre_b(4.0, 1.0)
    rotations = Rotation.from_rotvec(np.outer(np.linspace(0, 1, 41), [0, 0.3, 0])).as_matrix()
    figure = plot.history_figure(robot, path, edge_names="abcd", rotations=rotations)
    above, below = figure.axes
    np.testing.assert_allclose([line.get_ydata()[-1] for line in above.lines[:3]], [0, np.rad2deg(0.3), 0])
    np.testing.assert_allclose(below.lines[1].get_ydata(), np.rad2deg([0, 1, 1, 0, 0]))
    assert [label.get_text() for label in below.get_xticklabels()] == list("abcd")
    assert "17.2" in above.texts[0].get_text()
    with pytest.raises(ValueError, match="3 names; the path has 4 edges"):
        plot.history_figure(robot, path, edge_names="abc", rotations=rotations)
    with pytest.raises(ValueError, match="one waypoint"):
        plot.history_figure(robot, reojax.polygon(np.zeros((1, 3))))


def test_tilt_and_roll_make_up_the_rotation():
    """`R = exp((tilt_x, tilt_y, 0)) Rz(roll)`, and the roll counts turns."""
    rotations = Rotation.random(50, random_state=1).as_matrix()
    angles = tilt_and_roll(rotations)
    tilt, roll = Rotation.from_rotvec(angles * [1, 1, 0]), Rotation.from_rotvec(angles * [0, 0, 1])
    np.testing.assert_allclose((tilt * roll).as_matrix(), rotations, atol=1e-12)
    turns = Rotation.from_rotvec(np.outer(np.linspace(0, 15, 40), [0, 0, 1])).as_matrix()
    np.testing.assert_allclose(tilt_and_roll(turns)[-1], [0, 0, 15], atol=1e-12)


def test_compiling_quickly_leaves_given_flags_alone(monkeypatch):
    monkeypatch.setenv("XLA_FLAGS", "--xla_force_host_platform_device_count=2")
    session.compile_quickly()
    assert os.environ["XLA_FLAGS"] == "--xla_force_host_platform_device_count=2"
    monkeypatch.delenv("XLA_FLAGS")
    session.compile_quickly()
    assert "--xla_backend_optimization_level=0" in os.environ["XLA_FLAGS"].split()


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [(["simulte"], "simulate"), (["simulate", "--twst", "3"], "--twist"), (["sweep", "a", "--chunk-sise", "3"], None)],
)
def test_what_may_have_been_meant(capsys, arguments, meant):
    assert main(arguments) == 2
    complaint = capsys.readouterr().err
    assert meant is None or complaint.endswith(f"; did you mean {meant}?\n")


def test_pictures_have_one_option_everywhere():
    for command in ("simulate", "time", "compare", "plan", "sweep", "merge"):
        done = shell(f"reojax {command} --help")
        assert "--picture" in done.stdout

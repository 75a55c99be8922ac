"""Whatever reads a file reads regular files only, of a size that can be meant: no device, pipe or folder."""

import os

import numpy as np
import pytest

import reojax
from reojax.cli.plan import read_target
from reojax.cli.view import read_plan
from reojax.models.load import joint_kinds
from reojax.steering import onboard
from reojax.sweeps.store import open_store

ROBOT = reojax.robots.prototype()
READERS = {
    "load_robot": (reojax.load_robot, "robot.json"),
    "load_robot of a URDF": (reojax.load_robot, "robot.urdf"),
    "joint_kinds": (joint_kinds, "robot.urdf"),
    "load_plan": (reojax.load_plan, "plan.json"),
    "read_capture": (lambda path: reojax.read_capture(path, ROBOT), "capture.csv"),
    "Sweep.load": (reojax.Sweep.load, "sweep.npz"),
    "merge": (lambda path: open_store(path.parent), "sweep.json"),
    "plan --target 'matrix FILE'": (lambda path: read_target(f"matrix {path}"), "matrix.txt"),
    "view PLAN.json": (lambda path: read_plan(str(path)), "plan.json"),
    "onboard.read": (onboard.read, "gains.csv"),
}
KINDS = {
    "a pipe that nobody writes to": os.mkfifo,
    "a folder": os.mkdir,
    "/dev/zero": lambda path: path.symlink_to("/dev/zero"),
    "/dev/full": lambda path: path.symlink_to("/dev/full"),
    "a link to itself": lambda path: path.symlink_to(path),
    "nothing": lambda path: None,
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("reader", READERS)
def test_no_reader_waits_or_reads_without_end(reader, kind, tmp_path):
    read, name = READERS[reader]
    path = tmp_path / name
    KINDS[kind](path)
    with pytest.raises(ValueError, match=r"cannot read|is not the store|is not a regular file") as caught:
        read(path)
    assert "\n" not in str(caught.value)
    assert name in str(caught.value) or str(tmp_path) in str(caught.value)


@pytest.mark.parametrize("reader", sorted(READERS.keys() - {"onboard.read"}))
def test_a_file_of_terabytes_is_refused_unread(reader, tmp_path):
    read, name = READERS[reader]
    with (tmp_path / name).open("wb") as file:
        file.truncate(2**42)  # sparse: it takes no room
    with pytest.raises(ValueError, match=r"more than|larger than|is not the store"):
        read(tmp_path / name)


def test_a_target_from_a_file(tmp_path):
    turn = reojax.so3.exp(np.array([0.3, -0.2, 1.0]))
    np.savetxt(tmp_path / "matrix.txt", turn, fmt="%.17g")
    np.testing.assert_array_equal(read_target(f"matrix {tmp_path / 'matrix.txt'}"), turn)

"""Robots as JSON: the same numbers to the last bit, and no robot from what is none."""

import json

import jax
import numpy as np
import pytest

import reojax
from reojax import load_robot, robots, save_robot
from reojax.robots.random import random_robot


def same(a, b) -> bool:
    """Same structure, same bits, same dtypes."""
    first, second = jax.tree.flatten(a), jax.tree.flatten(b)
    return first[1] == second[1] and all(
        np.asarray(x).dtype == np.asarray(y).dtype and np.asarray(x).tobytes() == np.asarray(y).tobytes()
        for x, y in zip(first[0], second[0], strict=True)
    )


@pytest.mark.parametrize("name", robots.NAMES)
def test_a_saved_robot_is_the_same_to_the_last_bit(name, tmp_path):
    """Capsules, pairs, layout, notes and missing limits included."""
    robot = robots.by_name(name)
    save_robot(robot, tmp_path / "robot.json")
    assert same(load_robot(tmp_path / "robot.json"), robot)


def test_random_numbers_keep_their_bits(tmp_path):
    """Rotors on either side, branches, axes that are unit only to rounding."""
    for seed in range(20):
        robot = random_robot(seed, 6, branched=True)
        save_robot(robot, tmp_path / "robot.json")
        assert same(load_robot(tmp_path / "robot.json"), robot)


def test_couplings_scaled_axes_and_float32_are_kept(tmp_path):
    robot = robots.prototype().replace(axis=3 * np.asarray(robots.prototype().axis))
    robot = robot.replace(mass=np.asarray(robot.mass, np.float32))
    save_robot(robot, tmp_path / "robot.json")
    assert same(load_robot(tmp_path / "robot.json"), robot)
    parts = {key: getattr(robot, key) for key in ("mass", "com", "inertia", "anchor")}
    tied = reojax.make_robot(**parts, axis=[(0, 0, 1)] * 3, couplings={2: (0, -1 / 3, 0.1)})
    save_robot(tied, tmp_path / "robot.json")
    assert same(load_robot(tmp_path / "robot.json"), tied)


def test_another_name_can_be_given(tmp_path):
    save_robot(robots.prototype(), tmp_path / "robot.json")
    assert load_robot(tmp_path / "robot.json", name="mine").name == "mine"


def test_what_make_robot_would_refuse_is_not_written(tmp_path):
    file = tmp_path / "robot.json"
    with pytest.raises(ValueError, match="mass"):
        save_robot(robots.prototype().replace(mass=np.zeros(4)), file)
    with pytest.raises(ValueError, match="finite"):
        save_robot(robots.prototype().replace(com=np.full((4, 3), np.inf)), file)
    with pytest.raises(ValueError, match="ends in one of .json"):
        save_robot(robots.prototype(), tmp_path / "robot.txt")
    with pytest.raises(ValueError, match="must be a Robot"):
        save_robot("prototype", file)
    assert not file.exists()


def saved(tmp_path):
    save_robot(robots.six_body(), tmp_path / "robot.json")
    return json.loads((tmp_path / "robot.json").read_text())


@pytest.mark.parametrize(
    ("path", "value", "rule"),
    [
        (("version",), 2, "reads version 1"),
        (("version",), True, "reads version 1"),
        (("format",), "urdf", "must be 'reojax robot'"),
        (("weight",), 1, "'weight'.* not known"),
        (("links", 0, "mass"), "1", r"links\[0\]\.mass"),
        (("links", 0, "mass"), True, r"links\[0\]\.mass"),
        (("links", 0, "mass"), -1.0, r"mass\[0\] \(foot1\)"),
        (("links", 0, "mass"), 10**400, "too large|finite"),
        (("links", 0, "com"), [0, 0], r"com.*list of 3"),
        (("links", 0, "inertia"), [[0, 0, 0]] * 2, "list of 3"),
        (("links", 1, "name"), "foot1", "no such link"),
        (("joints", 0, "parent"), "nowhere", "no such link"),
        (("joints", 0, "parent"), "foot2", r"parent\[0\]"),
        (("joints", 0, "rotor_on"), "left", "rotor_on"),
        (("joints", 0, "axis"), [0, 0, 0], "axis"),
        (("joints", 0, "lower"), 7.0, "lower"),
        (("capsules",), [{"link": "foot1", "start": [0, 0, 0], "end": [0, 0, 0], "radius": -1}], "radius"),
        (("capsules",), {"a": 1}, "must be a list"),
        (("collision_pairs",), [[0, 99]], "collision_pairs"),
        (("couplings",), [{"joint": "a", "driver": "b", "ratio": 1, "offset": 0}], "couplings"),
        (("layout", "twist"), [0, 99], "layout"),
        (("layout", "bend"), 1.0, "layout.bend"),
        (("notes",), [1], "notes"),
        (("dtypes",), {"mass": "object"}, "floating precision"),
        (("links",), [], "no such link"),
        (("name",), 3, "name"),
    ],
)
def test_hostile_json_is_refused_by_name(tmp_path, path, value, rule):
    data = saved(tmp_path)
    inner = data
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    (tmp_path / "robot.json").write_text(json.dumps(data))
    with pytest.raises(ValueError, match=f"cannot read .*{rule}") as caught:
        load_robot(tmp_path / "robot.json")
    assert len(str(caught.value)) < 500
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("key", ["format", "links", "joints", "name"])
def test_what_is_missing_is_named(tmp_path, key):
    data = saved(tmp_path)
    del data[key]
    (tmp_path / "robot.json").write_text(json.dumps(data))
    with pytest.raises(ValueError, match=f"has no '{key}'"):
        load_robot(tmp_path / "robot.json")


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "3", "{}", '{"a": NaN}', '{"a": 1, "a": 2}', "[" * 100_000, '{"a":' * 100_000, "\xff", "x" * 10**6],
)
def test_what_is_no_json_object_is_refused_in_one_line(tmp_path, text):
    (tmp_path / "robot.json").write_text(text, encoding="latin-1")
    with pytest.raises(ValueError, match="cannot read") as caught:
        load_robot(tmp_path / "robot.json")
    assert len(str(caught.value)) < 500


def test_files_that_are_none(tmp_path):
    for path in (tmp_path, tmp_path / "nothing.json", "/dev/zero"):
        with pytest.raises(ValueError, match="cannot read"):
            load_robot(path)
    with pytest.raises(ValueError, match="not the path of a file"):
        load_robot(1)

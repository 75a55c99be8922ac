"""Programs kept without tracing: the same answers to the bit, nothing traced, and no doubt about what a file is."""

import json
import os
import subprocess
import sys
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from reojax import robots, so3
from reojax._internal import kept
from reojax._internal.kept import Program

VECTOR = np.array([0.3, -0.2, 0.5])
_SCRIPT = """
import json, sys, jax
traced = []
jax.monitoring.register_event_duration_secs_listener(
    lambda event, *_, fun_name=None, **__: traced.append(fun_name) if event.endswith("jaxpr_trace_duration") else None
)
from reojax.cli import main
status = main(sys.argv[1:])
print(json.dumps([status, [name for name in traced if name != "like"]]))
"""


def solution(matrix, right):
    return jnp.linalg.solve(matrix, right)


def moments(robot, power, x):
    return {"moment": jnp.asarray(robot.mass).sum() * x, "power": x**power}


@pytest.fixture
def folder(tmp_path):
    kept.keep_in(tmp_path)
    yield tmp_path
    kept.keep_in(None)


def names(folder) -> set[str]:
    return {file.name for file in folder.glob("*.program")}


def untraced(program: Program) -> Program:
    """The same, but that it cannot be compiled."""
    program._jit = None  # pyright: ignore[reportAttributeAccessIssue]
    return program


def test_what_is_found_gives_the_same_and_is_not_compiled(folder):
    expected = np.asarray(jax.jit(so3.exp)(VECTOR))
    for program in (Program(so3.exp), untraced(Program(so3.exp))):
        for _ in range(2):
            np.testing.assert_array_equal(program(VECTOR), expected)
        assert len(names(folder)) == 1
    np.testing.assert_array_equal(jax.jit(jax.vmap(Program(so3.exp)))(VECTOR[None])[0], expected)


def test_damage_does_no_harm(folder):
    expected = np.asarray(Program(so3.exp)(VECTOR))
    (name,) = names(folder)
    whole = (folder / name).read_bytes()
    for damage in (b"", b"damaged", whole[:-1], whole[:100] + bytes(1) + whole[101:]):
        (folder / name).write_bytes(damage)
        np.testing.assert_array_equal(Program(so3.exp)(VECTOR), expected)
        np.testing.assert_array_equal(untraced(Program(so3.exp))(VECTOR), expected)


def test_a_file_that_loads_and_does_not_run_is_made_anew(folder, monkeypatch):
    expected = np.asarray(Program(so3.exp)(VECTOR))

    def broken(*_):
        raise RuntimeError("NOT_FOUND: a function of the program")

    with monkeypatch.context() as patch:
        patch.setattr(kept, "_read", lambda file: broken)
        np.testing.assert_array_equal(Program(so3.exp)(VECTOR), expected)
    np.testing.assert_array_equal(untraced(Program(so3.exp))(VECTOR), expected)


def test_whatever_a_program_is_made_of_makes_another_file(folder, monkeypatch):
    robot = robots.prototype()
    heavier = robot.replace(mass=1.01 * np.asarray(robot.mass))

    def made(*arguments, function=moments, **options) -> int:
        Program(function, **options)(*arguments)
        return len(names(folder))

    def given(*fixed) -> dict:
        return {"function": partial(moments, *fixed)}

    assert made(robot, 2, VECTOR) == made(heavier, 3, 2 * VECTOR) == 1
    assert made(robot, 2, VECTOR[:2]) == 2
    assert made(robot, 2, VECTOR.astype(np.float32)) == 3
    assert made(robot, np.array([2]), VECTOR) == 4
    assert made(robot.replace(name="another"), 2, VECTOR) == 5
    assert made(VECTOR, **given(robot, 2)) == made(2 * VECTOR, **given(robot, 2)) == 6
    assert made(VECTOR, **given(heavier, 2)) == 7
    assert made(VECTOR, **given(robot, 3)) == 8
    assert made(robot, 2, VECTOR, static_argnums=(1,)) == made(heavier, 2, VECTOR, static_argnums=(1,)) == 9
    assert made(robot, 3, VECTOR, static_argnums=(1,)) == 10
    assert made(robot, 2, VECTOR, compiler_options={"xla_cpu_enable_fast_math": True}) == 11
    assert made(VECTOR, function=so3.exp) == 12
    assert made(VECTOR, function=so3.left_jacobian) == 13
    with jax.default_matmul_precision("highest"):
        assert made(VECTOR, function=so3.exp) == 14
    monkeypatch.setenv("XLA_FLAGS", os.environ.get("XLA_FLAGS", "") + " ")
    assert made(VECTOR, function=so3.exp) == 15
    monkeypatch.setattr(kept, "_versions", lambda: ("another source",))
    assert made(VECTOR, function=so3.exp) == 16


def test_what_jax_prepares_while_it_lowers_is_not_kept(folder):
    np.testing.assert_allclose(Program(solution)(2 * np.eye(2), np.ones(2)), [0.5, 0.5])
    assert not names(folder)


def test_nothing_is_kept_unasked(tmp_path, monkeypatch):
    monkeypatch.setattr(kept, "_write", None)
    monkeypatch.setattr(kept, "_read", None)
    np.testing.assert_array_equal(Program(so3.exp)(VECTOR), jax.jit(so3.exp)(VECTOR))


def test_a_folder_that_has_gone_stops_nothing(tmp_path):
    kept.keep_in(tmp_path / "gone")
    try:
        np.testing.assert_array_equal(Program(so3.exp)(VECTOR), jax.jit(so3.exp)(VECTOR))
    finally:
        kept.keep_in(None)


def test_a_static_argument_that_is_no_number_is_refused(folder):
    with pytest.raises(TypeError, match="Static arguments of what is kept"):
        Program(moments, static_argnums=(1,))(robots.prototype(), object(), VECTOR)


def test_a_function_that_its_name_does_not_tell_is_refused():
    with pytest.raises(ValueError, match="is no function of a module"):
        Program(lambda x: x)


def test_the_source_is_read_to_the_letter(tmp_path, monkeypatch):
    """Another file of the package, or another letter in one, is another version."""
    place = tmp_path / "reojax" / "_internal"
    place.mkdir(parents=True)
    monkeypatch.setattr(kept, "__file__", str(place / "kept.py"))
    found = set()
    for name, text in [("a.py", "x = 1"), ("a.py", "x = 2"), ("b.py", ""), ("c.txt", "")]:
        (place / name).write_text(text)
        found.add(repr(kept._versions.__wrapped__()))
    assert len(found) == 3


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(["simulate", "--json"], id="simulate"),
        pytest.param(["plan", "--target", "rotvec 0 90 0", "--json"], id="plan", marks=pytest.mark.slow),
    ],
)
def test_a_second_command_traces_nothing_and_says_the_same(command, tmp_path):
    given = {**os.environ, "JAX_COMPILATION_CACHE_DIR": "", "REOJAX_CACHE": "1", "XDG_CACHE_HOME": str(tmp_path)}
    answers = []
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", _SCRIPT, *command], env=given, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert done.stderr == ""
        answers.append(done.stdout.rpartition("\n[")[::2])
    (said, first), (again, second) = answers
    assert said == again
    assert json.loads("[" + second) == [0, []] != json.loads("[" + first)
    assert names(tmp_path / "reojax" / "jax")

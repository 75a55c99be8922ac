"""Compiled programs kept between runs: where, how many, how large; damage and obstacles do no harm."""

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import reojax
from reojax import session

_SCRIPT = """
import json, sys, jax
jax.jit(lambda x: x + 1)(3.0)  # JAX has compiled already when the cache is asked for
import reojax
kept = reojax.cache(*sys.argv[1:])
hits = []
jax.monitoring.register_event_listener(lambda event, **_: hits.append(event.endswith("cache_hits")))
print(json.dumps([float(jax.jit(lambda x: 2 * x)(3.0)), sum(hits), *map(str, kept)]))
"""


def _run(*arguments: str, **environment: str) -> tuple[list, str]:
    """What a script of its own prints: the answer, programs found in the cache, folder, number, size, limit."""
    given = {**os.environ, "JAX_COMPILATION_CACHE_DIR": "", "REOJAX_CACHE": "1", **environment}
    done = subprocess.run([sys.executable, "-c", _SCRIPT, *arguments], env=given, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), done.stderr


def test_a_second_script_finds_the_programs_of_the_first_and_damage_does_no_harm(tmp_path):
    """One call, also after the first compilation; damaged entries are made anew without a word."""
    folder = tmp_path / "reojax" / "jax"
    first, _ = _run(XDG_CACHE_HOME=str(tmp_path))
    assert first == [6.0, 0, str(folder), "0", "0", str(session.CACHE_BYTES)]
    files = list(folder.glob("jit_*-cache"))
    assert files
    second, _ = _run(XDG_CACHE_HOME=str(tmp_path))
    assert second[:2] == [6.0, 1]
    assert (int(second[3]), int(second[4])) == (len(files), sum(file.stat().st_size for file in files))
    for damage in (b"", b"damaged"):
        for file in files:
            file.write_bytes(damage)
        (answer, found, *_), complaint = _run(XDG_CACHE_HOME=str(tmp_path))
        assert (answer, found, complaint) == (6.0, 0, "")
        assert all(file.stat().st_size > 100 for file in folder.glob("jit_*-cache"))
    assert _run(XDG_CACHE_HOME=str(tmp_path))[0][:2] == [6.0, 1]


def test_a_folder_of_ones_own_is_made(tmp_path):
    folder = tmp_path / "here" / "programs"
    assert _run(str(folder))[0][2] == str(folder)
    assert list(folder.glob("jit_*-cache"))


@pytest.mark.parametrize(
    ("environment", "given", "expected"),
    [(None, None, "default"), ("1", None, "default"), ("0", None, None), (None, "/elsewhere", "/elsewhere")],
)
def test_the_environment_goes_first(monkeypatch, tmp_path, environment, given, expected):
    told, kept = _asked(monkeypatch, tmp_path, environment, given)
    folder = tmp_path / "reojax" / "jax"
    where = folder if expected == "default" else expected and Path(expected)
    assert kept.folder == where
    assert (told.get("jax_compilation_cache_dir") == str(folder)) is (expected == "default")
    assert folder.is_dir() is (expected == "default")


def test_what_cannot_be_a_folder_is_said_and_stops_no_command(monkeypatch, tmp_path):
    (tmp_path / "reojax").touch()
    with pytest.raises(ValueError, match="`folder`, the default folder, cannot be made: Not a directory"):
        _asked(monkeypatch, tmp_path, None, None)
    told = _told(monkeypatch, None)
    session.start()
    assert told == {"jax_enable_x64": True}
    with pytest.raises(ValueError, match=f"`folder`, '{tmp_path / 'reojax'}', cannot be made"):
        reojax.cache(tmp_path / "reojax")
    with pytest.raises(ValueError, match="`limit` is 0; it must be a positive integer"):
        reojax.cache(limit=0)


def test_the_oldest_programs_go_first(tmp_path):
    for age, name in enumerate(["new", "old", "oldest"]):
        (tmp_path / name).write_bytes(bytes(100))
        os.utime(tmp_path / name, (1e9 - age, 1e9 - age))
    session._trim(tmp_path, 200)
    assert sorted(os.listdir(tmp_path)) == ["new", "old"]


def _asked(monkeypatch, folder, environment, given):
    """What `cache` tells JAX, and returns."""
    told = _told(monkeypatch, given)
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    monkeypatch.delenv("REOJAX_CACHE", raising=False)
    if environment is not None:
        monkeypatch.setenv("REOJAX_CACHE", environment)
    return told, reojax.cache()


def _told(monkeypatch, given) -> dict:
    told = {}
    config = SimpleNamespace(values={"jax_compilation_cache_dir": given}, update=told.__setitem__)
    monkeypatch.setattr(session, "jax", SimpleNamespace(config=config))
    monkeypatch.setattr(session, "reset_cache", lambda: None)
    monkeypatch.setattr(session, "_forget_damaged", lambda _: None)
    return told

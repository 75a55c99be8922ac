"""A short run of hostile input (`long.py` runs longer): nothing silently wrong, nothing from deep inside."""

from itertools import islice

import pytest

from fuzz.kinds import LONG, source
from fuzz.tally import Tally

SHORT = {
    "functions that compile nothing": 1500,
    "functions that compile little": 150,
    "command lines that compute little": 150,
    "captures": 300,
    "robots, JSON": 200,
    "robots, URDF": 200,
    "robots, MJCF": 60,
    "plans": 60,
    "sweeps, manifests": 150,
    "sweeps, chunks": 150,
}


@pytest.mark.parametrize("kind", SHORT)
def test_hostile_input(kind, monkeypatch, tmp_path):
    monkeypatch.setenv("REOJAX_CACHE", "0")
    monkeypatch.chdir(tmp_path)
    if kind == "robots, MJCF":
        pytest.importorskip("mujoco")
    tally = Tally()
    for what, call in islice(source(kind, 0), SHORT[kind]):
        if call is not None:
            tally.judge(what, call)
    assert not tally.found
    assert tally["refused by name"] > 0.2 * SHORT[kind]


def test_the_long_run_has_all_kinds():
    assert SHORT.keys() <= LONG.keys()
    assert sum(LONG.values()) >= 28_000
